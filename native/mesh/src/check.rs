//! The check that names every defect of a polygon mesh, with indices, so that a caller can refuse, repair or select.
//!
//! Everything but the self-intersections costs a few sorts. Each list stands alone: one fault may show in several.

use crate::intersect::unit_scale;
use crate::{Aabb, Cancelled, Monitor, NONE, PolygonMesh, TriangleMesh, are_collinear, self_intersections};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What is wrong, or merely special, in a mesh. Lists are sorted; edges are vertex pairs, lower vertex first. A side of
/// a face that runs from a vertex to itself is no edge.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Defects {
    /// Vertices with a coordinate that is infinite or not a number.
    pub nonfinite_verts: Vec<u32>,
    /// Vertices without a face.
    pub isolated_verts: Vec<u32>,
    /// Vertices at exactly the position of a lower one: (lowest vertex there, vertex).
    pub duplicate_verts: Vec<[u32; 2]>,
    /// Faces that name a vertex twice.
    pub degenerate_faces: Vec<u32>,
    /// Faces whose corners all lie on one line, exactly.
    pub zero_area_faces: Vec<u32>,
    /// Faces with the corners of a lower face, in any order or direction: (lowest such face, face). Corners are
    /// compared by position, so that a doubled shell is found whether or not its vertices are merged.
    pub duplicate_faces: Vec<[u32; 2]>,
    /// Edges of more than two faces.
    pub nonmanifold_edges: Vec<[u32; 2]>,
    /// Edges of two faces that run along them in the same direction: one of the two is flipped.
    pub misoriented_edges: Vec<[u32; 2]>,
    /// Edges of a single face.
    pub border_edges: Vec<[u32; 2]>,
    /// Vertices whose faces form more than one fan.
    pub nonmanifold_verts: Vec<u32>,
    /// Pairs of faces that intersect, lower first, by [`crate::self_intersections`] of the mesh triangulated by
    /// [`TriangleMesh::from_polygons`]: a concave n-gon may meet itself, and is then listed as (face, face).
    pub self_intersecting_faces: Vec<[u32; 2]>,
    /// The faces of each closed component that faces the wrong way. Nested components alternate: one inside an even number
    /// of others has to face outwards, one inside an odd number bounds a void and has to face inwards. A component
    /// that intersects others is neither inside nor outside of them and is listed only when it would be wrong alone.
    pub inside_out_components: Vec<Vec<u32>>,
    /// Faces with three corners.
    pub triangles: Vec<u32>,
    /// Faces with more than four corners.
    pub ngons: Vec<u32>,
    /// Number of components; faces that share a vertex belong together.
    pub components: usize,
    /// Euler characteristic: used vertices - edges + faces.
    pub euler: i64,
}

impl Defects {
    /// No border: every edge has at least two faces.
    pub fn closed(&self) -> bool {
        self.border_edges.is_empty()
    }

    /// A consistently oriented surface, with or without border.
    pub fn manifold(&self) -> bool {
        self.nonmanifold_edges.is_empty()
            && self.nonmanifold_verts.is_empty()
            && self.misoriented_edges.is_empty()
            && self.degenerate_faces.is_empty()
    }

    /// Every face is a quad.
    pub fn pure_quad(&self) -> bool {
        self.triangles.is_empty() && self.ngons.is_empty()
    }

    /// Nothing is wrong: all lists are empty but those of borders, triangles and n-gons, which a sound mesh may have.
    pub fn is_clean(&self) -> bool {
        self.manifold()
            && self.nonfinite_verts.is_empty()
            && self.isolated_verts.is_empty()
            && self.duplicate_verts.is_empty()
            && self.zero_area_faces.is_empty()
            && self.duplicate_faces.is_empty()
            && self.self_intersecting_faces.is_empty()
            && self.inside_out_components.is_empty()
    }
}

