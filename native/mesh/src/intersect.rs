//! Exact triangle-triangle intersection, and the self-intersections of a triangle mesh. No tolerance anywhere.
//!
//! Decisions are signs of Shewchuk's adaptive predicates ("Adaptive precision floating-point arithmetic and fast robust
//! geometric predicates", 1997). Two triangles that share no corner intersect when they have a point in common; those
//! that share one corner, when they have another point in common; those that share an edge, when one is folded flat onto the other.
//! This is the notion of Zhou et al., "Mesh arrangements for solid geometry", 2016, whose boolean refuses such input.

use crate::{Aabb, Bvh, Cancelled, Monitor, TriangleMesh};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use robust::{Coord, Coord3D};

type Triangle = [DVec3; 3];

/// Sign of the volume of the tetrahedron `a b c d`, exactly: -1, 0 or 1. Which side is positive does not matter
/// here, as only signs against the same plane are compared.
fn side(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i8 {
    // Flat parts of a mesh often lie square to an axis: spare them the exact expansion that a zero costs.
    if (a.cmpeq(b) & a.cmpeq(c) & a.cmpeq(d)).any() {
        return 0;
    }
    let point = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    sign(robust::orient3d(point(a), point(b), point(c), point(d)))
}

/// Sign of the area of the plane triangle `a b c`, exactly; positive when counter-clockwise.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> i8 {
    let point = |p: DVec2| Coord { x: p.x, y: p.y };
    sign(robust::orient2d(point(a), point(b), point(c)))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

/// Drops one coordinate.
fn project(p: DVec3, dropped: usize) -> DVec2 {
    DVec2::new(p[(dropped + 1) % 3], p[(dropped + 2) % 3])
}

/// A coordinate that can be dropped without flattening the triangle to a line; none when the corners lie on one line.
fn projection(t: Triangle) -> Option<usize> {
    let normal = (t[1] - t[0]).cross(t[2] - t[0]).abs();
    // The widest shadow almost always decides; the others matter only within rounding.
    let first = normal.max_position();
    (first..first + 3).map(|k| k % 3).find(|&k| {
        let [a, b, c] = t.map(|p| project(p, k));
        turn(a, b, c) != 0
    })
}

/// True when the points lie on one line, exactly.
pub fn are_collinear(a: DVec3, b: DVec3, c: DVec3) -> bool {
    projection([a, b, c]).is_none()
}

/// True when two triangles intersect beyond the corners they share: `shared` lists (corner of `a`, corner of `b`) for
/// each corner that is one vertex of the mesh. No shared corner: any common point counts. One: any other common point.
/// Two: folded flat onto each other. Three: the same triangle twice, which is not an intersection but a duplicate.
/// Triangles without area intersect nothing. Exact for coordinates between about 1e-100 and 1e100 in size.
///
/// # Panics
/// When `shared` names a corner other than 0, 1 and 2.
///
/// ```
/// use mesh::{DVec3, triangles_intersect};
/// let floor = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// let wall = [DVec3::ZERO, DVec3::X, DVec3::Z];
/// assert!(triangles_intersect(floor, wall, &[]));
/// assert!(!triangles_intersect(floor, wall, &[(0, 0), (1, 1)]));
/// ```
pub fn triangles_intersect(a: [DVec3; 3], b: [DVec3; 3], shared: &[(usize, usize)]) -> bool {
    match *shared {
        [] => apart_intersect(a, b),
        [(i, j)] => corner_intersect([a[i], a[(i + 1) % 3], a[(i + 2) % 3]], [b[j], b[(j + 1) % 3], b[(j + 2) % 3]]),
        [(i, j), (k, l)] if i != k && j != l => edge_folded([a[i], a[k]], a[3 - i - k], b[3 - j - l]),
        _ => false,
    }
}

/// Sides of the three points on the plane of `t`.
fn sides(t: Triangle, points: Triangle) -> [i8; 3] {
    points.map(|p| side(t[0], t[1], t[2], p))
}

fn apart_intersect(a: Triangle, b: Triangle) -> bool {
    let b_sides = sides(a, b);
    if b_sides == [1; 3] || b_sides == [-1; 3] {
        return false;
    }
    let a_sides = sides(b, a);
    if a_sides == [1; 3] || a_sides == [-1; 3] {
        return false;
    }
    let (Some(a_drop), Some(b_drop)) = (projection(a), projection(b)) else { return false };
    // Where two triangles meet, an edge of one meets the other.
    (0..3).any(|k| {
        let next = (k + 1) % 3;
        edge_hits([b[k], b[next]], [b_sides[k], b_sides[next]], a, a_drop)
            || edge_hits([a[k], a[next]], [a_sides[k], a_sides[next]], b, b_drop)
    })
}

/// Triangles with their first corner in common. What they share beyond it starts at that corner and ends where the
/// opposite edge of one of them meets the other.
fn corner_intersect(a: Triangle, b: Triangle) -> bool {
    let [b1, b2] = [b[1], b[2]].map(|p| side(a[0], a[1], a[2], p));
    if b1 == b2 && b1 != 0 {
        return false;
    }
    let [a1, a2] = [a[1], a[2]].map(|p| side(b[0], b[1], b[2], p));
    if a1 == a2 && a1 != 0 {
        return false;
    }
    let (Some(a_drop), Some(b_drop)) = (projection(a), projection(b)) else { return false };
    edge_hits([b[1], b[2]], [b1, b2], a, a_drop) || edge_hits([a[1], a[2]], [a1, a2], b, b_drop)
}

/// Triangles with a common edge and the apexes `p` and `q`: in one plane, on the same side of the edge.
fn edge_folded(edge: [DVec3; 2], p: DVec3, q: DVec3) -> bool {
    if side(edge[0], edge[1], p, q) != 0 {
        return false;
    }
    let Some(drop) = projection([edge[0], edge[1], p]) else { return false };
    let [a, b, p, q] = [edge[0], edge[1], p, q].map(|x| project(x, drop));
    turn(a, b, p) == turn(a, b, q)
}

/// True when a segment whose ends lie on the given sides of the plane of `t` meets `t`; dropping coordinate `drop`
/// must keep the area of `t`.
fn edge_hits([p, q]: [DVec3; 2], ends: [i8; 2], t: Triangle, drop: usize) -> bool {
    match ends {
        [1, 1] | [-1, -1] => false,
        [0, 0] => {
            let [p, q] = [p, q].map(|x| project(x, drop));
            plane_segment_hits(p, q, t.map(|x| project(x, drop)))
        }
        _ => {
            // The segment reaches the plane in one point; it is in the triangle when the line passes all edges alike.
            let passes = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| side(p, q, t[i], t[j]));
            !(passes.contains(&1) && passes.contains(&-1))
        }
    }
}

