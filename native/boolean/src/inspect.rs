//! Inspection of the inputs: the quad boolean takes closed, manifold, outward-facing, pure-quad meshes, and says of
//! anything else what is wrong and where.

use crate::{BooleanError, Elements, Options};
use mesh::{Defects, Monitor, PolygonMesh, check};

/// Coordinates beyond this overflow when lengths are squared, scene units.
const LARGEST_COORDINATE: f64 = 1e100;

/// A mesh smaller than this part of its distance from the origin has too few floating-point steps across it.
const SMALLEST_PART: f64 = 1e-9;

impl Options {
    /// Checks ranges.
    ///
    /// # Errors
    /// [`BooleanError::Option`] names the option and its range.
    pub fn check(&self) -> Result<(), BooleanError> {
        let ranges = [
            ("retraction_distance", self.retraction_distance, 0.0..=10.0, "edge lengths"),
            ("alpha", self.alpha, 0.001..=0.999, "of the weight"),
            ("blend_radius", self.blend_radius, 0.0..=f64::MAX, "scene units"),
            ("sharp_angle", self.sharp_angle, 0.0..=std::f64::consts::PI, "radians"),
        ];
        for (name, value, range, unit) in ranges {
            if !range.contains(&value) {
                let most = if *range.end() == f64::MAX { "any".to_owned() } else { range.end().to_string() };
                return Err(BooleanError::Option(format!(
                    "{name} is {value}, but it must lie between {} and {most} ({unit})",
                    range.start(),
                )));
            }
        }
        Ok(())
    }
}

/// Checks input `input` (0 for A, 1 for B).
///
/// # Errors
/// [`BooleanError::Invalid`] for the first of: empty, non-finite or huge coordinates, faces that are not quads,
/// degenerate, duplicate or zero-area faces, open or non-manifold or misoriented edges, non-manifold vertices,
/// inside-out components, self-intersections. [`BooleanError::Cancelled`].
pub fn inspect(mesh: &PolygonMesh, input: usize, monitor: &Monitor) -> Result<(), BooleanError> {
    let refuse = |code, sentence: String, kind: &'static str, elements: Vec<u32>| {
        Err(BooleanError::Invalid { input, code, sentence, elements: Elements::from([(kind, elements)]) })
    };
    if mesh.face_count() == 0 {
        return refuse("empty", "has no faces; choose an object with a closed quad surface".into(), "faces", vec![]);
    }
    let largest = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let defects = check(mesh, monitor)?;
    let Defects { nonfinite_verts, triangles, ngons, .. } = &defects;
    if !nonfinite_verts.is_empty() {
        let sentence = format!(
            "has {} with a coordinate that is not a number or infinite; delete or move them",
            count(nonfinite_verts.len(), "vertex", "vertices")
        );
        return refuse("not_finite", sentence, "verts", nonfinite_verts.clone());
    }
    if largest > LARGEST_COORDINATE {
        let far = (0..mesh.vertex_count() as u32)
            .filter(|&v| mesh.positions[v as usize].abs().max_element() > LARGEST_COORDINATE);
        return refuse(
            "too_large",
            format!("has coordinates beyond {LARGEST_COORDINATE:e}; scale it down"),
            "verts",
            far.collect(),
        );
    }
    if mesh.diagonal() <= SMALLEST_PART * largest {
        let all = (0..mesh.vertex_count() as u32).collect();
        return refuse("too_small", "is too small for its distance from the origin to tell its vertices apart; move both objects near the origin".into(), "verts", all);
    }
    let faces = |n| count(n, "face", "faces");
    let edges = |n| count(n, "edge", "edges");
    let pairs = |list: &[[u32; 2]]| list.as_flattened().to_vec();
    let second = |list: &[[u32; 2]]| list.iter().map(|p| p[1]).collect::<Vec<_>>();
    if !triangles.is_empty() || !ngons.is_empty() {
        let mut others = triangles.clone();
        others.extend(ngons);
        others.sort_unstable();
        let sentence = format!(
            "has {} that are not quads ({} triangles, {} n-gons); make them quads or subdivide once",
            faces(others.len()),
            triangles.len(),
            ngons.len()
        );
        return refuse("not_quads", sentence, "faces", others);
    }
    if !defects.degenerate_faces.is_empty() {
        let sentence = format!(
            "has {} that name a vertex twice; delete them and close the gap",
            faces(defects.degenerate_faces.len())
        );
        return refuse("degenerate", sentence, "faces", defects.degenerate_faces);
    }
    if !defects.duplicate_faces.is_empty() {
        let sentence =
            format!("has {} that lie exactly on another; delete the doubles", faces(defects.duplicate_faces.len()));
        return refuse("duplicate", sentence, "faces", second(&defects.duplicate_faces));
    }
    if !defects.nonmanifold_edges.is_empty() {
        let sentence = format!(
            "has {} shared by more than two faces; separate the parts that meet there",
            edges(defects.nonmanifold_edges.len())
        );
        return refuse("non_manifold", sentence, "edges", pairs(&defects.nonmanifold_edges));
    }
    if !defects.border_edges.is_empty() {
        let sentence =
            format!("is open at {}; fill the holes or merge vertices by distance", edges(defects.border_edges.len()));
        return refuse("open", sentence, "edges", pairs(&defects.border_edges));
    }
    if !defects.misoriented_edges.is_empty() {
        let sentence = format!(
            "has {} where neighbouring faces point opposite ways; recalculate the normals",
            edges(defects.misoriented_edges.len())
        );
        return refuse("misoriented", sentence, "edges", pairs(&defects.misoriented_edges));
    }
    if !defects.nonmanifold_verts.is_empty() {
        let sentence = format!(
            "touches itself at {}; separate the parts that meet there",
            count(defects.nonmanifold_verts.len(), "vertex", "vertices")
        );
        return refuse("non_manifold_vertex", sentence, "verts", defects.nonmanifold_verts);
    }
    if !defects.zero_area_faces.is_empty() {
        let sentence = format!(
            "has {} without area; dissolve them or move their vertices apart",
            faces(defects.zero_area_faces.len())
        );
        return refuse("zero_area", sentence, "faces", defects.zero_area_faces);
    }
    if !defects.inside_out_components.is_empty() {
        let inside_out = defects.inside_out_components.concat();
        return refuse(
            "inside_out",
            format!("is inside out ({}); flip the normals", faces(inside_out.len())),
            "faces",
            inside_out,
        );
    }
    if !defects.self_intersecting_faces.is_empty() {
        let mut both = pairs(&defects.self_intersecting_faces);
        both.sort_unstable();
        both.dedup();
        let sentence = format!("has {} that intersect each other; move them apart", faces(both.len()));
        return refuse("self_intersecting", sentence, "faces", both);
    }
    Ok(())
}

/// Checks that marked edges name vertices of input `input`.
///
/// # Errors
/// [`BooleanError::Option`].
pub fn inspect_features(mesh: &PolygonMesh, edges: &[[u32; 2]], input: usize) -> Result<(), BooleanError> {
    match edges.iter().position(|e| e.iter().any(|&v| v as usize >= mesh.vertex_count())) {
        None => Ok(()),
        Some(k) => Err(BooleanError::Option(format!(
            "feature_edges of {} name vertex {} in edge {k}, but there are {} vertices",
            ["A", "B"][input],
            edges[k][0].max(edges[k][1]),
            mesh.vertex_count()
        ))),
    }
}

fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
