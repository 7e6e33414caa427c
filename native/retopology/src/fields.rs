//! Harmonic fields, one for each base vertex: Daniels et al. 2011, section 4.1, equation 2.
//!
//! Deviation: on a curve a field is not 1 all along but a hat, falling linearly from 1 at its base vertex to 0 at the next
//! ones along the curve, so that feature edges appear in the dual by construction and the vertex splits of section 4.2 have
//! nothing left to do.
//!
//! All fields share one matrix, the Laplacian without the vertices that curves and first sites fix: one factorisation. To
//! label vertices, fields of base vertices far apart are solved as sums (see [`crate::groups`]); one field by itself is solved
//! on demand. A base vertex added later needs one more right-hand side and no factorisation: with its hat h, which vanishes
//! at all others, every field f, or sum of fields, becomes f - f(v) h. That is exact for free sites and, since hats on
//! curves are linear between breakpoints, for new breakpoints too.

use crate::base_error::RetopologyError;
use crate::groups::Groups;
use mesh::{Monitor, NONE};
use rayon::prelude::*;
use solve::cholesky::Factor;
use surface::laplacian::WeightedEdge;

/// Right-hand sides solved between two looks at the monitor.
const BATCH: usize = 64;
/// Shares of a field below this are lost in single precision.
const NOTHING: f64 = 1e-6;

/// Boundary values of one field: vertices on curves, or a first site, and what the field is there. Zero elsewhere.
pub type Hat = Vec<(u32, f64)>;

/// The fields and what it takes to add more.
#[derive(Debug, Clone)]
pub struct Fields {
    /// Unknown of each vertex, or [`NONE`] where all fields are prescribed.
    unknown: Vec<u32>,
    /// Vertex of each unknown.
    vertex: Vec<u32>,
    /// For each prescribed vertex its free neighbours, as unknowns, and their weights.
    coupling: Vec<Vec<(u32, f64)>>,
    factor: Factor,
    groups: Groups,
    /// A sum of fields for each group, then one field for each later base vertex; a value at every vertex, in single
    /// precision to halve the memory.
    sums: Vec<Vec<f32>>,
    /// The base vertices and what their fields are on curves, kept for [`Fields::field`]. Later ones change the hats of
    /// earlier ones only through the update, which `field` repeats.
    additions: Vec<Addition>,
    /// Base vertices that are in the matrix from the start.
    first: usize,
}

/// A base vertex to be added.
#[derive(Debug, Clone)]
pub struct Addition {
    /// The vertex.
    pub vertex: u32,
    /// Its hat on the curve it lies on; empty for a free site.
    pub hat: Hat,
}

impl Fields {
    /// Factors the Laplacian and solves for the first fields. `prescribed` marks the vertices on curves and the first sites;
    /// every component must have one. The factorisation costs 50 ms for 25,000 vertices, the sums of all fields as much.
    ///
    /// # Errors
    /// Cancelled, or the solver's.
    pub fn new(
        weights: &[WeightedEdge],
        mut prescribed: Vec<bool>,
        first: Vec<Addition>,
        groups: Groups,
        monitor: &Monitor,
    ) -> Result<Self, RetopologyError> {
        let n = prescribed.len();
        let mut isolated = vec![true; n];
        for &(a, b, _) in weights {
            isolated[a as usize] = false;
            isolated[b as usize] = false;
        }
        for (fixed, &isolated) in prescribed.iter_mut().zip(&isolated) {
            *fixed |= isolated;
        }
        let vertex: Vec<u32> = (0..n as u32).filter(|&v| !prescribed[v as usize]).collect();
        let mut unknown = vec![NONE; n];
        for (k, &v) in vertex.iter().enumerate() {
            unknown[v as usize] = k as u32;
        }
        let (mut triplets, mut coupling) = (Vec::with_capacity(3 * weights.len()), vec![Vec::new(); n]);
        for &(a, b, weight) in weights {
            let (i, j) = (unknown[a as usize], unknown[b as usize]);
            for (i, j, other) in [(i, j, b), (j, i, a)] {
                if i == NONE {
                    continue;
                }
                triplets.push((i as usize, i as usize, weight));
                if j == NONE {
                    coupling[other as usize].push((i, weight));
                } else if i > j {
                    triplets.push((i as usize, j as usize, -weight));
                }
            }
        }
        let factor = Factor::new(vertex.len(), &triplets)?;
        let first_count = first.len();
        let mut sums: Vec<Hat> = vec![Hat::new(); groups.count];
        for (addition, &group) in first.iter().zip(&groups.of) {
            sums[group as usize].extend(&addition.hat);
        }
        let sums: Vec<Addition> = sums.into_iter().map(|hat| Addition { vertex: NONE, hat }).collect();
        let mut fields =
            Self { unknown, vertex, coupling, factor, groups, sums: Vec::new(), additions: first, first: first_count };
        for batch in sums.chunks(BATCH) {
            monitor.check()?;
            fields.sums.extend(fields.solve(batch)?);
        }
        Ok(fields)
    }

