//! The filler for annuli: a corner-aware row along a border that has corners, then concentric rows between the two loops.
//!
//! Not in the paper. The first row is that of paving (T. Blacker and M. Stephenson, `Paving`, IJNME 32, 1991): one quad at
//! a corner of 90 degrees, three at one of 270. Where the loops' counts differ, columns of one edge on one loop and three
//! on the other are placed where they shear the rest least, by dynamic programming over the pairing of the loops' edges;
//! each lies in a four-sided patch, which the patch filler meshes with as few irregular vertices as it knows.

mod strip;

use super::matching::TRIANGLE_EDGE;
use super::{Declined, Fill, Region};
use mesh::{Monitor, Topology};
use quadrangulate::Filler;
use std::f64::consts::FRAC_PI_2;
use strip::{Lifted, Strip, Walk, edges_of, harmonic};
use surface::remesh::{RemeshOptions, remesh};
use surface::smooth_star::Reference;

/// What a column of one edge against three costs, half of one against five, in units of a column sheared by 45 degrees.
const TRANSITION_COST: f64 = 10.0;

/// The quads at a kept border vertex are what the kept ones leave of four, unless the angle is off by more right angles.
const ANGLE_TOLERANCE: f64 = 0.75;

/// A row's inner loop shorter than this is no row.
const SHORTEST_LOOP: usize = 4;

/// Fills an annulus. Costs O(n^1.5) for the remeshed surface of n triangles and O(a b) for loops of a and b edges.
///
/// # Errors
/// [`Declined`] for any other region, when one loop has over five times the edges of the other, or remeshing fails.
pub fn fill(region: &Region, scale: f64, monitor: &Monitor) -> Result<Fill, Declined> {
    let [lower, upper] = match &region.loops[..] {
        [a, b] if region.inner_lines.is_empty() => [a, b],
        [_, _] => return Err(Declined::Because("a line runs inside the region".into())),
        _ => {
            return Err(Declined::Because(format!(
                "the region has {} border loops, an annulus two",
                region.loops.len()
            )));
        }
    };
    let topology = Topology::of_triangles(&region.surface);
    if region.surface.positions.len() + region.surface.triangles.len() != topology.edges().count() {
        return Err(Declined::Because("the region has handles".into()));
    }
    let size: Vec<f64> = region.size.iter().map(|s| s * scale * TRIANGLE_EDGE).collect();
    let made =
        remesh(&region.surface, &[], &size, &RemeshOptions::default(), monitor).map_err(|e| because(monitor, &e))?;
    // Two triangles make a quad; as many rows follow as make that many quads.
    let wanted = 0.5 * made.mesh.triangles.len() as f64;
    let in_mesh = |walk: &[u32]| walk.iter().map(|&v| made.vertex[v as usize]).collect::<Vec<u32>>();
    let strip = Strip::new(made.mesh, [&in_mesh(lower), &in_mesh(upper)], monitor)?;

    let mut quads = Quads { count: region.rim_count as u32, faces: vec![] };
    let mut angles = vec![None; region.rim_count];
    let mut heights = vec![None; region.rim_count];
    let mut rows_used = 0;
    let mut rails: Vec<Rail> = Vec::new();
    for (k, walk) in [lower, upper].into_iter().enumerate() {
        let mut walk = Walk { vertices: walk.clone(), angles: strip.walks[k].angles.clone() };
        let mut ends = walk.vertices.iter().map(|&v| quads_at(region, &topology, v)).collect::<Vec<usize>>();
        let turn = if k == 0 { 1 } else { -1 };
        let has_row = prepare_corners(&mut walk, &mut ends, turn);
        for (&v, &angle) in walk.vertices.iter().zip(&walk.angles) {
            angles[v as usize] = Some(angle);
            heights[v as usize] = Some(k as f64);
        }
        rows_used += usize::from(has_row);
        rails.push(if has_row { quads.first_row(&walk, &ends, turn) } else { Rail::along(&walk) });
    }
    let [bottom, top] = [rails[0].clone(), rails[1].reversed()];
    let mean_count = 0.5 * (lower.len() + upper.len()) as f64;
    let rows = ((wanted / mean_count).round() as usize).saturating_sub(rows_used).max(1);
    quads.concentric(&bottom, &top, rows)?;
    monitor.check()?;

    let count = quads.count as usize;
    angles.resize(count, None);
    heights.resize(count, None);
    let edges = edges_of(&quads.faces);
    let angle = harmonic(count, &edges, &angles).map_err(|e| because(monitor, &e))?;
    let level: Vec<(u32, u32, i32)> = edges.iter().map(|&(a, b, _)| (a, b, 0)).collect();
    let height = harmonic(count, &level, &heights).map_err(|e| because(monitor, &e))?;
    let place = |v: usize| region.under.project(strip.point(angle[v], height[v])).point;
    Ok(Fill {
        positions: (region.rim_count..count).map(place).collect(),
        quads: quads.faces.iter().map(|q| q.map(|(v, _)| v)).collect(),
    })
}

