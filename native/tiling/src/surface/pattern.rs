//! The pattern of triangles and squares over a coarse triangulation.
//!
//! Every coarse triangle is shrunk to a tile, every coarse edge opens to a square, and every coarse vertex to a polygon
//! that is filled by a fan of triangles: the expansion of the triangulation (Conway's operator e; section 5.1 of the paper
//! starts from such polyhedra), with the hexagons divided. Over the regular triangulation it is a tiling of the plane by
//! unit triangles and squares whose lattice has steps of 1 + sqrt 3. Around every new vertex but the fans' centres the
//! tiles are triangle, square, triangle, square and a fan's two halves: 360 degrees whatever the coarse triangulation.
//! So the irregular vertices are among the coarse ones, about one vertex in seven.
//!
//! Along a curve (border or marked edge) tiles end: its edges do not open, they get two vertices each at the thirds, which
//! the tiles of both sides share. What is left between two curves at a vertex of theirs is a fan about that vertex.

use super::coarse::Coarse;
use crate::Kind;
use mesh::{DVec3, NONE, Topology, sorted};
use std::collections::BTreeMap;

/// Edge of the shrunken triangle over that of the coarse one: 1 / (1 + sqrt 3).
const SHRINK: f64 = 0.366_025_403_784_438_6;

/// Where a vertex may go while the mesh is shaped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Anywhere near the surface.
    Free,
    /// Along a curve, an index into [`Coarse::curves`].
    OnCurve(u32),
    /// Nowhere: at an end of curves.
    Fixed,
}

/// A mesh of triangles and quads, before it is shaped.
#[derive(Clone)]
pub(super) struct Pattern {
    pub positions: Vec<DVec3>,
    pub places: Vec<Place>,
    /// Vertices of each tile, counter-clockwise: three or four.
    pub tiles: Vec<Vec<u32>>,
}

impl Pattern {
    /// What each tile is, where none is a rhombus.
    pub fn kinds(&self) -> Vec<Kind> {
        self.tiles.iter().map(|tile| if tile.len() == 3 { Kind::Triangle } else { Kind::Square }).collect()
    }

    /// Tiles at each edge, by its sorted vertices.
    pub fn edge_uses(&self) -> BTreeMap<[u32; 2], u8> {
        let mut uses = BTreeMap::new();
        for tile in &self.tiles {
            for (k, &v) in tile.iter().enumerate() {
                *uses.entry(sorted(v, tile[(k + 1) % tile.len()])).or_default() += 1;
            }
        }
        uses
    }

    /// The expansion of a coarse triangulation. O(n log n).
    pub fn expand(coarse: &Coarse) -> Self {
        let topology = Topology::of_triangles(&coarse.mesh);
        let mut pattern = Self { positions: Vec::new(), places: Vec::new(), tiles: Vec::new() };
        let corner = pattern.shrink(coarse, &topology);
        for h in topology.edges().filter(|&h| !topology.is_border(h)) {
            let (a, b) = (topology.from(h), topology.to(h));
            if coarse.curve_of(a, b).is_none() {
                let twin = topology.twin[h as usize];
                let of = |h: u32| corner[h as usize];
                let next = |h: u32| topology.next[h as usize];
                pattern.tiles.push(vec![of(next(h)), of(h), of(next(twin)), of(twin)]);
            }
        }
        for v in 0..coarse.mesh.positions.len() as u32 {
            pattern.fan(coarse, &topology, &corner, v);
        }
        pattern
    }

    fn add(&mut self, position: DVec3, place: Place) -> u32 {
        self.positions.push(position);
        self.places.push(place);
        self.positions.len() as u32 - 1
    }

    /// The tiles of the coarse triangles; the vertex at each corner, by the half-edge that leaves it.
    fn shrink(&mut self, coarse: &Coarse, topology: &Topology) -> Vec<u32> {
        let mut corner = vec![NONE; topology.len()];
        let mut on_curve: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for t in 0..coarse.mesh.triangles.len() {
            let points = coarse.mesh.points(t);
            let centre = points.iter().sum::<DVec3>() / 3.0;
            for k in 0..3 {
                let v = coarse.mesh.triangles[t][k];
                let near = [(k + 1) % 3, (k + 2) % 3].into_iter().find_map(|other| {
                    let w = coarse.mesh.triangles[t][other];
                    coarse.curve_of(v, w).map(|curve| (curve, w, points[other]))
                });
                corner[3 * t + k] = match near {
                    Some((curve, w, far)) => *on_curve
                        .entry([v, w])
                        .or_insert_with(|| self.add(points[k] + (far - points[k]) / 3.0, Place::OnCurve(curve))),
                    None => self.add(centre + SHRINK * (points[k] - centre), Place::Free),
                };
            }
            self.tiles.push(corner[3 * t..3 * t + 3].to_vec());
        }
        corner
    }

    /// Fills what the shrunken triangles leave around a coarse vertex.
    fn fan(&mut self, coarse: &Coarse, topology: &Topology, corner: &[u32], v: u32) {
        let around: Vec<u32> = topology.around(v).collect();
        if around.is_empty() || coarse.passed.contains(&v) {
            return;
        }
        let curve_at = |h: u32| coarse.hard.get(&sorted(v, topology.to(h))).copied();
        let curve = around
            .iter()
            .find_map(|&h| curve_at(h).or_else(|| coarse.curve_of(v, topology.from(topology.prev[h as usize]))));
        let place = match curve {
            _ if coarse.ends.contains(&v) => Place::Fixed,
            Some(curve) => Place::OnCurve(curve),
            None => Place::Free,
        };
        let centre = self.add(coarse.mesh.positions[v as usize], place);
        // Neighbours in the order around v: the fan crosses every edge from v that opens.
        for &h in &around {
            let twin = topology.twin[h as usize];
            if twin != NONE && curve_at(h).is_none() {
                let before = corner[topology.next[twin as usize] as usize];
                self.tiles.push(vec![centre, before, corner[h as usize]]);
            }
        }
    }
}
