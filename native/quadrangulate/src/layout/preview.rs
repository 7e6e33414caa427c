//! What a cut along a path would leave, without making it: most cuts that are compared are not made.

use super::LayoutOptions;
use super::canvas::{Canvas, Sides};
use super::region::{Bend, Outline, Shape, Share};
use surface::tracing::{Trace, TracePoint};

/// A path over triangles each of which it crosses once at most.
pub(super) struct Crossing {
    /// Triangles beside it that it does not cross.
    sides: Sides,
    /// Half-edges that it runs along, sorted.
    walls: Vec<u32>,
    /// Triangles that it crosses.
    crossed: Vec<u32>,
    /// Area of what is left and right of it in those.
    areas: [f64; 2],
}

impl Crossing {
    /// `None` when the path meets itself.
    pub fn new(canvas: &Canvas, trace: &Trace) -> Option<Self> {
        let topology = canvas.topology();
        let mut made = Self { sides: [vec![], vec![]], walls: vec![], crossed: vec![], areas: [0.0; 2] };
        // Half-edges that it crosses.
        let mut over = vec![];
        let twin = |h: u32| topology.twin[h as usize];
        for w in trace.points.windows(2) {
            // The half-edges of the crossed triangle that lie left and right of the path, and the share of its area left.
            let (triangle, left, right, share) = match (w[0], w[1]) {
                (TracePoint::Vertex(a), TracePoint::Vertex(b)) => {
                    let h = topology.find(a, b)?;
                    made.walls.extend([h, twin(h)]);
                    made.sides[0].push(h / 3);
                    made.sides[1].push(twin(h) / 3);
                    continue;
                }
                (TracePoint::Vertex(_), TracePoint::Edge(a, b, t)) => {
                    let h = topology.find(a, b)? as usize;
                    (h / 3, vec![topology.next[h]], vec![topology.prev[h]], 1.0 - t)
                }
                (TracePoint::Edge(a, b, t), TracePoint::Vertex(_)) => {
                    let h = twin(topology.find(a, b)?) as usize;
                    (h / 3, vec![topology.prev[h]], vec![topology.next[h]], 1.0 - t)
                }
                (TracePoint::Edge(a, b, t), TracePoint::Edge(c, d, s)) => {
                    let (from, to) = (twin(topology.find(a, b)?) as usize, topology.find(c, d)? as usize);
                    if topology.next[from] as usize == to {
                        (to / 3, vec![topology.prev[from]], vec![], 1.0 - t * s)
                    } else {
                        (to / 3, vec![], vec![topology.next[from]], (1.0 - t) * (1.0 - s))
                    }
                }
            };
            if let TracePoint::Edge(a, b, _) = w[0] {
                over.extend(topology.find(a, b));
            }
            made.crossed.push(triangle as u32);
            for (side, beside) in [left, right].iter().enumerate() {
                made.sides[side].extend(beside.iter().map(|&h| twin(h)).filter(|h| *h != mesh::NONE).map(|h| h / 3));
            }
            let area = canvas.area(triangle as u32);
            made.areas[0] += share * area;
            made.areas[1] += (1.0 - share) * area;
        }
        made.walls.sort_unstable();
        made.crossed.sort_unstable();
        let mut vertices: Vec<u32> = trace.vertices().collect();
        vertices.sort_unstable();
        let twice = |sorted: &[u32]| sorted.windows(2).any(|w| w[0] == w[1]);
        let is_wall = |h: &u32| made.walls.binary_search(h).is_ok();
        (!twice(&vertices) && !twice(&made.crossed) && !over.iter().any(is_wall)).then_some(made)
    }
}

/// What a cut would leave.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Preview {
    pub badness: usize,
    pub concave: usize,
    /// Sides more or fewer than four.
    pub irregular: usize,
    pub soft: usize,
    pub astray: usize,
    /// Share of the smaller part in the area.
    pub balance: f64,
}