fn because(monitor: &Monitor, reason: &impl std::fmt::Display) -> Declined {
    match monitor.check() {
        Err(cancelled) => cancelled.into(),
        Ok(()) => Declined::Because(reason.to_string()),
    }
}

/// How many quads should meet at a rim vertex: 1 at a corner, 2 along a side, 3 at a reflex corner.
fn quads_at(region: &Region, topology: &Topology, v: u32) -> usize {
    let at = |v: u32| region.surface.positions[v as usize];
    let angle: f64 = topology
        .around(v)
        .map(|h| (at(topology.to(h)) - at(v)).angle_between(at(topology.from(topology.prev[h as usize])) - at(v)))
        .sum();
    let right_angles = angle / FRAC_PI_2;
    let kept = region.outside[v as usize];
    let wanted = if kept == 0 { 2.0 } else { (4.0 - f64::from(kept)).clamp(1.0, 3.0) };
    let best = if (right_angles - wanted).abs() <= ANGLE_TOLERANCE { wanted } else { right_angles.round() };
    best.clamp(1.0, 3.0) as usize
}

/// Turns a walk to start on a side, with no corner just before, and makes sides of corners that no row can round:
/// neighbours of corners, and all when too short a loop would remain. Tells whether corners remain.
fn prepare_corners(walk: &mut Walk, ends: &mut [usize], turn: i32) -> bool {
    let n = ends.len();
    let start = (0..n).find(|&k| ends[k] == 2 && ends[(k + n - 1) % n] != 1).unwrap_or(0);
    walk.vertices.rotate_left(start);
    walk.angles.rotate_left(start);
    for angle in &mut walk.angles[n - start..] {
        *angle += f64::from(turn);
    }
    ends.rotate_left(start);
    ends[0] = 2;
    if ends[n - 1] == 1 {
        ends[n - 1] = 2;
    }
    for k in 1..n {
        if ends[k] == 1 && ends[k - 1] == 1 {
            ends[k] = 2;
        }
    }
    let inner_length = |ends: &[usize]| ends.iter().map(|&q| 2 * q as i64 - 4).sum::<i64>() + n as i64;
    if inner_length(ends) < SHORTEST_LOOP as i64 {
        ends.fill(2);
    }
    ends.iter().any(|&q| q != 2)
}

/// A loop between which and another rows are laid: lifted vertices and their angles, in turns.
#[derive(Debug, Clone)]
struct Rail {
    points: Vec<Lifted>,
    angles: Vec<f64>,
}

impl Rail {
    fn along(walk: &Walk) -> Self {
        Self { points: walk.vertices.iter().map(|&v| (v, 0)).collect(), angles: walk.angles.clone() }
    }

    /// A rail of falling angle as one of rising angle.
    fn reversed(&self) -> Self {
        let n = self.points.len();
        let order = || (0..n).map(|k| (n - k) % n);
        Self {
            points: order().map(|k| (self.points[k].0, self.points[k].1 + i32::from(k > 0))).collect(),
            angles: order().map(|k| self.angles[k] + f64::from(u8::from(k > 0))).collect(),
        }
    }

    fn at(&self, k: i64) -> Lifted {
        let n = self.points.len() as i64;
        let (v, turn) = self.points[k.rem_euclid(n) as usize];
        (v, turn + k.div_euclid(n) as i32)
    }

    fn angle(&self, k: i64) -> f64 {
        let n = self.points.len() as i64;
        self.angles[k.rem_euclid(n) as usize] + k.div_euclid(n) as f64
    }
}

/// Pairing of the edges of two rails, column by column: edges of the lower and of the upper.
#[derive(Debug)]
struct Pairing {
    /// Where on the upper rail the first column starts.
    start: i64,
    columns: Vec<[u32; 2]>,
}

