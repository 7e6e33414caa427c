//! Sub-surfaces of a chart, and how curves divide them (section 4.2.1).
//!
//! A curve is drawn in the chart and lives in space too; it has a left and a right side, each with its own image in a chart,
//! so that a cut that a chart meets twice needs no special care. A region is what its arcs enclose. Dividing one leaves
//! all other regions as they are: a point put on a shared curve is a corner of 180 degrees to the region across.

use super::chart::{contains, cross};
use glam::DVec2;
use mesh::DVec3;
use std::sync::Arc as Shared;

/// Points along a new curve.
const SAMPLES: usize = 20;

/// Points of a region's polygon on each arc.
const POLYGON: usize = 10;

/// Where a curve ends, if not where it began to be: at a place on another curve, or inside a region.
#[derive(Debug, Clone)]
pub(super) enum Spot {
    /// A node of the whole, by number.
    Node(u32),
    /// On a curve, at a parameter.
    On(Shared<Line>, f64),
    /// A centre, by the number of the first curve that was drawn to it.
    Centre(usize),
}

/// A curve: a border, a marked line, a cut, or a partition. Its parameter counts segments.
#[derive(Debug)]
pub(super) struct Line {
    pub id: usize,
    pub points: Vec<DVec3>,
    /// Length up to each point, scene units.
    pub walked: Vec<f64>,
    /// In the chart on its left and on its right, in the same order.
    pub images: [Option<Vec<DVec2>>; 2],
    pub ends: [Spot; 2],
}

impl Line {
    pub fn new(id: usize, points: Vec<DVec3>, images: [Option<Vec<DVec2>>; 2], ends: [Spot; 2]) -> Self {
        let mut walked = vec![0.0];
        for w in points.windows(2) {
            walked.push(walked[walked.len() - 1] + w[0].distance(w[1]));
        }
        Self { id, points, walked, images, ends }
    }

    /// Last parameter.
    pub fn last(&self) -> f64 {
        (self.points.len() - 1) as f64
    }

    /// Length up to a parameter.
    pub fn length_at(&self, t: f64) -> f64 {
        let k = (t as usize).min(self.points.len() - 2);
        self.walked[k] + (t - k as f64) * (self.walked[k + 1] - self.walked[k])
    }

    /// Parameter at a length.
    pub fn at_length(&self, length: f64) -> f64 {
        let k = self.walked.partition_point(|&w| w <= length).clamp(1, self.points.len() - 1) - 1;
        let step = self.walked[k + 1] - self.walked[k];
        k as f64 + if step > 0.0 { ((length - self.walked[k]) / step).clamp(0.0, 1.0) } else { 0.0 }
    }

    pub fn point(&self, t: f64) -> DVec3 {
        let k = (t as usize).min(self.points.len() - 2);
        self.points[k].lerp(self.points[k + 1], t - k as f64)
    }

    /// In the chart on its left (0) or right (1), where there is one.
    pub fn image_at(&self, side: usize, t: f64) -> Option<DVec2> {
        let image = self.images[side].as_ref()?;
        let k = (t as usize).min(image.len() - 2);
        Some(image[k].lerp(image[k + 1], t - k as f64))
    }
}

/// A piece of a curve along which a region lies on the left, as it is walked.
#[derive(Debug, Clone)]
pub(super) struct Arc {
    pub line: Shared<Line>,
    pub reversed: bool,
    /// Parameters where it starts and ends: falling when reversed.
    pub from: f64,
    pub to: f64,
}

impl Arc {
    pub fn length(&self) -> f64 {
        (self.line.length_at(self.to) - self.line.length_at(self.from)).abs()
    }

    fn image(&self) -> &[DVec2] {
        self.line.images[usize::from(self.reversed)].as_ref().expect("a region lies on this side of the curve")
    }

    /// In the chart.
    pub fn at(&self, t: f64) -> DVec2 {
        let image = self.image();
        let k = (t as usize).min(image.len() - 2);
        image[k].lerp(image[k + 1], t - k as f64)
    }

