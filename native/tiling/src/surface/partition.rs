//! Partitions of a region (Algorithm 1): which there are, what each is worth, and a search for the best recursive one.
//!
//! A *binary* partition joins two places on the border by a cubic curve; an *n-ary* one joins a point inside to a place on
//! each side. The curves meet the border at fractions of its angle that are whole numbers of c-indices, so angles are
//! right by construction. What can be wrong is where the curvature lies: each part should hold as much of the surface's
//! curvature as its c-indices leave for it. That rounding error, how far a flat part is from closing with the lengths its
//! sides have, bends, defects of more than 30 degrees at one point, creases crossed, and the number of parts make the
//! score.
//!
//! Deviations: the paper takes the best partition at each step; here the best few are followed and the sum over the whole
//! tree decides (`search`). Corners of 30 degrees are not made, as no whole tile fits them. A region without corners gets some
//! for n-ary partitions, of 180 degrees, at equal distances.

use super::chart::Chart;
use super::region::{Arc, Line, Place, Region, Spot, bend, cubic, stays_inside};
use glam::DVec2;
use mesh::{Cancelled, DVec3, Monitor};
use std::sync::Arc as Shared;

/// Weights of the score; a rounding error of 30 degrees counts 1.
const GAP: f64 = 10.0;
const BEND: f64 = 0.12;
pub(super) const PART: f64 = 0.12;
const STRONG_DEFECT: f64 = 0.3;
const CREASE: f64 = 4.0;

/// Weights against patches that are not of one lattice, and may have no tiling: the first partition seldom has such; the second
/// is tried where the first leads nowhere, or to rhombi.
pub(super) const WARY: [f64; 2] = [3.0, 0.5];

/// What is expected of a part that is not flat yet, for each 30 degrees.
const AHEAD: f64 = 1.2;

const NO_CONE: f64 = 1.5;

/// Curves leave and arrive along their chord at least so much: the cosine of the angle.
const STRAIGHT: f64 = 0.5;

/// The shortest side, in edges.
const SHORTEST: f64 = 1.3;

/// Most n-ary partitions of a region that are drawn.
const MOST_CONES: usize = 48;

/// Sides of a region from which on only their middles are ends of curves.
const MANY_SIDES: usize = 7;

/// What does not change during a search.
pub(super) struct Ground<'a> {
    pub charts: &'a [Chart],
    pub edge_length: f64,
    /// Weight against patches of more than one lattice, of [`WARY`].
    pub mixed: f64,
    /// Creases that are not followed, as segments in each chart.
    pub creases: &'a [Vec<[DVec2; 2]>],
}

/// One way to divide a region.
#[derive(Debug, Clone)]
pub(super) struct Division {
    /// Lower is better.
    pub score: f64,
    pub parts: Vec<Region>,
}

