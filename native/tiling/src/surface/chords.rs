//! Binary partitions of a region before they are drawn (section 4.2.1): which chords there are, and what each seems worth.
//!
//! A region of many sides has thousands of chords, and one that is drawn, lifted to the surface and judged costs a hundred times
//! one that is not. So all are judged first by what the border tells: defects by counting corners, how far a flat part is from
//! closing by unrolling the border into the plane, the curvature on either side as if the chord were straight, and its bend by
//! the angles at its ends. Only the best for each way of sharing the defect are drawn.

use super::chart::{contains, signed};
use super::partition::{AHEAD, BEND, GAP, Ground, SHORTEST, STRAIGHT, UNEVEN, turned};
use super::region::{Place, Region};
use glam::DVec2;
use mesh::{Cancelled, Monitor};
use std::f64::consts::{FRAC_PI_6, PI};
use std::ops::RangeInclusive;

/// Sides of a region from which on only their middles are ends of curves.
const MANY_SIDES: usize = 7;

/// A place on the border, and how the border runs there.
#[derive(Clone, Copy)]
pub(super) struct Port {
    pub place: Place,
    pub c_index: u8,
    /// In the chart, the direction in which the border goes on, and the angle inside, radians.
    pub at: DVec2,
    pub out: DVec2,
    pub angle: f64,
    /// Length along its arc.
    offset: f64,
}

/// A curve from one place to another.
pub(super) struct Chord {
    pub ends: [Port; 2],
    /// C-index on its right where it starts, and on its left where it ends.
    pub c_indices: [u8; 2],
    /// Defect of the part on its right, and what the division seems worth: less is better.
    defect: i32,
    score: f64,
}

impl Port {
    pub fn new(region: &Region, place: Place) -> Self {
        let (at, out, angle) = region.frame(place);
        let arc = &region.arcs[place.arc];
        let offset = place.t.map_or(0.0, |t| (arc.line.length_at(t) - arc.line.length_at(arc.from)).abs());
        Self { place, c_index: region.c_index(place), at, out, angle, offset }
    }

    /// The direction that leaves a c-index of `right` on the right.
    pub fn leaving(&self, right: u8) -> DVec2 {
        turned(self.out, self.angle * f64::from(right) / f64::from(self.c_index))
    }
}

/// The border of a region unrolled into the plane, twice around: as straight sides that turn by whole c-indices.
struct Unrolled {
    /// Where each arc starts, and its direction in units of 30 degrees.
    at: Vec<(DVec2, i32)>,
    /// Length, turns, and corners that are no multiples of 2 and of 3, of all arcs before.
    walked: Vec<f64>,
    turns: Vec<i32>,
    odd: Vec<[u32; 2]>,
}

/// The border from one place to another.
struct Stretch {
    turn: i32,
    odd: [bool; 2],
    length: f64,
    /// Where it ends, if it starts at the origin along the x-axis.
    end: DVec2,
}

impl Unrolled {
    fn new(region: &Region) -> Self {
        let n = region.arcs.len();
        let (mut here, mut direction, mut length) = (DVec2::ZERO, 0, 0.0);
        let mut unrolled = Self { at: Vec::new(), walked: Vec::new(), turns: vec![0], odd: vec![[0, 0]] };
        for k in 0..2 * n {
            let c = region.corners[k % n];
            if k > 0 {
                direction += 6 - i32::from(c);
            }
            unrolled.at.push((here, direction));
            unrolled.walked.push(length);
            unrolled.turns.push(unrolled.turns[k] + 6 - i32::from(c));
            let [of_two, of_three] = unrolled.odd[k];
            unrolled.odd.push([of_two + u32::from(c % 2), of_three + u32::from(!c.is_multiple_of(3))]);
            let step = region.arcs[k % n].length();
            here += step * DVec2::from_angle(f64::from(direction) * FRAC_PI_6);
            length += step;
        }
        unrolled
    }

