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
//! for n-ary partitions, of 180 degrees, at equal distances. Where a region holds curvature of both signs, a part may have as large a
//! defect as it holds of one sign: the paper would leave a piece of a torus whole, as its defect is zero, and stretch its panels.

use super::chart::{Chart, contains, cross};
use super::chords::Chord;
use super::region::{Arc, Line, Place, Region, Spot, bend, cubic, stays_inside};
use glam::DVec2;
use mesh::{Cancelled, DVec3, Monitor};
use std::ops::RangeInclusive;
use std::sync::Arc as Shared;

/// Weights of the score; a rounding error of 30 degrees counts 1.
pub(super) const GAP: f64 = 10.0;
pub(super) const BEND: f64 = 0.12;
pub(super) const PART: f64 = 0.12;
const STRONG_DEFECT: f64 = 0.3;
const CREASE: f64 = 4.0;

/// What curvature counts that a flat part holds of both signs, for each 30 degrees of it; and from how much on it is worth dividing.
pub(super) const UNEVEN: f64 = 0.4;
const LEAST_UNEVEN: f64 = 1.5;

/// The greatest defect of a part whose region has less.
const MOST_UNEVEN: i32 = 4;

/// Weights against patches that are not of one lattice, and may have no tiling: the first partition seldom has such; the second
/// is tried where the first leads nowhere, or to rhombi.
pub(super) const WARY: [f64; 2] = [3.0, 0.5];

/// What is expected of a part that is not flat yet, for each 30 degrees.
pub(super) const AHEAD: f64 = 1.2;

const NO_CONE: f64 = 1.5;

/// Curves leave and arrive along their chord at least so much: the cosine of the angle.
pub(super) const STRAIGHT: f64 = 0.5;

/// The shortest side, in edges.
pub(super) const SHORTEST: f64 = 1.3;

/// Most n-ary partitions of a region that are drawn, and that are listed to choose these from.
const MOST_CONES: usize = 32;
const LISTED_CONES: usize = 512;

/// What does not change during a search.
pub(super) struct Ground<'a> {
    pub charts: &'a [Chart],
    pub edge_length: f64,
    /// Number of the first curve that a partition drew.
    pub old: usize,
    /// Weight against patches of more than one lattice, of [`WARY`].
    pub mixed: f64,
    /// Most binary partitions that are drawn for each way to share a region's defect.
    pub drawn: usize,
    /// Creases that are not followed, as segments in each chart.
    pub creases: &'a [Vec<[DVec2; 2]>],
}