/// Pairs each edge with one, or with three or five where counts differ, with the least shear.
fn pair(bottom: &Rail, top: &Rail, rows: usize) -> Option<Pairing> {
    let (n, m) = (bottom.points.len(), top.points.len());
    let columns = n.max(m) as f64;
    let nearest = (-(m as i64)..2 * m as i64)
        .min_by(|&a, &b| {
            let off = |k: i64| (top.angle(k) - bottom.angle(0)).abs();
            off(a).total_cmp(&off(b))
        })
        .unwrap_or(0);
    let mut best: Option<(f64, Pairing)> = None;
    let reach = (n.abs_diff(m) as i64 / 2).clamp(2, 6);
    for start in nearest - reach..=nearest + reach {
        let shear = |i: usize, j: usize| {
            let off = (top.angle(start + j as i64) - bottom.angle(i as i64)) * columns / rows as f64;
            off * off
        };
        let mut cost = vec![f64::INFINITY; (n + 1) * (m + 1)];
        let mut from = vec![[0, 0]; cost.len()];
        cost[0] = 0.0;
        for i in 0..=n {
            for j in 0..=m {
                for step in [[1, 1], [1, 3], [3, 1], [1, 5], [5, 1]] {
                    let (Some(a), Some(b)) = (i.checked_sub(step[0]), j.checked_sub(step[1])) else { continue };
                    let extra = TRANSITION_COST * (step[0] + step[1] - 2) as f64 / 2.0;
                    let total = cost[a * (m + 1) + b] + extra + shear(i, j);
                    if total < cost[i * (m + 1) + j] {
                        cost[i * (m + 1) + j] = total;
                        from[i * (m + 1) + j] = [step[0] as u32, step[1] as u32];
                    }
                }
            }
        }
        let total = cost[cost.len() - 1];
        if total.is_finite() && best.as_ref().is_none_or(|(least, _)| total < *least) {
            let (mut i, mut j, mut columns) = (n, m, vec![]);
            while i + j > 0 {
                let step = from[i * (m + 1) + j];
                columns.push(step);
                i -= step[0] as usize;
                j -= step[1] as usize;
            }
            columns.reverse();
            best = Some((total, Pairing { start, columns }));
        }
    }
    best.map(|(_, pairing)| pairing)
}

impl Pairing {
    /// Numbers of columns in runs that hold one transition each, at most, and reach at most `reach` columns from it: a
    /// wider patch with a transition would be given more rows all along.
    fn runs(&self, reach: usize) -> Vec<usize> {
        let transitions: Vec<usize> = (0..self.columns.len()).filter(|&k| self.columns[k] != [1, 1]).collect();
        let mut ends: Vec<usize> = transitions.windows(2).map(|w| (w[0] + w[1]).div_ceil(2)).collect();
        ends.push(self.columns.len());
        for (k, &t) in transitions.iter().enumerate() {
            let before = if k == 0 { 0 } else { (transitions[k - 1] + t).div_ceil(2) };
            let after = transitions.get(k + 1).map_or(self.columns.len(), |&u| (t + u).div_ceil(2));
            ends.extend([t.saturating_sub(reach).max(before), (t + 1 + reach).min(after)]);
        }
        ends.sort_unstable();
        ends.dedup();
        let mut start = 0;
        ends.into_iter().filter(|&end| end > 0).map(|end| end - std::mem::replace(&mut start, end)).collect()
    }
}

/// Quads being made, corners with their turns.
#[derive(Debug)]
struct Quads {
    count: u32,
    faces: Vec<[Lifted; 4]>,
}

impl Quads {
    fn vertex(&mut self) -> u32 {
        self.count += 1;
        self.count - 1
    }

    /// The row along a walk that [`prepare_corners`] prepared, and the rail on its inner side.
    fn first_row(&mut self, walk: &Walk, ends: &[usize], turn: i32) -> Rail {
        let n = ends.len();
        let at = |k: usize| (walk.vertices[k % n], if k < n { 0 } else { turn });
        let mut rail = Rail { points: vec![], angles: vec![] };
        let mut push = |made: u32, k: usize| {
            rail.points.push((made, 0));
            rail.angles.push(walk.angles[k]);
            (made, 0)
        };
        // The inner vertex that the row has reached.
        let first = push(self.vertex(), 0);
        let mut reached = first;
        let mut k = 0;
        while k < n {
            if ends[(k + 1) % n] == 1 {
                self.faces.push([at(k), at(k + 1), at(k + 2), reached]);
                k += 2;
            } else {
                let over = if k + 1 == n { (first.0, turn) } else { push(self.vertex(), k + 1) };
                self.faces.push([at(k), at(k + 1), over, reached]);
                reached = over;
                k += 1;
            }
            if k < n && ends[k] == 3 {
                let [across, beyond] = [(); 2].map(|()| push(self.vertex(), k));
                self.faces.push([at(k), beyond, across, reached]);
                reached = beyond;
            }
        }
        rail
    }

