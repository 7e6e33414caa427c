//! Counts of tilings, against known numbers and against trying every tile.

use mesh::Monitor;
use proptest::prelude::*;
use std::collections::BTreeSet;
use testkit::outlines;
use testkit::random::Random;
use tiling::{Boundary, Certificate, Options, Tiling, Tilings, count_tilings, is_tileable, tilings_by_programme};

fn boundary(code: &[u8]) -> Boundary {
    Boundary::new(code).unwrap_or_else(|error| panic!("{code:?}: {error}"))
}

fn count(code: &[u8]) -> u64 {
    let count = count_tilings(&boundary(code), &Options::default(), &Monitor::new()).unwrap();
    count.try_into().unwrap()
}

/// A polygon with straight sides: (interior angle, edges of the side that follows).
fn polygon(sides: &[(u8, usize)]) -> Vec<u8> {
    sides.iter().flat_map(|&(angle, length)| [vec![angle], vec![6; length - 1]].concat()).collect()
}

fn dodecagon(a: usize, b: usize) -> Vec<u8> {
    polygon(&[(5, a), (5, b)].repeat(6))
}

#[test]
fn dodecagons_have_binomially_many() {
    for a in 1..=6u64 {
        for b in 1..=6u64 {
            let binomial = (1..=a).fold(1, |product, k| product * (b + k) / k);
            assert_eq!(count(&dodecagon(a as usize, b as usize)), binomial, "{a} {b}");
        }
    }
}

#[test]
fn hexagons_triangles_and_rectangles_have_one() {
    for n in 1..8 {
        assert_eq!(count(&polygon(&[(2, n); 3])), 1);
        assert_eq!(count(&polygon(&[(4, n); 6])), 1);
        for m in 1..8 {
            assert_eq!(count(&polygon(&[(3, n), (3, m), (3, n), (3, m)])), 1);
        }
    }
}

#[test]
fn the_papers_outlines() {
    assert_eq!(count(&[4, 5, 5, 4, 7, 4, 5, 6, 3, 5, 7, 5]), 1);
    assert_eq!(count(&[4, 5, 3, 8, 3, 5, 4, 5, 5]), 1);
    assert_eq!(count(&[5; 12]), 2);
}

/// The tilings of the integer programme and those of the state graph, as sets of tiles.
fn check_programme(code: &[u8]) {
    let (outline, monitor) = (boundary(code), Monitor::new());
    let mut graph = Tilings::new(&outline, &Options::default(), &monitor).unwrap();
    let count: u32 = graph.count().try_into().unwrap();
    let tiles = |tiling: Tiling| tiling.tiles.iter().map(|tile| tile.normalised()).collect::<BTreeSet<_>>();
    let of_graph: BTreeSet<_> = (0..count).map(|k| tiles(graph.get(&k.into(), &monitor).unwrap().unwrap())).collect();
    let of_programme = tilings_by_programme(&outline, usize::MAX, &monitor).unwrap();
    assert_eq!(of_programme.len(), count as usize, "{code:?}");
    assert_eq!(of_programme.into_iter().map(tiles).collect::<BTreeSet<_>>(), of_graph, "{code:?}");
}

/// Compares everything that is known of a code with what trying finds.
fn check(code: &[u8]) -> Result<(), TestCaseError> {
    let tried = outlines::count_by_trying(code);
    let outline = boundary(code);
    prop_assert_eq!(count(code), tried, "{:?}", code);
    prop_assert_eq!(is_tileable(&outline, &Options::default(), &Monitor::new()).unwrap(), tried > 0);
    let certificate = Certificate::new(outline.directions());
    prop_assert!(tried == 0 || !certificate.refutes(), "{:?} {}", code, certificate);
    Ok(())
}

#[test]
fn all_short_codes_agree_with_trying() {
    let mut codes = 0;
    for edges in 3..=9 {
        for code in outlines::all_codes(edges) {
            check(&code).unwrap();
            codes += 1;
        }
    }
    assert!(codes > 1000, "{codes}");
}

#[test]
fn random_codes_agree_with_trying() {
    let mut random = Random::new(20);
    let mut tileable = 0;
    for k in 0..500 {
        let code = if k % 2 == 0 {
            outlines::random_code(10 + k % 11, &mut random)
        } else {
            outlines::random_tileable(4 + k % 12, &mut random)
        };
        check(&code).unwrap();
        tileable += usize::from(count(&code) > 0);
    }
    assert!((250..400).contains(&tileable), "{tileable}");
}

#[test]
fn the_integer_programme_finds_the_same_tilings_of_short_codes() {
    for edges in 3..=9 {
        for code in outlines::all_codes(edges) {
            check_programme(&code);
        }
    }
}

#[test]
fn the_integer_programme_finds_the_same_tilings_of_random_codes() {
    let mut random = Random::new(20);
    for k in 0..500 {
        let code = if k % 2 == 0 {
            outlines::random_code(10 + k % 11, &mut random)
        } else {
            outlines::random_tileable(4 + k % 12, &mut random)
        };
        check_programme(&code);
    }
    // Some with many tilings.
    check_programme(&dodecagon(1, 1));
    check_programme(&dodecagon(1, 2));
}
