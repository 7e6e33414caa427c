//! From flat regions to a patch graph: nodes and sides by index, and where vertices along them may go.
//!
//! Every arc of a region ends at a *break* of its curve; between neighbouring breaks lies a side, for both patches. Breaks
//! on either side of a curve that all but coincide become one, so that sides are not shorter than panels.

use super::curve::Curve;
use super::halves::{Slide, Through};
use super::layout::{Base, Layout};
use super::patch_graph::{Corner, Patch, PatchGraph, Side};
use super::pattern::Place;
use super::region::{Arc, Line, Region, Spot};
use glam::DVec2;
use mesh::DVec3;
use std::collections::BTreeMap;
use std::sync::Arc as Shared;

/// Breaks on either side of a curve that are nearer than this, in edges, become one.
const MERGE: f64 = 0.9;

/// Lengths that differ by less than this fraction of a curve are rounding.
const ROUNDING: f64 = 1e-6;

/// Where arcs end on a curve.
#[derive(Clone, Copy)]
struct Break {
    t: f64,
    /// Where it was before it slid along the curve.
    was: f64,
    /// Which sides of the curve have an arc that ends here: 1 the left, 2 the right.
    sides: u8,
    node: u32,
}

struct Assembly<'a> {
    base: &'a Base,
    lines: BTreeMap<usize, Shared<Line>>,
    breaks: BTreeMap<usize, Vec<Break>>,
    nodes: Vec<DVec3>,
    node_places: Vec<Place>,
    of_vertex: BTreeMap<u32, u32>,
    of_centre: BTreeMap<usize, u32>,
    curves: Vec<Curve>,
    curve_of: BTreeMap<usize, u32>,
}

/// The patch graph of flat regions, nodes moved as `slides` say; `None` where two corners of one fall together.
pub(super) fn assemble(base: &Base, regions: &[Region], slides: &[Slide]) -> Option<Layout> {
    let mut lines = BTreeMap::new();
    let mut breaks: BTreeMap<usize, Vec<Break>> = BTreeMap::new();
    for arc in regions.iter().flat_map(|region| &region.arcs) {
        lines.insert(arc.line.id, arc.line.clone());
        let sides = if arc.reversed { 2 } else { 1 };
        breaks.entry(arc.line.id).or_default().extend([arc.from, arc.to].map(|t| Break { t, was: t, sides, node: 0 }));
    }
    for (id, at) in &mut breaks {
        merge(&lines[id], at, MERGE * base.edge_length);
    }
    for slide in slides {
        let (line, slid) = (&lines[&slide.line], breaks.get_mut(&slide.line)?.get_mut(slide.index)?);
        slid.t = line.at_length(line.length_at(slid.was) + slide.by);
    }
    for id in lines.keys().copied().collect::<Vec<_>>() {
        if let Some(drawn) = drawn_to_its_nodes(&lines[&id], &lines, &breaks) {
            lines.insert(id, drawn);
        }
    }
    let (mut curves, mut curve_of) = (Vec::new(), BTreeMap::new());
    for (&id, line) in lines.iter().filter(|(id, _)| base.chains.is_line.get(**id) == Some(&true)) {
        curve_of.insert(id, curves.len() as u32);
        curves.push(Curve::new(line.points.iter().copied()));
    }
    let mut assembly = Assembly {
        base,
        lines,
        breaks,
        nodes: Vec::new(),
        node_places: Vec::new(),
        of_vertex: BTreeMap::new(),
        of_centre: BTreeMap::new(),
        curves,
        curve_of,
    };
    assembly.number_nodes()?;
    assembly.layout(regions)
}

/// Sorts the breaks of a curve and makes one of those that all but coincide: of all by rounding, of either side within `near`.
fn merge(line: &Line, breaks: &mut Vec<Break>, near: f64) {
    breaks.sort_by(|a, b| a.t.total_cmp(&b.t));
    let apart = |a: &Break, b: &Break| line.length_at(b.t) - line.length_at(a.t);
    let rounding = ROUNDING * line.length_at(line.last());
    breaks.dedup_by(|b, a| {
        let same = apart(a, b) <= rounding;
        if same {
            a.sides |= b.sides;
        }
        same
    });
    // The ends are of both sides.
    let last = breaks.len() - 1;
    breaks[0].sides = 3;
    breaks[last].sides = 3;
    breaks.dedup_by(|b, a| {
        let same = a.sides & b.sides == 0 && apart(a, b) < near;
        if same {
            a.sides |= b.sides;
        }
        same
    });
}

