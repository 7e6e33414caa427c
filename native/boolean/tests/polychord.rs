//! A band whose pieces have odd borders (`QuadMixer`, section 3.4, Fig. 12): a torus of pentagonal section with a block over
//! a stretch of it. Each end of the stretch leaves a ring of five edges, which no choice of counts on the curve makes even.

use boolean::{Operation, Options, Output, boolean};
use mesh::{DVec3, Monitor, PolygonMesh};
use std::collections::BTreeMap;
use testkit::{oracle, shapes};

fn pair() -> [PolygonMesh; 2] {
    let torus = shapes::torus(2.0, 0.3, 48, 5);
    let block = shapes::cuboid(DVec3::new(1.4, 2.0, 1.4), 10);
    [torus, shapes::transformed(&block, glam::DMat3::from_rotation_z(0.1), DVec3::new(2.0, 0.02, 0.03))]
}

/// Input faces (mesh, face) that came back as pieces, and how many: a new face is a piece when every corner of it is a
/// corner, a middle or the centre of one input face, and at least one is a corner.
fn split_faces(inputs: &[PolygonMesh; 2], output: &Output) -> BTreeMap<(u8, u32), usize> {
    let mut pieces = BTreeMap::new();
    for f in (0..output.mesh.face_count()).filter(|&f| output.face_source[f][0] < 0) {
        let sources = &output.corner_source[output.mesh.face_corners(f)];
        let (m, face) = (sources[0].mesh, sources[0].face);
        let is_piece = sources.iter().zip(output.mesh.face_points(f)).all(|(s, p)| {
            let simple = s.weights.iter().all(|w| [0.0, 0.25, 0.5, 1.0].contains(w));
            let corners = inputs[m as usize].face_points(face as usize);
            let there: DVec3 = corners.zip(s.weights).map(|(corner, w)| w * corner).sum();
            (s.mesh, s.face) == (m, face) && simple && there.distance(p) < 1e-12
        });
        if is_piece && sources.iter().any(|s| s.weights.contains(&1.0)) {
            *pieces.entry((m, face)).or_default() += 1;
        }
    }
    // A new quad of the band may lie on half a quad by chance; a split quad gives both halves.
    pieces.retain(|_, n| *n > 1);
    pieces
}

#[test]
fn a_strip_between_odd_pieces_is_split_and_all_is_quads() {
    let inputs = pair();
    for (operation, euler) in [(Operation::Union, 0), (Operation::Difference, 2)] {
        let output =
            boolean(&inputs[0], &inputs[1], operation, &Options::default(), &Monitor::new()).expect("a result");
        assert!(output.mesh.is_pure_quad());
        assert_eq!(oracle::closed_manifold(&output.mesh), Ok(()));
        assert_eq!(oracle::euler(&output.mesh), euler);
        assert_eq!((&output.report.retries[..], &output.report.warnings[..]), (&[][..], &[][..]), "{operation:?}");

        // One strip: halves, each beside the next one, with two ends.
        let pieces = split_faces(&inputs, &output);
        assert!(!pieces.is_empty() && pieces.values().all(|&n| n == 2), "{operation:?}: {pieces:?}");
        let (m, _) = *pieces.first_key_value().expect("not empty").0;
        assert!(pieces.keys().all(|&(n, _)| n == m));
        let mesh = &inputs[m as usize];
        let beside =
            |f: u32, g: u32| mesh.face(f as usize).iter().filter(|v| mesh.face(g as usize).contains(v)).count() == 2;
        let neighbours: Vec<usize> =
            pieces.keys().map(|&(_, f)| pieces.keys().filter(|&&(_, g)| f != g && beside(f, g)).count()).collect();
        assert_eq!(neighbours.iter().filter(|&&n| n == 1).count(), 2, "{operation:?}: {neighbours:?}");
        assert!(neighbours.iter().all(|n| [1, 2].contains(n)));
    }
}