    /// Rows of quads between two rails of rising angle.
    fn concentric(&mut self, bottom: &Rail, top: &Rail, rows: usize) -> Result<(), Declined> {
        let pairing = pair(bottom, top, rows)
            .ok_or_else(|| Declined::Because("one border loop has over five times the edges of the other".into()))?;
        let runs = pairing.runs(rows);
        // Radial lines between the runs, upwards, without their ends.
        let lines: Vec<Vec<u32>> = runs.iter().map(|_| (1..rows).map(|_| self.vertex()).collect()).collect();
        let mut filler = Filler::new();
        let (mut i, mut j, mut column) = (0, pairing.start, 0);
        for (k, &run) in runs.iter().enumerate() {
            let [n, m] = [0, 1].map(|side| pairing.columns[column..column + run].iter().map(|c| c[side]).sum::<u32>());
            let patch =
                filler.fill(&[n, rows as u32, m, rows as u32]).map_err(|error| Declined::Because(error.to_string()))?;
            let turn = i32::from(k + 1 == runs.len());
            let mut vertices: Vec<Lifted> = (0..=i64::from(n)).map(|s| bottom.at(i + s)).collect();
            vertices.extend(lines[(k + 1) % lines.len()].iter().map(|&v| (v, turn)));
            vertices.extend((0..=i64::from(m)).rev().map(|s| top.at(j + s)));
            vertices.extend(lines[k].iter().rev().map(|&v| (v, 0)));
            while vertices.len() < patch.vertex_count {
                vertices.push((self.vertex(), 0));
            }
            self.faces.extend(patch.quads.iter().map(|q| q.map(|v| vertices[v as usize])));
            i += i64::from(n);
            j += i64::from(m);
            column += run;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fill::test_region::region as annulus;
    use glam::{DVec2, DVec3};
    use testkit::plane_region::{circle, subdivided};

    fn filled(region: &Region) -> (Fill, usize) {
        let fill = fill(region, 1.0, &Monitor::new()).unwrap();
        region.verify(&fill).unwrap();
        let topology = Topology::new(region.rim_count + fill.positions.len(), &fill.quads);
        let inner = region.rim_count..region.rim_count + fill.positions.len();
        let irregular = inner.filter(|&v| topology.around(v as u32).count() != 4).count();
        (fill, irregular)
    }

    #[test]
    fn equal_counts_give_a_grid() {
        let loops = [circle(DVec2::ZERO, 3.0, 24), circle(DVec2::ZERO, 1.5, 24)];
        let (fill, irregular) = filled(&annulus(&loops, |p| p.extend(0.0)));
        assert_eq!((fill.quads.len() % 24, irregular), (0, 0));
    }

    #[test]
    fn unequal_counts_are_taken_up_inside() {
        for (outer, inner) in [(32, 24), (30, 12), (40, 10), (8, 26)] {
            let loops = [circle(DVec2::ZERO, 3.0, outer), circle(DVec2::new(0.3, 0.0), 1.2, inner)];
            filled(&annulus(&loops, |p| p.extend(0.0)));
        }
    }

    #[test]
    fn a_square_hole_gets_three_quads_at_each_corner() {
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(DVec2::from);
        let loops = [circle(DVec2::ZERO, 3.0, 24), subdivided(&square, 0.5)];
        let region = annulus(&loops, |p| p.extend(0.0));
        let (fill, irregular) = filled(&region);
        assert!(irregular <= 4, "{irregular} irregular: at most one beside each corner, since the counts agree");
        let corner = |p: DVec3| square.iter().any(|c| c.extend(0.0).distance(p) < 1e-9);
        for v in (0..region.rim_count).filter(|&v| corner(region.surface.positions[v])) {
            assert_eq!(fill.quads.iter().flatten().filter(|&&u| u as usize == v).count(), 3);
        }
    }

    #[test]
    fn a_square_outside_gets_one_quad_at_each_corner() {
        let square = [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)].map(DVec2::from);
        let region = annulus(&[subdivided(&square, 0.75), circle(DVec2::ZERO, 1.0, 12)], |p| p.extend(0.0));
        let (fill, _) = filled(&region);
        let corner = |p: DVec3| square.iter().any(|c| c.extend(0.0).distance(p) < 1e-9);
        for v in (0..region.rim_count).filter(|&v| corner(region.surface.positions[v])) {
            assert_eq!(fill.quads.iter().flatten().filter(|&&u| u as usize == v).count(), 1);
        }
    }

    #[test]
    fn vertices_stay_on_a_cone() {
        let loops = [circle(DVec2::ZERO, 3.0, 28), circle(DVec2::ZERO, 1.0, 14)];
        let region = annulus(&loops, |p| p.extend(2.0 * p.length()));
        let (fill, _) = filled(&region);
        assert!(fill.positions.iter().all(|&p| region.under.distance(p) < 1e-9));
    }

    #[test]
    fn a_disk_is_declined() {
        let disk = annulus(&[circle(DVec2::ZERO, 3.0, 24)], |p| p.extend(0.0));
        assert!(matches!(fill(&disk, 1.0, &Monitor::new()), Err(Declined::Because(_))));
    }
}
