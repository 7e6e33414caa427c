//! First paths of the base edges: in every cell a star of disjoint paths from the base vertex to the arcs of its rim.
//!
//! Daniels et al. 2011, section 4.3, take geodesics, which may cross. Here every base edge crosses its own arc once, at a
//! port, and stays in its two cells otherwise. A cell is a disk; the paths that a star has already cut it into sectors, each
//! a disk with the base vertex at its tip; so the next port is always joined to the base vertex by a strip of triangles. The
//! search runs over free vertices and over edges, which are split where the path crosses them: it cannot fail, and paths
//! never touch. `surface::flip_geodesic` shortens them afterwards.

use crate::base_error::RetopologyError;
use crate::cells::{Cells, Piece};
use crate::fields::Fields;
use crate::split_mesh::{SplitMesh, next, prev};
use foldhash::fast::FixedState;
use mesh::{DVec3, Monitor, NONE, sorted};
use ordered_float::OrderedFloat;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Sets and maps that are asked, never listed, so that their order does not matter.
type Set<T> = std::collections::HashSet<T, FixedState>;
type Map<K, V> = std::collections::HashMap<K, V, FixedState>;

/// A place a path may run through: a vertex, or the middle of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
enum Node {
    Vertex(u32),
    Edge(u32, u32),
}

/// Base edges drawn on a surface, which is split along them.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// The surface.
    pub mesh: SplitMesh,
    /// The path of each base edge, as vertices from its lower base vertex to the other.
    pub paths: Vec<Vec<u32>>,
    /// Cell of each vertex; [`NONE`] for ports and where it no longer matters.
    label: Vec<u32>,
    /// Vertices of curves and of paths.
    taken: Vec<bool>,
    /// Edges of curves and of paths.
    taken_edges: Set<[u32; 2]>,
}

/// Where a path may run.
enum Bounds {
    /// In one cell.
    Cell(u32),
    /// In these triangles.
    Triangles(Set<u32>),
}

/// Draws a path for every arc of sound cells. Arcs across curves follow the curve.
///
/// # Errors
/// Cancelled; [`RetopologyError::Internal`] when the cells are not sound.
pub fn draw(
    mesh: &SplitMesh,
    cells: &Cells,
    fields: &Fields,
    peaks: &[u32],
    pieces: &[Piece],
    monitor: &Monitor,
) -> Result<Drawing, RetopologyError> {
    let mut taken = vec![false; mesh.positions.len()];
    let mut taken_edges = Set::default();
    for piece in pieces {
        for &v in &piece.vertices {
            taken[v as usize] = true;
        }
        taken_edges.extend(piece.vertices.windows(2).map(|pair| sorted(pair[0], pair[1])));
    }
    for &v in peaks {
        taken[v as usize] = true;
    }
    // Where the two fields are largest, the arc is nearest to both base vertices. Ends, since splits renumber half-edges.
    let best_crossing = |arc: &crate::cells::CellArc| {
        let height = |h: u32| {
            [mesh.from(h), mesh.to(h)]
                .map(|v| fields.value(cells.label[v as usize], v))
                .into_iter()
                .fold(f32::INFINITY, f32::min)
        };
        arc.crossed.iter().copied().max_by(|&g, &h| height(g).total_cmp(&height(h)).then(h.cmp(&g))).map(|h| {
            let (a, b) = (mesh.from(h), mesh.to(h));
            if cells.label[a as usize] == arc.cells[0] { [a, b] } else { [b, a] }
        })
    };
    let crossings: Vec<Option<[u32; 2]>> =
        cells.arcs.iter().map(|arc| if arc.piece.is_none() { best_crossing(arc) } else { None }).collect();
    let (label, paths) = (cells.label.clone(), Vec::with_capacity(cells.arcs.len()));
    let mut stars = Drawing { mesh: mesh.clone(), paths, label, taken, taken_edges };
    let ports: Vec<u32> = crossings
        .into_iter()
        .map(|ends| ends.map_or(Some(NONE), |[a, b]| stars.split(a, b, NONE)))
        .collect::<Option<_>>()
        .ok_or(BROKEN)?;
    for &port in ports.iter().filter(|&&port| port != NONE) {
        stars.taken[port as usize] = true;
    }
    for (arc, &port) in cells.arcs.iter().zip(&ports) {
        monitor.check()?;
        if let Some(k) = arc.piece {
            let mut path = pieces[k as usize].vertices.clone();
            if pieces[k as usize].ends[0] != arc.cells[0] {
                path.reverse();
            }
            stars.paths.push(path);
            continue;
        }
        let mut half = |cell: u32| stars.path(port, peaks[cell as usize], &Bounds::Cell(cell)).ok_or(BROKEN);
        let mut path = half(arc.cells[0])?;
        path.reverse();
        path.pop();
        path.extend(half(arc.cells[1])?);
        stars.paths.push(path);
    }
    Ok(stars)
}

const BROKEN: RetopologyError = RetopologyError::Internal {
    stage: "drawing base edges",
    reason: "a base vertex cannot be reached within its cell",
};

