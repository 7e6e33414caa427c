//! Networks of paths made as short as they get by edge flips, without ever crossing.
//!
//! All paths are edge paths of one [`Intrinsic`] triangulation, and no two share a vertex but at their ends. Where a path
//! bends, the edges inside the bend are flipped away and the path takes the short cut. Edges of paths are never flipped, so
//! no two paths can cross.
//!
//! Source: Sharp and Crane, "You can find geodesic paths in triangle meshes by just flipping edges", 2020. Deviation: a short
//! cut through a vertex of another path, or along a fixed edge, is refused. A path that leans on another stays beside it
//! instead of touching it, so that the regions between paths remain disks with distinct sides.

use crate::intrinsic::Intrinsic;
use mesh::{Cancelled, Monitor, NONE};
use std::f64::consts::PI;

/// A bend is worth a flip when the angle inside it is below pi by this much, radians.
const STRAIGHT: f64 = 1e-6;
/// Sweeps over all paths; each lets paths use the room that others have left.
const SWEEPS: usize = 12;

/// Paths that share no vertex but their ends, as half-edges in order, and what they must keep off.
#[derive(Debug)]
pub struct Network {
    /// Half-edges of each path, first to last.
    pub paths: Vec<Vec<u32>>,
    /// Vertices that no path may newly run through: those of all paths and of fixed curves.
    taken_vertex: Vec<bool>,
    /// Edges that are neither flipped nor taken: those of all paths, fixed curves and borders.
    taken_edge: Vec<bool>,
}

impl Network {
    /// A network of `paths`. `fixed` marks the edges, by either half-edge, of curves that stay; `ends` are vertices that no
    /// path may run through although nothing marks them.
    pub fn new(triangulation: &Intrinsic, paths: Vec<Vec<u32>>, fixed: &[bool], ends: &[u32]) -> Self {
        let vertices = triangulation.origin.iter().max().map_or(0, |&v| v as usize + 1);
        let mut network =
            Self { paths, taken_vertex: vec![false; vertices], taken_edge: vec![false; triangulation.length.len()] };
        let on_path: Vec<u32> = network.paths.iter().flatten().copied().collect();
        let curves = (0..fixed.len() as u32).filter(|&h| fixed[h as usize] || triangulation.twin[h as usize] == NONE);
        for h in on_path.into_iter().chain(curves) {
            network.taken_edge[triangulation.edge[h as usize] as usize] = true;
            network.taken_vertex[triangulation.from(h) as usize] = true;
            network.taken_vertex[triangulation.to(h) as usize] = true;
        }
        for &v in ends {
            network.taken_vertex[v as usize] = true;
        }
        network
    }

    /// Shortens all paths in turn until none can be, or little is left to gain. Their length never grows.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn shorten(&mut self, triangulation: &mut Intrinsic, monitor: &Monitor) -> Result<(), Cancelled> {
        for _ in 0..SWEEPS {
            let mut changed = false;
            for path in 0..self.paths.len() {
                monitor.check()?;
                changed |= self.shorten_path(triangulation, path);
            }
            if !changed {
                break;
            }
        }
        Ok(())
    }

    /// Cuts the bends of a path one after the other, going back where a cut has changed the bend before it.
    fn shorten_path(&mut self, triangulation: &mut Intrinsic, path: usize) -> bool {
        let (mut changed, mut k) = (false, 1);
        while k < self.paths[path].len() {
            let (out, back) = self.joint(triangulation, path, k);
            let mut bends = [(true, out, back), (false, back, out)]
                .map(|(left, start, end)| (wedge_angle(triangulation, start, end), left));
            if bends[1].0 < bends[0].0 {
                bends.swap(0, 1);
            }
            let bent = |&&(angle, _): &&(f64, bool)| angle < PI - STRAIGHT;
            if bends.iter().filter(bent).any(|&(_, left)| self.cut_bend(triangulation, path, k, left)) {
                changed = true;
                k = (k - 1).max(1);
            } else {
                k += 1;
            }
        }
        changed
    }

    /// At joint `k` of a path: the half-edge that leaves, and the one that leads back.
    fn joint(&self, triangulation: &Intrinsic, path: usize, k: usize) -> (u32, u32) {
        (self.paths[path][k], triangulation.twin[self.paths[path][k - 1] as usize])
    }

    /// Flips the edges inside a bend away and leads the path along what is then its rim. False when the rim is taken.
    fn cut_bend(&mut self, triangulation: &mut Intrinsic, path: usize, k: usize, left: bool) -> bool {
        let (out, back) = self.joint(triangulation, path, k);
        let (start, end) = if left { (out, back) } else { (back, out) };
        let vertex = triangulation.from(out);
        loop {
            let mut flipped = false;
            let mut spoke = triangulation.counter_clockwise(start);
            while spoke != end {
                let after = triangulation.counter_clockwise(spoke);
                let t = triangulation.twin[spoke as usize];
                let far = triangulation.angle(t) + triangulation.angle(triangulation.next[spoke as usize]);
                let edge = triangulation.edge[spoke as usize] as usize;
                if far < PI - STRAIGHT && !self.taken_edge[edge] && triangulation.from(t) != vertex {
                    triangulation.flip(spoke);
                    flipped = true;
                }
                spoke = after;
            }
            if !flipped {
                break;
            }
        }
        let mut rim = Vec::new();
        let mut spoke = start;
        while spoke != end {
            rim.push(triangulation.next[spoke as usize]);
            spoke = triangulation.counter_clockwise(spoke);
        }
        if left {
            // The rim runs from the tip of `out` to the tip of `back`: against the path.
            rim.reverse();
            for h in &mut rim {
                *h = triangulation.twin[*h as usize];
            }
        }
        let length = |part: &[u32]| part.iter().map(|&h| triangulation.length_of(h)).sum::<f64>();
        let free = rim.iter().all(|&h| h != NONE && !self.taken_edge[triangulation.edge[h as usize] as usize])
            && rim[1..].iter().all(|&h| !self.taken_vertex[triangulation.from(h) as usize]);
        let old = [self.paths[path][k - 1], self.paths[path][k]];
        if !free || length(&rim) >= length(&old) * (1.0 - 1e-12) {
            return false;
        }
        // A rim that passes one vertex twice is no path.
        let mut inner: Vec<u32> = rim[1..].iter().map(|&h| triangulation.from(h)).collect();
        inner.sort_unstable();
        if inner.windows(2).any(|pair| pair[0] == pair[1]) {
            return false;
        }
        self.taken_vertex[vertex as usize] = false;
        for h in old {
            self.taken_edge[triangulation.edge[h as usize] as usize] = false;
        }
        for &h in &rim {
            self.taken_edge[triangulation.edge[h as usize] as usize] = true;
        }
        for v in inner {
            self.taken_vertex[v as usize] = true;
        }
        self.paths[path].splice(k - 1..=k, rim);
        true
    }
}

/// Angle from `start` counter-clockwise to `end`, two half-edges with one origin inside the surface, radians.
fn wedge_angle(triangulation: &Intrinsic, start: u32, end: u32) -> f64 {
    let (mut sum, mut h) = (0.0, start);
    while h != end {
        sum += triangulation.angle(h);
        h = triangulation.counter_clockwise(h);
    }
    sum
}
