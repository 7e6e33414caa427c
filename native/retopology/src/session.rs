//! The editing loop: features are added, moved and removed, and only the base triangles about them are made anew.
//!
//! Daniels et al. 2011, section 7, edit features by hand and start over. Here the base triangles that a feature touches, and
//! those around them, are a surface of their own with a rim of base edges that stay. It is triangulated by the same stages and put back.
//! Where the rim does not leave enough room, more is taken, at last everything: the result keeps every promise of
//! [`Base`] whatever was edited. It depends on the order of the edits, not on threads.

use crate::base::Base;
use crate::base_error::RetopologyError;
use crate::build::{BaseOptions, build_base};
use crate::features::{Crumbs, Features, Network, network};
use crate::sizing::even_length;
use crate::splice::rebuild;
use crate::{detect, input};
use mesh::{Monitor, NONE, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Rings of base triangles taken round those an edit touches, in turn until one is enough.
const RINGS: [usize; 3] = [1, 2, 4];
/// A part larger than this fraction of the base triangles is no faster than all.
const LARGEST_PART: f64 = 0.6;

/// A surface with features that are edited.
#[derive(Debug, Clone)]
pub struct Session {
    mesh: TriangleMesh,
    topology: Topology,
    features: Features,
    options: BaseOptions,
    /// Base edge length far from features where the density is 1, scene units.
    even: f64,
    base: Base,
    /// Of the base's surface.
    surface: Topology,
    network: Network,
    /// Marked edges left out because what they are part of is too short for quads.
    dropped: Vec<[u32; 2]>,
    seconds: Vec<(&'static str, f64)>,
    /// Of the base triangles.
    names: Vec<u64>,
    /// The next name.
    next_name: u64,
}

/// What an edit did.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EditReport {
    /// Base triangles taken out.
    pub removed: usize,
    /// Base triangles put in.
    pub added: usize,
    /// True when everything was made anew.
    pub whole: bool,
}

impl Session {
    /// Builds the first base triangulation. Sharp edges that the options detect become features like the others.
    ///
    /// # Errors
    /// As [`build_base`].
    pub fn new(
        mesh: TriangleMesh,
        mut features: Features,
        mut options: BaseOptions,
        monitor: &Monitor,
    ) -> Result<Self, RetopologyError> {
        let topology = input::check(&mesh)?;
        if let Some(detection) = options.detect.take() {
            let (working, _) = input::normalised(&mesh);
            features.edges.extend(detect::sharp_edges(&working, &topology, &features.edges, &detection)?);
        }
        let even = even_length(&mesh, &options.density, options.vertices);
        let (base, network) = (Base::default(), Network::default());
        let surface = Topology::of_triangles(&base.surface);
        let mut session = Self {
            mesh,
            topology,
            features,
            options,
            even,
            base,
            surface,
            network,
            dropped: vec![],
            seconds: vec![],
            names: vec![],
            next_name: 0,
        };
        session.start_over(session.features.clone(), monitor)?;
        Ok(session)
    }

    /// Makes everything anew.
    fn start_over(&mut self, mut features: Features, monitor: &Monitor) -> Result<(), RetopologyError> {
        let built = build_base(&self.mesh, &features, &self.options, monitor)?;
        let inputs = self.mesh.positions.len() as u32;
        self.network = built.fieldwork.network;
        // Refining the surface put vertices between those of the input.
        self.network.chains.iter_mut().for_each(|chain| chain.vertices.retain(|&v| v < inputs));
        self.dropped = built.report.dropped;
        features.edges.retain(|&[a, b]| self.dropped.binary_search(&sorted(a, b)).is_err());
        self.surface = Topology::of_triangles(&built.base.surface);
        self.names.clear();
        self.name_new(built.base.triangles.len());
        (self.base, self.features, self.seconds) = (built.base, features, built.report.seconds);
        Ok(())
    }

    /// The base triangulation as it is; [`crate::quads_from_base`] takes it from here.
    pub fn base(&self) -> &Base {
        &self.base
    }

    /// Names of the base triangles, ascending: a triangle that an edit leaves alone keeps its name, its corners' order and its sides.
    pub(crate) fn names(&self) -> &[u64] {
        &self.names
    }

    /// Names base triangles that follow those which have one.
    fn name_new(&mut self, triangles: usize) {
        while self.names.len() < triangles {
            self.names.push(self.next_name);
            self.next_name += 1;
        }
    }

    /// All features as they are, without those left out.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// The features as chains between corners, by the numbers that the base's edges give them. Vertices are the surface's.
    pub fn network(&self) -> &Network {
        &self.network
    }

    /// Marked edges left out because what they are part of is too short for quads, ascending.
    pub fn dropped(&self) -> &[[u32; 2]] {
        &self.dropped
    }

    /// Seconds by stage of what was last made.
    pub fn seconds(&self) -> &[(&'static str, f64)] {
        &self.seconds
    }

    /// Makes these the features, whatever they were. Makes anew what differs, see [`Session::move_feature`].
    ///
    /// # Errors
    /// As [`build_base`]; after an error nothing has changed.
    pub fn set_features(&mut self, features: &Features, monitor: &Monitor) -> Result<EditReport, RetopologyError> {
        let crumbs = self.options.crumbs(&self.mesh);
        let network = network(&self.mesh, &self.topology, features, self.options.corner_angle, crumbs)?;
        let edges =
            |features: &Features| -> BTreeSet<[u32; 2]> { features.edges.iter().map(|&[a, b]| sorted(a, b)).collect() };
        let (old, mut new) = (edges(&self.features), edges(features));
        new.retain(|edge| network.dropped.binary_search(edge).is_err());
        let vertices = |features: &Features| features.vertices.iter().copied().collect::<BTreeSet<u32>>();
        let (old_vertices, new_vertices) = (vertices(&self.features), vertices(features));
        let from = Features {
            edges: old.difference(&new).copied().collect(),
            vertices: old_vertices.difference(&new_vertices).copied().collect(),
        };
        let to = Features {
            edges: new.difference(&old).copied().collect(),
            vertices: new_vertices.difference(&old_vertices).copied().collect(),
        };
        let report = self.move_feature(&from, &to, monitor)?;
        self.dropped = network.dropped;
        Ok(report)
    }

    /// Marks edges and vertices.
    ///
    /// # Errors
    /// As [`Session::move_feature`].
    pub fn add_feature(&mut self, feature: &Features, monitor: &Monitor) -> Result<EditReport, RetopologyError> {
        self.move_feature(&Features::default(), feature, monitor)
    }

    /// Takes marks away.
    ///
    /// # Errors
    /// As [`Session::move_feature`].
    pub fn remove_feature(&mut self, feature: &Features, monitor: &Monitor) -> Result<EditReport, RetopologyError> {
        self.move_feature(feature, &Features::default(), monitor)
    }

    /// Takes some marks away and puts others, in one step. Costs as much as building a base over the part that is touched,
    /// and O(n) to put it back. After an error nothing has changed.
    ///
    /// # Errors
    /// [`RetopologyError::FeatureOffSurface`] or [`RetopologyError::VertexOffSurface`] for marks to take away that are none, by
    /// their index in `from`; else as [`build_base`].
    pub fn move_feature(
        &mut self,
        from: &Features,
        to: &Features,
        monitor: &Monitor,
    ) -> Result<EditReport, RetopologyError> {
        let start = Instant::now();
        let features = self.edited(from, to)?;
        // Says what is wrong with the new marks.
        let network = network(&self.mesh, &self.topology, &features, self.options.corner_angle, Crumbs::NONE)?;
        if from == to {
            return Ok(EditReport::default());
        }
        let surface = &self.surface;
        let walk = |edges: &[[u32; 2]]| -> Result<Vec<Vec<u32>>, RetopologyError> {
            edges.iter().map(|&edge| self.walk(&self.base, surface, edge).ok_or(LOST)).collect()
        };
        let (gone, new) = (walk(&from.edges)?, walk(&to.edges)?);
        let mut touched: BTreeSet<u32> = BTreeSet::new();
        let changed = gone.iter().chain(&new).flatten().chain(&from.vertices).chain(&to.vertices);
        for &v in changed {
            touched.extend(surface.around(v).map(|h| self.base.owner[h as usize / 3]));
        }
        let pairs = |walks: &[Vec<u32>]| -> BTreeSet<[u32; 2]> {
            walks.iter().flat_map(|walk| walk.windows(2).map(|pair| sorted(pair[0], pair[1]))).collect()
        };
        let (gone, new) = (pairs(&gone), pairs(&new));
        let mut kept = [network.corners.as_slice(), &network.points].concat();
        kept.sort_unstable();
        for rings in RINGS {
            let part = self.grown(&touched, rings);
            if part.len() as f64 > LARGEST_PART * self.base.triangles.len() as f64 {
                break;
            }
            let inputs = self.mesh.positions.len();
            let marks = crate::splice::Marks { gone: &gone, new: &new, vertices: &kept };
            match rebuild(&self.base, inputs, surface, &part, &marks, self.even, &self.options, monitor) {
                Ok(Some(mut base)) => {
                    let added = part.len() + base.triangles.len() - self.base.triangles.len();
                    let surface = Topology::of_triangles(&base.surface);
                    if !self.number_chains(&mut base, &surface, &network) {
                        break;
                    }
                    // Those that stay come first, in their order.
                    let stays = |t: usize| !part.contains(&(t as u32));
                    self.names = (0..self.names.len()).filter(|&t| stays(t)).map(|t| self.names[t]).collect();
                    self.name_new(base.triangles.len());
                    (self.base, self.surface, self.features, self.network) = (base, surface, features, network);
                    self.seconds = vec![("edit", start.elapsed().as_secs_f64())];
                    return Ok(EditReport { removed: part.len(), added, whole: false });
                }
                // A rim in the way: take more.
                Ok(None) | Err(RetopologyError::Internal { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        let removed = self.base.triangles.len();
        self.start_over(features, monitor)?;
        Ok(EditReport { removed, added: self.base.triangles.len(), whole: true })
    }

    /// Gives the base's edges the chains of a network. False when one of them lies on no chain: a bug, but starting over mends it.
    fn number_chains(&self, base: &mut Base, surface: &Topology, network: &Network) -> bool {
        let mut chain_at = BTreeMap::new();
        for (chain, c) in network.chains.iter().zip(0..) {
            let own: Vec<u32> = chain.walk().collect();
            for pair in own.windows(2) {
                let Some(walk) = self.walk(base, surface, [pair[0], pair[1]]) else { return false };
                chain_at.extend(walk.windows(2).map(|step| (sorted(step[0], step[1]), c)));
            }
        }
        for edge in &mut base.edges {
            let chain = chain_at.get(&sorted(edge.path[0], edge.path[1])).copied();
            if chain.is_some() != edge.feature.is_some() {
                return false;
            }
            edge.feature = chain;
        }
        true
    }

    /// The features after an edit.
    fn edited(&self, from: &Features, to: &Features) -> Result<Features, RetopologyError> {
        let mut edges: BTreeSet<[u32; 2]> = self.features.edges.iter().map(|&[a, b]| sorted(a, b)).collect();
        let mut vertices: BTreeSet<u32> = self.features.vertices.iter().copied().collect();
        let mut unmarked = |k: &u32| {
            let [a, b] = from.edges[*k as usize];
            !edges.remove(&sorted(a, b))
        };
        let off: Vec<u32> = (0..from.edges.len() as u32).filter(|k| unmarked(k)).collect();
        if !off.is_empty() {
            return Err(RetopologyError::FeatureOffSurface { features: off });
        }
        let lost: Vec<u32> =
            (0..from.vertices.len() as u32).filter(|&k| !vertices.remove(&from.vertices[k as usize])).collect();
        if !lost.is_empty() {
            return Err(RetopologyError::VertexOffSurface { features: lost });
        }
        let mut edges: Vec<[u32; 2]> = edges.into_iter().collect();
        edges.extend(&to.edges);
        vertices.extend(&to.vertices);
        Ok(Features { edges, vertices: vertices.into_iter().collect() })
    }

    /// The vertices of a base's surface along an edge of the input.
    fn walk(&self, base: &Base, surface: &Topology, [a, b]: [u32; 2]) -> Option<Vec<u32>> {
        let h = self.topology.find(a, b).or_else(|| self.topology.find(b, a))?;
        let twin = self.topology.twin[h as usize];
        let sides = sorted(h / 3, if twin == NONE { NONE } else { twin / 3 });
        let source = |h: u32| if h == NONE { NONE } else { base.source[h as usize / 3] };
        let mut walk = vec![a];
        let direction = self.mesh.positions[b as usize] - self.mesh.positions[a as usize];
        while walk[walk.len() - 1] != b {
            let here = walk[walk.len() - 1];
            let before = walk.len().checked_sub(2).map(|k| walk[k]);
            let ways = surface.around(here).flat_map(|h| [h, surface.prev[h as usize]]);
            let on = ways
                .filter(|&h| sorted(source(h), source(surface.twin[h as usize])) == sides)
                .map(|h| if surface.from(h) == here { surface.to(h) } else { surface.from(h) })
                .find(|&v| {
                    let step = base.surface.positions[v as usize] - base.surface.positions[here as usize];
                    Some(v) != before && step.dot(direction) >= 0.0
                })?;
            walk.push(on);
            if walk.len() > base.surface.positions.len() {
                return None;
            }
        }
        Some(walk)
    }

    /// Base triangles with `rings` more around them; a vertex in common is enough.
    fn grown(&self, touched: &BTreeSet<u32>, rings: usize) -> BTreeSet<u32> {
        let mut part = touched.clone();
        for _ in 0..rings {
            let mut near = vec![false; self.base.vertices.len()];
            for &v in part.iter().flat_map(|&t| &self.base.triangles[t as usize]) {
                near[v as usize] = true;
            }
            let meets = |t: &u32| self.base.triangles[*t as usize].iter().any(|&v| near[v as usize]);
            part = (0..self.base.triangles.len() as u32).filter(meets).collect();
        }
        part
    }
}

const LOST: RetopologyError =
    RetopologyError::Internal { stage: "editing a feature", reason: "an input edge is not in the surface of the base" };
