//! A smooth cross field aligned with borders and feature edges: `QuadMixer` (Nuvoli et al. 2019), section 3.2.1.
//!
//! A cross is four unit tangents a quarter turn apart. Per face it is the fourth power of a unit complex number in a
//! frame of the face; across an edge the frames differ by the angle the shared edge makes with each. Minimising the
//! weighted squared difference of neighbours is one sparse symmetric solve for cross fields (Knöppel et al., *Globally
//! optimal direction fields*, 2013; the n = 4 special case of the poly-vectors of Diamanti et al. 2014 that the paper names).
//! Faces at a border or feature edge are fixed to that edge, so a corner of any angle needs no special case: each of its
//! edges binds its own face. Without any edge to follow (closed surfaces) the smoothest unit-norm field is the
//! eigenvector of the least eigenvalue, by inverse iteration.
//!
//! Deviation: crosses only, not general poly-vectors, because aligned orthogonal directions are all the tracing reads.

use glam::{DVec2, DVec3};
use mesh::{NONE, Topology, TriangleMesh};
use solve::SolveError;
use solve::cholesky::Factor;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A cross per face and per vertex. A direction stands for itself and its three quarter turns about the normal.
#[derive(Debug, Clone)]
pub struct CrossField {
    /// One unit direction of the cross of each face, in the face's plane.
    pub face_directions: Vec<DVec3>,
    /// One unit direction of the cross of each vertex, orthogonal to its normal; zero for unused vertices.
    pub vertex_directions: Vec<DVec3>,
    /// Unit normal of each vertex, weighted by the angles of its triangles; zero for unused vertices.
    pub vertex_normals: Vec<DVec3>,
    /// Interior vertices round which the cross does not close up, ascending, with the index in quarter turns
    /// (+1 where an irregular vertex of valence 3 belongs, -1 for valence 5).
    pub singularities: Vec<(u32, i32)>,
}

/// Why there is no cross field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CrossFieldError {
    /// A triangle without area has no tangent frame.
    #[error("triangle {triangle} has no area; remesh or collapse it first")]
    Degenerate {
        /// The first such triangle.
        triangle: u32,
    },
    /// A feature names two vertices that no triangle edge joins.
    #[error("feature {feature} is not an edge of the mesh; give pairs of vertices joined by an edge")]
    NoSuchEdge {
        /// Index into the features.
        feature: usize,
    },
    /// A connected component has nothing to follow while others have.
    #[error(
        "the component of triangle {triangle} has neither border nor feature while others have; compute its field separately"
    )]
    Unconstrained {
        /// A triangle of the component.
        triangle: u32,
    },
    /// The factorisation failed.
    #[error("the cross field's equations could not be solved: {0}")]
    Solve(#[from] SolveError),
}

/// Index of a face's unknown, or the value it is fixed to.
#[derive(Clone, Copy)]
enum Cross {
    Free(usize),
    Fixed(DVec2),
}

