//! Initial patch layout of a quad mesh (section 3, Fig. 5): traces from the irregular vertices divide it into
//! rectangular grids of quads.
//!
//! Two choices, as in the paper: full separatrices, or the motorcycle graph (Eppstein et al. 2008). Deviation: where
//! the traces leave something that is no rectangle (a torus, or an annulus between two closed separatrices), a further
//! trace is seeded there, until every patch is one.

use crate::Layout;
use crate::intersect::Input;
use mesh::NONE;

/// A patch: `faces[y * width + x]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    /// Number of columns.
    pub width: usize,
    /// Quads, row by row.
    pub faces: Vec<u32>,
}

/// The layout of one mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Patches {
    /// Patches, each a full rectangle.
    pub grids: Vec<Grid>,
}

/// Traces the layout. O(edges) for each extra seed, of which closed meshes with irregular vertices rarely need any.
pub fn trace(input: &Input<'_>, layout: Layout) -> Patches {
    let mut tracer = Tracer::new(input);
    let seeds: Vec<u32> = (0..input.quads.vertex_count() as u32)
        .filter(|&v| input.topology.outgoing[v as usize] != NONE && tracer.valence(v) != 4)
        .flat_map(|v| input.topology.around(v).collect::<Vec<_>>())
        .collect();
    tracer.run(&seeds, layout);
    loop {
        match tracer.grids() {
            Ok(grids) => return Patches { grids },
            Err(free) => {
                let seeds: Vec<u32> = input.topology.around(input.topology.from(free)).collect();
                tracer.run(&seeds, layout);
            }
        }
    }
}

struct Tracer<'a> {
    input: &'a Input<'a>,
    /// Half-edges, both of each edge, that a trace runs along.
    marked: Vec<bool>,
    /// Vertices a trace has passed.
    visited: Vec<bool>,
}

impl<'a> Tracer<'a> {
    fn new(input: &'a Input<'a>) -> Self {
        Self { input, marked: vec![false; input.topology.len()], visited: vec![false; input.quads.vertex_count()] }
    }

    fn valence(&self, v: u32) -> usize {
        self.input.topology.around(v).count()
    }

    /// Advances all traces by one edge at a time, so that motorcycles meet as they should.
    fn run(&mut self, seeds: &[u32], layout: Layout) {
        let t = &self.input.topology;
        for &h in seeds {
            self.visited[t.from(h) as usize] = true;
        }
        let mut active = seeds.to_vec();
        while !active.is_empty() {
            let mut next = Vec::with_capacity(active.len());
            for h in active {
                // A marked edge belongs to a trace on the same line: it has gone, or will go, the rest of the way.
                if self.marked[h as usize] {
                    continue;
                }
                self.marked[h as usize] = true;
                self.marked[t.twin[h as usize] as usize] = true;
                let v = t.to(h);
                let crossed = std::mem::replace(&mut self.visited[v as usize], true);
                if self.valence(v) != 4 || (crossed && layout == Layout::Motorcycle) {
                    continue;
                }
                next.push(t.next[t.twin[t.next[h as usize] as usize] as usize]);
            }
            active = next;
        }
    }

    /// The grids, or an untraced half-edge inside a component that is no rectangle: a trace from there divides it.
    fn grids(&self) -> Result<Vec<Grid>, u32> {
        let t = &self.input.topology;
        let faces = self.input.quads.face_count();
        let mut placed: Vec<Option<[i32; 2]>> = vec![None; faces];
        let mut grids = Vec::new();
        for start in 0..faces {
            if placed[start].is_some() {
                continue;
            }
            placed[start] = Some([0, 0]);
            let mut members = vec![(start as u32, [0, 0])];
            let mut stack = vec![(self.input.quads.face_corners(start).start as u32, [0, 0])];
            while let Some((bottom, [x, y])) = stack.pop() {
                let right = t.next[bottom as usize];
                let top = t.next[right as usize];
                let left = t.next[top as usize];
                for (edge, at) in [(bottom, [x, y - 1]), (right, [x + 1, y]), (top, [x, y + 1]), (left, [x - 1, y])] {
                    if self.marked[edge as usize] {
                        continue;
                    }
                    let over = t.twin[edge as usize];
                    let face = t.face[over as usize];
                    match placed[face as usize] {
                        Some(p) if p == at => {}
                        // The patch closes on itself: an annulus or a torus.
                        Some(_) => return Err(edge),
                        None => {
                            placed[face as usize] = Some(at);
                            members.push((face, at));
                            let behind = t.next[t.next[over as usize] as usize];
                            let bottom = if edge == bottom {
                                behind
                            } else if edge == right {
                                t.next[over as usize]
                            } else if edge == top {
                                over
                            } else {
                                t.prev[over as usize]
                            };
                            stack.push((bottom, at));
                        }
                    }
                }
            }
            let low = [0, 1].map(|k| members.iter().map(|m| m.1[k]).min().expect("a face"));
            let high = [0, 1].map(|k| members.iter().map(|m| m.1[k]).max().expect("a face"));
            let (width, height) = ((high[0] - low[0] + 1) as usize, (high[1] - low[1] + 1) as usize);
            let mut grid = vec![NONE; width * height];
            for &(face, [x, y]) in &members {
                grid[(y - low[1]) as usize * width + (x - low[0]) as usize] = face;
            }
            if grid.contains(&NONE) || members.len() != grid.len() {
                let corners = members.iter().flat_map(|m| self.input.quads.face_corners(m.0 as usize));
                return Err(corners
                    .map(|h| h as u32)
                    .find(|&h| !self.marked[h as usize])
                    .expect("two quads share an edge"));
            }
            grids.push(Grid { width, faces: grid });
        }
        Ok(grids)
    }
}
