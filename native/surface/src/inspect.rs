//! Whether a polygon mesh is a surface that can be worked on: every fault named by elements of the polygon mesh, before it
//! becomes triangles.

use mesh::{Aabb, DVec3, PolygonMesh, Topology, face_normal, sorted};

/// A mesh smaller than this part of its largest coordinate has too few floating-point steps across it.
const SMALLEST_PART: f64 = 1e-9;
/// A surface with less area than this, as a part of its squared diagonal, is a line or a point.
const LEAST_AREA: f64 = 1e-12;

/// Why a mesh is no surface, and which of its elements to look at.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the mesh {sentence}")]
pub struct Fault {
    /// Stable identifier, such as `non_manifold`.
    pub code: &'static str,
    /// What is wrong and how to mend it.
    pub sentence: String,
    /// `"faces"`, `"edges"` or `"verts"`.
    pub kind: &'static str,
    /// Indices of those; edges as flat vertex pairs.
    pub elements: Vec<u32>,
}

/// Checks that the mesh is an oriented surface, open or closed, of any number of components, with any faces. Vertices without a
/// face, vertices where sheets touch, single faces without area and self-intersections are allowed. O(n log n).
///
/// # Errors
/// The first of: no faces, positions that are no numbers, too small beside its coordinates, faces that name a vertex twice,
/// doubled faces, edges of more than two faces, neighbours that face opposite ways, no area at all.
pub fn inspect(mesh: &PolygonMesh) -> Result<(), Fault> {
    if mesh.face_count() == 0 {
        return refuse("empty", "has no faces; choose an object with a surface".into(), "faces", vec![]);
    }
    let bad: Vec<u32> = indices(mesh.vertex_count(), |v| !mesh.positions[v].is_finite());
    if !bad.is_empty() {
        let sentence = format!(
            "has {} with a coordinate that is not a number or infinite; delete or move them",
            count(bad.len(), "vertex", "vertices")
        );
        return refuse("not_finite", sentence, "verts", bad);
    }
    let used = || mesh.corner_verts().iter().map(|&v| mesh.positions[v as usize]);
    let largest = used().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    // Halved first: the box of a huge mesh may be wider than the largest number.
    let diagonal = 2.0 * Aabb::of(used().map(|p| p / 2.0)).diagonal();
    if diagonal <= SMALLEST_PART * largest || diagonal == 0.0 {
        let sentence =
            "is too small to tell its vertices apart, so far from the origin; move it to the origin or scale it up";
        return refuse("too_small", sentence.into(), "verts", (0..mesh.vertex_count() as u32).collect());
    }
    let sorted_corners: Vec<Vec<u32>> = mesh
        .faces()
        .map(|face| {
            let mut corners = face.to_vec();
            corners.sort_unstable();
            corners
        })
        .collect();
    let degenerate = indices(mesh.face_count(), |f| sorted_corners[f].windows(2).any(|w| w[0] == w[1]));
    if !degenerate.is_empty() {
        let sentence =
            format!("has {} that name a vertex twice; delete them and close the gap", faces(degenerate.len()));
        return refuse("degenerate", sentence, "faces", degenerate);
    }
    let mut order: Vec<u32> = (0..mesh.face_count() as u32).collect();
    order.sort_by(|&a, &b| sorted_corners[a as usize].cmp(&sorted_corners[b as usize]).then(a.cmp(&b)));
    let mut doubles: Vec<u32> = order
        .windows(2)
        .filter(|w| sorted_corners[w[0] as usize] == sorted_corners[w[1] as usize])
        .map(|w| w[1])
        .collect();
    if !doubles.is_empty() {
        doubles.sort_unstable();
        let sentence = format!("has {} with the same corners as another; delete the doubles", faces(doubles.len()));
        return refuse("duplicate", sentence, "faces", doubles);
    }
    inspect_edges(mesh)?;
    let centre = Aabb::of(used().map(|p| p / 2.0)).centre() * 2.0;
    let flat = |f: usize| {
        let p: Vec<DVec3> = mesh.face_points(f).map(|p| (p - centre) / diagonal).collect();
        face_normal(&p) == DVec3::ZERO
            || (1..p.len() - 1).map(|k| (p[k] - p[0]).cross(p[k + 1] - p[0]).length()).sum::<f64>() <= LEAST_AREA
    };
    if (0..mesh.face_count()).all(flat) {
        let all = (0..mesh.face_count() as u32).collect();
        return refuse(
            "zero_area",
            "has no area: all its faces lie on a line or in a point; choose an object with a surface".into(),
            "faces",
            all,
        );
    }
    Ok(())
}

/// Checks that no two sheets touch in a vertex, in a mesh that [`inspect`] let pass. O(n).
///
/// # Errors
/// The vertices where they do.
pub fn inspect_vertices(mesh: &PolygonMesh) -> Result<(), Fault> {
    let topology = Topology::of(mesh);
    let mut uses = vec![0_usize; mesh.vertex_count()];
    mesh.corner_verts().iter().for_each(|&v| uses[v as usize] += 1);
    let split = indices(uses.len(), |v| topology.around(v as u32).take(uses[v] + 1).count() != uses[v]);
    if !split.is_empty() {
        let sentence = format!(
            "touches itself at {}; separate the parts that meet there",
            count(split.len(), "vertex", "vertices")
        );
        return refuse("non_manifold_vertex", sentence, "verts", split);
    }
    Ok(())
}

fn inspect_edges(mesh: &PolygonMesh) -> Result<(), Fault> {
    // Each side of a face: the edge, and whether the face runs along it upwards.
    let mut sides: Vec<([u32; 2], bool)> = mesh
        .faces()
        .flat_map(|face| (0..face.len()).map(|k| (face[k], face[(k + 1) % face.len()])))
        .map(|(a, b)| (sorted(a, b), a < b))
        .collect();
    sides.sort_unstable();
    let (mut crowded, mut opposed) = (Vec::new(), Vec::new());
    for edge in sides.chunk_by(|a, b| a.0 == b.0) {
        match edge {
            [a, b] if a.1 == b.1 => opposed.extend(a.0),
            [_] | [_, _] => {}
            _ => crowded.extend(edge[0].0),
        }
    }
    let edges = |flat: &[u32]| count(flat.len() / 2, "edge", "edges");
    if !crowded.is_empty() {
        let sentence =
            format!("has {} shared by more than two faces; separate the parts that meet there", edges(&crowded));
        return refuse("non_manifold", sentence, "edges", crowded);
    }
    if !opposed.is_empty() {
        let sentence = format!(
            "has {} where neighbouring faces point opposite ways; recalculate the normals (a Möbius strip has none)",
            edges(&opposed)
        );
        return refuse("misoriented", sentence, "edges", opposed);
    }
    Ok(())
}

fn refuse(code: &'static str, sentence: String, kind: &'static str, elements: Vec<u32>) -> Result<(), Fault> {
    Err(Fault { code, sentence, kind, elements })
}

fn indices(n: usize, is_one: impl Fn(usize) -> bool) -> Vec<u32> {
    (0..n).filter(|&k| is_one(k)).map(|k| k as u32).collect()
}

fn faces(n: usize) -> String {
    count(n, "face", "faces")
}

fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