/// Finds every defect of a mesh. Any mesh will do: empty, tiny, huge, with coordinates that are not numbers. Costs
/// O(n log n), nearly all of it for the self-intersections, plus O(m) for each closed component whose bounding box lies in
/// those of others with m faces.
///
/// # Errors
/// [`Cancelled`].
///
/// ```
/// use mesh::{DVec3, Monitor, PolygonMesh, check};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
/// let square = PolygonMesh::from_polygons(corners, [[0, 1, 2, 3]])?;
/// let defects = check(&square, &Monitor::new())?;
/// assert!(defects.is_clean() && !defects.closed());
/// assert_eq!(defects.border_edges.len(), 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check(mesh: &PolygonMesh, monitor: &Monitor) -> Result<Defects, Cancelled> {
    let mut defects = Defects::default();
    let first_there = check_verts(mesh, &mut defects);
    // The rest works at unit size, so that the scale of the scene can neither overflow nor underflow.
    let scale = unit_scale(&mesh.positions);
    let mesh = &mesh.scaled(scale);
    monitor.check()?;
    check_faces(mesh, &first_there, &mut defects);
    monitor.check()?;
    let edges = check_edges(mesh, &mut defects);
    monitor.check()?;
    let components = Components::new(mesh);
    defects.components = components.faces.len();
    let used = mesh.vertex_count() - defects.isolated_verts.len();
    defects.euler = used as i64 - edges as i64 + mesh.face_count() as i64;
    monitor.check()?;

    let (triangles, face_of) = TriangleMesh::from_polygons(mesh);
    let pairs = self_intersections(&triangles, monitor)?;
    check_direction(&triangles, &components, &pairs, &mut defects, monitor)?;
    defects.self_intersecting_faces = pairs.iter().map(|pair| pair.map(|t| face_of[t as usize])).collect();
    defects.self_intersecting_faces.sort_unstable();
    defects.self_intersecting_faces.dedup();
    Ok(defects)
}

/// Returns, for each vertex, the lowest vertex at its position.
fn check_verts(mesh: &PolygonMesh, defects: &mut Defects) -> Vec<u32> {
    let verts = 0..mesh.vertex_count() as u32;
    // Adding zero turns -0 into 0.
    let at = |v: u32| mesh.positions[v as usize] + DVec3::ZERO;
    let mut used = vec![false; mesh.vertex_count()];
    mesh.corner_verts().iter().for_each(|&v| used[v as usize] = true);
    defects.isolated_verts = verts.clone().filter(|&v| !used[v as usize]).collect();

    let (mut finite, bad): (Vec<u32>, Vec<u32>) = verts.clone().partition(|&v| at(v).is_finite());
    defects.nonfinite_verts = bad;
    finite.par_sort_unstable_by(|&v, &w| {
        let (p, q) = (at(v), at(w));
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)).then(v.cmp(&w))
    });
    let mut first_there: Vec<u32> = verts.collect();
    for same in finite.chunk_by(|&v, &w| at(v) == at(w)) {
        for &v in &same[1..] {
            first_there[v as usize] = same[0];
            defects.duplicate_verts.push([same[0], v]);
        }
    }
    defects.duplicate_verts.sort_unstable();
    first_there
}

fn check_faces(mesh: &PolygonMesh, first_there: &[u32], defects: &mut Defects) {
    // Corners of each face in a normal form: sorted lowest vertices at their positions.
    let mut corners: Vec<u32> = mesh.corner_verts().iter().map(|&v| first_there[v as usize]).collect();
    let mut sorted = Vec::new();
    for (f, face) in mesh.faces().enumerate() {
        let f = f as u32;
        match face.len() {
            3 => defects.triangles.push(f),
            4 => {}
            _ => defects.ngons.push(f),
        }
        sorted.clear();
        sorted.extend_from_slice(face);
        sorted.sort_unstable();
        if sorted.windows(2).any(|w| w[0] == w[1]) {
            defects.degenerate_faces.push(f);
        }
        if on_a_line(mesh, f as usize) {
            defects.zero_area_faces.push(f);
        }
        corners[mesh.face_corners(f as usize)].sort_unstable();
    }
    let normal_form = |f: u32| &corners[mesh.face_corners(f as usize)];
    let mut order: Vec<u32> = (0..mesh.face_count() as u32).collect();
    order.par_sort_unstable_by(|&f, &g| normal_form(f).cmp(normal_form(g)).then(f.cmp(&g)));
    for same in order.chunk_by(|&f, &g| normal_form(f) == normal_form(g)) {
        defects.duplicate_faces.extend(same[1..].iter().map(|&f| [same[0], f]));
    }
    defects.duplicate_faces.sort_unstable();
}

/// True when all corners of a face lie on one line; false when one of them is not finite.
fn on_a_line(mesh: &PolygonMesh, f: usize) -> bool {
    let mut points = mesh.face_points(f);
    let Some(a) = points.next().filter(|_| mesh.face_points(f).all(DVec3::is_finite)) else { return false };
    let Some(b) = points.find(|&p| p != a) else { return true };
    points.all(|c| are_collinear(a, b, c))
}

/// A face's side of an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    low: u32,
    high: u32,
    low_corner: u32,
    high_corner: u32,
    /// The face runs from the low vertex to the high one.
    rising: bool,
}

