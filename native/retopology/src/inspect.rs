//! The check of what the caller gives: every fault named by elements of the polygon mesh, before it becomes triangles.

use crate::failure::{Elements, RetopologizeError};
use crate::features::Features;
use mesh::{Aabb, DVec3, PolygonMesh, Topology, face_normal, sorted};
use std::collections::BTreeSet;

/// A mesh smaller than this part of its largest coordinate has too few floating-point steps across it.
const SMALLEST_PART: f64 = 1e-9;
/// A surface with less area than this, as a part of its squared diagonal, is a line or a point.
const LEAST_AREA: f64 = 1e-12;

/// Checks that the mesh is an oriented manifold, open or closed, of any number of components, with any faces. Vertices
/// without a face, single faces without area and self-intersections are allowed. O(n log n).
///
/// # Errors
/// [`RetopologizeError::Invalid`] for the first of: no faces, positions that are no numbers, too small beside its
/// coordinates, faces that name a vertex twice, doubled faces, edges of more than two faces, neighbours that face opposite
/// ways, vertices where sheets touch, no area at all.
pub(crate) fn inspect(mesh: &PolygonMesh) -> Result<(), RetopologizeError> {
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

fn inspect_edges(mesh: &PolygonMesh) -> Result<(), RetopologizeError> {
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

/// Checks that the features are edges and vertices of faces, each edge given once. Returns the edges, lower vertex first.
///
/// # Errors
/// [`RetopologizeError::Feature`] with the positions in the lists given.
pub(crate) fn inspect_features(
    mesh: &PolygonMesh,
    features: &Features,
) -> Result<BTreeSet<[u32; 2]>, RetopologizeError> {
    let edges = edges_of(mesh);
    let wrong = |code, sentence: String, kind: &'static str, at: Vec<u32>| {
        Err(RetopologizeError::Feature { code, sentence, elements: Elements::from([(kind, at)]) })
    };
    let strange = indices(features.edges.len(), |k| {
        edges.binary_search(&sorted(features.edges[k][0], features.edges[k][1])).is_err()
    });
    if let Some(&first) = strange.first() {
        let [a, b] = features.edges[first as usize];
        let sentence = format!(
            "feature_edges holds {} of vertices that no edge of a face joins, the first at position {first}: {a} and {b}; mark edges of the surface only",
            count(strange.len(), "pair", "pairs")
        );
        return wrong("feature_not_edge", sentence, "features", strange);
    }
    let mut marked = BTreeSet::new();
    let repeated = {
        let mut again = Vec::new();
        for (k, &[a, b]) in features.edges.iter().enumerate() {
            if !marked.insert(sorted(a, b)) {
                again.push(k as u32);
            }
        }
        again
    };
    if let Some(&first) = repeated.first() {
        let [a, b] = features.edges[first as usize];
        let sentence = format!(
            "feature_edges holds {} that came before, the first at position {first}: {a} and {b}; list each edge once, in one direction",
            count(repeated.len(), "pair", "pairs")
        );
        return wrong("feature_repeated", sentence, "features", repeated);
    }
    let mut used = vec![false; mesh.vertex_count()];
    mesh.corner_verts().iter().for_each(|&v| used[v as usize] = true);
    let loose =
        indices(features.vertices.len(), |k| !used.get(features.vertices[k] as usize).copied().unwrap_or(false));
    if let Some(&first) = loose.first() {
        let sentence = format!(
            "feature_verts holds {} of no face, the first at position {first}: {}; mark vertices of the surface only",
            count(loose.len(), "vertex", "vertices"),
            features.vertices[first as usize]
        );
        return wrong("feature_not_vertex", sentence, "feature_verts", loose);
    }
    Ok(marked)
}

/// The edges of all faces, lower vertex first, ascending.
pub(crate) fn edges_of(mesh: &PolygonMesh) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> =
        mesh.faces().flat_map(|face| (0..face.len()).map(|k| sorted(face[k], face[(k + 1) % face.len()]))).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn refuse(
    code: &'static str,
    sentence: String,
    kind: &'static str,
    elements: Vec<u32>,
) -> Result<(), RetopologizeError> {
    Err(RetopologizeError::Invalid { code, sentence, elements: Elements::from([(kind, elements)]) })
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
