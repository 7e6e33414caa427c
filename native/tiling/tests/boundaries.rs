//! What is said of boundary codes, good and bad.

use mesh::Monitor;
use proptest::prelude::*;
use testkit::outlines;
use testkit::random::Random;
use tiling::{Boundary, Explanation, Options, Point, TilingError, Verdict, explain_boundary};

fn explain(code: &[u8]) -> Explanation {
    explain_boundary(code, &Options::default(), &Monitor::new()).unwrap()
}

#[test]
fn each_fault_has_its_verdict_and_its_corners() {
    let cases: [(&[u8], Verdict, &[u32]); 9] = [
        (&[], Verdict::Angle, &[]),
        (&[3, 3, 12, 3, 0], Verdict::Angle, &[2, 4]),
        (&[3, 3, 3], Verdict::Turning, &[]),
        (&[3, 3, 3, 4, 5], Verdict::Open, &[]),
        // Two squares with a corner in common.
        (&[3, 3, 3, 9, 3, 3, 3, 9], Verdict::NotSimple, &[2, 6, 2, 7, 3, 6, 3, 7]),
        (&[3; 4], Verdict::Tileable, &[]),
        (&[5; 12], Verdict::Tileable, &[]),
        (&[5, 6, 5, 5, 3, 5, 6, 5, 5, 3], Verdict::Refuted, &[]),
        (&[4, 5, 5, 4, 7, 4, 5, 6, 3, 5, 7, 5], Verdict::Tileable, &[]),
    ];
    for (code, verdict, corners) in cases {
        let found = explain(code);
        assert_eq!((found.verdict, &found.corners[..]), (verdict, corners), "{code:?}: {}", found.sentence);
    }
    assert_eq!(
        explain(&[3, 3, 3]).sentence,
        "the exterior angles add up to 270 degrees instead of 360: lower the angles by 3 units of 30 degrees in all"
    );
    assert!(explain(&[5; 12]).sentence.contains("6 squares (2, 2 and 2"));
}

#[test]
fn points_are_where_the_code_leads() {
    let outline = Boundary::new(&[3, 6, 3, 3, 6, 3]).unwrap();
    let positions: Vec<[f64; 2]> = outline.points().iter().map(|p| p.position()).collect();
    assert_eq!(positions, [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(outline.points()[3], Point([2, 0, 0, 1]));
}

proptest! {
    #[test]
    fn any_bytes_get_an_answer(code in prop::collection::vec(0u8..14, 0..12)) {
        let found = explain(&code);
        prop_assert_eq!(found.verdict == Verdict::Angle, code.len() < 3 || code.iter().any(|a| !(2..12).contains(a)));
        prop_assert!(!found.sentence.is_empty());
    }

    /// The exact test against one with rounded coordinates, on closed codes that mostly cross themselves.
    #[test]
    fn simple_is_what_rounded_coordinates_say(seed in any::<u64>(), edges in 6usize..24) {
        let mut random = Random::new(seed);
        let mut code = outlines::random_code(edges, &mut random);
        // An exchange of two edges keeps the code closed.
        let at = random.index(edges);
        let turn = i16::from(code[at]) - 6;
        code.rotate_left(at);
        let changed = [i16::from(code[edges - 1]) + turn, 12 - i16::from(code[0]), i16::from(code[1]) + turn];
        if changed.iter().all(|angle| (2..12).contains(angle)) {
            [code[edges - 1], code[0], code[1]] = changed.map(|angle| angle as u8);
            match Boundary::new(&code) {
                Ok(_) => prop_assert!(outlines::is_simple(&code)),
                Err(TilingError::Boundary { code: fault, .. }) => {
                    prop_assert_eq!(fault, "not_simple");
                    prop_assert!(!outlines::is_simple(&code));
                }
                Err(other) => prop_assert!(false, "{}", other),
            }
        }
    }
}
