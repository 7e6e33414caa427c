//! What the quads over one base leave for the quads over the next: the editing loop of section 7, beyond the base.
//!
//! An edit of the features makes some base triangles anew. Patches that have none of those stay: which triangles they merge, the
//! quads along their sides, their pattern and where its vertices lie. Only what lies between them is paired, counted, filled and
//! moved, and the first quads beside it are moved too; all other vertices keep their place bit for bit.
//! The last resort ([`crate::mend`]) changes quads for good, so that what is kept is from before it.

use crate::base::Base;
use crate::density::{Contrast, Counts};
use crate::fill::{Filled, Place};
use crate::patch::Patch;
use crate::rails::Rails;
use mesh::{DVec3, NONE};
use quadrangulate::PatchTopology;
use std::collections::BTreeMap;

/// Rings of quads around new patches that are moved with them.
const RINGS: usize = 2;

/// Quads as they were before the last resort, and what they lie on.
#[derive(Debug)]
pub(crate) struct Kept {
    /// Names of the base triangles, ascending; see [`crate::session::Session::names`].
    pub names: Vec<u64>,
    /// Corners and sides of the base triangles.
    pub triangles: Vec<[u32; 3]>,
    pub triangle_edges: Vec<[u32; 3]>,
    pub patches: Vec<Patch>,
    pub topologies: Vec<PatchTopology>,
    /// Quads along each base edge.
    pub counts: Vec<u32>,
    pub edge_length: f64,
    pub contrast: Contrast,
    pub filled: Filled,
}

/// A vertex: where it lies, and whether it stays there.
type Vertex = (DVec3, bool);

/// Patches that stay, by the numbers of the new base.
#[derive(Debug, Default)]
pub(crate) struct Carried {
    pub patches: Vec<Patch>,
    pub topologies: Vec<PatchTopology>,
    /// Vertices inside each patch.
    pub inner: Vec<Vec<Vertex>>,
    /// Counts of the base edges along their sides; empty when there are none.
    pub counts: Vec<Option<u32>>,
    pub edge_length: f64,
    pub contrast: Contrast,
    /// Vertices inside those edges, and at their ends.
    along: BTreeMap<u32, Vec<Vertex>>,
    corners: BTreeMap<u32, Vertex>,
}

impl Kept {
    /// What an edit has left of it; `names` are those of the new base's triangles. O(base triangles and quads).
    pub fn carry(&self, base: &Base, names: &[u64]) -> Carried {
        let new: Vec<Option<usize>> = self.names.iter().map(|name| names.binary_search(name).ok()).collect();
        let stays = |patch: &Patch| patch.triangles.iter().all(|&t| new[t as usize].is_some());
        let mut inner: Vec<Vec<Vertex>> = vec![Vec::new(); self.patches.len()];
        let vertex = |v: usize| (self.filled.positions[v], self.filled.stays[v]);
        for (v, place) in self.filled.places.iter().enumerate() {
            if let Place::Patch(patch) = place {
                inner[*patch as usize].push(vertex(v));
            }
        }
        let mut carried = Carried {
            counts: vec![None; base.edges.len()],
            edge_length: self.edge_length,
            contrast: self.contrast,
            ..Carried::default()
        };
        for (p, patch) in self.patches.iter().enumerate().filter(|(_, patch)| stays(patch)) {
            let renamed = |t: u32| new[t as usize].map_or(NONE, |t| t as u32);
            for &h in &patch.border {
                let (t, k) = (h as usize / 3, h as usize % 3);
                let now = renamed(t as u32) as usize;
                let (old_edge, new_edge) = (self.triangle_edges[t][k], base.triangle_edges[now][k]);
                carried.counts[new_edge as usize] = Some(self.counts[old_edge as usize]);
                let along = &self.filled.along[old_edge as usize];
                let between = along.get(1..along.len().saturating_sub(1)).unwrap_or_default();
                carried.along.insert(new_edge, between.iter().map(|&v| vertex(v as usize)).collect());
                carried.corners.insert(base.triangles[now][k], vertex(self.triangles[t][k] as usize));
            }
            let mut triangles: Vec<u32> = patch.triangles.iter().map(|&t| renamed(t)).collect();
            triangles.sort_unstable();
            carried.patches.push(Patch {
                triangles,
                border: patch.border.iter().map(|&h| 3 * renamed(h / 3) + h % 3).collect(),
                corners: patch.corners.clone(),
                template: None,
                split: false,
            });
            carried.topologies.push(self.topologies[p].clone());
            carried.inner.push(std::mem::take(&mut inner[p]));
        }
        carried
    }
}

impl Carried {
    /// Puts the vertices on the sides of these patches where they were. Base vertex `v` is vertex `v` of the quads.
    pub fn put_back(&self, rails: &Rails, filled: &mut Filled) {
        let mut put = |v: usize, (position, stays): Vertex| {
            filled.positions[v] = position;
            filled.stays[v] = stays;
        };
        // What is a corner now stays on its feature.
        let free = |v: &u32| !rails.corner[*v as usize];
        self.corners.iter().filter(|(v, _)| free(v)).for_each(|(&v, &vertex)| put(v as usize, vertex));
        for (&e, vertices) in &self.along {
            let along = &filled.along[e as usize];
            along.iter().skip(1).zip(vertices).for_each(|(&v, &vertex)| put(v as usize, vertex));
        }
        let inside = |p: &Place| matches!(p, Place::Patch(patch) if (*patch as usize) < self.inner.len());
        let first = filled.places.iter().position(inside).unwrap_or(0);
        let vertices = self.inner.iter().flatten().enumerate();
        vertices.for_each(|(k, &vertex)| put(first + k, vertex));
    }

    /// Number of their quads.
    pub fn faces(&self) -> usize {
        self.topologies.iter().map(|topology| topology.quads.len()).sum()
    }

    /// All counts from those beside these patches, 0 elsewhere; `None` where two of them contradict.
    pub fn completed(&self, beside: Counts) -> Option<Counts> {
        let both = |(kept, count): (&Option<u32>, u32)| match *kept {
            Some(kept) => (count == 0 || count == kept).then_some(kept),
            None => Some(count),
        };
        let of_edge = self.counts.iter().zip(beside.of_edge).map(both).collect::<Option<Vec<u32>>>()?;
        Some(Counts { of_edge, ..beside })
    }

    /// Which vertices may move: those of new patches, and a few rings of quads around them. All where nothing was carried.
    pub fn movable(&self, filled: &Filled) -> Vec<bool> {
        let first = self.patches.len() as u32;
        let mut moves = vec![false; filled.positions.len()];
        let mut spread = |all: &dyn Fn(usize, &[bool]) -> bool| {
            let quads: Vec<usize> = (0..filled.quads.len()).filter(|&q| all(q, &moves)).collect();
            quads.into_iter().flat_map(|q| filled.quads[q]).for_each(|v| moves[v as usize] = true);
        };
        spread(&|q, _| filled.patch_of[q] >= first);
        for _ in 0..RINGS {
            spread(&|q, moves| filled.quads[q].iter().any(|&v| moves[v as usize]));
        }
        moves
    }
}