/// Returns the number of edges.
fn check_edges(mesh: &PolygonMesh, defects: &mut Defects) -> usize {
    let verts = mesh.corner_verts();
    // Corners that belong to one fan round their vertex.
    let mut fans = DisjointSets::new(verts.len());
    let mut sides = Vec::with_capacity(verts.len());
    for f in 0..mesh.face_count() {
        let corners = mesh.face_corners(f);
        for from in corners.clone() {
            let to = if from + 1 == corners.end { corners.start } else { from + 1 };
            if verts[from] == verts[to] {
                fans.unite(from as u32, to as u32);
                continue;
            }
            let rising = verts[from] < verts[to];
            let (low, high) = if rising { (from, to) } else { (to, from) };
            let (low_corner, high_corner) = (low as u32, high as u32);
            sides.push(Side { low: verts[low], high: verts[high], low_corner, high_corner, rising });
        }
    }
    sides.par_sort_unstable();

    let mut edges = 0;
    for edge in sides.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
        edges += 1;
        let ends = [edge[0].low, edge[0].high];
        match edge {
            [_] => defects.border_edges.push(ends),
            [a, b] if a.rising == b.rising => defects.misoriented_edges.push(ends),
            [_, _] => {}
            _ => defects.nonmanifold_edges.push(ends),
        }
        for pair in edge.windows(2) {
            fans.unite(pair[0].low_corner, pair[1].low_corner);
            fans.unite(pair[0].high_corner, pair[1].high_corner);
        }
    }
    let mut fan_count = vec![0u32; mesh.vertex_count()];
    for (corner, &v) in verts.iter().enumerate() {
        fan_count[v as usize] += u32::from(fans.root(corner as u32) == corner as u32);
    }
    defects.nonmanifold_verts = (0..mesh.vertex_count() as u32).filter(|&v| fan_count[v as usize] > 1).collect();
    edges
}

/// Faces that share a vertex belong together.
struct Components {
    /// Component of each vertex, [`NONE`] for isolated ones.
    of_vert: Vec<u32>,
    /// Faces of each component, components in the order of their first faces.
    faces: Vec<Vec<u32>>,
}

impl Components {
    fn new(mesh: &PolygonMesh) -> Self {
        let mut sets = DisjointSets::new(mesh.vertex_count());
        for face in mesh.faces() {
            for &v in face {
                sets.unite(face[0], v);
            }
        }
        let (mut of_vert, mut faces) = (vec![NONE; mesh.vertex_count()], Vec::<Vec<u32>>::new());
        for (f, face) in mesh.faces().enumerate() {
            let root = sets.root(face[0]) as usize;
            if of_vert[root] == NONE {
                of_vert[root] = faces.len() as u32;
                faces.push(Vec::new());
            }
            faces[of_vert[root] as usize].push(f as u32);
        }
        // An isolated vertex is its own root, without a component.
        for v in 0..of_vert.len() {
            of_vert[v] = of_vert[sets.root(v as u32) as usize];
        }
        Self { of_vert, faces }
    }
}

/// Finds the closed components that face the wrong way; `intersecting` are the pairs of triangles that intersect.
fn check_direction(
    triangles: &TriangleMesh,
    components: &Components,
    intersecting: &[[u32; 2]],
    defects: &mut Defects,
    monitor: &Monitor,
) -> Result<(), Cancelled> {
    /// Volumes below this fraction of the cubed diagonal are flat: their sign is rounding.
    const FLAT: f64 = 1e-12;

    let component = |t: [u32; 3]| components.of_vert[t[0] as usize] as usize;
    let mut closed = vec![true; components.faces.len()];
    for edge in [&defects.border_edges, &defects.nonmanifold_edges, &defects.misoriented_edges].into_iter().flatten() {
        closed[components.of_vert[edge[0] as usize] as usize] = false;
    }
    let mut crossing = vec![false; closed.len()];
    for pair in intersecting {
        let [c, d] = pair.map(|t| component(triangles.triangles[t as usize]));
        if c != d {
            crossing[c] = true;
            crossing[d] = true;
        }
    }
    let mut own: Vec<Vec<u32>> = vec![vec![]; closed.len()];
    let mut bounds = vec![Aabb::EMPTY; closed.len()];
    let mut origins = vec![None; closed.len()];
    let mut volumes = vec![0.0; closed.len()];
    for (t, &verts) in triangles.triangles.iter().enumerate() {
        let (c, points) = (component(verts), triangles.points(t));
        own[c].push(t as u32);
        bounds[c] = bounds[c].union(&Aabb::of(points));
        let origin = *origins[c].get_or_insert(points[0]);
        let [p, q, r] = points.map(|p| p - origin);
        volumes[c] += p.dot(q.cross(r)) / 6.0;
    }
    for c in 0..closed.len() {
        let Some(point) = origins[c] else { continue };
        if !closed[c] || volumes[c].abs() <= FLAT * bounds[c].diagonal().powi(3) || volumes[c].is_nan() {
            continue;
        }
        monitor.check()?;
        let mut depth = 0;
        for d in (0..closed.len()).filter(|&d| d != c && closed[d] && bounds[d].contains(&bounds[c])) {
            let angle: f64 = own[d].iter().map(|&t| solid_angle(triangles.points(t as usize), point)).sum();
            // A closed surface is seen under 4 pi from inside and under 0 from outside.
            depth += usize::from(angle.abs() > TAU);
        }
        let wants_outward = depth % 2 == 0;
        if wants_outward != (volumes[c] > 0.0) && (depth == 0 || !crossing[c]) {
            defects.inside_out_components.push(components.faces[c].clone());
        }
    }
    Ok(())
}

