//! Divides chains of edges anew: afterwards each chain is a path of mesh edges through chosen points of itself.
//!
//! The chain's edges are split at the new vertices, then every other vertex of the chain is merged into the next one
//! along the chain. Vertices in the way are removed or pushed aside first.

use crate::editable::{Editable, sorted};
use mesh::{Cancelled, Monitor, TriangleMesh};

/// A new vertex this near an old one, as a part of the new edge, is that old vertex.
const SNAP: f64 = 0.12;

/// Cosine of the angle through which a merge may turn a triangle.
const TURN: f64 = 0.3;

/// Rounds of clearing the way and merging before merges ignore the turn of triangles.
const ROUNDS: usize = 8;

/// A chain to divide.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Path of vertices along mesh edges; a closed one repeats its first vertex at the end.
    pub vertices: Vec<u32>,
    /// Arc-length parameters in (0, 1) of the new inner vertices, rising. The ends stay.
    pub positions: Vec<f64>,
}

/// The divided mesh.
#[derive(Debug, Clone)]
pub struct Resampled {
    /// The new mesh.
    pub mesh: TriangleMesh,
    /// New vertex of each old one, [`mesh::NONE`] when it went.
    pub vertex: Vec<u32>,
    /// Old triangle that each triangle comes from.
    pub source: Vec<u32>,
    /// Vertices of each chain in the new mesh.
    pub chains: Vec<Vec<u32>>,
}