/// The smoothest cross field aligned with every border edge and with both sides of every feature edge (vertex pairs). The cross of
/// a triangle in `given` is that direction's instead, the mean where there are several.
///
/// Costs one sparse factorisation of twice as many unknowns as there are free faces: about 10 ms for 10,000 faces.
/// The same input gives the same bytes.
///
/// # Errors
/// [`CrossFieldError`]; all of its cases can be read off the input except a failed factorisation.
pub fn cross_field(
    mesh: &TriangleMesh,
    topology: &Topology,
    features: &[[u32; 2]],
    given: &[(u32, DVec3)],
) -> Result<CrossField, CrossFieldError> {
    let faces = mesh.triangles.len();
    let edge_angle = edge_angles(mesh)?;
    // Sum, over the edges a face must follow, of the cross along that edge, weighted by length.
    let mut target: Vec<Option<DVec2>> = vec![None; faces];
    let mut follow = |h: u32| {
        let [a, b] = [topology.from(h), topology.to(h)].map(|v| mesh.positions[v as usize]);
        let aim = target[h as usize / 3].get_or_insert(DVec2::ZERO);
        *aim += a.distance(b) * DVec2::from_angle(4.0 * edge_angle[h as usize]);
    };
    (0..topology.len() as u32).filter(|&h| topology.is_border(h)).for_each(&mut follow);
    for (feature, &[a, b]) in features.iter().enumerate() {
        let inside = |v: u32| (v as usize) < mesh.positions.len();
        let found = (inside(a) && inside(b)).then(|| [topology.find(a, b), topology.find(b, a)]);
        let sides = found.unwrap_or_default();
        if sides == [None; 2] {
            return Err(CrossFieldError::NoSuchEdge { feature });
        }
        // A border edge follows itself already.
        sides.into_iter().flatten().filter(|&h| !topology.is_border(h)).for_each(&mut follow);
    }
    let mut means = BTreeMap::<u32, DVec2>::new();
    for &(face, direction) in given {
        let angle = angle_in_frame(mesh, face as usize, direction);
        // In the units of the edges' crosses.
        *means.entry(face).or_default() += mesh_scale(mesh) * DVec2::from_angle(4.0 * angle);
    }
    for (face, mean) in means {
        target[face as usize] = Some(mean);
    }

    let mut free = 0;
    let crosses: Vec<Cross> = target
        .iter()
        .map(|aim| match aim {
            // Two edges at 45 degrees to each other cancel: such a face follows neither.
            Some(aim) if aim.length() > 1e-9 * mesh_scale(mesh) => Cross::Fixed(aim.normalize()),
            _ => {
                free += 1;
                Cross::Free(free - 1)
            }
        })
        .collect();
    let constrained = free < faces;
    if constrained {
        check_components(topology, &crosses)?;
    }
    let values = solve_crosses(mesh, topology, &edge_angle, &crosses, free, constrained)?;

    let face_angle: Vec<f64> = values.iter().map(|z| z.to_angle() / 4.0).collect();
    let face_directions: Vec<DVec3> = (0..faces)
        .map(|f| {
            let [x, y] = frame(mesh, f);
            face_angle[f].cos() * x + face_angle[f].sin() * y
        })
        .collect();
    let (vertex_directions, vertex_normals) = vertex_crosses(mesh, &face_directions);
    let singularities = singular(mesh, topology, &edge_angle, &face_angle);
    Ok(CrossField { face_directions, vertex_directions, vertex_normals, singularities })
}

/// Interior vertices round which a cross does not close up, as in [`CrossField::singularities`], from one of its directions in each face.
///
/// # Errors
/// [`CrossFieldError::Degenerate`].
pub fn singularities(
    mesh: &TriangleMesh,
    topology: &Topology,
    directions: &[DVec3],
) -> Result<Vec<(u32, i32)>, CrossFieldError> {
    let edge_angle = edge_angles(mesh)?;
    let face_angle: Vec<f64> =
        directions.iter().enumerate().map(|(f, &direction)| angle_in_frame(mesh, f, direction)).collect();
    Ok(singular(mesh, topology, &edge_angle, &face_angle))
}

fn singular(mesh: &TriangleMesh, topology: &Topology, edge_angle: &[f64], face_angle: &[f64]) -> Vec<(u32, i32)> {
    (0..mesh.positions.len() as u32)
        .filter(|&v| topology.outgoing[v as usize] != NONE && !topology.is_border_vertex(v))
        .map(|v| (v, turning(mesh, topology, edge_angle, face_angle, v)))
        .filter(|&(_, index)| index != 0)
        .collect()
}

/// Length that "negligible" is measured against: the first triangle's longest side stands for all.
fn mesh_scale(mesh: &TriangleMesh) -> f64 {
    mesh.triangles.first().map_or(1.0, |_| {
        let [a, b, c] = mesh.points(0);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    })
}

/// Axes of a face's frame in its plane.
fn frame(mesh: &TriangleMesh, face: usize) -> [DVec3; 2] {
    let [a, b, _] = mesh.points(face);
    let x = (b - a).normalize();
    [x, mesh.area_normal(face).normalize().cross(x)]
}

fn angle_in_frame(mesh: &TriangleMesh, face: usize, direction: DVec3) -> f64 {
    let [x, y] = frame(mesh, face);
    direction.dot(y).atan2(direction.dot(x))
}

