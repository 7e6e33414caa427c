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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::grid;
    use glam::DVec3;
    use mesh::{Topology, TriangleMesh};

    /// Half-edges along vertices.
    fn half_edges(topology: &Topology, path: &[u32]) -> Vec<u32> {
        path.windows(2).map(|pair| topology.find(pair[0], pair[1]).unwrap()).collect()
    }

    fn shortened(mesh: &TriangleMesh, paths: &[Vec<u32>], fixed: &[bool]) -> (Intrinsic, Vec<Vec<u32>>) {
        let topology = Topology::of_triangles(mesh);
        let mut triangulation = Intrinsic::new(mesh, &topology);
        let half_edges = paths.iter().map(|path| half_edges(&topology, path)).collect();
        let mut network = Network::new(&triangulation, half_edges, fixed, &[]);
        network.shorten(&mut triangulation, &Monitor::new()).unwrap();
        (triangulation, network.paths)
    }

    fn length(triangulation: &Intrinsic, path: &[u32]) -> f64 {
        path.iter().map(|&h| triangulation.length_of(h)).sum()
    }

    #[test]
    fn a_detour_over_a_folded_sheet_becomes_the_straight_line_of_the_unfolded_one() {
        // Folded like a roof: geodesics are straight once it is flat again.
        let flat = |x: f64, y: f64| DVec3::new(x + 0.2 * (3.0 * y).sin(), y, 0.0);
        let fold = |p: DVec3| if p.x < 5.0 { p } else { DVec3::new(5.0 + (p.x - 5.0) * 0.6, p.y, (p.x - 5.0) * 0.8) };
        let place = |x: f64, y: f64| if x == 5.0 { DVec3::new(5.0, y, 0.0) } else { flat(x, y) };
        let mesh = grid(10, 8, |x, y| fold(place(x, y)));
        let at = |x: u32, y: u32| 11 * y + x;
        let detour: Vec<u32> =
            (2..=7).map(|y| at(2, y)).chain((3..=8).map(|x| at(x, 7))).chain((3..7).rev().map(|y| at(8, y))).collect();
        let (triangulation, paths) = shortened(&mesh, &[detour], &[]);
        let straight = place(2.0, 2.0).distance(place(8.0, 3.0));
        assert!((length(&triangulation, &paths[0]) - straight).abs() < 1e-9);
    }

    #[test]
    fn paths_keep_off_each_other_and_off_fixed_curves() {
        let mesh = grid(10, 8, |x, y| DVec3::new(x, y, 0.0));
        let topology = Topology::of_triangles(&mesh);
        let at = |x: u32, y: u32| 11 * y + x;
        // A curve stands in the way of two paths that go round it.
        let mut fixed = vec![false; topology.len()];
        let wall: Vec<u32> = (0..=4).map(|y| at(5, y)).collect();
        for h in half_edges(&topology, &wall) {
            fixed[h as usize] = true;
        }
        let around = |top: u32, x: u32| -> Vec<u32> {
            let up = (1..=top).map(|y| at(x, y));
            let over = (x + 1..=10 - x).map(|x| at(x, top));
            up.chain(over).chain((1..top).rev().map(|y| at(10 - x, y))).collect()
        };
        let (inner, outer) = (around(6, 3), around(7, 2));
        let (triangulation, paths) = shortened(&mesh, &[inner.clone(), outer.clone()], &fixed);
        let vertices = |path: &[u32]| -> Vec<u32> { path[1..].iter().map(|&h| triangulation.from(h)).collect() };
        let (a, b) = (vertices(&paths[0]), vertices(&paths[1]));
        assert!(a.iter().all(|v| !b.contains(v) && !wall.contains(v)));
        assert!(b.iter().all(|v| !wall.contains(v)));
        let before = |path: &[u32]| (path.len() - 1) as f64;
        assert!(length(&triangulation, &paths[0]) < before(&inner) - 1.0);
        assert!(length(&triangulation, &paths[1]) < before(&outer) - 1.0);
        // Round the top of the curve and no shorter: the other side is out of reach.
        let tip = 2.0 * DVec3::new(2.0, 3.0, 0.0).length();
        assert!(length(&triangulation, &paths[0]) >= tip - 1e-9);
        for (path, ends) in paths.iter().zip([[at(3, 1), at(7, 1)], [at(2, 1), at(8, 1)]]) {
            assert_eq!([triangulation.from(path[0]), triangulation.to(path[path.len() - 1])], ends);
        }
    }
}