/// Why the chains cannot be divided.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ResampleError {
    /// A vertex of a chain cannot be removed without changing the topology.
    #[error("chain {chain} cannot be divided as wanted without changing the topology of the surface")]
    Stuck {
        /// Index of the chain.
        chain: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Divides the chains. `size` is the edge length wanted at each vertex: inner vertices much closer together than that go,
/// to clear the way. Border edges stay. Topology is kept. Costs O(n log n).
///
/// # Errors
/// [`ResampleError`].
pub fn resample_chains(
    mesh: &TriangleMesh,
    chains: &[Chain],
    size: &[f64],
    monitor: &Monitor,
) -> Result<Resampled, ResampleError> {
    let lines = chains.iter().flat_map(|c| c.vertices.windows(2).map(|w| [w[0], w[1]]));
    let mut work = Work {
        normals: (0..mesh.triangles.len()).map(|t| mesh.area_normal(t).normalize_or_zero()).collect(),
        mesh: Editable::new(mesh, lines),
        role: vec![Role::Free; mesh.positions.len()],
        size: size.to_vec(),
        paths: Vec::new(),
    };
    for [a, b] in work.mesh.edges() {
        if work.mesh.on_edge(a, b).nth(1).is_none() {
            work.role[a as usize] = Role::Fixed;
            work.role[b as usize] = Role::Fixed;
        }
    }
    for chain in chains {
        for &v in &chain.vertices[1..chain.vertices.len() - 1] {
            work.role[v as usize] = Role::Passing;
        }
    }
    for chain in chains {
        for v in [chain.vertices[0], chain.vertices[chain.vertices.len() - 1]] {
            work.role[v as usize] = Role::Fixed;
        }
    }
    for chain in chains {
        let path = work.insert(chain);
        work.paths.push(path);
    }
    for round in 0..=ROUNDS {
        monitor.check()?;
        work.clear_the_way();
        work.flip();
        let left = work.merge_passing(round == ROUNDS);
        if left == 0 {
            break;
        }
    }
    let stuck = |path: &Vec<u32>| path.iter().any(|&v| work.role[v as usize] == Role::Passing);
    if let Some(chain) = work.paths.iter().position(stuck) {
        return Err(ResampleError::Stuck { chain });
    }
    let paths = work.paths;
    let done = work.mesh.finish();
    let chains = paths.into_iter().map(|p| p.into_iter().map(|v| done.vertex[v as usize]).collect()).collect();
    let vertex = done.vertex[..mesh.positions.len()].to_vec();
    Ok(Resampled { mesh: done.mesh, vertex, source: done.source, chains })
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Inside the surface.
    Free,
    /// Border vertex, end of a chain or new vertex of one.
    Fixed,
    /// Old vertex of a chain: to be removed.
    Passing,
}

struct Work {
    mesh: Editable,
    /// Normal of each input triangle.
    normals: Vec<glam::DVec3>,
    role: Vec<Role>,
    size: Vec<f64>,
    paths: Vec<Vec<u32>>,
}

impl Work {
    /// Puts the new vertices of a chain into it and returns its path, old vertices included.
    fn insert(&mut self, chain: &Chain) -> Vec<u32> {
        let mut length = vec![0.0];
        for pair in chain.vertices.windows(2) {
            length.push(length[length.len() - 1] + self.mesh.length(pair[0], pair[1]));
        }
        let total = length[length.len() - 1];
        let spacing = total / (chain.positions.len() + 1) as f64;
        let mut path = vec![chain.vertices[0]];
        let mut next = chain.positions.iter().map(|t| t * total).peekable();
        for k in 1..chain.vertices.len() {
            let (mut from, to) = (chain.vertices[k - 1], chain.vertices[k]);
            let last = k + 1 == chain.vertices.len();
            while let Some(&s) = next.peek() {
                if s > length[k] + if last { f64::INFINITY } else { 0.0 } {
                    break;
                }
                // The old vertex before or after, when it is near and not taken.
                let free = |work: &Self, v: u32| work.role[v as usize] == Role::Passing;
                if s - length[k - 1] < SNAP * spacing && free(self, chain.vertices[k - 1]) {
                    self.role[chain.vertices[k - 1] as usize] = Role::Fixed;
                } else if length[k] - s < SNAP * spacing && free(self, to) {
                    self.role[to as usize] = Role::Fixed;
                } else {
                    let part = ((s - length[k - 1]) / (length[k] - length[k - 1])).clamp(0.0, 1.0);
                    let point = self.mesh.at(chain.vertices[k - 1]).lerp(self.mesh.at(to), part);
                    let wanted = 0.5 * (self.size[from as usize] + self.size[to as usize]);
                    let v = self.mesh.split(from, to, point);
                    self.role.push(Role::Fixed);
                    self.size.push(wanted);
                    path.push(v);
                    from = v;
                }
                next.next();
            }
            path.push(to);
        }
        path
    }

    /// Cosine between a triangle and the surface it comes from.
    fn upright(&self, corners: [u32; 3], t: u32) -> f64 {
        self.mesh.area_normal(corners).normalize_or_zero().dot(self.normals[self.mesh.source[t as usize] as usize])
    }

    /// True when merging turns no triangle more than it was turned already.
    fn merge_is_fair(&self, from: u32, to: u32) -> bool {
        self.mesh.after_collapse(from, to).all(|(t, fresh)| {
            let after = self.upright(fresh, t);
            after > TURN || (after > 0.0 && after >= self.upright(self.mesh.triangles[t as usize], t))
        })
    }

    /// Removes free vertices that stand much closer to a neighbour than the wanted edge length.
    fn clear_the_way(&mut self) {
        let mut short: Vec<(f64, [u32; 2])> = self
            .mesh
            .edges()
            .into_iter()
            .filter(|&[a, b]| [a, b].iter().any(|&v| self.role[v as usize] == Role::Free))
            .map(|[a, b]| {
                let wanted = 0.5 * (self.size[a as usize] + self.size[b as usize]);
                (self.mesh.length(a, b) / wanted, [a, b])
            })
            .filter(|&(ratio, _)| ratio < 0.5)
            .collect();
        short.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for (_, [a, b]) in short {
            for (from, to) in [(a, b), (b, a)] {
                if self.role[from as usize] == Role::Free
                    && self.mesh.can_collapse(from, to)
                    && self.merge_is_fair(from, to)
                {
                    self.mesh.collapse(from, to);
                    break;
                }
            }
        }
    }

    /// Flips inner edges towards fatter triangles.
    fn flip(&mut self) {
        let fatness = |mesh: &Editable, [a, b, c]: [u32; 3]| {
            let longest = mesh.length(a, b).max(mesh.length(b, c)).max(mesh.length(c, a));
            if longest > 0.0 { mesh.area_normal([a, b, c]).length() / (longest * longest) } else { 0.0 }
        };
        for _ in 0..3 {
            for [a, b] in self.mesh.edges() {
                let Some((sides, fresh)) = self.mesh.after_flip(a, b) else { continue };
                let worst = |t: [[u32; 3]; 2]| fatness(&self.mesh, t[0]).min(fatness(&self.mesh, t[1]));
                let old = sides.map(|t| self.mesh.triangles[t as usize]);
                let stands = self.upright(fresh[0], sides[0]).min(self.upright(fresh[1], sides[1]));
                let flat = self.normals[self.mesh.source[sides[0] as usize] as usize]
                    .dot(self.normals[self.mesh.source[sides[1] as usize] as usize]);
                if worst(fresh) > worst(old) + 1e-9 && stands > 0.5 && flat > 0.7 {
                    self.mesh.flip(sides, fresh);
                }
            }
        }
    }

    /// Merges old chain vertices into a neighbour on their chain, shortest edge first; returns how many are left.
    /// `forced` merges turn triangles as they must.
    fn merge_passing(&mut self, forced: bool) -> usize {
        for k in 0..self.paths.len() {
            while let Some(i) = self.merge_one(k, forced) {
                self.paths[k].remove(i);
            }
        }
        self.paths.iter().flatten().filter(|&&v| self.role[v as usize] == Role::Passing).count()
    }

    /// Merges one vertex of a path and returns its place, or `None` when no merge is possible.
    fn merge_one(&mut self, k: usize, forced: bool) -> Option<usize> {
        let path = &self.paths[k];
        let mut candidates: Vec<(f64, usize, u32, u32)> = (1..path.len() - 1)
            .filter(|&i| self.role[path[i] as usize] == Role::Passing)
            .flat_map(|i| [(i, path[i], path[i - 1]), (i, path[i], path[i + 1])])
            .map(|(i, from, to)| (self.mesh.length(from, to), i, from, to))
            .collect();
        candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for (_, i, from, to) in candidates {
            if !forced && !self.merge_is_fair(from, to) {
                continue;
            }
            self.make_room(from, to);
            if self.mesh.can_collapse(from, to) && (forced || self.merge_is_fair(from, to)) {
                self.mesh.collapse(from, to);
                return Some(i);
            }
        }
        None
    }

    /// Splits the edges to vertices that forbid the merge.
    fn make_room(&mut self, from: u32, to: u32) {
        for blocker in self.mesh.blockers(from, to) {
            let end = if self.mesh.lines.contains(&sorted(from, blocker)) { to } else { from };
            if self.mesh.lines.contains(&sorted(end, blocker)) || self.mesh.on_edge(end, blocker).nth(1).is_none() {
                continue;
            }
            let middle = self.mesh.at(end).midpoint(self.mesh.at(blocker));
            let wanted = 0.5 * (self.size[end as usize] + self.size[blocker as usize]);
            self.mesh.split(end, blocker, middle);
            self.role.push(Role::Free);
            self.size.push(wanted);
        }
    }
}