/// Angle of each half-edge in the frame of its face, whose x axis is the face's first half-edge.
fn edge_angles(mesh: &TriangleMesh) -> Result<Vec<f64>, CrossFieldError> {
    let mut angles = Vec::with_capacity(3 * mesh.triangles.len());
    for f in 0..mesh.triangles.len() {
        let p = mesh.points(f);
        let normal = mesh.area_normal(f).normalize_or_zero();
        if normal == DVec3::ZERO {
            return Err(CrossFieldError::Degenerate { triangle: f as u32 });
        }
        let x = (p[1] - p[0]).normalize();
        let y = normal.cross(x);
        for k in 0..3 {
            let edge = p[(k + 1) % 3] - p[k];
            angles.push(edge.dot(y).atan2(edge.dot(x)));
        }
    }
    Ok(angles)
}

/// Every component must hold a fixed face, or its block of the matrix has no unique solution.
fn check_components(topology: &Topology, crosses: &[Cross]) -> Result<(), CrossFieldError> {
    let mut reached: Vec<bool> = crosses.iter().map(|cross| matches!(cross, Cross::Fixed(_))).collect();
    let mut stack: Vec<usize> = (0..crosses.len()).filter(|&f| reached[f]).collect();
    while let Some(f) = stack.pop() {
        for h in 3 * f..3 * f + 3 {
            let twin = topology.twin[h];
            if twin != NONE && !reached[twin as usize / 3] {
                reached[twin as usize / 3] = true;
                stack.push(twin as usize / 3);
            }
        }
    }
    match reached.iter().position(|&seen| !seen) {
        Some(f) => Err(CrossFieldError::Unconstrained { triangle: f as u32 }),
        None => Ok(()),
    }
}

/// Minimises the sum over edges of `w |z_f - r z_g|^2`, `r` the turn from g's frame to f's raised to the fourth power.
fn solve_crosses(
    mesh: &TriangleMesh,
    topology: &Topology,
    edge_angle: &[f64],
    crosses: &[Cross],
    free: usize,
    constrained: bool,
) -> Result<Vec<DVec2>, CrossFieldError> {
    let mut triplets = Vec::with_capacity(14 * free);
    let mut right = vec![0.0; 2 * free];
    for h in topology.edges().filter(|&h| !topology.is_border(h)) {
        let twin = topology.twin[h as usize];
        let (f, g) = (h as usize / 3, twin as usize / 3);
        // Weight of the dual edge for linear elements on an equilateral mesh: |e|^2 over a third of both areas.
        let length = mesh.positions[topology.from(h) as usize].distance(mesh.positions[topology.to(h) as usize]);
        let weight = 6.0 * length * length / (mesh.area_normal(f).length() + mesh.area_normal(g).length());
        // The twin runs the other way; half a turn vanishes in the fourth power.
        let turn = DVec2::from_angle(4.0 * (edge_angle[h as usize] - edge_angle[twin as usize]));
        for (cross, other, turn) in [(f, g, turn), (g, f, DVec2::new(turn.x, -turn.y))] {
            let Cross::Free(i) = crosses[cross] else {
                continue;
            };
            triplets.extend([(2 * i, 2 * i, weight), (2 * i + 1, 2 * i + 1, weight)]);
            match crosses[other] {
                Cross::Fixed(value) => {
                    let moved = weight * turn.rotate(value);
                    right[2 * i] += moved.x;
                    right[2 * i + 1] += moved.y;
                }
                Cross::Free(j) if j < i => triplets.extend([
                    (2 * i, 2 * j, -weight * turn.x),
                    (2 * i, 2 * j + 1, weight * turn.y),
                    (2 * i + 1, 2 * j, -weight * turn.y),
                    (2 * i + 1, 2 * j + 1, -weight * turn.x),
                ]),
                Cross::Free(_) => {}
            }
        }
    }
    if free > 0 && constrained {
        Factor::new(2 * free, &triplets)?.solve(&mut right)?;
    } else if free > 0 {
        right = smoothest(free, &mut triplets)?;
    }
    Ok(crosses
        .iter()
        .map(|&cross| match cross {
            Cross::Fixed(value) => value,
            // A cross that vanishes is a singularity inside the face: any direction is as good as another there.
            Cross::Free(i) => DVec2::new(right[2 * i], right[2 * i + 1]).try_normalize().unwrap_or(DVec2::X),
        })
        .collect())
}