impl Ground<'_> {
    fn line(
        &self,
        chart: usize,
        next: &mut usize,
        curve: Vec<DVec2>,
        ends: [Spot; 2],
        fixed: [Option<DVec3>; 2],
    ) -> Shared<Line> {
        let mut points: Vec<DVec3> = curve.iter().map(|&p| self.charts[chart].lift(p)).collect();
        let last = points.len() - 1;
        if let Some(p) = fixed[0] {
            points[0] = p;
        }
        if let Some(p) = fixed[1] {
            points[last] = p;
        }
        *next += 1;
        Shared::new(Line::new(*next - 1, points, [Some(curve.clone()), Some(curve)], ends))
    }

    fn crossed(&self, chart: usize, curve: &[DVec2]) -> f64 {
        let meets = |w: &[DVec2]| self.creases[chart].iter().any(|&crease| super::chart::cross([w[0], w[1]], crease));
        if curve.windows(2).any(meets) { CREASE } else { 0.0 }
    }

    /// What a part adds to the score of a division: infinite where it cannot be a patch, nor become one.
    pub fn judge(&self, part: &Region, is_final: bool) -> f64 {
        let sides = part.sides();
        if part.corners.iter().any(|c| !(2..=10).contains(c))
            || part.arcs.iter().any(|arc| arc.length() < 0.6 * self.edge_length)
            || sides.iter().any(|&side| part.length(side) < SHORTEST * self.edge_length)
        {
            return f64::INFINITY;
        }
        let defect = part.defect();
        let polygon = part.polygon();
        let error = (self.charts[part.chart].curvature_within(&polygon) - f64::from(defect)).abs();
        if defect != 0 {
            if is_final {
                return error;
            }
            // A part that could be finished at once is worth more than one that has to be divided again and again.
            let is_cone = defect.abs() > 1 || !cones(part, &sides, SHORTEST * self.edge_length).is_empty();
            return error + AHEAD * f64::from(defect.abs()) + if is_cone { 0.0 } else { NO_CONE };
        }
        if sides.len() < 3 {
            return f64::INFINITY;
        }
        // Parts of one lattice surely have a tiling.
        let is_of = |step: u8| part.corners.iter().all(|c| c % step == 0);
        let mixed = if is_of(2) || is_of(3) { 0.0 } else { self.mixed };
        error + GAP * Self::gap(part, &sides) + mixed
    }

    /// How far the sides of a flat part, at their lengths and directions, are from closing, over its circumference.
    fn gap(part: &Region, sides: &[(usize, usize)]) -> f64 {
        let (mut end, mut around, mut direction) = (DVec2::ZERO, 0.0, 0i32);
        for &side in sides {
            direction += 6 - i32::from(part.corners[side.0]);
            let length = part.length(side);
            end += length * DVec2::from_angle(f64::from(direction) * std::f64::consts::FRAC_PI_6);
            around += length;
        }
        end.length() / around
    }

    /// All admissible partitions of a region, best first.
    pub fn divisions(&self, region: &Region, next: &mut usize, monitor: &Monitor) -> Result<Vec<Division>, Cancelled> {
        let mut found = Vec::new();
        self.binary(region, next, &mut found, monitor)?;
        self.flat_off(region, next, &mut found, monitor)?;
        self.n_ary(region, next, &mut found, monitor)?;
        found.sort_by(|a, b| a.score.total_cmp(&b.score));
        Ok(found)
    }

    fn is_admissible(region: &Region, parts: &[Region]) -> bool {
        parts.iter().all(|part| part.defect().abs() <= region.defect().abs())
    }

    /// Places on the sides where curves may end: their middles, thirds, and where corners can be divided.
    fn places(&self, region: &Region) -> Vec<Place> {
        let snap = SHORTEST * self.edge_length;
        let mut places: Vec<Place> =
            (0..region.arcs.len()).filter(|&k| region.corners[k] >= 4).map(|arc| Place { arc, t: None }).collect();
        for side in region.sides() {
            let length = region.length(side);
            let fractions: &[f64] = if region.sides().len() < MANY_SIDES { &[0.25, 0.5, 0.75] } else { &[0.5] };
            for fraction in fractions {
                let along = fraction * length;
                if along > snap && length - along > snap {
                    places.push(region.place(side.0, along, snap));
                }
            }
        }
        let mut distinct: Vec<Place> = Vec::new();
        for place in places {
            if !distinct.contains(&place) && region.c_index(place) >= 4 {
                distinct.push(place);
            }
        }
        distinct
    }

    fn binary(
        &self,
        region: &Region,
        next: &mut usize,
        found: &mut Vec<Division>,
        monitor: &Monitor,
    ) -> Result<(), Cancelled> {
        let places = self.places(region);
        let polygon = region.polygon();
        for (i, &p) in places.iter().enumerate() {
            for &q in &places[i + 1..] {
                monitor.check()?;
                let (c_p, c_q) = (region.c_index(p), region.c_index(q));
                for right_p in 2..=c_p - 2 {
                    for left_q in 2..=c_q - 2 {
                        self.chord(region, &polygon, [p, q], [right_p, left_q], next, found);
                    }
                }
            }
        }
        Ok(())
    }

    /// Binary partitions that cut off a flat part: where it has its angles, the place on the far side follows from that on the
    /// near one.
    fn flat_off(
        &self,
        region: &Region,
        next: &mut usize,
        found: &mut Vec<Division>,
        monitor: &Monitor,
    ) -> Result<(), Cancelled> {
        let snap = SHORTEST * self.edge_length;
        let polygon = region.polygon();
        let n = region.arcs.len();
        let starts: Vec<f64> = std::iter::once(0.0)
            .chain(region.arcs.iter().scan(0.0, |sum, arc| {
                *sum += arc.length();
                Some(*sum)
            }))
            .collect();
        let whole = starts[n];
        for p in self.places(region) {
            monitor.check()?;
            let at = starts[p.arc]
                + p.t.map_or(0.0, |t| {
                    let arc = &region.arcs[p.arc];
                    (arc.line.length_at(t) - arc.line.length_at(arc.from)).abs()
                });
            let c_p = region.c_index(p);
            for is_ahead in [true, false] {
                for near in 2..=c_p - 2 {
                    let ray = DVec2::from_angle(f64::from(near) * std::f64::consts::FRAC_PI_6);
                    // Along the border from p, unfolded; backwards it is the same, mirrored.
                    let (mut here, mut direction, mut walked) = (DVec2::ZERO, 0i32, 0.0);
                    let mut arc = p.arc;
                    let mut left = if is_ahead { starts[p.arc + 1] - at } else { at - starts[p.arc] };
                    if !is_ahead && p.t.is_none() {
                        arc = (p.arc + n - 1) % n;
                        left = region.arcs[arc].length();
                    }
                    for _ in 0..n {
                        let along = DVec2::from_angle(f64::from(direction) * std::f64::consts::FRAC_PI_6);
                        let across = ray.perp_dot(along);
                        let far = direction - i32::from(near);
                        if (2..=4).contains(&far) && across > 1e-9 {
                            let reach = -ray.perp_dot(here) / across;
                            let distance = (here + reach * along).dot(ray);
                            if reach > 0.0 && reach < left && distance > snap {
                                let length = if is_ahead { at + walked + reach } else { at - walked - reach };
                                let q = region.place(0, length.rem_euclid(whole), 0.5 * snap);
                                if region.c_index(q) == 6 && q != p {
                                    let far = far as u8;
                                    let c = if is_ahead { [near, 6 - far] } else { [c_p - near, far] };
                                    self.chord(region, &polygon, [p, q], c, next, found);
                                }
                            }
                        }
                        here += left * along;
                        walked += left;
                        let corner = if is_ahead { (arc + 1) % n } else { arc };
                        direction += 6 - i32::from(region.corners[corner]);
                        arc = if is_ahead { (arc + 1) % n } else { (arc + n - 1) % n };
                        left = region.arcs[arc].length();
                    }
                }
            }
        }
        Ok(())
    }

    /// The partition by one curve between two places, with the c-index on its right where it starts and on its left where it
    /// ends.
    fn chord(
        &self,
        region: &Region,
        polygon: &[DVec2],
        [p, q]: [Place; 2],
        [right_p, left_q]: [u8; 2],
        next: &mut usize,
        found: &mut Vec<Division>,
    ) {
        let ((at_p, out_p, angle_p), (at_q, out_q, angle_q)) = (region.frame(p), region.frame(q));
        let (c_p, c_q) = (region.c_index(p), region.c_index(q));
        let straight = (at_q - at_p).normalize_or_zero();
        let leaving = turned(out_p, angle_p * f64::from(right_p) / f64::from(c_p));
        let back = turned(out_q, angle_q * f64::from(left_q) / f64::from(c_q));
        if leaving.dot(straight) < STRAIGHT || back.dot(-straight) < STRAIGHT {
            return;
        }
        let curve = cubic([at_p, at_q], [leaving, -back]);
        if !stays_inside(&curve, polygon) {
            return;
        }
        let extra = BEND * bend(&curve) * 6.0 / std::f64::consts::PI + self.crossed(region.chart, &curve);
        let ends = [region.spot(p), region.spot(q)];
        let line = self.line(region.chart, next, curve, ends, [Some(region.point(p)), Some(region.point(q))]);
        let last = line.last();
        let forward = Arc { line: line.clone(), reversed: false, from: 0.0, to: last };
        let backward = Arc { line, reversed: true, from: last, to: 0.0 };
        let left = region.part([q, p], [left_q, c_p - right_p], &[forward], &[]);
        let right = region.part([p, q], [right_p, c_q - left_q], &[backward], &[]);
        self.add(region, vec![left, right], extra, 0, found);
    }

    fn add(&self, region: &Region, parts: Vec<Region>, extra: f64, defect: i32, found: &mut Vec<Division>) {
        if !Self::is_admissible(region, &parts) {
            return;
        }
        let strong = f64::from((defect.abs() - 1).max(0)) * STRONG_DEFECT;
        let score = extra + strong + parts.iter().map(|part| PART + self.judge(part, false)).sum::<f64>();
        if score.is_finite() {
            found.push(Division { score, parts });
        }
    }

    /// N-ary partitions. Where they leave nothing but flat parts, the region is a cone, whose tip its sides determine, and the
    /// places on the sides follow from the angles at which the curves meet them.
    fn n_ary(
        &self,
        region: &Region,
        next: &mut usize,
        found: &mut Vec<Division>,
        monitor: &Monitor,
    ) -> Result<(), Cancelled> {
        let snap = SHORTEST * self.edge_length;
        let sides = region.sides();
        let polygon = region.polygon();
        let chart = &self.charts[region.chart];
        if sides.len() >= 3 {
            for cone in cones(region, &sides, snap) {
                monitor.check()?;
                let places: Vec<Place> =
                    cone.feet.iter().map(|&(side, length)| region.place(sides[side].0, length, 0.5 * snap)).collect();
                if places.iter().any(|&p| region.c_index(p) != 6) {
                    continue;
                }
                let frames: Vec<_> = places.iter().map(|&p| region.frame(p)).collect();
                let leaving: Vec<DVec2> = frames
                    .iter()
                    .zip(&cone.right)
                    .map(|(&(_, out, angle), &right)| turned(out, angle * f64::from(right) / 6.0))
                    .collect();
                let Some(centre) = meeting_point(&frames, &leaving) else { continue };
                if super::chart::contains(&polygon, centre) {
                    self.spokes(region, &places, &frames, centre, (&cone.right, &cone.centre), next, found);
                }
            }
        }
        if sides.len() > 2 {
            return Ok(());
        }
        // Sides that are too few get corners of 180 degrees, so that there are three to six.
        let whole: f64 = sides.iter().map(|&side| region.length(side)).sum();
        for n in 3..=6 {
            let places: Vec<Place> =
                (0..n).map(|k| region.place(sides[0].0, (k as f64 + 0.5) / n as f64 * whole, snap)).collect();
            if places.iter().any(|&p| region.c_index(p) != 6) || (1..n).any(|k| places[..k].contains(&places[k])) {
                continue;
            }
            let frames: Vec<_> = places.iter().map(|&p| region.frame(p)).collect();
            let middle = frames.iter().map(|f| f.0).sum::<DVec2>() / n as f64;
            let heavy = heavy_point(chart, &polygon).unwrap_or(middle);
            for centre in [middle, 0.5 * (middle + heavy)] {
                for at_centre in 2..=4 {
                    monitor.check()?;
                    if super::chart::contains(&polygon, centre) && (12 - n as i32 * at_centre).abs() <= 3 {
                        let even = (vec![3; n], vec![at_centre as u8; n]);
                        self.spokes(region, &places, &frames, centre, (&even.0, &even.1), next, found);
                    }
                }
            }
        }
        Ok(())
    }

    /// The n-ary partition with a given centre and c-indices: on the right of each curve at its place, and at the centre
    /// between it and the next.
    #[allow(clippy::too_many_arguments)]
    fn spokes(
        &self,
        region: &Region,
        places: &[Place],
        frames: &[(DVec2, DVec2, f64)],
        centre: DVec2,
        (right, at_centre): (&[u8], &[u8]),
        next: &mut usize,
        found: &mut Vec<Division>,
    ) {
        let n = places.len();
        let polygon = region.polygon();
        let full: Vec<u8> = places.iter().map(|&p| region.c_index(p)).collect();
        let here = self.charts[region.chart].lift(centre);
        let sum: f64 = at_centre.iter().map(|&c| f64::from(c)).sum();
        // Directions from the centre at fractions of a full turn, turned to fit the places best.
        let mut turns = vec![0.0];
        for &c in &at_centre[..n - 1] {
            turns.push(turns[turns.len() - 1] + f64::from(c) / sum * std::f64::consts::TAU);
        }
        let fit: DVec2 =
            (0..n).map(|k| DVec2::from_angle(-turns[k]).rotate((frames[k].0 - centre).normalize_or_zero())).sum();
        let start = fit.to_angle();
        let mut lines: Vec<Shared<Line>> = Vec::new();
        let mut extra = 0.0;
        let mut drawn: Vec<Vec<DVec2>> = Vec::new();
        for k in 0..n {
            let (at, out, angle) = frames[k];
            let leaving = turned(out, angle * f64::from(right[k]) / f64::from(full[k]));
            let arriving = -DVec2::from_angle(start + turns[k]);
            let way = (centre - at).normalize_or_zero();
            if leaving.dot(way) < STRAIGHT || arriving.dot(way) < STRAIGHT {
                break;
            }
            let curve = cubic([at, centre], [leaving, arriving]);
            if !stays_inside(&[curve.as_slice(), &curve[curve.len() - 1..]].concat(), &polygon) {
                break;
            }
            extra += BEND * bend(&curve) * 6.0 / std::f64::consts::PI + self.crossed(region.chart, &curve);
            drawn.push(curve);
        }
        if drawn.len() < n {
            return;
        }
        let hub = *next;
        for (curve, &place) in drawn.into_iter().zip(places) {
            let ends = [region.spot(place), Spot::Centre(hub)];
            lines.push(self.line(region.chart, next, curve, ends, [Some(region.point(place)), Some(here)]));
        }
        let parts: Vec<Region> = (0..n)
            .map(|k| {
                let to = (k + 1) % n;
                let inward = &lines[to];
                let outward = &lines[k];
                let back = [
                    Arc { line: inward.clone(), reversed: false, from: 0.0, to: inward.last() },
                    Arc { line: outward.clone(), reversed: true, from: outward.last(), to: 0.0 },
                ];
                region.part([places[k], places[to]], [right[k], full[to] - right[to]], &back, &[at_centre[k]])
            })
            .collect();
        self.add(region, parts, extra, 12 - sum as i32, found);
    }
}

