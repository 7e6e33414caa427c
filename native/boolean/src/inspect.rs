//! Inspection of the inputs: the quad boolean takes closed, manifold, outward-facing, pure-quad meshes, and says of
//! anything else what is wrong and where.

use crate::{BooleanError, Elements, Options};
use mesh::{Aabb, Defects, Monitor, PolygonMesh, check};

/// A mesh smaller than this part of the largest coordinate has too few floating-point steps across it.
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

/// Checks input `input` (0 for A, 1 for B). `unit` brings the largest coordinate of both inputs to about 1.
///
/// # Errors
/// [`BooleanError::Invalid`] for the first of: empty, non-finite coordinates, too small beside its coordinates or the other
/// input's, faces that are not quads, degenerate or duplicate faces, non-manifold, open or misoriented edges, non-manifold
/// vertices, zero-area faces, inside-out components, self-intersections. [`BooleanError::Cancelled`].
pub fn inspect(mesh: &PolygonMesh, input: usize, unit: f64, monitor: &Monitor) -> Result<(), BooleanError> {
    let refuse = |code, sentence: String, kind: &'static str, elements: Vec<u32>| {
        Err(BooleanError::Invalid { input, code, sentence, elements: Elements::from([(kind, elements)]) })
    };
    if mesh.face_count() == 0 {
        return refuse("empty", "has no faces; choose an object with a closed quad surface".into(), "faces", vec![]);
    }
    let defects = check(mesh, monitor)?;
    let Defects { nonfinite_verts, triangles, ngons, .. } = &defects;
    if !nonfinite_verts.is_empty() {
        let sentence = format!(
            "has {} with a coordinate that is not a number or infinite; delete or move them",
            count(nonfinite_verts.len(), "vertex", "vertices")
        );
        return refuse("not_finite", sentence, "verts", nonfinite_verts.clone());
    }
    let corners = mesh.corner_verts().iter().map(|&v| unit * mesh.positions[v as usize]);
    if Aabb::of(corners).diagonal() <= SMALLEST_PART {
        let all = (0..mesh.vertex_count() as u32).collect();
        let sentence = "is too small to tell its vertices apart, so far from the origin or beside so large an object; move both objects to the origin or scale it up";
        return refuse("too_small", sentence.into(), "verts", all);
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
            format!(
                "has {} that face the wrong way; flip their normals, or delete them where they lie inside another part",
                faces(inside_out.len())
            ),
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
