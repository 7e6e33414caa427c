//! The coarse triangulation that the pattern is laid over: one triangle for each triangle of the pattern's dual lattice.
//!
//! The surface is cut, in thought, along its borders and the marked edges; these *curves* end at corners and get vertices
//! at equal steps first ([`surface::resample`]), then the rest is remeshed towards equilateral triangles
//! ([`surface::remesh`]). Both keep the topology, whatever the step: a step larger than the surface leaves the smallest
//! triangulation that its topology allows. So no input runs out of triangles, which is what the guarantee rests on.

use super::bends::steps_wanted;
use super::curve::{Curve, Strides};
use super::{STEP, SurfaceError};
use mesh::{DVec3, Monitor, Topology, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::remesh::{RemeshOptions, remesh};
use surface::resample::{Chain, ResampleError, resample_chains};

/// Rounds of remeshing: irregular vertices become fewer up to about here.
const ITERATIONS: u32 = 16;

/// The first remeshing: its step as a fraction of the coarse one, and its rounds.
const FINE_STEP: f64 = 0.45;
const FINE_ITERATIONS: u32 = 5;

/// A bend is a corner when the curve still turns by as much seen from so far on both sides, in steps: what is smaller than a panel is the
/// jaggedness of the mesh, and panels would be crumpled at each tooth.
const REACH: f64 = 0.5;

/// Steps along a curve are measured on its mean over so much on both sides, in steps: a jagged line is longer than the panels along it.
const STRAIGHTENED: f64 = 0.35;

/// Edges along a curve for each step, and the shortest steps that a curve gets to be followed where it bends, in steps: between corners, and
/// round a hole.
const STEP_EDGES: usize = 3;
const LEAST_STEP: f64 = 0.6;
const LEAST_ROUND: f64 = 0.4;

/// A coarse vertex between curves with two triangles in a sector wider than this gets a third, radians.
const WIDE_SECTOR: f64 = 2.2;

/// The triangulation and its curves.
pub(super) struct Coarse {
    /// Triangles, no edge joining two vertices of curves but along a curve.
    pub mesh: TriangleMesh,
    /// Edges along curves: the curve's index, by sorted vertices.
    pub hard: BTreeMap<[u32; 2], u32>,
    /// Vertices at which curves end: they stay where they are.
    pub ends: BTreeSet<u32>,
    /// Border vertices that the pattern passes by: the square between their two triangles lies on the border instead.
    pub passed: BTreeSet<u32>,
    /// The borders and marked edges of the surface, from corner to corner.
    pub curves: Vec<Curve>,
}

/// Builds the triangulation: `step` is the edge length inside, `curve_step` that along curves, scene units.
pub(super) fn coarse(
    surface: &TriangleMesh,
    marked: &[[u32; 2]],
    corner_angle: f64,
    [step, curve_step]: [f64; 2],
    monitor: &Monitor,
) -> Result<Coarse, SurfaceError> {
    let paths = curve_paths(surface, marked, corner_angle, step);
    let curves: Vec<Curve> =
        paths.iter().map(|path| Curve::new(path.iter().map(|&v| surface.positions[v as usize]))).collect();
    let strides: Vec<Strides> = curves.iter().map(|curve| curve.strides(STRAIGHTENED * step)).collect();
    let mut counts = step_counts(&paths, &strides, curve_step);
    for (path, count) in counts.iter_mut().enumerate() {
        monitor.check()?;
        let curve = &curves[path];
        let is_round = curve.is_closed() && !is_open_end(&paths, path);
        let least = if is_round { LEAST_ROUND } else { LEAST_STEP };
        let most = ((curve.length() / (least * curve_step)) as usize).max(*count);
        *count = steps_wanted(curve, step / STEP, is_round, STEP_EDGES, [*count, most]);
    }
    let resampled = loop {
        let chains: Vec<Chain> = paths
            .iter()
            .zip(&strides)
            .zip(&counts)
            .map(|((path, strides), &n)| Chain { vertices: path.clone(), positions: strides.equal(n) })
            .collect();
        match resample_chains(surface, &chains, &[], monitor) {
            Ok(resampled) => break resampled,
            // More samples than the chain has vertices leave nothing to collapse, so this ends.
            Err(ResampleError::Topology { chain }) if counts[chain] < 4 * paths[chain].len() => counts[chain] *= 2,
            Err(ResampleError::Cancelled(cancelled)) => return Err(cancelled.into()),
            Err(error) => return Err(SurfaceError::Curves(error)),
        }
    };
    let chain_edges: Vec<[u32; 2]> = resampled.chains.iter().flat_map(|c| c.windows(2).map(|w| [w[0], w[1]])).collect();
    // Finer first: the rows of a regular input would else survive, stretched one way.
    let mut remeshed = resampled.mesh.clone();
    let mut place: Vec<u32> = (0..resampled.mesh.positions.len() as u32).collect();
    for (fraction, iterations) in [(FINE_STEP, FINE_ITERATIONS), (1.0, ITERATIONS)] {
        let edges: Vec<[u32; 2]> = chain_edges.iter().map(|edge| edge.map(|v| place[v as usize])).collect();
        let size = vec![fraction * step; remeshed.positions.len()];
        let options = RemeshOptions { iterations, ..RemeshOptions::default() };
        let next = remesh(&remeshed, &edges, &size, &options, monitor)?;
        for v in place.iter_mut().filter(|v| **v != mesh::NONE) {
            *v = next.vertex[*v as usize];
        }
        remeshed = next.mesh;
    }
    let mut hard = BTreeMap::new();
    let mut ends = BTreeSet::new();
    for (curve, chain) in resampled.chains.iter().enumerate() {
        for w in chain.windows(2) {
            hard.insert(sorted(place[w[0] as usize], place[w[1] as usize]), curve as u32);
        }
        if chain.first() != chain.last() || is_open_end(&paths, curve) {
            ends.extend([chain[0], chain[chain.len() - 1]].map(|v| place[v as usize]));
        }
    }
    let mut coarse = Coarse { mesh: remeshed, hard, ends, passed: BTreeSet::new(), curves };
    coarse.open_narrow_sectors(monitor)?;
    Ok(coarse)
}

/// Whether a closed path starts at a corner or where other curves end, rather than anywhere on a smooth loop.
fn is_open_end(paths: &[Vec<u32>], curve: usize) -> bool {
    let start = paths[curve][0];
    paths.iter().enumerate().any(|(other, path)| other != curve && (path[0] == start || path.last() == Some(&start)))
}

/// The borders and marked edges as vertex paths between corners; loops without a corner start anywhere.
fn curve_paths(surface: &TriangleMesh, marked: &[[u32; 2]], corner_angle: f64, step: f64) -> Vec<Vec<u32>> {
    let topology = Topology::of_triangles(surface);
    let mut edges: BTreeSet<[u32; 2]> =
        topology.edges().filter(|&h| topology.is_border(h)).map(|h| sorted(topology.from(h), topology.to(h))).collect();
    edges.extend(marked);
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &[a, b] in &edges {
        around.entry(a).or_default().push(b);
        around.entry(b).or_default().push(a);
    }
    let at = |v: u32| surface.positions[v as usize];
    let mut stops: BTreeSet<u32> = around.iter().filter(|(_, n)| n.len() != 2).map(|(&v, _)| v).collect();
    // Sharpest first, so that of corners side by side the one that is kept is the one to see.
    let mut bends: Vec<(f64, u32)> = around
        .iter()
        .filter(|(_, n)| n.len() == 2)
        .map(|(&v, n)| ((at(v) - at(n[0])).angle_between(at(n[1]) - at(v)), v))
        .filter(|&(turn, _)| turn > corner_angle)
        .filter(|&(_, v)| {
            let [back, ahead] = [0, 1].map(|side| seen_from(&around, v, side, REACH * step, &at));
            (at(v) - back).angle_between(ahead - at(v)) > corner_angle
        })
        .collect();
    bends.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (turn, v) in bends {
        // A right angle stays a corner at half the distance that a mild bend needs.
        let apart = step * if turn > 1.0 { 0.35 } else { 0.7 };
        if !is_near_stop(&around, &stops, v, apart, &at) {
            stops.insert(v);
        }
    }
    let mut left = edges;
    let mut paths = Vec::new();
    let walk = |start: u32, first: u32, left: &mut BTreeSet<[u32; 2]>| {
        let (mut path, mut last, mut here) = (vec![start, first], start, first);
        left.remove(&sorted(start, first));
        while here != start && !stops.contains(&here) {
            let next = around[&here].iter().copied().find(|&n| n != last).expect("two neighbours: no stop");
            left.remove(&sorted(here, next));
            (last, here) = (here, next);
            path.push(here);
        }
        path
    };
    for &stop in &stops {
        for &first in &around[&stop] {
            if left.contains(&sorted(stop, first)) {
                paths.push(walk(stop, first, &mut left));
            }
        }
    }
    while let Some(&[start, first]) = left.first() {
        paths.push(walk(start, first, &mut left));
    }
    paths
}

/// The point of the curve through `v`, at which no other ends, that is so far from it along the curve on one side, less where the
/// curve ends before; on a closed one no further than an eighth of its length.
fn seen_from(around: &BTreeMap<u32, Vec<u32>>, v: u32, side: usize, far: f64, at: &impl Fn(u32) -> DVec3) -> DVec3 {
    let walk = |far: f64| {
        let (mut last, mut here, mut walked) = (v, around[&v][side], 0.0);
        loop {
            let length = at(last).distance(at(here));
            if walked + length >= far {
                return (far, at(last).lerp(at(here), (far - walked) / length));
            }
            walked += length;
            let next = around[&here].iter().copied().find(|&n| n != last);
            match next.filter(|_| around[&here].len() == 2 && here != v) {
                Some(next) => (last, here) = (here, next),
                None => return (walked, at(here)),
            }
        }
    };
    let (walked, _) = walk(8.0 * far);
    walk(far.min(walked / 8.0)).1
}

/// Whether a curve through `v` meets a stop within the distance `apart`, along the curve.
fn is_near_stop(
    around: &BTreeMap<u32, Vec<u32>>,
    stops: &BTreeSet<u32>,
    v: u32,
    apart: f64,
    at: &impl Fn(u32) -> DVec3,
) -> bool {
    around[&v].iter().any(|&first| {
        let (mut last, mut here, mut walked) = (v, first, at(v).distance(at(first)));
        while walked < apart && here != v {
            if stops.contains(&here) {
                return true;
            }
            let Some(&next) = around[&here].iter().find(|&&n| n != last) else { return false };
            walked += at(here).distance(at(next));
            (last, here) = (here, next);
        }
        false
    })
}

/// Steps of each path: near `curve_step`, enough for loops to stay loops and for parallel paths to stay apart.
fn step_counts(paths: &[Vec<u32>], strides: &[Strides], curve_step: f64) -> Vec<usize> {
    let ends = |path: &[u32]| sorted(path[0], path[path.len() - 1]);
    let mut between: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for path in paths {
        *between.entry(ends(path)).or_default() += 1;
    }
    let count = |(path, strides): (&Vec<u32>, &Strides)| {
        let least = match (ends(path), between[&ends(path)]) {
            ([start, end], _) if start == end => 3,
            (_, 1) => 1,
            _ => 2,
        };
        ((strides.length() / curve_step).round() as usize).max(least)
    };
    paths.iter().zip(strides).map(count).collect()
}

impl Coarse {
    /// The curve that an edge runs along.
    pub fn curve_of(&self, a: u32, b: u32) -> Option<u32> {
        self.hard.get(&sorted(a, b)).copied()
    }

    /// Gives each triangle one edge along a curve at most, and each wide sector between curves three triangles: the
    /// pattern's triangles at the curve would be flat otherwise.
    fn open_narrow_sectors(&mut self, monitor: &Monitor) -> Result<(), SurfaceError> {
        // No edge is taken from a vertex that got one, so the turns end.
        let mut opened = BTreeSet::new();
        loop {
            monitor.check()?;
            let split: Vec<usize> = (0..self.mesh.triangles.len())
                .filter(|&t| {
                    let corners = self.mesh.triangles[t];
                    (0..3).filter(|&k| self.curve_of(corners[k], corners[(k + 1) % 3]).is_some()).count() > 1
                })
                .collect();
            for &t in &split {
                self.split_triangle(t);
            }
            let Some(h) = self.narrow_sector() else { return Ok(()) };
            self.open_sector(h, &mut opened);
        }
    }

    /// A triangle's half-edge opposite a vertex where a wide sector between curves has two triangles only, or all around the loose end
    /// of a curve there are three: the fan there would have two triangles over the same three vertices.
    fn narrow_sector(&self) -> Option<u32> {
        let topology = Topology::of_triangles(&self.mesh);
        let angle = |h: u32| {
            let at = |v: u32| self.mesh.positions[v as usize];
            let v = at(topology.from(h));
            (at(topology.to(h)) - v).angle_between(at(topology.from(topology.prev[h as usize])) - v)
        };
        (0..topology.len() as u32).find_map(|h| {
            let v = topology.from(h);
            self.curve_of(v, topology.to(h))?;
            if self.passed.contains(&v) {
                return None;
            }
            let before = topology.prev[h as usize];
            let second = topology.twin[before as usize];
            let outer = if second == mesh::NONE { return None } else { topology.prev[second as usize] };
            if self.curve_of(v, topology.from(outer)).is_none() {
                let is_loose = !topology.is_border_vertex(v)
                    && topology.around(v).count() == 3
                    && self.curve_of(v, topology.from(before)).is_none();
                return is_loose.then(|| topology.next[second as usize]);
            }
            if self.curve_of(v, topology.from(before)).is_some() || angle(h) + angle(second) < WIDE_SECTOR {
                return None;
            }
            let wider = if angle(h) >= angle(second) { h } else { second };
            Some(topology.next[wider as usize])
        })
    }

    /// Adds a triangle at the vertex opposite a half-edge: by turning the edge where that folds nothing, else by a vertex in
    /// the triangle. A border vertex that is no corner is passed by instead.
    fn open_sector(&mut self, h: u32, opened: &mut BTreeSet<u32>) {
        let topology = Topology::of_triangles(&self.mesh);
        let t = topology.face[h as usize] as usize;
        let apex = topology.from(topology.prev[h as usize]);
        if let Some([first, second]) = self.turned_edge(&topology, h, opened) {
            opened.insert(apex);
            self.mesh.triangles[t] = first;
            self.mesh.triangles[topology.face[topology.twin[h as usize] as usize] as usize] = second;
        } else if topology.around(apex).count() == 2 && !self.ends.contains(&apex) {
            self.passed.insert(apex);
        } else {
            self.split_triangle(t);
        }
    }

    /// The triangles on both sides of a half-edge after it is turned, if that is possible without harm.
    fn turned_edge(&self, topology: &Topology, h: u32, opened: &BTreeSet<u32>) -> Option<[[u32; 3]; 2]> {
        let twin = topology.twin[h as usize];
        let (a, b) = (topology.from(h), topology.to(h));
        if twin == mesh::NONE || self.curve_of(a, b).is_some() || opened.contains(&a) || opened.contains(&b) {
            return None;
        }
        let apex = topology.from(topology.prev[h as usize]);
        let far = topology.from(topology.prev[twin as usize]);
        if self.hard.keys().any(|e| e.contains(&far))
            || topology.find(apex, far).is_some()
            || topology.find(far, apex).is_some()
        {
            return None;
        }
        let turned = [[apex, a, far], [apex, far, b]];
        let normal = |t: [u32; 3]| mesh::face_normal(&t.map(|v| self.mesh.positions[v as usize]));
        let old = [h, twin].map(|h| normal(self.mesh.triangles[topology.face[h as usize] as usize]));
        turned.iter().all(|&t| old.iter().all(|n| normal(t).dot(*n) > 0.5)).then_some(turned)
    }

    fn split_triangle(&mut self, t: usize) {
        let [a, b, c] = self.mesh.triangles[t];
        let m = self.mesh.positions.len() as u32;
        let centre = self.mesh.points(t).iter().sum::<DVec3>() / 3.0;
        self.mesh.positions.push(centre);
        self.mesh.triangles[t] = [a, b, m];
        self.mesh.triangles.push([b, c, m]);
        self.mesh.triangles.push([c, a, m]);
    }
}