impl Drawing {
    /// Draws the path of an edge anew, between other ends, through the two base triangles that it divides now.
    ///
    /// # Errors
    /// [`RetopologyError::Internal`] when the ends are not the far corners of those triangles.
    pub fn redraw(&mut self, edge: usize, ends: [u32; 2]) -> Result<(), RetopologyError> {
        let old = std::mem::take(&mut self.paths[edge]);
        // All triangles on either side, up to the next paths.
        let mut region = Set::default();
        let mut open = Vec::new();
        for pair in old.windows(2) {
            let h = self.mesh.find(pair[0], pair[1]).ok_or(BROKEN)?;
            open.extend([h / 3, self.mesh.twin[h as usize] / 3]);
            self.taken_edges.remove(&sorted(pair[0], pair[1]));
        }
        for &v in &old[1..old.len() - 1] {
            self.taken[v as usize] = false;
        }
        while let Some(t) = open.pop() {
            if region.insert(t) {
                for h in 3 * t..3 * t + 3 {
                    let twin = self.mesh.twin[h as usize];
                    if twin != NONE && !self.is_wall(self.mesh.from(h), self.mesh.to(h)) {
                        open.push(twin / 3);
                    }
                }
            }
        }
        self.paths[edge] = self.path(ends[0], ends[1], &Bounds::Triangles(region)).ok_or(BROKEN)?;
        Ok(())
    }

    fn is_wall(&self, a: u32, b: u32) -> bool {
        self.taken[a as usize] && self.taken[b as usize] && self.taken_edges.contains(&sorted(a, b))
    }

    /// Splits the edge from `a` to `b` for a vertex of the cell `label`.
    fn split(&mut self, a: u32, b: u32, label: u32) -> Option<u32> {
        let m = self.mesh.split(self.mesh.find(a, b)?, 0.5);
        self.label.push(label);
        self.taken.push(false);
        Some(m)
    }

    fn at(&self, node: Node) -> DVec3 {
        match node {
            Node::Vertex(v) => self.mesh.positions[v as usize],
            Node::Edge(a, b) => self.mesh.positions[a as usize].midpoint(self.mesh.positions[b as usize]),
        }
    }

    fn is_free(&self, node: Node, bounds: &Bounds, goal: u32) -> bool {
        let inside = |v: u32| match bounds {
            Bounds::Cell(cell) => self.label[v as usize] == *cell,
            // Only nodes of these triangles are looked at.
            Bounds::Triangles(_) => true,
        };
        match node {
            Node::Vertex(v) => v == goal || (inside(v) && !self.taken[v as usize]),
            Node::Edge(a, b) => (inside(a) || inside(b)) && !self.is_wall(a, b),
        }
    }

    /// Nodes that share a triangle with a node, but for those on its own edges.
    fn beside(&self, node: Node, bounds: &Bounds) -> Vec<Node> {
        let open = |h: u32| match bounds {
            Bounds::Cell(_) => true,
            Bounds::Triangles(region) => region.contains(&(h / 3)),
        };
        let edge = |h: u32| {
            let [a, b] = sorted(self.mesh.from(h), self.mesh.to(h));
            Node::Edge(a, b)
        };
        let mut found = Vec::new();
        match node {
            Node::Vertex(v) => {
                for h in self.mesh.around(v).filter(|&h| open(h)) {
                    found.extend([Node::Vertex(self.mesh.to(h)), Node::Vertex(self.mesh.from(prev(h))), edge(next(h))]);
                }
            }
            Node::Edge(a, b) => {
                let Some(h) = self.mesh.find(a, b) else { return found };
                for side in [h, self.mesh.twin[h as usize]].into_iter().filter(|&side| side != NONE && open(side)) {
                    found.extend([Node::Vertex(self.mesh.from(prev(side))), edge(next(side)), edge(prev(side))]);
                }
            }
        }
        found
    }

    /// The shortest path from a vertex to another, cut into the mesh and taken.
    fn path(&mut self, start: u32, goal: u32, bounds: &Bounds) -> Option<Vec<u32>> {
        let start = Node::Vertex(start);
        let mut reached = Map::default();
        reached.insert(start, (0.0, start));
        let mut front = BinaryHeap::from([Reverse((OrderedFloat(0.0), start))]);
        while let Some(Reverse((OrderedFloat(distance), node))) = front.pop() {
            if node == Node::Vertex(goal) {
                break;
            }
            if distance > reached[&node].0 {
                continue;
            }
            let here = self.at(node);
            for other in self.beside(node, bounds) {
                if !self.is_free(other, bounds, goal) || !self.is_open(node, other) {
                    continue;
                }
                let far = distance + here.distance(self.at(other));
                if reached.get(&other).is_none_or(|&(d, _)| far < d) {
                    reached.insert(other, (far, node));
                    front.push(Reverse((OrderedFloat(far), other)));
                }
            }
        }
        let mut nodes = vec![Node::Vertex(goal)];
        while nodes[nodes.len() - 1] != start {
            nodes.push(reached.get(&nodes[nodes.len() - 1])?.1);
        }
        nodes.reverse();
        let label = if let Bounds::Cell(cell) = bounds { *cell } else { NONE };
        let mut path = Vec::with_capacity(nodes.len());
        for node in nodes {
            path.push(match node {
                Node::Vertex(v) => v,
                Node::Edge(a, b) => self.split(a, b, label)?,
            });
        }
        for pair in path.windows(2) {
            self.taken_edges.insert(sorted(pair[0], pair[1]));
        }
        for &v in &path {
            self.taken[v as usize] = true;
        }
        Some(path)
    }

    /// False along an edge that is taken.
    fn is_open(&self, from: Node, to: Node) -> bool {
        match (from, to) {
            (Node::Vertex(a), Node::Vertex(b)) => !self.is_wall(a, b),
            _ => true,
        }
    }
}
