//! Which lattice each patch is a piece of, so that it surely has a tiling, whatever the lengths of its sides.
//!
//! A patch of triangles has sides of edges alone where they run in directions of one parity, and of pairs alone in those of the other;
//! a patch of squares has all sides of edges. So a patch says of each of its sides what it is made of, in two or three ways, and
//! patches side by side have to agree. All ways to choose for the whole graph are searched before any lengths are asked for: what
//! remains then is a programme without choices, which is solved at once however many sides there are.
//!
//! Deviation: the paper leaves the choice between edges to the integer programme of its additional material.

use super::patch_graph::{Patch, PatchGraph};
use crate::plane::Direction;

/// Choices that are worth asking for lengths, and patches looked at in the search for them.
const MOST_CHOICES: usize = 8;
const MOST_VISITS: usize = 20_000;

/// What the edges in and around a patch are: of squares along the first side, or of triangles along even or odd directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lattice {
    Squares,
    Even,
    Odd,
}

impl Lattice {
    /// Whether edges of it run in a direction.
    pub fn has(self, direction: Direction) -> bool {
        match self {
            Self::Squares => direction.is_multiple_of(3),
            Self::Even => direction.is_multiple_of(2),
            Self::Odd => !direction.is_multiple_of(2),
        }
    }

    /// Those that a patch may be a piece of.
    fn of(patch: &Patch) -> impl Iterator<Item = Self> {
        let is_right = patch.corners.iter().all(|corner| corner.c_index.is_multiple_of(3));
        [Self::Squares, Self::Even, Self::Odd].into_iter().filter(move |&lattice| is_right || lattice != Self::Squares)
    }
}

/// For each patch its lattice; `None` for one that is not flat, or where lengths decide.
pub(super) type Choice = Vec<Option<Lattice>>;

/// Edges alone for patches that then are of one lattice: what needs no search. The others are left to the lengths.
pub(super) fn of_edges(graph: &PatchGraph) -> Choice {
    let lattice = |patch: &Patch| {
        let straight = |&lattice: &Lattice| patch.directions().into_iter().all(|direction| lattice.has(direction));
        Lattice::of(patch).find(straight).filter(|_| patch.total_interior_defect() == 0)
    };
    graph.patches.iter().map(lattice).collect()
}

/// Choices in which every flat patch is of one lattice, those with sides of edges first.
pub(super) fn choices(graph: &PatchGraph) -> Vec<Choice> {
    let mut search = Search {
        graph,
        order: by_neighbours(graph),
        has_pairs: vec![None; graph.sides.len()],
        choice: vec![None; graph.patches.len()],
        found: Vec::new(),
        visits: 0,
    };
    search.choose(0);
    search.found
}

/// Flat patches, each beside one before it where that can be.
fn by_neighbours(graph: &PatchGraph) -> Vec<usize> {
    let mut beside = vec![Vec::new(); graph.sides.len()];
    for (p, patch) in graph.patches.iter().enumerate() {
        patch.corners.iter().for_each(|corner| beside[corner.side as usize].push(p));
    }
    let mut is_known: Vec<bool> = graph.patches.iter().map(|patch| patch.total_interior_defect() != 0).collect();
    let mut order: Vec<usize> = Vec::new();
    for start in 0..graph.patches.len() {
        let mut next = order.len();
        if !std::mem::replace(&mut is_known[start], true) {
            order.push(start);
        }
        while let Some(&p) = order.get(next) {
            for &q in graph.patches[p].corners.iter().flat_map(|corner| &beside[corner.side as usize]) {
                if !std::mem::replace(&mut is_known[q], true) {
                    order.push(q);
                }
            }
            next += 1;
        }
    }
    order
}

struct Search<'a> {
    graph: &'a PatchGraph,
    order: Vec<usize>,
    /// Of each side that a chosen patch has: whether it is of pairs.
    has_pairs: Vec<Option<bool>>,
    choice: Choice,
    found: Vec<Choice>,
    visits: usize,
}

impl Search<'_> {
    /// Chooses for the patches from one in the order on.
    fn choose(&mut self, next: usize) {
        self.visits += 1;
        let Some(&p) = self.order.get(next) else {
            self.found.push(self.choice.clone());
            return;
        };
        let patch = &self.graph.patches[p];
        let directions = patch.directions();
        for lattice in Lattice::of(patch) {
            if self.found.len() == MOST_CHOICES || self.visits > MOST_VISITS {
                return;
            }
            let mut set = Vec::new();
            let agrees = patch.corners.iter().zip(&directions).all(|(corner, &direction)| {
                let known = &mut self.has_pairs[corner.side as usize];
                if known.is_none() {
                    set.push(corner.side as usize);
                }
                *known.get_or_insert(!lattice.has(direction)) != lattice.has(direction)
            });
            if agrees {
                self.choice[p] = Some(lattice);
                self.choose(next + 1);
            }
            for side in set {
                self.has_pairs[side] = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::PolygonMesh;
    use std::collections::BTreeSet;
    use testkit::shapes;

    /// What each side is made of, told by every patch beside it.
    fn told(graph: &PatchGraph, choice: &Choice) -> Vec<BTreeSet<bool>> {
        let mut told = vec![BTreeSet::new(); graph.sides.len()];
        for (patch, lattice) in graph.patches.iter().zip(choice) {
            let lattice = lattice.expect("flat patches have one");
            for (corner, direction) in patch.corners.iter().zip(patch.directions()) {
                // Edges run along the side, or 30 degrees beside it.
                let ways = [vec![direction], vec![(direction + 1) % 12, (direction + 11) % 12]];
                let fits = ways.map(|ways| ways.into_iter().all(|way| lattice.has(way)));
                assert_ne!(fits[0], fits[1]);
                told[corner.side as usize].insert(fits[1]);
            }
        }
        told
    }

    #[test]
    fn patches_side_by_side_agree_in_every_choice() {
        let prism = |n: u32| -> PolygonMesh {
            let at = |k: u32, z: f64| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
                mesh::DVec3::new(angle.cos(), angle.sin(), z)
            };
            let positions = (0..n).map(|k| at(k, 0.0)).chain((0..n).map(|k| at(k, 1.0))).collect();
            let mut faces: Vec<Vec<u32>> = (0..n).map(|k| vec![k, (k + 1) % n, n + (k + 1) % n, n + k]).collect();
            faces.extend([(0..n).rev().collect(), (n..2 * n).collect()]);
            PolygonMesh::from_polygons(positions, &faces).expect("a prism")
        };
        for mesh in [shapes::cuboid(mesh::DVec3::ONE, 1), prism(6)] {
            let graph = PatchGraph::of_polygons(&mesh, false).expect("c-indices");
            let found = choices(&graph);
            assert!(found.len() > 1, "{} choices", found.len());
            for choice in &found {
                assert!(told(&graph, choice).iter().all(|told| told.len() == 1), "{choice:?}");
            }
        }
    }
}