/// A curve that ends on another where a break became one with its neighbour, drawn to end there; older curves come first. `None`
/// where it does already.
fn drawn_to_its_nodes(
    line: &Line,
    lines: &BTreeMap<usize, Shared<Line>>,
    breaks: &BTreeMap<usize, Vec<Break>>,
) -> Option<Shared<Line>> {
    let last = line.points.len() - 1;
    let mut shifts = [DVec3::ZERO; 2];
    let mut flat_shifts = [[DVec2::ZERO; 2]; 2];
    for end in 0..2 {
        let Spot::On(target, t) = &line.ends[end] else { continue };
        let Some(target) = lines.get(&target.id) else { continue };
        let of_target = &breaks[&target.id];
        let to = of_target[nearest(target, of_target, *t)].t;
        let index = end * last;
        shifts[end] = target.point(to) - line.points[index];
        for (side, image) in line.images.iter().enumerate() {
            let Some(image) = image else { continue };
            let shift = |side: usize| target.image_at(side, to).map(|p| p - image[index]);
            let shortest = [shift(0), shift(1)].into_iter().flatten().min_by(|a, b| a.length().total_cmp(&b.length()));
            flat_shifts[side][end] = shortest.unwrap_or(DVec2::ZERO);
        }
    }
    let whole = line.length_at(line.last());
    if shifts.iter().all(|shift| shift.length() <= ROUNDING * whole) {
        return None;
    }
    let along = |k: usize| line.walked[k] / whole.max(f64::MIN_POSITIVE);
    let points = (0..=last).map(|k| line.points[k] + shifts[0].lerp(shifts[1], along(k))).collect();
    let images = [0, 1].map(|side| {
        let image = line.images[side].as_ref()?;
        let [from, to] = flat_shifts[side];
        Some(image.iter().enumerate().map(|(k, &p)| p + from.lerp(to, along(k))).collect())
    });
    Some(Shared::new(Line::new(line.id, points, images, line.ends.clone())))
}