/// One way to divide a region.
#[derive(Debug, Clone)]
pub(super) struct Division {
    /// Lower is better: what the curves cost, and what the parts are expected to.
    pub score: f64,
    /// The former alone.
    pub own: f64,
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
        let (low, high) = curve.iter().fold((curve[0], curve[0]), |(l, h), &p| (l.min(p), h.max(p)));
        let is_near = |&&[a, b]: &&[DVec2; 2]| a.min(b).cmple(high).all() && a.max(b).cmpge(low).all();
        let near: Vec<&[DVec2; 2]> = self.creases[chart].iter().filter(is_near).collect();
        let meets = |w: &[DVec2]| near.iter().any(|&&crease| cross([w[0], w[1]], crease));
        if curve.windows(2).any(meets) { CREASE } else { 0.0 }
    }

    /// Curvature of both signs inside a region, in units of 30 degrees, where there is so much that it is worth dividing.
    fn both_signs(&self, region: &Region) -> Option<[f64; 2]> {
        let [plus, minus] = self.charts[region.chart].curvature_within(&region.polygon());
        (plus.min(-minus) >= LEAST_UNEVEN).then_some([plus, minus])
    }

    /// The lesser of the two, or nothing.
    pub fn uneven(&self, region: &Region) -> f64 {
        self.both_signs(region).map_or(0.0, |[plus, minus]| plus.min(-minus))
    }

    /// How much there is to do for a region, about: its defect, or the curvature that its parts should share out.
    pub fn task(&self, region: &Region) -> f64 {
        f64::from(region.defect().abs()).max(self.uneven(region))
    }

    /// The defects that parts of a region may have.
    pub fn admissible(&self, region: &Region) -> RangeInclusive<i32> {
        let defect = region.defect();
        let (mut low, mut high) = (-defect.abs(), defect.abs());
        if let Some([plus, minus]) = self.both_signs(region) {
            let shared = |k: f64| (k.round() as i32).min(MOST_UNEVEN);
            (low, high) = (low.min(-shared(-minus)), high.max(shared(plus)));
        }
        low..=high
    }

    /// What a part adds to the score of a division: infinite where it cannot be a patch, nor become one.
    pub fn judge(&self, part: &Region) -> f64 {
        let sides = part.sides();
        // What is short already, no partition makes longer.
        let is_old = |arc: &Arc| arc.line.id < self.old && arc.from.min(arc.to) == arc.from.min(arc.to).round();
        let is_too_short = |(first, count): (usize, usize), least: f64| {
            let is_new = (first..first + count).any(|k| !is_old(&part.arcs[k % part.arcs.len()]));
            is_new && part.length((first, count)) < least * self.edge_length
        };
        if part.corners.iter().any(|c| !(2..=10).contains(c))
            || (0..part.arcs.len()).any(|k| is_too_short((k, 1), 0.6))
            || sides.iter().any(|&side| is_too_short(side, SHORTEST))
        {
            return f64::INFINITY;
        }
        let defect = part.defect();
        let polygon = part.polygon();
        let [plus, minus] = self.charts[part.chart].curvature_within(&polygon);
        let error = (plus + minus - f64::from(defect)).abs();
        if defect != 0 {
            // A part that could be finished at once is worth more than one that has to be divided again and again.
            let is_cone = defect.abs() > 1 || !cones(part, &sides, SHORTEST * self.edge_length, 1).is_empty();
            return error + AHEAD * f64::from(defect.abs()) + if is_cone { 0.0 } else { NO_CONE };
        }
        if sides.len() < 3 {
            return f64::INFINITY;
        }
        // Parts of one lattice surely have a tiling.
        let is_of = |step: u8| part.corners.iter().all(|c| c % step == 0);
        let mixed = if is_of(2) || is_of(3) { 0.0 } else { self.mixed };
        error + GAP * Self::gap(part, &sides) + UNEVEN * plus.min(-minus) + mixed
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

    /// Admissible partitions of a region, best first: of the binary ones so many as are to be drawn.
    pub fn divisions(&self, region: &Region, next: &mut usize, monitor: &Monitor) -> Result<Vec<Division>, Cancelled> {
        let mut found = Vec::new();
        let polygon = region.polygon();
        for chord in self.chords(region, &polygon, monitor)? {
            monitor.check()?;
            self.draw(region, &polygon, &chord, next, &mut found);
        }
        self.n_ary(region, &polygon, next, &mut found, monitor)?;
        found.sort_by(|a, b| a.score.total_cmp(&b.score));
        Ok(found)
    }

    /// The partition by one curve.
    fn draw(&self, region: &Region, polygon: &[DVec2], chord: &Chord, next: &mut usize, found: &mut Vec<Division>) {
        let ([p, q], [right_p, left_q]) = (&chord.ends, chord.c_indices);
        let curve = cubic([p.at, q.at], [p.leaving(right_p), -q.leaving(left_q)]);
        if !stays_inside(&curve, polygon) {
            return;
        }
        let extra = BEND * bend(&curve) * 6.0 / std::f64::consts::PI + self.crossed(region.chart, &curve);
        let (from, to) = (p.place, q.place);
        let ends = [region.spot(from), region.spot(to)];
        let line = self.line(region.chart, next, curve, ends, [Some(region.point(from)), Some(region.point(to))]);
        let last = line.last();
        let forward = Arc { line: line.clone(), reversed: false, from: 0.0, to: last };
        let backward = Arc { line, reversed: true, from: last, to: 0.0 };
        let left = region.part([to, from], [left_q, p.c_index - right_p], &[forward], &[]);
        let right = region.part([from, to], [right_p, q.c_index - left_q], &[backward], &[]);
        self.add(vec![left, right], extra, 0, found);
    }

    fn add(&self, parts: Vec<Region>, extra: f64, defect: i32, found: &mut Vec<Division>) {
        let strong = f64::from((defect.abs() - 1).max(0)) * STRONG_DEFECT;
        let own = extra + strong;
        let score = own + parts.iter().map(|part| PART + self.judge(part)).sum::<f64>();
        if score.is_finite() {
            found.push(Division { score, own, parts });
        }
    }

    /// N-ary partitions. Where they leave nothing but flat parts, the region is a cone, whose tip its sides determine, and the
    /// places on the sides follow from the angles at which the curves meet them.
    fn n_ary(
        &self,
        region: &Region,
        polygon: &[DVec2],
        next: &mut usize,
        found: &mut Vec<Division>,
        monitor: &Monitor,
    ) -> Result<(), Cancelled> {
        let snap = SHORTEST * self.edge_length;
        let sides = region.sides();
        let chart = &self.charts[region.chart];
        if sides.len() >= 3 {
            for cone in cones(region, &sides, snap, LISTED_CONES) {
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
                if contains(polygon, centre) {
                    self.spokes(region, polygon, &places, &frames, centre, (&cone.right, &cone.centre), next, found);
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
            let heavy = heavy_point(chart, polygon).unwrap_or(middle);
            for centre in [middle, 0.5 * (middle + heavy)] {
                for at_centre in 2..=4 {
                    monitor.check()?;
                    if contains(polygon, centre) && (12 - n as i32 * at_centre).abs() <= 3 {
                        let even = (vec![3; n], vec![at_centre as u8; n]);
                        self.spokes(region, polygon, &places, &frames, centre, (&even.0, &even.1), next, found);
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
        polygon: &[DVec2],
        places: &[Place],
        frames: &[(DVec2, DVec2, f64)],
        centre: DVec2,
        (right, at_centre): (&[u8], &[u8]),
        next: &mut usize,
        found: &mut Vec<Division>,
    ) {
        let n = places.len();
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
            if !stays_inside(&[curve.as_slice(), &curve[curve.len() - 1..]].concat(), polygon) {
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
        let admissible = self.admissible(region);
        if parts.iter().all(|part| admissible.contains(&part.defect())) {
            self.add(parts, extra, 12 - sum as i32, found);
        }
    }
}

/// A flat cone: how an n-ary partition into flat parts must lie.
struct Cone {
    /// Side and length along it where each curve starts.
    feet: Vec<(usize, f64)>,
    right: Vec<u8>,
    centre: Vec<u8>,
}

/// Partitions of a region into flat parts about one point, as if it were a flat cone: all, or the first `listed` of them, best first.
fn cones(region: &Region, sides: &[(usize, usize)], snap: f64, listed: usize) -> Vec<Cone> {
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
    while found.len() < listed
        && let Some(chosen) = open.pop()
    {
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

pub(super) fn turned(direction: DVec2, by: f64) -> DVec2 {
    DVec2::from_angle(by).rotate(direction)
}

/// The mean place of the curvature in a polygon.
fn heavy_point(chart: &Chart, polygon: &[DVec2]) -> Option<DVec2> {
    let inside = chart.curvature.iter().filter(|(p, _)| contains(polygon, *p));
    let (sum, weight) = inside.fold((DVec2::ZERO, 0.0), |(s, w), &(p, k)| (s + k.abs() * p, w + k.abs()));
    (weight > 0.0).then(|| sum / weight)
}