/// True when the segment `p q` meets the triangle, in the plane.
fn plane_segment_hits(p: DVec2, q: DVec2, t: [DVec2; 3]) -> bool {
    let edges = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| [t[i], t[j]]);
    let inside = edges.map(|[a, b]| turn(a, b, p));
    !(inside.contains(&1) && inside.contains(&-1)) || edges.iter().any(|&[a, b]| plane_segments_meet(p, q, a, b))
}

fn plane_segments_meet(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> bool {
    let (pa, pb, ap, aq) = (turn(p, q, a), turn(p, q, b), turn(a, b, p), turn(a, b, q));
    if [pa, pb, ap, aq] == [0; 4] {
        // On one line: the ranges overlap.
        let overlap = |k: usize| p[k].min(q[k]) <= a[k].max(b[k]) && a[k].min(b[k]) <= p[k].max(q[k]);
        return overlap(0) && overlap(1);
    }
    pa * pb <= 0 && ap * aq <= 0
}

/// A power of two that brings the largest finite coordinate to between 1/2 and 2: multiplying by it is exact and keeps
/// the predicates clear of overflow and underflow whatever the scale of the scene.
pub fn unit_scale<'a>(positions: impl IntoIterator<Item = &'a DVec3>) -> f64 {
    let largest = positions.into_iter().filter(|p| p.is_finite()).fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    // 2^-n from the exponent bits; clamped where 2^n or 2^-n would leave the normal range.
    let exponent = ((largest.to_bits() >> 52) as i32 - 1023).clamp(-1022, 1022);
    if largest == 0.0 { 1.0 } else { f64::from_bits(((1023 - exponent) as u64) << 52) }
}