    /// The field that is largest at a vertex, as the number of its base vertex; the first of equals. [`NONE`] where there is
    /// no field.
    pub fn largest(&self, vertex: u32) -> u32 {
        let first = self.groups.in_sight(vertex).iter().copied();
        let later = self.first as u32..self.additions.len() as u32;
        first
            .chain(later)
            .fold((NONE, f32::NEG_INFINITY), |best, k| {
                let value = self.value(k, vertex);
                if value > best.1 { (k, value) } else { best }
            })
            .0
    }

    /// Field of base vertex `k` at a vertex in sight of it.
    pub fn value(&self, k: u32, vertex: u32) -> f32 {
        let sum =
            self.groups.of.get(k as usize).map_or_else(|| self.groups.count + k as usize - self.first, |&g| g as usize);
        self.sums[sum][vertex as usize]
    }

    /// Number of base vertices.
    pub fn len(&self) -> usize {
        self.additions.len()
    }

    /// True without base vertices.
    pub fn is_empty(&self) -> bool {
        self.additions.is_empty()
    }

    /// The whole field of base vertex `k`, a value between 0 and 1 at every vertex of the surface, for display. One
    /// right-hand side: about a millisecond for 25,000 vertices.
    ///
    /// # Errors
    /// The solver's.
    pub fn field(&self, k: usize) -> Result<Vec<f32>, RetopologyError> {
        let mut field = if k < self.first {
            self.solve(&self.additions[k..=k])?.swap_remove(0)
        } else {
            self.sums[self.groups.count + k - self.first].clone()
        };
        // Those added later have each taken their share; theirs vanish at one another's base vertices by now.
        for later in self.first.max(k + 1)..self.additions.len() {
            let share = f64::from(field[self.additions[later].vertex as usize]);
            subtract(&mut field, &self.sums[self.groups.count + later - self.first], share);
        }
        Ok(field)
    }

    /// Solutions with the hats as boundary values, or for a unit load at a free vertex.
    fn solve(&self, additions: &[Addition]) -> Result<Vec<Vec<f32>>, RetopologyError> {
        let mut sides: Vec<Vec<f64>> = additions
            .iter()
            .map(|addition| {
                let mut side = vec![0.0; self.vertex.len()];
                for &(v, value) in &addition.hat {
                    for &(i, weight) in &self.coupling[v as usize] {
                        side[i as usize] += weight * value;
                    }
                }
                if addition.hat.is_empty() {
                    side[self.unknown[addition.vertex as usize] as usize] = 1.0;
                }
                side
            })
            .collect();
        self.factor.solve_many(&mut sides)?;
        let spread = |(addition, side): (&Addition, &Vec<f64>)| {
            let mut field = vec![0.0_f32; self.unknown.len()];
            // A unit load has a peak of any height: bring it to 1 while the precision is there.
            let height =
                if addition.hat.is_empty() { side[self.unknown[addition.vertex as usize] as usize] } else { 1.0 };
            for (&v, value) in self.vertex.iter().zip(side) {
                field[v as usize] = (value / height) as f32;
            }
            for &(v, value) in &addition.hat {
                field[v as usize] = value as f32;
            }
            field
        };
        Ok(additions.par_iter().zip(&sides).map(spread).collect())
    }

    /// Adds base vertices; those on curves with their hats, which take the others among `additions` into account. One
    /// right-hand side each, and an update of the few fields that reach there.
    ///
    /// # Errors
    /// Cancelled, or the solver's.
    pub fn add(&mut self, additions: &[Addition], monitor: &Monitor) -> Result<(), RetopologyError> {
        for batch in additions.chunks(BATCH) {
            for (addition, mut field) in batch.iter().zip(self.solve(batch)?) {
                monitor.check()?;
                let at = addition.vertex as usize;
                // Those added before this one are not in the matrix.
                for later in self.first..self.additions.len() {
                    let share = f64::from(field[self.additions[later].vertex as usize]);
                    subtract(&mut field, &self.sums[self.groups.count + later - self.first], share);
                }
                if addition.hat.is_empty() {
                    let height = field[at];
                    for value in &mut field {
                        *value /= height;
                    }
                }
                self.sums.par_iter_mut().for_each(|sum| {
                    let share = f64::from(sum[at]);
                    subtract(sum, &field, share);
                });
                self.sums.push(field);
                self.additions.push(addition.clone());
            }
        }
        Ok(())
    }
}

fn subtract(from: &mut [f32], what: &[f32], share: f64) {
    if share.abs() > NOTHING {
        for (value, &w) in from.iter_mut().zip(what) {
            *value -= (share * f64::from(w)) as f32;
        }
    }
}