/// A flat cone: how an n-ary partition into flat parts must lie.
struct Cone {
    /// Side and length along it where each curve starts.
    feet: Vec<(usize, f64)>,
    right: Vec<u8>,
    centre: Vec<u8>,
}

/// All partitions of a region into flat parts about one point, as if it were a flat cone.
fn cones(region: &Region, sides: &[(usize, usize)], snap: f64) -> Vec<Cone> {
    let defect = region.defect();
    if !(1..=4).contains(&defect.abs()) || sides.len() < 3 {
        return Vec::new();
    }
    let n = sides.len();
    let (mut corner, mut direction) = (DVec2::ZERO, 0i32);
    let mut unfolded = Vec::new();
    for (k, &side) in sides.iter().enumerate() {
        if k > 0 {
            direction += 6 - i32::from(region.corners[side.0]);
        }
        let length = region.length(side);
        let along = DVec2::from_angle(f64::from(direction) * std::f64::consts::FRAC_PI_6);
        unfolded.push((corner, along, length, direction));
        corner += length * along;
    }
    // The tip is the fixed point of the turn that takes the border's start to its end: (1 - turn) tip = end.
    let turn = DVec2::from_angle(-f64::from(defect) * std::f64::consts::FRAC_PI_6);
    let rest = DVec2::X - turn;
    let tip = DVec2::new(rest.x, -rest.y).rotate(corner) / rest.length_squared();
    let feet: Vec<Vec<(usize, f64, u8)>> = (0..)
        .zip(&unfolded)
        .map(|(k, &(corner, along, length, _))| {
            let to = tip - corner;
            let (ahead, height) = (to.dot(along), along.perp_dot(to));
            (2..=4u8)
                .map(|right| (k, ahead - height / (f64::from(right) * std::f64::consts::FRAC_PI_6).tan(), right))
                .filter(|&(_, foot, _)| height > 0.0 && foot > snap && foot < length - snap)
                .collect()
        })
        .collect();
    let bearing = |foot: &(usize, f64, u8)| unfolded[foot.0].3 + i32::from(foot.2);
    let mut found = Vec::new();
    // Curves in the order of their sides, some sides without, by the angles between neighbours.
    let mut open: Vec<Vec<(usize, f64, u8)>> = feet.iter().flatten().map(|&foot| vec![foot]).collect();
    while let Some(chosen) = open.pop() {
        let (first, last) = (chosen[0], chosen[chosen.len() - 1]);
        let closing = bearing(&first) + 12 - defect - bearing(&last);
        if chosen.len() >= 3 && (2..=5).contains(&closing) {
            let mut centre: Vec<u8> = chosen.windows(2).map(|w| (bearing(&w[1]) - bearing(&w[0])) as u8).collect();
            centre.push(closing as u8);
            found.push(Cone {
                feet: chosen.iter().map(|&(side, length, _)| (side, length)).collect(),
                right: chosen.iter().map(|foot| foot.2).collect(),
                centre,
            });
        }
        for foot in feet[last.0 + 1..].iter().flatten() {
            if (2..=5).contains(&(bearing(foot) - bearing(&last))) {
                open.push([chosen.as_slice(), &[*foot]].concat());
            }
        }
    }
    // Those that divide angles evenly, into few parts, are most often the best.
    let odd = |cone: &Cone| {
        let uneven = cone.right.iter().filter(|&&right| right != 3).count();
        let sharp = cone.centre.iter().map(|&c| usize::from(c == 5)).sum::<usize>();
        2 * sharp + uneven + cone.centre.len() + 2 * n.abs_diff(cone.centre.len())
    };
    found.sort_by_key(odd);
    found.truncate(MOST_CONES);
    found
}