/// All pairs of triangles that intersect as [`triangles_intersect`] defines it, lower number first, sorted. Corners
/// at exactly the same position count as shared, whatever their vertex numbers; triangles without area or with a
/// non-finite corner intersect nothing. The same pairs that libigl reports through CGAL. Runs on all threads of the
/// current rayon pool; O(n log n + overlapping boxes).
///
/// # Errors
/// [`Cancelled`].
pub fn self_intersections(mesh: &TriangleMesh, monitor: &Monitor) -> Result<Vec<[u32; 2]>, Cancelled> {
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    self_intersections_of(mesh, &all, monitor)
}

/// The [`self_intersections`] in which at least one triangle of `subset` takes part: after an edit, pass the triangles
/// that moved. Costs one scan of the boxes of the mesh, and searches only near the subset.
///
/// # Errors
/// [`Cancelled`].
pub fn self_intersections_of(
    mesh: &TriangleMesh,
    subset: &[u32],
    monitor: &Monitor,
) -> Result<Vec<[u32; 2]>, Cancelled> {
    /// Triangles a task takes at least: some tens of microseconds of work.
    const TASK: usize = 256;

    let mut in_subset = vec![false; mesh.triangles.len()];
    for &t in subset {
        in_subset[t as usize] = true;
    }
    let bounds = |t: usize| {
        let points = mesh.points(t);
        if points.iter().all(|p| p.is_finite()) { Aabb::of(points) } else { Aabb::EMPTY }
    };
    let subset: Vec<usize> = (0..in_subset.len()).filter(|&t| in_subset[t]).collect();
    let boxes: Vec<Aabb> = subset.iter().map(|&t| bounds(t)).collect();
    let tree = Bvh::new(&boxes);
    monitor.check()?;

    let scale = unit_scale(&mesh.positions);
    let reach = tree.bounds();
    let mut pairs = (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(TASK)
        .try_fold(Vec::new, |mut pairs, a| {
            let query = bounds(a);
            if query.overlaps(&reach) {
                monitor.check()?;
                tree.overlapping(&query, &mut |k| {
                    let b = subset[k as usize];
                    // A pair inside the subset comes up from both sides.
                    if (a < b || !in_subset[a]) && a != b && pair_intersects(mesh, a, b, scale) {
                        pairs.push([a.min(b) as u32, a.max(b) as u32]);
                    }
                });
            }
            Ok(pairs)
        })
        .try_reduce(Vec::new, |mut pairs, more| {
            pairs.extend(more);
            Ok(pairs)
        })?;
    pairs.sort_unstable();
    Ok(pairs)
}

fn pair_intersects(mesh: &TriangleMesh, a: usize, b: usize, scale: f64) -> bool {
    let (a_points, b_points) = (mesh.points(a), mesh.points(b));
    let mut shared = [(0, 0); 9];
    let mut count = 0;
    for (i, p) in a_points.iter().enumerate() {
        for (j, q) in b_points.iter().enumerate() {
            if mesh.triangles[a][i] == mesh.triangles[b][j] || p == q {
                shared[count] = (i, j);
                count += 1;
            }
        }
    }
    triangles_intersect(a_points.map(|p| p * scale), b_points.map(|p| p * scale), &shared[..count])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Whole = [i128; 3];

    fn minus(a: Whole, b: Whole) -> Whole {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Whole, b: Whole) -> Whole {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn dot(a: Whole, b: Whole) -> i128 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    fn normal(t: [Whole; 3]) -> Whole {
        cross(minus(t[1], t[0]), minus(t[2], t[0]))
    }

    fn flat(t: [Whole; 3]) -> bool {
        normal(t) == [0; 3]
    }

    /// Separating axes in whole numbers: the triangles have a common point when no axis keeps them apart.
    fn common_point(a: [Whole; 3], b: [Whole; 3]) -> bool {
        let edges = |t: [Whole; 3]| [minus(t[1], t[0]), minus(t[2], t[1]), minus(t[0], t[2])];
        let mut axes = vec![normal(a), normal(b)];
        axes.extend(edges(a).iter().flat_map(|&e| edges(b).map(|f| cross(e, f))));
        axes.extend(edges(a).map(|e| cross(normal(a), e)));
        axes.extend(edges(b).map(|e| cross(normal(b), e)));
        axes.iter().all(|&axis| {
            let (p, q) = (a.map(|x| dot(axis, x)), b.map(|x| dot(axis, x)));
            p.iter().max() >= q.iter().min() && q.iter().max() >= p.iter().min()
        })
    }

    /// The cones that two triangles span at a common first corner share a ray: s a1 + t a2 = p b1 + q b2 has a solution
    /// without negative numbers.
    fn common_ray(a: [Whole; 3], b: [Whole; 3]) -> bool {
        let [a1, a2] = [minus(a[1], a[0]), minus(a[2], a[0])];
        let [b1, b2] = [minus(b[1], a[0]), minus(b[2], a[0])];
        let det = |x, y, z| dot(x, cross(y, z));
        // Cramer's rule; the last two columns carry a minus, so their minors change sign twice.
        let solution = [det(a2, b1, b2), -det(a1, b1, b2), -det(a1, a2, b2), det(a1, a2, b1)];
        if solution != [0; 4] {
            return solution.iter().all(|&x| x >= 0) || solution.iter().all(|&x| x <= 0);
        }
        let in_cone = |x: Whole, from: Whole, to: Whole| {
            let up = cross(from, to);
            dot(cross(from, x), up) >= 0 && dot(cross(x, to), up) >= 0
        };
        in_cone(b1, a1, a2) || in_cone(b2, a1, a2) || in_cone(a1, b1, b2) || in_cone(a2, b1, b2)
    }

    fn corner() -> impl Strategy<Value = Whole> {
        prop::array::uniform3(-3i128..=3)
    }

    fn triangle() -> impl Strategy<Value = [Whole; 3]> {
        prop::array::uniform3(corner())
    }

    /// The grid as it is, and squeezed to the last digits beside 1.5, where floating-point determinants are noise.
    fn embeddings(t: [Whole; 3]) -> [Triangle; 2] {
        let place = |scale: f64, origin: f64| t.map(|p| DVec3::from_array(p.map(|x| origin + scale * x as f64)));
        [place(1.0, 0.0), place(f64::EPSILON, 1.5)]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]

        #[test]
        fn without_shared_corners_agrees_with_separating_axes(a in triangle(), b in triangle()) {
            let expected = !flat(a) && !flat(b) && common_point(a, b);
            for (a, b) in embeddings(a).into_iter().zip(embeddings(b)) {
                prop_assert_eq!(triangles_intersect(a, b, &[]), expected);
                prop_assert_eq!(triangles_intersect(b, a, &[]), expected);
            }
        }

        #[test]
        fn with_one_shared_corner_agrees_with_cones(a in triangle(), mut b in triangle(), i in 0..3usize, j in 0..3usize) {
            b[0] = a[0];
            let expected = !flat(a) && !flat(b) && common_ray(a, b);
            a_b_turned(a, b, i, j, |a, b| {
                prop_assert_eq!(triangles_intersect(a, b, &[(i, j)]), expected);
                Ok(())
            })?;
        }

        #[test]
        fn with_a_shared_edge_only_a_fold_counts(a in triangle(), q in corner(), i in 0..3usize, j in 0..3usize) {
            let b = [a[0], a[1], q];
            let (n, m) = (normal(a), normal(b));
            let expected = cross(n, m) == [0; 3] && dot(n, m) > 0;
            a_b_turned(a, b, i, j, |a, b| {
                prop_assert_eq!(triangles_intersect(a, b, &[(i, j), ((i + 1) % 3, (j + 1) % 3)]), expected);
                Ok(())
            })?;
        }
    }

    /// Runs `check` on both embeddings, with corner 0 of `a` moved to `i` and that of `b` to `j`.
    fn a_b_turned(
        mut a: [Whole; 3],
        mut b: [Whole; 3],
        i: usize,
        j: usize,
        check: impl Fn(Triangle, Triangle) -> Result<(), TestCaseError>,
    ) -> Result<(), TestCaseError> {
        a.rotate_right(i);
        b.rotate_right(j);
        embeddings(a).into_iter().zip(embeddings(b)).try_for_each(|(a, b)| check(a, b))
    }

    /// Triangles over a small grid, so that every kind of contact occurs.
    fn soup() -> impl Strategy<Value = TriangleMesh> {
        (prop::collection::vec(corner(), 4..14), prop::collection::vec(prop::array::uniform3(0..4u32), 0..24)).prop_map(
            |(corners, picks)| {
                let positions: Vec<DVec3> = corners.iter().map(|p| DVec3::from_array(p.map(|x| x as f64))).collect();
                let n = positions.len() as u32;
                let triangles = picks.iter().enumerate().map(|(k, t)| t.map(|v| (v + k as u32) % n)).collect();
                TriangleMesh { positions, triangles }
            },
        )
    }

    proptest! {
        #[test]
        fn a_subset_gives_the_pairs_it_takes_part_in(mesh in soup(), step in 1..5usize) {
            let monitor = Monitor::new();
            let all = self_intersections(&mesh, &monitor).unwrap();
            let subset: Vec<u32> = (0..mesh.triangles.len() as u32).step_by(step).collect();
            let expected: Vec<_> = all.into_iter().filter(|p| p.iter().any(|t| subset.contains(t))).collect();
            prop_assert_eq!(self_intersections_of(&mesh, &subset, &monitor).unwrap(), expected);
        }

        #[test]
        fn scale_does_not_matter(mesh in soup(), exponent in -1000..1000i32) {
            let monitor = Monitor::new();
            let scale = 2f64.powi(exponent);
            let scaled = TriangleMesh {
                positions: mesh.positions.iter().map(|&p| p * scale).collect(),
                triangles: mesh.triangles.clone(),
            };
            prop_assert_eq!(self_intersections(&mesh, &monitor), self_intersections(&scaled, &monitor));
        }
    }

    #[test]
    fn unit_scale_is_a_power_of_two_near_the_inverse() {
        for largest in [1.0, 3.0, 1e-300, 1e300, f64::MAX, f64::MIN_POSITIVE, 5e-324] {
            let scale = unit_scale(&[DVec3::new(-largest, 0.0, 0.0), DVec3::NAN]);
            assert_eq!(scale.to_bits() << 12, 0, "no mantissa");
            assert!(largest * scale < 4.0 && (largest * scale > 0.4 || largest < f64::MIN_POSITIVE), "{largest}");
        }
        assert_eq!(unit_scale(&[]), 1.0);
    }

    #[test]
    fn corners_without_coordinates_intersect_nothing() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::NAN, DVec3::INFINITY];
        let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3], [2, 1, 4], [0, 0, 0]] };
        assert_eq!(self_intersections(&mesh, &Monitor::new()), Ok(vec![]));
    }

    #[test]
    fn stops_when_cancelled() {
        let monitor = Monitor::new();
        monitor.cancel();
        assert_eq!(self_intersections(&TriangleMesh::default(), &monitor), Err(Cancelled));
    }
}
