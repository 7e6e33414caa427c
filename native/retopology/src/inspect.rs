//! The check of the features that the caller gives. `surface::inspect` checks the mesh.

use crate::failure::{Elements, RetopologizeError};
use crate::features::Features;
use mesh::{PolygonMesh, sorted};
use std::collections::BTreeSet;

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

fn indices(n: usize, is_one: impl Fn(usize) -> bool) -> Vec<u32> {
    (0..n).filter(|&k| is_one(k)).map(|k| k as u32).collect()
}

fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