    /// The parameters of the polyline from end to end.
    pub fn parameters(&self) -> Vec<f64> {
        let (low, high) = (self.from.min(self.to), self.from.max(self.to));
        let mut inner: Vec<f64> = ((low.floor() as usize + 1)..(high.ceil() as usize)).map(|k| k as f64).collect();
        if self.reversed {
            inner.reverse();
        }
        [&[self.from], inner.as_slice(), &[self.to]].concat()
    }

    /// Parameter at a length from its start.
    pub fn along(&self, length: f64) -> f64 {
        let start = self.line.length_at(self.from);
        self.line.at_length(if self.reversed { start - length } else { start + length })
    }
}

/// A disk in a chart.
#[derive(Debug, Clone)]
pub(super) struct Region {
    pub chart: usize,
    pub arcs: Vec<Arc>,
    /// C-index where each arc starts.
    pub corners: Vec<u8>,
}

/// A place on the border of a region: where arc `arc` starts when `t` is none, else within it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub arc: usize,
    pub t: Option<f64>,
}

impl Region {
    /// As [`super::patch_graph::Patch::total_interior_defect`].
    pub fn defect(&self) -> i32 {
        12 - self.corners.iter().map(|&c| 6 - i32::from(c)).sum::<i32>()
    }

    /// The border in the chart, a few points an arc: arcs are smooth.
    pub fn polygon(&self) -> Vec<DVec2> {
        let mut polygon = Vec::new();
        for arc in &self.arcs {
            let parameters = arc.parameters();
            let steps = (parameters.len() - 1).min(POLYGON);
            polygon.extend((0..steps).map(|k| arc.at(parameters[k * (parameters.len() - 1) / steps])));
        }
        polygon
    }

    /// The sides: arcs from one corner that is none of 180 degrees to the next, first arc and how many.
    pub fn sides(&self) -> Vec<(usize, usize)> {
        let n = self.arcs.len();
        let starts: Vec<usize> = (0..n).filter(|&k| self.corners[k] != 6).collect();
        if starts.is_empty() {
            return vec![(0, n)];
        }
        (0..starts.len())
            .map(|k| {
                let next = starts[(k + 1) % starts.len()];
                (starts[k], (next + n - starts[k] - 1) % n + 1)
            })
            .collect()
    }

    /// Length of some consecutive arcs.
    pub fn length(&self, (first, count): (usize, usize)) -> f64 {
        (0..count).map(|k| self.arcs[(first + k) % self.arcs.len()].length()).sum()
    }

    /// The place at a length from the start of arc `first`; where arcs meet within `snap` of it, there.
    pub fn place(&self, first: usize, length: f64, snap: f64) -> Place {
        let n = self.arcs.len();
        let (mut left, mut k) = (length, first % n);
        for _ in 0..n {
            let whole = self.arcs[k].length();
            if left < snap {
                return Place { arc: k, t: None };
            }
            if left <= whole - snap {
                return Place { arc: k, t: Some(self.arcs[k].along(left)) };
            }
            left = (left - whole).max(0.0);
            k = (k + 1) % n;
        }
        Place { arc: k, t: None }
    }

    pub fn c_index(&self, place: Place) -> u8 {
        if place.t.is_some() { 6 } else { self.corners[place.arc] }
    }

    pub fn spot(&self, place: Place) -> Spot {
        let arc = &self.arcs[place.arc];
        Spot::On(arc.line.clone(), place.t.unwrap_or(arc.from))
    }

    pub fn point(&self, place: Place) -> DVec3 {
        let arc = &self.arcs[place.arc];
        arc.line.point(place.t.unwrap_or(arc.from))
    }

