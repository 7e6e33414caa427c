//! Strips of a torus of pentagonal section, of which two rings are the border of what is kept (Fig. 12).

use super::*;
use mesh::PolygonMesh;
use testkit::shapes;

const AROUND: u32 = 24;
const ACROSS: u32 = 5;

/// Faces of the torus are numbered ring by ring. Rings 0 to 9 are kept.
fn kept(faces: usize) -> Kept {
    [(0..faces).map(|f| f < 10 * ACROSS as usize).collect(), vec![]]
}

/// The five edges between ring `ring - 1` and ring `ring`.
fn border(ring: u32) -> Vec<(u8, [u32; 2])> {
    (0..ACROSS).map(|j| (0, sorted(ring * ACROSS + j, ring * ACROSS + (j + 1) % ACROSS))).collect()
}

fn torus() -> PolygonMesh {
    shapes::torus(1.0, 0.3, AROUND, ACROSS)
}

#[test]
fn the_strip_joins_two_odd_pieces_and_is_split_lengthwise() {
    let mesh = torus();
    let empty = PolygonMesh::default();
    let inputs = [Input::new(&mesh), Input::new(&empty)];
    let kept = kept(mesh.face_count());
    let pieces = border(0).into_iter().map(|e| (e, 0)).chain(border(10).into_iter().map(|e| (e, 1))).collect();
    let mut strips = Strips::default();
    assert!(strips.is_empty());
    assert!(strips.make_borders_even(&inputs, &kept, &pieces, &|| false));
    assert!(!strips.make_borders_even(&inputs, &kept, &pieces, &|| false), "once is enough");

    // One quad of each of the ten rings, all at the same place across the tube, and eleven middles of edges.
    let faces: Vec<u32> = strips.split[0].keys().copied().collect();
    assert_eq!(faces.iter().map(|f| f / ACROSS).collect::<Vec<_>>(), (0..10).collect::<Vec<_>>());
    assert!(faces.iter().all(|f| f % ACROSS == faces[0] % ACROSS));
    assert_eq!((strips.middle[0].len(), strips.positions[0].len()), (11, 11));
    for (&[a, b], &v) in &strips.middle[0] {
        let middle = mesh.positions[a as usize].midpoint(mesh.positions[b as usize]);
        assert_eq!(strips.position(&inputs[0], 0, v), middle);
    }
    // Each end of the strip gives its ring a sixth edge.
    for ring in [0, 10] {
        assert_eq!(border(ring).iter().filter(|(_, edge)| strips.middle[0].contains_key(edge)).count(), 1);
    }
    for &face in &faces {
        let pieces = strips.pieces(&inputs[0], 0, face);
        assert_eq!(pieces.len(), 2);
        assert_tiles(&mesh, &strips, &inputs[0], face, &pieces);
    }
}

/// The pieces lie where their weights say, run round as the face does, and cover it: their bilinear areas add up.
fn assert_tiles(mesh: &PolygonMesh, strips: &Strips, input: &Input<'_>, face: u32, pieces: &[Piece]) {
    let corners: Vec<DVec3> = mesh.face_points(face as usize).collect();
    let plane_area = |uv: [[f64; 2]; 4]| {
        (0..4).map(|k| uv[k][0] * uv[(k + 1) % 4][1] - uv[(k + 1) % 4][0] * uv[k][1]).sum::<f64>() / 2.0
    };
    let mut covered = 0.0;
    for piece in pieces {
        for &(v, weights) in piece {
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            let there: DVec3 = (0..4).map(|k| weights[k] * corners[k]).sum();
            assert!(strips.position(input, 0, v).distance(there) < 1e-15);
        }
        // In the unit square of the face, where its corners are (0,0), (1,0), (1,1), (0,1).
        let area = plane_area(piece.map(|(_, w)| [w[1] + w[2], w[2] + w[3]]));
        assert!((area - 1.0 / pieces.len() as f64).abs() < 1e-15, "{area}");
        covered += area;
    }
    assert!((covered - 1.0).abs() < 1e-12);
}

#[test]
fn a_quad_that_two_strips_cross_becomes_four() {
    let mesh = torus();
    let empty = PolygonMesh::default();
    let inputs = [Input::new(&mesh), Input::new(&empty)];
    let mut strips = Strips::default();
    let t = &inputs[0].topology;
    let first = mesh.face_corners(7).start as u32;
    strips.split_along(&inputs[0], 0, &[first]);
    strips.split_along(&inputs[0], 0, &[t.next[first as usize]]);
    let pieces = strips.pieces(&inputs[0], 0, 7);
    assert_eq!(pieces.len(), 4);
    assert_tiles(&mesh, &strips, &inputs[0], 7, &pieces);
}

#[test]
fn nothing_is_split_between_even_pieces() {
    let mesh = torus();
    let empty = PolygonMesh::default();
    let inputs = [Input::new(&mesh), Input::new(&empty)];
    let kept = kept(mesh.face_count());
    // Both rings are the border of one piece: ten edges.
    let one_piece = border(0).into_iter().chain(border(10)).map(|e| (e, 0)).collect();
    let mut strips = Strips::default();
    assert!(!strips.make_borders_even(&inputs, &kept, &one_piece, &|| false));
    assert!(strips.is_empty());
}

#[test]
fn two_odd_pieces_are_joined_over_an_even_one_between() {
    let mesh = torus();
    let empty = PolygonMesh::default();
    let inputs = [Input::new(&mesh), Input::new(&empty)];
    // Rings 0 to 4 and 6 to 9 are kept: ring 5 is a piece with ten border edges between two with five.
    let ring = |f: usize| f / ACROSS as usize;
    let kept: Kept = [(0..mesh.face_count()).map(|f| ring(f) < 10 && ring(f) != 5).collect(), vec![]];
    let rings = [(0, 0), (5, 1), (6, 1), (10, 2)];
    let pieces: BTreeMap<_, u32> =
        rings.into_iter().flat_map(|(ring, piece)| border(ring).into_iter().map(move |e| (e, piece))).collect();
    let mut strips = Strips::default();
    assert!(strips.make_borders_even(&inputs, &kept, &pieces, &|| false));
    let split: Vec<usize> = strips.split[0].keys().map(|&f| ring(f as usize)).collect();
    assert_eq!(split, [0, 1, 2, 3, 4, 6, 7, 8, 9]);
    for piece in 0..3 {
        let edges = pieces.iter().filter(|(_, p)| **p == piece).map(|((_, edge), _)| edge);
        let halves: usize = edges.map(|edge| 1 + usize::from(strips.middle[0].contains_key(edge))).sum();
        assert_eq!(halves % 2, 0, "piece {piece} has {halves} border edges");
    }
}
