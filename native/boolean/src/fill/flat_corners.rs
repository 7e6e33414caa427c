//! A straight rim or line whose vertex has one quad beside it makes a triangle of that quad: its scaled Jacobian is zero
//! wherever its other corners go. Such a corner is opened: the vertex gets an edge, and two quads more (Fig. 3 of Tarini
//! et al., "Practical quad mesh simplification", 2010, has the same move as a vertex split, read backwards).

use super::{Fill, Region};
use mesh::{DVec3, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::smooth_star::Reference;

/// A corner between two fixed edges is opened when it is blunter than this, radians: 160 degrees.
const FLAT: f64 = 2.79;

/// Opens the flat corners of a fill; true when there was one. Costs O(n log n).
pub fn open(region: &Region, fill: &mut Fill) -> bool {
    let fixed: BTreeSet<[u32; 2]> = region
        .loops
        .iter()
        .flat_map(|walk| (0..walk.len()).map(|k| sorted(walk[k], walk[(k + 1) % walk.len()])))
        .chain(region.inner_lines.iter().map(|&[a, b]| sorted(a, b)))
        .collect();
    let mut opened = false;
    for q in 0..fill.quads.len() {
        for k in 0..4 {
            let quad = fill.quads[q];
            let [v, a, b, c] = [0, 1, 2, 3].map(|j| quad[(k + j) % 4]);
            let is_fixed = fixed.contains(&sorted(v, a)) && fixed.contains(&sorted(v, c));
            if !is_fixed || (b as usize) < region.rim_count {
                continue;
            }
            let points = region.points(fill);
            let [at_v, at_a, at_c] = [v, a, c].map(|w| points[w as usize]);
            if (at_a - at_v).angle_between(at_c - at_v) > FLAT {
                opened |= split(region, fill, &points, q, [v, a, b, c]);
            }
        }
    }
    opened
}

/// Splits the inner vertex `b` of the quad `[v, a, b, c]` into three: one goes with `a`, one with `c`, and `v` gets an edge
/// to the one between. The edge of `b` half way round, to `e`, is doubled; between its two copies comes a quad.
fn split(region: &Region, fill: &mut Fill, points: &[DVec3], q: usize, [v, a, b, c]: [u32; 4]) -> bool {
    // Quads round b by the neighbour they start from: (b, from, _, to), counter-clockwise.
    let mut next: BTreeMap<u32, (u32, usize)> = BTreeMap::new();
    for (index, quad) in fill.quads.iter().enumerate() {
        if let Some(j) = quad.iter().position(|&w| w == b) {
            next.insert(quad[(j + 1) % 4], (quad[(j + 3) % 4], index));
        }
    }
    // In the quad (b, c, v, a) the walk goes from c to a; on from a, back to c.
    let mut fan = Vec::new();
    let mut at = a;
    while at != c {
        let Some(&(to, index)) = next.get(&at) else { return false };
        if fan.len() > next.len() {
            return false;
        }
        fan.push((to, index));
        at = to;
    }
    if fan.len() < 2 {
        return false;
    }
    let half = fan.len() / 2;
    let e = fan[half - 1].0;
    let position = |v: u32| points[v as usize];
    let on_surface = |p: DVec3| region.under.project(p).point;
    let third = |w: u32| on_surface(position(b).lerp(position(w), 1.0 / 3.0));
    let first = points.len() as u32;
    let (with_a, with_c) = (first, first + 1);
    fill.positions.extend([third(a), third(c)]);
    // b itself stays between: it moves towards v.
    fill.positions[b as usize - region.rim_count] = third(v);
    for (place, &(_, index)) in fan.iter().enumerate() {
        let fresh = if place < half { with_a } else { with_c };
        for w in &mut fill.quads[index] {
            if *w == b {
                *w = fresh;
            }
        }
    }
    fill.quads[q] = [v, a, with_a, b];
    fill.quads.push([v, b, with_c, c]);
    fill.quads.push([b, with_a, e, with_c]);
    true
}

#[cfg(test)]
mod tests {
    use super::open;
    use crate::fill::test_region::region;
    use crate::fill::{Fill, finish};
    use glam::DVec2;
    use mesh::{DVec3, Monitor, scaled_jacobian};
    use testkit::plane_region::subdivided;

    #[test]
    fn a_flat_corner_gets_an_edge_and_the_fill_stays_one() {
        // A grid of 4 x 3 squares; the edge from (2, 0) to (2, 1) is turned to join (1, 0) and (3, 1).
        let rim = subdivided(&[(0, 0), (4, 0), (4, 3), (0, 3)].map(|(x, y)| DVec2::new(x.into(), y.into())), 1.0);
        let region = region(&[rim], |p| p.extend(0.0));
        let mut fill = Fill {
            positions: (0..6).map(|k| DVec3::new(f64::from(1 + k % 3), f64::from(1 + k / 3), 0.0)).collect(),
            quads: vec![],
        };
        let points = region.points(&fill);
        let at = |x: i32, y: i32| {
            let p = DVec3::new(x.into(), y.into(), 0.0);
            points.iter().position(|q| q.distance(p) < 1e-9).expect("a vertex of the grid") as u32
        };
        for (x, y) in (0..3).flat_map(|y| (0..4).map(move |x| (x, y))).filter(|&(x, y)| y > 0 || x == 0 || x == 3) {
            fill.quads.push([at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
        fill.quads.push([at(1, 0), at(2, 0), at(3, 0), at(3, 1)]);
        fill.quads.push([at(1, 0), at(3, 1), at(2, 1), at(1, 1)]);
        region.verify(&fill).unwrap();

        assert!(open(&region, &mut fill));
        region.verify(&fill).unwrap();
        let flat = at(2, 0);
        assert_eq!(fill.quads.iter().flatten().filter(|&&v| v == flat).count(), 2);
        assert!(!open(&region, &mut fill), "once is enough");
        let smooth = finish::smooth(&region, &fill, &Monitor::new()).unwrap();
        let points = region.points(&smooth);
        let worst = smooth.quads.iter().map(|q| scaled_jacobian(q.map(|v| points[v as usize]))).fold(1.0, f64::min);
        assert!(worst > 0.2, "{worst}");
    }
}