    fn between(&self, from: &Port, to: &Port) -> Stretch {
        let n = self.at.len() / 2;
        let (a, mut b) = (from.place.arc, to.place.arc);
        if b < a || (b == a && to.offset <= from.offset) {
            b += n;
        }
        let along =
            |k: usize, offset: f64| self.at[k].0 + offset * DVec2::from_angle(f64::from(self.at[k].1) * FRAC_PI_6);
        let last = if to.place.t.is_some() { b + 1 } else { b };
        Stretch {
            turn: self.turns[last] - self.turns[a + 1],
            odd: [0, 1].map(|k| self.odd[last][k] > self.odd[a + 1][k]),
            length: self.walked[b] + to.offset - self.walked[a] - from.offset,
            end: DVec2::from_angle(-f64::from(self.at[a].1) * FRAC_PI_6)
                .rotate(along(b, to.offset) - along(a, from.offset)),
        }
    }
}

/// What chords of one region are judged by.
struct Scale<'a> {
    ground: &'a Ground<'a>,
    unrolled: Unrolled,
    defect: i32,
    admissible: RangeInclusive<i32>,
    /// Curvature of the chart within the region.
    cells: Vec<(DVec2, f64)>,
}

impl Ground<'_> {
    /// The chords of a region that are worth drawing.
    pub fn chords(&self, region: &Region, polygon: &[DVec2], monitor: &Monitor) -> Result<Vec<Chord>, Cancelled> {
        let cells =
            self.charts[region.chart].curvature.iter().copied().filter(|(p, _)| contains(polygon, *p)).collect();
        let scale = Scale {
            ground: self,
            unrolled: Unrolled::new(region),
            defect: region.defect(),
            admissible: self.admissible(region),
            cells,
        };
        let ports: Vec<Port> = self.places(region).into_iter().map(|place| Port::new(region, place)).collect();
        let mut found = Vec::new();
        for (i, p) in ports.iter().enumerate() {
            monitor.check()?;
            for q in &ports[i + 1..] {
                scale.add([p, q], 2..=p.c_index - 2, 2..=q.c_index - 2, &mut found);
            }
            self.flat_off(region, p, &scale, &mut found);
        }
        found.sort_by(|a, b| a.defect.cmp(&b.defect).then(a.score.total_cmp(&b.score)));
        let mut chosen: Vec<Chord> = Vec::new();
        for chord in found {
            let alike = chosen.iter().rev().take_while(|other| other.defect == chord.defect).count();
            if alike < self.drawn {
                chosen.push(chord);
            }
        }
        Ok(chosen)
    }

    /// Places on the sides where curves may end: their middles, thirds, and where corners can be divided.
    fn places(&self, region: &Region) -> Vec<Place> {
        let snap = SHORTEST * self.edge_length;
        let mut places: Vec<Place> =
            (0..region.arcs.len()).filter(|&k| region.corners[k] >= 4).map(|arc| Place { arc, t: None }).collect();
        let sides = region.sides();
        for &side in &sides {
            let length = region.length(side);
            let fractions: &[f64] = if sides.len() < MANY_SIDES { &[0.25, 0.5, 0.75] } else { &[0.5] };
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

    /// Chords that cut off a flat part: where it has its angles, the place on the far side follows from that on the near one.
    fn flat_off(&self, region: &Region, p: &Port, scale: &Scale<'_>, found: &mut Vec<Chord>) {
        let snap = SHORTEST * self.edge_length;
        let n = region.arcs.len();
        let walked = &scale.unrolled.walked;
        let whole = walked[n];
        let at = walked[p.place.arc] + p.offset;
        for is_ahead in [true, false] {
            for near in 2..=p.c_index - 2 {
                let ray = DVec2::from_angle(f64::from(near) * FRAC_PI_6);
                // Along the border from p, unrolled; backwards it is the same, mirrored.
                let (mut here, mut direction, mut passed) = (DVec2::ZERO, 0i32, 0.0);
                let mut arc = p.place.arc;
                let mut left = if is_ahead { region.arcs[arc].length() - p.offset } else { p.offset };
                if !is_ahead && p.place.t.is_none() {
                    arc = (arc + n - 1) % n;
                    left = region.arcs[arc].length();
                }
                for _ in 0..n {
                    let along = DVec2::from_angle(f64::from(direction) * FRAC_PI_6);
                    let across = ray.perp_dot(along);
                    let far = direction - i32::from(near);
                    if (2..=4).contains(&far) && across > 1e-9 {
                        let reach = -ray.perp_dot(here) / across;
                        let distance = (here + reach * along).dot(ray);
                        if reach > 0.0 && reach < left && distance > snap {
                            let length = if is_ahead { at + passed + reach } else { at - passed - reach };
                            let q = region.place(0, length.rem_euclid(whole), 0.5 * snap);
                            if region.c_index(q) == 6 && q != p.place {
                                let far = far as u8;
                                let [right, back] = if is_ahead { [near, 6 - far] } else { [p.c_index - near, far] };
                                scale.add([p, &Port::new(region, q)], right..=right, back..=back, found);
                            }
                        }
                    }
                    here += left * along;
                    passed += left;
                    let corner = if is_ahead { (arc + 1) % n } else { arc };
                    direction += 6 - i32::from(region.corners[corner]);
                    arc = if is_ahead { (arc + 1) % n } else { (arc + n - 1) % n };
                    left = region.arcs[arc].length();
                }
            }
        }
    }
}

impl Scale<'_> {
    /// Adds the admissible chords between two places with c-indices of given ranges: on the right of the start, on the left of
    /// the end.
    fn add(&self, ends: [&Port; 2], rights: RangeInclusive<u8>, lefts: RangeInclusive<u8>, found: &mut Vec<Chord>) {
        let [p, q] = ends;
        let straight = (q.at - p.at).normalize_or_zero();
        let angles = |port: &Port, c_indices: RangeInclusive<u8>, towards: DVec2| -> Vec<(u8, f64)> {
            let off = |c: u8| (c, port.leaving(c).dot(towards));
            c_indices.map(off).filter(|&(_, cosine)| cosine >= STRAIGHT).map(|(c, x)| (c, x.min(1.0).acos())).collect()
        };
        let (rights, lefts) = (angles(p, rights, straight), angles(q, lefts, -straight));
        if rights.is_empty() || lefts.is_empty() {
            return;
        }
        let borders = [self.unrolled.between(p, q), self.unrolled.between(q, p)];
        let mut curvature: Option<[[f64; 2]; 2]> = None;
        for &(right, bend_p) in &rights {
            for &(left, bend_q) in &lefts {
                let of_right = 12 - (6 - i32::from(right)) - (6 - i32::from(q.c_index - left)) - borders[0].turn;
                let defects = [of_right, self.defect - of_right];
                if !defects.iter().all(|defect| self.admissible.contains(defect)) {
                    continue;
                }
                let curvature = curvature.get_or_insert_with(|| self.beside(p.at, straight));
                let corners = [[right, q.c_index - left], [left, p.c_index - right]];
                let mut score = BEND * (bend_p + bend_q) * 6.0 / PI;
                for side in 0..2 {
                    let [plus, minus] = curvature[side];
                    score += (plus + minus - f64::from(defects[side])).abs() + AHEAD * f64::from(defects[side].abs());
                    if defects[side] == 0 {
                        let is_of = |k: usize| {
                            let step = [2, 3][k];
                            !borders[side].odd[k] && corners[side].iter().all(|c| c % step == 0)
                        };
                        let mixed = if is_of(0) || is_of(1) { 0.0 } else { self.ground.mixed };
                        score += GAP * borders[side].gap(corners[side][0]) + UNEVEN * plus.min(-minus) + mixed;
                    }
                }
                found.push(Chord { ends: [*p, *q], c_indices: [right, left], defect: of_right, score });
            }
        }
    }

    /// Curvature on the right and on the left of a straight line.
    fn beside(&self, at: DVec2, along: DVec2) -> [[f64; 2]; 2] {
        [-1.0, 1.0].map(|side| {
            signed(self.cells.iter().filter(|(p, _)| side * along.perp_dot(*p - at) >= 0.0).map(|(_, k)| *k))
        })
    }
}

impl Stretch {
    /// How far it is from closing with a chord that leaves its start with this c-index between, over the circumference.
    fn gap(&self, c_index: u8) -> f64 {
        let chord = DVec2::from_angle(f64::from(c_index) * FRAC_PI_6);
        let off = if self.end.dot(chord) > 0.0 { self.end.perp_dot(chord).abs() } else { self.end.length() };
        off / (self.length + self.end.length())
    }
}