/// The point nearest to all lines that leave places in given directions.
fn meeting_point(frames: &[(DVec2, DVec2, f64)], directions: &[DVec2]) -> Option<DVec2> {
    let (mut a, mut b, mut c, mut right) = (0.0, 0.0, 0.0, DVec2::ZERO);
    for (frame, d) in frames.iter().zip(directions) {
        let normal = d.perp();
        let offset = normal.dot(frame.0);
        (a, b, c) = (a + normal.x * normal.x, b + normal.x * normal.y, c + normal.y * normal.y);
        right += offset * normal;
    }
    let whole = a * c - b * b;
    (whole > 1e-9).then(|| DVec2::new(c * right.x - b * right.y, a * right.y - b * right.x) / whole)
}

fn turned(direction: DVec2, by: f64) -> DVec2 {
    DVec2::from_angle(by).rotate(direction)
}

/// The mean place of the curvature in a polygon.
fn heavy_point(chart: &Chart, polygon: &[DVec2]) -> Option<DVec2> {
    let inside = chart.curvature.iter().filter(|(p, _)| super::chart::contains(polygon, *p));
    let (sum, weight) = inside.fold((DVec2::ZERO, 0.0), |(s, w), &(p, k)| (s + k.abs() * p, w + k.abs()));
    (weight > 0.0).then(|| sum / weight)
}
