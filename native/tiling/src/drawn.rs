//! Closed curves drawn as polygons: what lies inside, and how far things are from them.

/// A point of a drawn curve's plane.
pub(crate) type Position = [f64; 2];

pub(crate) fn segments(polygon: &[Position]) -> impl Iterator<Item = [Position; 2]> {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]])
}

pub(crate) fn distance(p: Position, q: Position) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Mean of the curve's points, weighted by length.
pub(crate) fn middle(curve: &[Position]) -> Position {
    let mut sum = [0.0; 3];
    for [a, b] in segments(curve) {
        let length = distance(a, b);
        sum[0] += length * f64::midpoint(a[0], b[0]);
        sum[1] += length * f64::midpoint(a[1], b[1]);
        sum[2] += length;
    }
    if sum[2] > 0.0 { [sum[0] / sum[2], sum[1] / sum[2]] } else { curve[0] }
}

pub(crate) fn contains(curve: &[Position], p: Position) -> bool {
    let crossings = segments(curve)
        .filter(|[a, b]| (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
    crossings.count() % 2 == 1
}

/// Distance from a point to a closed polygon.
pub(crate) fn to_curve(p: Position, curve: &[Position]) -> f64 {
    let to_segment = |segment| on_segment(p, segment).0;
    segments(curve).map(to_segment).fold(f64::INFINITY, f64::min)
}

/// Distance from a point to a closed polygon, and how far along the polygon its nearest point lies.
pub(crate) fn nearest(curve: &[Position], p: Position) -> (f64, f64) {
    let (mut best, mut begin) = ((f64::INFINITY, 0.0), 0.0);
    for [a, b] in segments(curve) {
        let (away, t) = on_segment(p, [a, b]);
        let length = distance(a, b);
        if away < best.0 {
            best = (away, begin + t * length);
        }
        begin += length;
    }
    best
}

/// Distance from a point to a segment, and where on it, from 0 to 1, the nearest point lies.
fn on_segment(p: Position, [a, b]: [Position; 2]) -> (f64, f64) {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = d[0] * d[0] + d[1] * d[1];
    let t = if square > 0.0 { ((d[0] * e[0] + d[1] * e[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    ((e[0] - t * d[0]).hypot(e[1] - t * d[1]), t)
}

/// Points along a polygon, at most a quarter of an edge apart.
fn samples(polygon: &[Position]) -> impl Iterator<Item = Position> {
    segments(polygon).flat_map(|[a, b]| {
        let steps = (4.0 * distance(a, b)).ceil().max(1.0);
        let at = move |k: usize| {
            let t = k as f64 / steps;
            [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]
        };
        (0..steps as usize).map(at)
    })
}

/// Distance from a point to a closed polygon, negative inside.
pub(crate) fn signed_distance(curve: &[Position], p: Position) -> f64 {
    if contains(curve, p) { -to_curve(p, curve) } else { to_curve(p, curve) }
}

pub(crate) fn greatest_distance(a: &[Position], b: &[Position]) -> f64 {
    let one_way = |a: &[Position], b: &[Position]| samples(a).map(|p| to_curve(p, b)).fold(0.0, f64::max);
    one_way(a, b).max(one_way(b, a))
}

/// Mean of the squared distances both ways: small when the outline keeps near everywhere.
pub(crate) fn mean_square(outline: &[Position], curve: &[Position]) -> f64 {
    let one_way = |a: &[Position], b: &[Position]| {
        let squares: Vec<f64> = a.iter().map(|&p| to_curve(p, b).powi(2)).collect();
        squares.iter().sum::<f64>() / squares.len() as f64
    };
    let along: Vec<Position> = samples(curve).step_by(2).collect();
    one_way(outline, curve) + one_way(&along, outline)
}