impl Preview {
    /// `None` when the path meets itself. Costs what the smaller part and the border have.
    pub fn new(
        canvas: &Canvas,
        outline: &Outline,
        trace: &Trace,
        share: Share,
        options: &LayoutOptions,
    ) -> Option<Self> {
        let crossing = Crossing::new(canvas, trace)?;
        let mut marks = vec![0; canvas.topology().len() / 3];
        crossing.crossed.iter().for_each(|&t| marks[t as usize] = 3);
        let small = canvas.smaller_side(&crossing.sides, &crossing.walls, &mut marks);
        let small = small.map(|(side, triangles)| {
            let inside: f64 = triangles.iter().map(|&t| canvas.area(t)).sum();
            (side, inside + crossing.areas[side])
        });
        // Singular vertices on the path are so no more.
        let is_cut = |v: u32| trace.vertices().any(|on| on == v);
        let index = |v: &u32| i64::from(canvas.index[*v as usize]);
        let inner = || outline.singular.iter().filter(|v| !is_cut(**v));
        let mut cut = cut_loops(canvas, outline, trace, share);
        let Some((side, area)) = small else {
            let loops = cut.new.into_iter().chain(cut.others).collect::<Vec<_>>();
            let shape = Shape::of(&loops, outline.euler_characteristic + 1, inner().map(index).sum(), options);
            return Some(Self::of(&[shape], 0.5));
        };
        let mark = side as u8 + 1;
        let topology = canvas.topology();
        let is_small = |v: u32| topology.around(v).any(|h| marks[h as usize / 3] == mark);
        let mut parts: [Vec<Vec<Bend>>; 2] = [vec![], vec![]];
        for border in cut.others {
            parts[usize::from(!border.iter().any(|bend| is_small(bend.vertex)))].push(border);
        }
        if side == 1 {
            cut.new.reverse();
        }
        for (part, border) in parts.iter_mut().zip(cut.new) {
            part.push(border);
        }
        // Handles stay in the greater part.
        let euler = 2 - parts[0].len() as i64;
        let small_index: i64 = inner().filter(|v| is_small(**v)).map(index).sum();
        let all: i64 = inner().map(index).sum();
        let [few, many] = parts;
        let shapes = [
            Shape::of(&few, euler, small_index, options),
            Shape::of(&many, outline.euler_characteristic + 1 - euler, all - small_index, options),
        ];
        Some(Self::of(&shapes, area.min(outline.area - area) / outline.area))
    }

    pub fn of(shapes: &[Shape], balance: f64) -> Self {
        let sum = |of: fn(&Shape) -> usize| shapes.iter().map(of).sum();
        Self {
            badness: sum(Shape::badness),
            concave: sum(|shape| shape.concave),
            irregular: sum(|shape| shape.sides.abs_diff(4)),
            soft: sum(Shape::soft),
            astray: sum(|shape| shape.astray),
            balance,
        }
    }
}

/// The border loops of a region that was cut.
struct CutLoops {
    /// Those along the path: left and right of it, or one where it joined two loops.
    new: Vec<Vec<Bend>>,
    others: Vec<Vec<Bend>>,
}

fn cut_loops(canvas: &Canvas, outline: &Outline, trace: &Trace, share: Share) -> CutLoops {
    let last = trace.points.len() - 1;
    // The path's points as they lie on the border of what is left (0) or right (1) of it.
    let side = |side: usize| -> Vec<Bend> {
        let bend = |(k, &point): (usize, &TracePoint)| {
            let (vertex, place) = match point {
                TracePoint::Vertex(v) => (v, canvas.place[v as usize]),
                // A place of its own.
                TracePoint::Edge(..) => (mesh::NONE, mesh::NONE - k as u32),
            };
            let quarters = match k {
                0 => share.start[1 - side],
                k if k == last => share.end[side],
                _ => 2,
            };
            Bend { vertex, place, at: canvas.at_point(point), quarters, angle: trace.angles[k][side] }
        };
        trace.points.iter().enumerate().map(bend).collect()
    };
    let (mut left, mut right) = (side(0), side(1));
    right.reverse();
    let mut others = outline.loops.clone();
    // The loop through a vertex, from after it on.
    let mut after = |v: u32| -> Option<Vec<Bend>> {
        let found = others.iter().position(|border| border.iter().any(|bend| bend.vertex == v))?;
        let mut border = others.remove(found);
        let at = border.iter().position(|bend| bend.vertex == v)?;
        border.rotate_left(at + 1);
        border.pop();
        Some(border)
    };
    let [start, end] = [trace.start(), trace.end()];
    let from_end = after(end).unwrap_or_default();
    if let Some(at) = from_end.iter().position(|bend| bend.vertex == start) {
        left.extend(&from_end[..at]);
        right.extend(&from_end[at + 1..]);
        return CutLoops { new: vec![left, right], others };
    }
    left.extend(from_end);
    left.extend(right);
    left.extend(after(start).unwrap_or_default());
    CutLoops { new: vec![left], others }
}