/// Signed solid angle of a triangle seen from a point, in steradians.
///
/// Source: van Oosterom and Strackee, "The solid angle of a plane triangle", 1983.
fn solid_angle(triangle: [DVec3; 3], from: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|p| p - from);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

/// Sets of numbers that only grow together.
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    /// The least number of the set.
    fn root(&mut self, mut x: u32) -> u32 {
        while self.0[x as usize] != x {
            self.0[x as usize] = self.0[self.0[x as usize] as usize];
            x = self.0[x as usize];
        }
        x
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh_of(positions: &[[f64; 3]], faces: &[&[u32]]) -> PolygonMesh {
        PolygonMesh::from_polygons(positions.iter().map(|&p| p.into()).collect(), faces).unwrap()
    }

    fn checked(mesh: &PolygonMesh) -> Defects {
        check(mesh, &Monitor::new()).unwrap()
    }

    /// Cubes with a low corner and a size each; a negative size turns one inside out.
    fn cubes(of: &[(f64, f64)]) -> PolygonMesh {
        const FACES: [[u32; 4]; 6] =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        for &(low, size) in of {
            let first = positions.len() as u32;
            positions.extend((0..8).map(|k| {
                DVec3::splat(low) + DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * size.abs()
            }));
            for face in FACES {
                let mut face = face.map(|v| v + first);
                if size < 0.0 {
                    face.reverse();
                }
                faces.push(face);
            }
        }
        PolygonMesh::from_polygons(positions, faces).unwrap()
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    #[test]
    fn a_cube_is_clean() {
        let defects = checked(&cubes(&[(0.0, 1.0)]));
        assert_eq!(defects, Defects { components: 1, euler: 2, ..Defects::default() });
        assert!(defects.is_clean() && defects.closed() && defects.pure_quad());
    }

    #[test]
    fn an_empty_mesh_has_no_defects() {
        assert_eq!(checked(&PolygonMesh::default()), Defects::default());
    }

    #[test]
    fn every_kind_of_bad_vertex() {
        let mut positions = SQUARE.to_vec();
        positions.extend([[1.0, -0.0, 0.0], [f64::NAN, 0., 0.], [f64::NAN, 0., 0.], [0., 0., f64::INFINITY]]);
        let defects = checked(&mesh_of(&positions, &[&[0, 1, 2, 3], &[4, 5, 7]]));
        assert_eq!(defects.duplicate_verts, [[1, 4]]);
        assert_eq!(defects.nonfinite_verts, [5, 6, 7]);
        assert_eq!(defects.isolated_verts, [6]);
        assert_eq!(defects.components, 2);
    }

    #[test]
    fn every_kind_of_bad_face() {
        let mut positions = SQUARE.to_vec();
        positions.extend([[2., 0., 0.], [3., 0., 0.], [0., 0., 0.]]);
        let faces: &[&[u32]] = &[&[0, 1, 2, 3], &[1, 1, 2], &[0, 1, 4, 5], &[3, 2, 1, 6], &[0, 1, 4, 2, 3], &[0, 6, 4]];
        let defects = checked(&mesh_of(&positions, faces));
        assert_eq!(defects.degenerate_faces, [1]);
        assert_eq!(defects.zero_area_faces, [1, 2, 5]);
        assert_eq!(defects.duplicate_faces, [[0, 3]]);
        assert_eq!((defects.triangles, defects.ngons), (vec![1, 5], vec![4]));
    }

    #[test]
    fn every_kind_of_bad_edge() {
        // Three fins on the edge 0-1, then a square against the direction of the first fin.
        let positions =
            [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.], [-1., 1., 0.], [-1., -1., 0.], [2., 0., 0.5], [2., 0., 1.5]];
        let defects = checked(&mesh_of(&positions, &[&[0, 1, 2], &[1, 0, 3], &[1, 0, 4], &[1, 2, 5, 6]]));
        assert_eq!(defects.nonmanifold_edges, [[0, 1]]);
        assert_eq!(defects.misoriented_edges, [[1, 2]]);
        assert_eq!(defects.border_edges, [[0, 2], [0, 3], [0, 4], [1, 3], [1, 4], [1, 6], [2, 5], [5, 6]]);
        assert!(defects.nonmanifold_verts.is_empty(), "one fan, though it branches");
        assert!(!defects.manifold() && !defects.closed());
    }

    #[test]
    fn a_vertex_between_two_fans() {
        let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [0., -1., 0.]];
        let defects = checked(&mesh_of(&positions, &[&[0, 1, 2], &[0, 3, 4]]));
        assert_eq!(defects.nonmanifold_verts, [0]);
        assert_eq!((defects.components, defects.euler), (1, 1));
        assert!(defects.self_intersecting_faces.is_empty());
    }

    #[test]
    fn components_that_face_inwards_unless_they_bound_a_void() {
        let inside_out = |of| checked(&cubes(of)).inside_out_components;
        assert_eq!(inside_out(&[(0.0, 1.0), (5.0, -1.0)]), [[6, 7, 8, 9, 10, 11]]);
        assert!(inside_out(&[(0.0, 4.0), (1.0, -1.0)]).is_empty(), "a void");
        assert_eq!(inside_out(&[(0.0, -4.0), (1.0, -1.0)]), [[0, 1, 2, 3, 4, 5]]);
        assert_eq!(inside_out(&[(0.0, 4.0), (1.0, 1.0)]), [[6, 7, 8, 9, 10, 11]], "no void");
        assert!(inside_out(&[(0.0, 6.0), (1.0, -4.0), (2.0, 2.0)]).is_empty(), "a body in a void");
        assert_eq!(inside_out(&[(0.0, 6.0), (1.0, -4.0), (2.0, -2.0)]), [[12, 13, 14, 15, 16, 17]]);
        assert!(inside_out(&[(0.0, 3.0), (0.0, 2.0)]).is_empty(), "they touch: that is another defect");
        // In the corner of an L, inside its box but outside of it.
        let l = mesh_of(
            &[
                [0., 0., 0.],
                [4., 0., 0.],
                [4., 1., 0.],
                [1., 1., 0.],
                [1., 4., 0.],
                [0., 4., 0.],
                [0., 0., 4.],
                [4., 0., 4.],
                [4., 1., 4.],
                [1., 1., 4.],
                [1., 4., 4.],
                [0., 4., 4.],
            ],
            &[
                &[0, 3, 2, 1],
                &[0, 5, 4, 3],
                &[6, 7, 8, 9],
                &[6, 9, 10, 11],
                &[0, 1, 7, 6],
                &[1, 2, 8, 7],
                &[2, 3, 9, 8],
                &[3, 4, 10, 9],
                &[4, 5, 11, 10],
                &[5, 0, 6, 11],
            ],
        );
        let cube = cubes(&[(2.0, -1.0)]);
        let shift = l.vertex_count() as u32;
        let faces = l.faces().map(<[u32]>::to_vec).chain(cube.faces().map(|f| f.iter().map(|v| v + shift).collect()));
        let both = PolygonMesh::from_polygons([&l.positions[..], &cube.positions].concat(), faces).unwrap();
        assert_eq!(checked(&both).inside_out_components, [[10, 11, 12, 13, 14, 15]]);
        assert!(checked(&l).is_clean());
    }

    #[test]
    fn cubes_that_cut_each_other() {
        let pairs = checked(&cubes(&[(0.0, 2.0), (1.0, 2.0)])).self_intersecting_faces;
        // The three high faces of the first cube each meet two low faces of the second.
        assert_eq!(pairs, [[1, 8], [1, 10], [3, 6], [3, 10], [5, 6], [5, 8]]);
    }

    #[test]
    fn scale_does_not_matter() {
        let cubes = cubes(&[(0.0, 2.0), (1.0, -2.0), (8.0, 1.0)]);
        let expected = checked(&cubes);
        for exponent in [-1000, -600, 600, 1000] {
            assert_eq!(checked(&cubes.scaled(2f64.powi(exponent))), expected, "2^{exponent}");
        }
    }
}
