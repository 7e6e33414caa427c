//! Which base vertices can matter where, and which are so far apart that one right-hand side serves them all.
//!
//! A harmonic field decays by a factor from cell to cell, and only the largest one labels a vertex. So a field is looked at
//! within two cells of its base vertex, and the fields of base vertices at least five cells apart are solved as one sum: near
//! each of them the sum is its own field but for a remainder far below the values compared. The number of right-hand sides
//! then stays near fifty however many base vertices there are, where Daniels et al. 2011 solve one system for each.

use crate::metric::Metric;
use crate::split_mesh::SplitMesh;
use mesh::NONE;
use std::collections::BTreeSet;

/// A field is looked at this many cells from its own.
const SIGHT: usize = 2;
/// Fields whose cells are this many steps apart share a right-hand side.
const APART: usize = 5;

/// Groups of base vertices, and who is in sight of each vertex.
#[derive(Debug, Clone)]
pub struct Groups {
    /// Group of each base vertex.
    pub of: Vec<u32>,
    /// Number of groups.
    pub count: usize,
    /// Geodesic cell of each vertex; [`NONE`] where there is none.
    cell: Vec<u32>,
    /// For each geodesic cell, the base vertices in sight, ascending.
    sight: Vec<Vec<u32>>,
}

impl Groups {
    /// Groups `count` base vertices. `seeds` are vertices and the base vertex each belongs to: the base vertices themselves
    /// and all vertices of curves. O(n log n).
    pub fn new(mesh: &SplitMesh, metric: &Metric, seeds: &[(u32, u32)], count: usize) -> Self {
        let n = mesh.positions.len();
        let (mut away, mut cell) = (vec![f64::INFINITY; n], vec![NONE; n]);
        let seeds: Vec<(u32, f64, u32)> = seeds.iter().map(|&(v, k)| (v, 0.0, k)).collect();
        metric.spread(&mut away, &mut cell, &seeds, 1.0);
        let mut neighbours = vec![BTreeSet::new(); count];
        for h in 0..mesh.origin.len() as u32 {
            let (a, b) = (cell[mesh.from(h) as usize], cell[mesh.to(h) as usize]);
            if a != b && a != NONE && b != NONE {
                neighbours[a as usize].insert(b);
                neighbours[b as usize].insert(a);
            }
        }
        let within = |k: u32, steps: usize| {
            let (mut reached, mut rim) = (BTreeSet::from([k]), vec![k]);
            for _ in 0..steps {
                let next: Vec<u32> = rim.iter().flat_map(|&l| neighbours[l as usize].iter().copied()).collect();
                rim = next.into_iter().filter(|&l| reached.insert(l)).collect();
            }
            reached
        };
        let sight = (0..count as u32).map(|k| within(k, SIGHT).into_iter().collect()).collect();
        let mut of = vec![NONE; count];
        for k in 0..count as u32 {
            let used: BTreeSet<u32> = within(k, APART - 1).into_iter().map(|l| of[l as usize]).collect();
            of[k as usize] = (0..=used.len() as u32).find(|group| !used.contains(group)).unwrap_or(0);
        }
        let groups = of.iter().max().map_or(0, |&g| g as usize + 1);
        Self { of, count: groups, cell, sight }
    }

    /// The base vertices in sight of a vertex, ascending.
    pub fn in_sight(&self, vertex: u32) -> &[u32] {
        match self.cell[vertex as usize] {
            NONE => &[],
            k => &self.sight[k as usize],
        }
    }
}