/// Eigenvector of the least eigenvalue of the matrix given by its lower triangle, from a fixed start.
fn smoothest(free: usize, triplets: &mut Vec<(usize, usize, f64)>) -> Result<Vec<f64>, SolveError> {
    let trace: f64 = triplets.iter().filter(|t| t.0 == t.1).map(|t| t.2).sum();
    // A flat torus has a parallel field, hence a zero eigenvalue: the shift keeps the matrix definite.
    let shift = 1e-9 * trace / (2 * free) as f64;
    triplets.extend((0..2 * free).map(|i| (i, i, shift)));
    let factor = Factor::new(2 * free, triplets)?;
    // Any start that is not orthogonal to the answer will do; this one has no symmetry a mesh could share.
    let mut x: Vec<f64> = (0..2 * free).map(|i| (1.0 + (i as f64 * 0.618_033_988_75).fract()).sin() - 0.3).collect();
    for _ in 0..60 {
        factor.solve(&mut x)?;
        let norm = x.iter().map(|value| value * value).sum::<f64>().sqrt();
        for value in &mut x {
            *value /= norm;
        }
    }
    Ok(x)
}

/// Crosses of vertices: those of their faces, turned into the tangent plane by the least rotation and averaged as fourth
/// powers with the corner angles as weights.
fn vertex_crosses(mesh: &TriangleMesh, face_directions: &[DVec3]) -> (Vec<DVec3>, Vec<DVec3>) {
    let corner_angle = |f: usize, k: usize| {
        let p = mesh.points(f);
        (p[(k + 1) % 3] - p[k]).angle_between(p[(k + 2) % 3] - p[k])
    };
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for (f, triangle) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            normals[triangle[k] as usize] += corner_angle(f, k) * mesh.area_normal(f).normalize();
        }
    }
    for normal in &mut normals {
        *normal = normal.normalize_or_zero();
    }
    let mut powers = vec![DVec2::ZERO; mesh.positions.len()];
    for (f, triangle) in mesh.triangles.iter().enumerate() {
        let face_normal = mesh.area_normal(f).normalize();
        for k in 0..3 {
            let normal = normals[triangle[k] as usize];
            if normal == DVec3::ZERO {
                continue;
            }
            let direction = glam::DQuat::from_rotation_arc(face_normal, normal) * face_directions[f];
            let (x, y) = normal.any_orthonormal_pair();
            let angle = direction.dot(y).atan2(direction.dot(x));
            powers[triangle[k] as usize] += corner_angle(f, k) * DVec2::from_angle(4.0 * angle);
        }
    }
    let directions = normals
        .iter()
        .zip(&powers)
        .map(|(&normal, power)| {
            if normal == DVec3::ZERO {
                return DVec3::ZERO;
            }
            let (x, y) = normal.any_orthonormal_pair();
            let angle = power.to_angle() / 4.0;
            angle.cos() * x + angle.sin() * y
        })
        .collect();
    (directions, normals)
}

/// Index of the field at an interior vertex in quarter turns: how far the cross turns against a direction carried round
/// the vertex, plus the angle the surface itself lacks there.
fn turning(mesh: &TriangleMesh, topology: &Topology, edge_angle: &[f64], face_angle: &[f64], v: u32) -> i32 {
    let mut turned = 0.0;
    let mut angles = 0.0;
    for h in topology.around(v) {
        let before = topology.prev[h as usize];
        let twin = topology.twin[before as usize];
        let [at, to, back] = [v, topology.to(h), topology.from(before)].map(|u| mesh.positions[u as usize]);
        angles += (to - at).angle_between(back - at);
        // Cross relative to the shared edge on either side of it.
        let here = face_angle[h as usize / 3] - edge_angle[before as usize];
        let there = face_angle[twin as usize / 3] - edge_angle[twin as usize];
        turned += wrap_quarter(there - here);
    }
    ((turned + TAU - angles) / FRAC_PI_2).round() as i32
}

/// The angle in [-45, 45] degrees that differs by quarter turns.
pub(crate) fn wrap_quarter(angle: f64) -> f64 {
    angle - FRAC_PI_2 * (angle / FRAC_PI_2).round()
}

#[cfg(test)]
#[path = "cross_field_tests.rs"]
mod tests;
