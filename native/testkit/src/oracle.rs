//! Slow and plain measures of a mesh, from the definitions.

use mesh::{DVec3, PolygonMesh};
use std::collections::{BTreeMap, BTreeSet};

/// Euler characteristic: used vertices - edges + faces. A side from a vertex to itself is no edge.
pub fn euler(mesh: &PolygonMesh) -> i64 {
    let verts: BTreeSet<u32> = mesh.corner_verts().iter().copied().collect();
    let edges: BTreeSet<[u32; 2]> = sides(mesh).filter(|(a, b)| a != b).map(|(a, b)| [a.min(b), a.max(b)]).collect();
    verts.len() as i64 - edges.len() as i64 + mesh.face_count() as i64
}

/// Number of components; faces that share a vertex belong together.
pub fn components(mesh: &PolygonMesh) -> usize {
    let mut neighbours = BTreeMap::<u32, Vec<u32>>::new();
    for (a, b) in sides(mesh) {
        neighbours.entry(a).or_default().push(b);
        neighbours.entry(b).or_default().push(a);
    }
    let mut count = 0;
    while let Some((_, reached)) = neighbours.pop_first() {
        count += 1;
        let mut open = reached;
        while let Some(v) = open.pop() {
            open.extend(neighbours.remove(&v).into_iter().flatten());
        }
    }
    count
}

/// `Ok` when no face names a vertex twice, each side of a face has one partner of opposite direction, and the faces round each vertex form one ring.
///
/// # Errors
/// A sentence about the first place where this fails.
pub fn closed_manifold(mesh: &PolygonMesh) -> Result<(), String> {
    let mut count = BTreeMap::<(u32, u32), usize>::new();
    sides(mesh).for_each(|side| *count.entry(side).or_default() += 1);
    for (&(a, b), &n) in &count {
        let back = count.get(&(b, a)).copied().unwrap_or(0);
        if a == b || n != 1 || back != 1 {
            return Err(format!("edge {a}-{b} has {n} faces along it and {back} against it"));
        }
    }
    for (f, face) in mesh.faces().enumerate() {
        if face.iter().collect::<std::collections::BTreeSet<_>>().len() != face.len() {
            return Err(format!("face {f} names a vertex twice"));
        }
    }
    // Round each vertex, the vertex before it in a face leads to the vertex after it.
    let mut round = BTreeMap::<u32, BTreeMap<u32, u32>>::new();
    for face in mesh.faces() {
        for k in 0..face.len() {
            let (before, after) = (face[(k + face.len() - 1) % face.len()], face[(k + 1) % face.len()]);
            round.entry(face[k]).or_default().insert(before, after);
        }
    }
    for (v, steps) in round {
        let start = steps.keys().next().copied();
        let walk = std::iter::successors(start, |at| steps.get(at).copied().filter(|&next| Some(next) != start));
        let ring = walk.take(steps.len() + 1).count();
        if ring != steps.len() {
            return Err(format!("vertex {v} has {} faces, of which {ring} form a ring", steps.len()));
        }
    }
    Ok(())
}

/// Enclosed volume, cubic scene units, by the divergence theorem: positive when the faces look outwards. A face that is
/// not plane counts as the fan from its centre.
pub fn volume(mesh: &PolygonMesh) -> f64 {
    let mut sum = 0.0;
    for f in 0..mesh.face_count() {
        let points: Vec<DVec3> = mesh.face_points(f).collect();
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        for k in 0..points.len() {
            sum += centre.dot(points[k].cross(points[(k + 1) % points.len()]));
        }
    }
    sum / 6.0
}

/// Area of a mesh, square scene units, with faces as in [`volume`].
pub fn area(mesh: &PolygonMesh) -> f64 {
    let mut sum = 0.0;
    for f in 0..mesh.face_count() {
        let points: Vec<DVec3> = mesh.face_points(f).collect();
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        for k in 0..points.len() {
            sum += (points[k] - centre).cross(points[(k + 1) % points.len()] - centre).length() / 2.0;
        }
    }
    sum
}

/// The directed sides of all faces.
fn sides(mesh: &PolygonMesh) -> impl Iterator<Item = (u32, u32)> + '_ {
    mesh.faces().flat_map(|face| (0..face.len()).map(|k| (face[k], face[(k + 1) % face.len()])))
}