    /// Where a place is in the chart, the direction in which the border leaves it, and the angle inside, radians.
    pub fn frame(&self, place: Place) -> (DVec2, DVec2, f64) {
        let n = self.arcs.len();
        let arc = &self.arcs[place.arc];
        // Directions are those over a twelfth of an arc: single segments of a cut along mesh edges mean little.
        let ahead = |arc: &Arc, from: f64| {
            let reach = 0.08 * arc.length();
            let start = arc.line.length_at(from);
            let to = arc.line.at_length(if arc.reversed { start - reach } else { start + reach });
            arc.at(if arc.reversed { to.max(arc.to) } else { to.min(arc.to) })
        };
        let behind = |arc: &Arc, from: f64| {
            let reach = 0.08 * arc.length();
            let start = arc.line.length_at(from);
            let to = arc.line.at_length(if arc.reversed { start + reach } else { start - reach });
            arc.at(if arc.reversed { to.min(arc.from) } else { to.max(arc.from) })
        };
        let (here, out, back) = if let Some(t) = place.t {
            let here = arc.at(t);
            (here, ahead(arc, t) - here, behind(arc, t) - here)
        } else {
            let here = arc.at(arc.from);
            let before = &self.arcs[(place.arc + n - 1) % n];
            (here, ahead(arc, arc.from) - here, behind(before, before.to) - before.at(before.to))
        };
        let mut angle = out.angle_to(back);
        if angle <= 0.0 {
            angle += std::f64::consts::TAU;
        }
        (here, out.normalize_or(DVec2::X), angle)
    }

    /// The arcs from one place to another, counter-clockwise, and the c-indices where they start; that of the first is for
    /// the caller to set.
    fn between(&self, from: Place, to: Place) -> (Vec<Arc>, Vec<u8>) {
        let n = self.arcs.len();
        let (mut arcs, mut corners) = (Vec::new(), Vec::new());
        let mut k = from.arc;
        let mut start = from.t;
        loop {
            let arc = &self.arcs[k];
            let piece = Arc { from: start.unwrap_or(arc.from), ..arc.clone() };
            let ends_here =
                to.arc == k && to.t.is_some_and(|t| if arc.reversed { t < piece.from } else { t > piece.from });
            corners.push(self.corners[k]);
            if ends_here {
                arcs.push(Arc { to: to.t.unwrap_or(arc.to), ..piece });
                return (arcs, corners);
            }
            arcs.push(piece);
            k = (k + 1) % n;
            start = None;
            if to.t.is_none() && to.arc == k || arcs.len() > n + 1 {
                return (arcs, corners);
            }
        }
    }

    /// The part on the left of curves that lead away from `to` and arrive at `from`: what lies between the two places,
    /// counter-clockwise from `from`, closed by arcs with given c-indices at `from`, at `to`, and where the arcs meet.
    pub fn part(&self, [from, to]: [Place; 2], [at_from, at_to]: [u8; 2], back: &[Arc], middle: &[u8]) -> Self {
        let (mut arcs, mut corners) = self.between(from, to);
        corners[0] = at_from;
        corners.push(at_to);
        corners.extend(middle);
        arcs.extend_from_slice(back);
        Self { chart: self.chart, arcs, corners }
    }
}

/// A cubic curve in the chart with given ends and directions there, as a polyline.
pub(super) fn cubic([p, q]: [DVec2; 2], [out, arriving]: [DVec2; 2]) -> Vec<DVec2> {
    let reach = p.distance(q);
    let (out, arriving) = (out * reach, arriving * reach);
    (0..=SAMPLES)
        .map(|k| {
            let t = k as f64 / SAMPLES as f64;
            let (t2, t3) = (t * t, t * t * t);
            p * (2.0 * t3 - 3.0 * t2 + 1.0)
                + out * (t3 - 2.0 * t2 + t)
                + q * (3.0 * t2 - 2.0 * t3)
                + arriving * (t3 - t2)
        })
        .collect()
}

/// Whether a polyline between border points, or from one to the inside, stays within a polygon.
pub(super) fn stays_inside(curve: &[DVec2], polygon: &[DVec2]) -> bool {
    let n = polygon.len();
    let inner = &curve[1..curve.len() - 1];
    contains(polygon, inner[inner.len() / 2])
        && inner.windows(2).all(|w| (0..n).all(|k| !cross([w[0], w[1]], [polygon[k], polygon[(k + 1) % n]])))
        && contains(polygon, inner[0])
}

/// Total turn of a polyline without regard to its sense, radians.
pub(super) fn bend(curve: &[DVec2]) -> f64 {
    curve.windows(3).map(|w| (w[1] - w[0]).angle_to(w[2] - w[1]).abs()).sum()
}
