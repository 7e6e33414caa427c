//! A quad mesh that can be edited and put back: every operator is "take these quads out, put those in", kept in a journal.

use super::ImproveError;
use mesh::{DVec3, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::smooth::Constraint;

/// What a journal entry takes back.
#[derive(Debug)]
enum Step {
    Removed(u32, [u32; 4]),
    Added,
    NewVertex,
}

/// A state of the journal to go back to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Mark(usize);

/// The quads of a patch with the fan of each vertex. Removed quads leave a gap; vertices without quads are unused.
pub(super) struct Editable {
    pub quads: Vec<Option<[u32; 4]>>,
    /// Reference surface of each quad.
    pub surface_of: Vec<u32>,
    /// Quads round each vertex, unordered.
    pub around: Vec<Vec<u32>>,
    pub positions: Vec<DVec3>,
    pub constraints: Vec<Constraint>,
    /// Vertices on the border or on a feature edge: their identity never changes.
    pub anchored: Vec<bool>,
    /// Edge length wanted round each vertex.
    pub size: Vec<f64>,
    features: BTreeSet<[u32; 2]>,
    /// Quads wanted in each sector of an anchored vertex, by the vertex its first edge (counter-clockwise) goes to.
    sectors: BTreeMap<(u32, u32), u32>,
    journal: Vec<Step>,
}

/// Cost of a vertex `off` quads from its ideal valence: 1, 3, 6, ... so that two small errors are better than one large one.
pub(super) fn valence_cost(off: i32) -> i32 {
    off.abs() * (off.abs() + 1) / 2
}

/// Cost of a sector of an anchored vertex: too few quads make corners flat or inverted, which no smoothing mends.
pub(super) fn sector_cost(off: i32) -> i32 {
    if off < 0 { 4 * valence_cost(off) } else { valence_cost(off) }
}

impl Editable {
    /// Takes the patch and checks that it is an oriented manifold in which two quads meet in a vertex or an edge at most.
    pub(super) fn new(
        quads: &[[u32; 4]],
        surface_of: Vec<u32>,
        positions: Vec<DVec3>,
        constraints: Vec<Constraint>,
        features: &[[u32; 2]],
    ) -> Result<Self, ImproveError> {
        let n = positions.len();
        let mut mesh = Self {
            quads: quads.iter().copied().map(Some).collect(),
            surface_of,
            around: vec![Vec::new(); n],
            positions,
            constraints,
            anchored: vec![false; n],
            size: vec![0.0; n],
            features: features.iter().map(|&[a, b]| sorted(a, b)).collect(),
            sectors: BTreeMap::new(),
            journal: Vec::new(),
        };
        let mut directed = BTreeSet::new();
        for (q, quad) in quads.iter().enumerate() {
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) & 3]);
                if a == b || a == quad[(k + 2) & 3] || !directed.insert((a, b)) {
                    return Err(ImproveError::NotManifold { quad: q });
                }
                mesh.around[a as usize].push(q as u32);
            }
        }
        for (q, quad) in quads.iter().enumerate() {
            for k in 0..4 {
                let (a, b) = (quad[k], quad[(k + 1) & 3]);
                let border = !directed.contains(&(b, a));
                if border || mesh.features.contains(&sorted(a, b)) {
                    mesh.anchored[a as usize] = true;
                    mesh.anchored[b as usize] = true;
                }
                if mesh.fan(a).len() != mesh.around[a as usize].len() {
                    return Err(ImproveError::NotManifold { quad: q });
                }
            }
        }
        for (feature, &[a, b]) in features.iter().enumerate() {
            if !directed.contains(&(a, b)) && !directed.contains(&(b, a)) {
                return Err(ImproveError::NoSuchFeature { feature });
            }
        }
        Ok(mesh)
    }

    pub(super) fn is_feature(&self, a: u32, b: u32) -> bool {
        self.anchored[a as usize] && self.anchored[b as usize] && self.features.contains(&sorted(a, b))
    }

    /// The quad with the directed edge a-b, and the corner of a in it.
    pub(super) fn directed(&self, a: u32, b: u32) -> Option<(u32, usize)> {
        self.around[a as usize].iter().find_map(|&q| {
            let quad = self.quads[q as usize]?;
            (0..4).find(|&k| quad[k] == a && quad[(k + 1) & 3] == b).map(|k| (q, k))
        })
    }

    pub(super) fn has_edge(&self, a: u32, b: u32) -> bool {
        self.directed(a, b).is_some() || self.directed(b, a).is_some()
    }

    /// Quads round `v`, counter-clockwise, as (quad, corner of v); starts after a border or feature edge where there is one.
    pub(super) fn fan(&self, v: u32) -> Vec<(u32, usize)> {
        let corner = |q: u32| self.quads[q as usize].and_then(|quad| quad.iter().position(|&w| w == v)).map(|k| (q, k));
        let Some(mut start) = self.around[v as usize].first().and_then(|&q| corner(q)) else { return Vec::new() };
        let clockwise = |(q, k): (u32, usize)| {
            let first = self.quads[q as usize]?[(k + 1) & 3];
            let (p, j) = self.directed(first, v)?;
            Some(((p, (j + 1) & 3), self.is_feature(v, first)))
        };
        let mut at = start;
        let mut feature = None;
        for _ in 0..self.around[v as usize].len() {
            let Some((before, on_feature)) = clockwise(at) else {
                feature = Some(at);
                break;
            };
            if on_feature && feature.is_none() {
                feature = Some(at);
            }
            at = before;
        }
        // The border is the only place to start at a border vertex; elsewhere a feature is a good one.
        start = feature.unwrap_or(start);
        let mut fan = vec![start];
        let mut at = start;
        while fan.len() <= self.around[v as usize].len() {
            let Some(quad) = self.quads[at.0 as usize] else { break };
            match self.directed(v, quad[(at.1 + 3) & 3]) {
                Some(next) if next != start => {
                    fan.push(next);
                    at = next;
                }
                _ => break,
            }
        }
        fan
    }

    /// Sectors of an anchored vertex: the vertex at the end of the first edge, that at the end of the last, the quads between.
    pub(super) fn sectors_of(&self, v: u32) -> Vec<(u32, u32, u32, u32)> {
        let mut sectors: Vec<(u32, u32, u32, u32)> = Vec::new();
        for (q, k) in self.fan(v) {
            let Some(quad) = self.quads[q as usize] else { continue };
            let (first, last) = (quad[(k + 1) & 3], quad[(k + 3) & 3]);
            match sectors.last_mut() {
                Some(sector) if !self.is_feature(v, first) => {
                    sector.1 = last;
                    sector.2 += 1;
                }
                _ => sectors.push((first, last, 1, q)),
            }
        }
        sectors
    }

    pub(super) fn set_ideal(&mut self, v: u32, first: u32, ideal: u32) {
        self.sectors.insert((v, first), ideal);
    }

    /// Quads that a vertex should have more, negative for fewer; an anchored one in the sector of quad `q`.
    pub(super) fn missing(&self, q: u32, v: u32) -> i32 {
        if !self.anchored[v as usize] {
            return 4 - self.around[v as usize].len() as i32;
        }
        let place = self.fan(v).iter().position(|&(p, _)| p == q).unwrap_or(0);
        let mut passed = 0;
        let sector = self.sectors_of(v).into_iter().find(|&(_, _, count, _)| {
            passed += count as usize;
            place < passed
        });
        sector.map_or(0, |(first, _, count, _)| self.ideal(v, first) as i32 - count as i32)
    }

    /// Quads wanted in the sector of an anchored vertex whose first edge goes to `first`.
    fn ideal(&self, v: u32, first: u32) -> u32 {
        self.sectors.get(&(v, first)).copied().unwrap_or(2)
    }

    /// How far the valence of `v` is from ideal: 0 when regular.
    pub(super) fn vertex_cost(&self, v: u32) -> i32 {
        let count = self.around[v as usize].len() as i32;
        if count == 0 {
            0
        } else if self.anchored[v as usize] {
            self.sectors_of(v)
                .iter()
                .map(|&(first, _, count, _)| {
                    // Border and feature edges never change, so every sector keeps its first edge.
                    sector_cost(count as i32 - self.ideal(v, first) as i32)
                })
                .sum()
        } else {
            valence_cost(count - 4)
        }
    }

    pub(super) fn mark(&self) -> Mark {
        Mark(self.journal.len())
    }

    pub(super) fn remove(&mut self, q: u32) {
        if let Some(quad) = self.quads[q as usize].take() {
            for v in quad {
                self.around[v as usize].retain(|&p| p != q);
            }
            self.journal.push(Step::Removed(q, quad));
        }
    }

    pub(super) fn add(&mut self, quad: [u32; 4], surface: u32) {
        let q = self.quads.len() as u32;
        for v in quad {
            self.around[v as usize].push(q);
        }
        self.quads.push(Some(quad));
        self.surface_of.push(surface);
        self.journal.push(Step::Added);
    }

    /// A new free vertex.
    pub(super) fn add_vertex(&mut self, position: DVec3, size: f64) -> u32 {
        self.positions.push(position);
        self.constraints.push(Constraint::Free);
        self.anchored.push(false);
        self.size.push(size);
        self.around.push(Vec::new());
        self.journal.push(Step::NewVertex);
        self.positions.len() as u32 - 1
    }

    /// Goes back. Positions of old vertices are not part of the journal: whoever moves them puts them back.
    pub(super) fn undo(&mut self, mark: Mark) {
        while self.journal.len() > mark.0 {
            match self.journal.pop() {
                Some(Step::Removed(q, quad)) => {
                    self.quads[q as usize] = Some(quad);
                    for v in quad {
                        self.around[v as usize].push(q);
                    }
                }
                Some(Step::Added) => {
                    let q = self.quads.len() as u32 - 1;
                    if let Some(Some(quad)) = self.quads.pop() {
                        for v in quad {
                            self.around[v as usize].retain(|&p| p != q);
                        }
                    }
                    self.surface_of.pop();
                }
                Some(Step::NewVertex) => {
                    self.positions.pop();
                    self.constraints.pop();
                    self.anchored.pop();
                    self.size.pop();
                    self.around.pop();
                }
                None => {}
            }
        }
    }

    /// Vertices of all quads that were taken out or put in since the mark, ascending.
    pub(super) fn touched(&self, mark: Mark) -> Vec<u32> {
        let mut touched = Vec::new();
        let mut added = self.quads.len();
        for step in self.journal[mark.0..].iter().rev() {
            match step {
                Step::Removed(_, quad) => touched.extend(quad),
                Step::Added => {
                    added -= 1;
                    touched.extend(self.quads[added].iter().flatten());
                }
                Step::NewVertex => {}
            }
        }
        touched.sort_unstable();
        touched.dedup();
        touched
    }

    /// True when every quad put in since the mark is proper: four vertices, each directed edge once, and with any other quad at
    /// most one edge or one vertex in common (so no doublets, no duplicates, no pillows).
    pub(super) fn is_proper_since(&self, mark: Mark) -> bool {
        let added = self.journal[mark.0..].iter().filter(|step| matches!(step, Step::Added)).count();
        (self.quads.len() - added..self.quads.len()).all(|q| {
            let q = q as u32;
            let Some(quad) = self.quads[q as usize] else { return true };
            if quad[0] == quad[2] || quad[1] == quad[3] || (0..4).any(|k| quad[k] == quad[(k + 1) & 3]) {
                return false;
            }
            quad.iter().all(|&v| {
                self.around[v as usize].iter().all(|&p| {
                    let Some(other) = self.quads[p as usize] else { return true };
                    if p == q {
                        return true;
                    }
                    match (0..4).filter(|&k| other.contains(&quad[k])).count() {
                        0 | 1 => true,
                        2 => (0..4).any(|k| {
                            let (a, b) = (quad[k], quad[(k + 1) & 3]);
                            (0..4).any(|j| other[j] == b && other[(j + 1) & 3] == a)
                        }),
                        _ => false,
                    }
                })
            })
        })
    }
}