/// The break of a curve that was nearest to a parameter.
fn nearest(line: &Line, breaks: &[Break], t: f64) -> usize {
    let off = |k: usize| (line.length_at(breaks[k].was) - line.length_at(t)).abs();
    (0..breaks.len()).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

impl Assembly<'_> {
    fn add_node(&mut self, p: DVec3, place: Place) -> u32 {
        self.nodes.push(p);
        self.node_places.push(place);
        self.nodes.len() as u32 - 1
    }

    /// Nodes for vertices of the surface, centres, and breaks within curves; then curves that end on others find theirs.
    fn number_nodes(&mut self) -> Option<()> {
        let lines: Vec<Shared<Line>> = self.lines.values().cloned().collect();
        for line in &lines {
            for (end, t) in [(0, 0.0), (1, line.last())] {
                match line.ends[end] {
                    Spot::Node(v) => self.add_vertex(line, v, line.point(t)),
                    Spot::Centre(hub) if !self.of_centre.contains_key(&hub) => {
                        let node = self.add_node(line.point(t), Place::Free);
                        self.of_centre.insert(hub, node);
                    }
                    Spot::Centre(_) | Spot::On(..) => {}
                }
            }
            for k in 1..self.breaks[&line.id].len() - 1 {
                let t = self.breaks[&line.id][k].t;
                let node = self.add_node(line.point(t), self.place_on(line, t));
                self.breaks.get_mut(&line.id)?[k].node = node;
            }
        }
        for line in &lines {
            let ends = [self.node_of(&line.ends[0])?, self.node_of(&line.ends[1])?];
            let breaks = self.breaks.get_mut(&line.id)?;
            let last = breaks.len() - 1;
            (breaks[0].node, breaks[last].node) = (ends[0], ends[1]);
        }
        Some(())
    }

    fn add_vertex(&mut self, line: &Line, v: u32, p: DVec3) {
        let known = self.of_vertex.get(&v).copied();
        let node = known.unwrap_or_else(|| self.add_node(p, Place::Free));
        self.of_vertex.insert(v, node);
        if let Some(&curve) = self.curve_of.get(&line.id) {
            let is_first = self.node_places[node as usize] == Place::Free;
            let is_fixed = self.base.chains.fixed.contains(&v) || (!is_first && self.base.is_bent(v));
            self.node_places[node as usize] = if is_fixed { Place::Fixed } else { Place::OnCurve(curve) };
        }
    }

    /// Where a vertex within a curve may go: nowhere at a sharp corner.
    fn place_on(&self, line: &Line, t: f64) -> Place {
        let Some(&curve) = self.curve_of.get(&line.id) else { return Place::Free };
        let k = t.round() as usize;
        if (t - k as f64).abs() < 1e-9 && k > 0 && k + 1 < line.points.len() {
            let turn = (line.points[k] - line.points[k - 1]).angle_between(line.points[k + 1] - line.points[k]);
            if turn > self.base.corner_angle {
                return Place::Fixed;
            }
        }
        Place::OnCurve(curve)
    }

    fn node_of(&self, spot: &Spot) -> Option<u32> {
        match spot {
            Spot::Node(v) => self.of_vertex.get(v).copied(),
            Spot::Centre(hub) => self.of_centre.get(hub).copied(),
            Spot::On(line, t) => {
                let k = nearest(line, &self.breaks[&line.id], *t);
                if k == 0 || k + 1 == self.breaks[&line.id].len() {
                    self.node_of(&line.ends[usize::from(k > 0)])
                } else {
                    Some(self.breaks[&line.id][k].node)
                }
            }
        }
    }

    fn layout(self, regions: &[Region]) -> Option<Layout> {
        let mut graph = PatchGraph { nodes: self.nodes.clone(), ..PatchGraph::default() };
        let mut first_side: BTreeMap<usize, u32> = BTreeMap::new();
        let mut side_places = Vec::new();
        for (&id, breaks) in &self.breaks {
            first_side.insert(id, graph.sides.len() as u32);
            let line = &self.lines[&id];
            for w in breaks.windows(2) {
                let arc = Arc { line: line.clone(), reversed: false, from: w[0].t, to: w[1].t };
                let points = arc.parameters().iter().map(|&t| line.point(t)).collect();
                graph.sides.push(Side { ends: [w[0].node, w[1].node], points });
                side_places.push(self.curve_of.get(&id).map_or(Place::Free, |&curve| Place::OnCurve(curve)));
            }
        }
        let mut through = vec![None; graph.nodes.len()];
        for (&line, breaks) in &self.breaks {
            for index in 1..breaks.len() - 1 {
                let ahead = first_side[&line] + index as u32;
                through[breaks[index].node as usize] = Some(Through { line, index, sides: [ahead - 1, ahead] });
            }
        }
        let (mut pieces, mut chart_of) = (Vec::new(), Vec::new());
        for region in regions {
            let (mut patch, mut of_patch) = (Patch::default(), Vec::new());
            for (arc, &c) in region.arcs.iter().zip(&region.corners) {
                let breaks = &self.breaks[&arc.line.id];
                let line = &self.lines[&arc.line.id];
                let (from, to) = (nearest(line, breaks, arc.from), nearest(line, breaks, arc.to));
                if from == to {
                    return None;
                }
                for k in 0..from.abs_diff(to) {
                    let (a, b) = if arc.reversed { (from - k, from - k - 1) } else { (from + k, from + k + 1) };
                    patch.corners.push(Corner {
                        node: breaks[a].node,
                        c_index: if k == 0 { c } else { 6 },
                        side: first_side[&arc.line.id] + a.min(b) as u32,
                        reversed: arc.reversed,
                    });
                    of_patch.push(Arc { line: line.clone(), from: breaks[a].t, to: breaks[b].t, ..arc.clone() });
                }
            }
            graph.patches.push(patch);
            pieces.push(of_patch);
            chart_of.push(region.chart);
        }
        Some(Layout {
            graph,
            chart_of,
            pieces,
            curves: self.curves,
            node_places: self.node_places,
            side_places,
            through,
        })
    }
}
