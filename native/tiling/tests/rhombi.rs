//! Tilings with thin rhombi, against trying every tile.

use mesh::Monitor;
use std::collections::BTreeSet;
use testkit::outlines;
use testkit::random::Random;
use tiling::{Boundary, Certificate, Kind, Options, Point, Tiling, TilingError, count_with_rhombi, tile_with_rhombi};

fn boundary(code: &[u8]) -> Boundary {
    Boundary::new(code).unwrap_or_else(|error| panic!("{code:?}: {error}"))
}

fn counts(code: &[u8], most: usize) -> Vec<u64> {
    let found = count_with_rhombi(&boundary(code), most, &Options::default(), &Monitor::new()).unwrap();
    found.into_iter().map(|count| count.try_into().unwrap()).collect()
}

/// Edges cancel but for the outline's, areas add up, and rhombi have the shape they should.
fn assert_tiles(tiling: &Tiling, boundary: &Boundary) {
    let mut edges = BTreeSet::new();
    let mut area = 0.0;
    let cross = |p: &[f64; 2], q: &[f64; 2]| (p[0] * q[1] - p[1] * q[0]) / 2.0;
    let area_of = |corners: &[Point]| {
        let at: Vec<[f64; 2]> = corners.iter().map(|p| p.position()).collect();
        (0..at.len()).map(|k| cross(&at[k], &at[(k + 1) % at.len()])).sum::<f64>()
    };
    for tile in &tiling.tiles {
        let corners: Vec<Point> = tile.corners().collect();
        let expected = match tile.kind {
            Kind::Triangle => 0.75f64.sqrt() / 2.0,
            Kind::Square => 1.0,
            Kind::Rhombus => 0.5,
        };
        assert!((area_of(&corners) - expected).abs() < 1e-9);
        area += expected;
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            if !edges.remove(&(b, a)) {
                assert!(edges.insert((a, b)), "an edge twice on one side");
            }
        }
    }
    let points = boundary.points();
    assert_eq!(edges, (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()])).collect());
    assert!((area - area_of(points)).abs() < 1e-6);
}

#[test]
fn all_short_codes_have_as_many_as_trying_finds() {
    let mut with_rhombi = 0;
    for edges in 3..=8 {
        for code in outlines::all_codes(edges) {
            let tried = outlines::count_rhombi_by_trying(&code, 4);
            assert_eq!(counts(&code, 4), tried, "{code:?}");
            with_rhombi += usize::from(tried[0] == 0 && tried.iter().any(|&count| count > 0));
        }
    }
    assert!(with_rhombi > 20, "{with_rhombi}");
}

#[test]
fn random_codes_have_as_many_as_trying_finds() {
    let mut random = Random::new(8);
    for k in 0..150 {
        let code = outlines::random_code(9 + k % 8, &mut random);
        let defect = Certificate::new(boundary(&code).directions()).defect.unsigned_abs() as usize;
        if defect <= 2 {
            assert_eq!(counts(&code, 2), outlines::count_rhombi_by_trying(&code, 2), "{code:?}");
        }
    }
}

/// Fewest, as trying says; and on the border when trying could not have them otherwise is too dear to say, so the depth
/// is measured again on the tiles.
#[test]
fn the_fewest_are_found() {
    let (options, monitor) = (Options::default(), Monitor::new());
    let mut random = Random::new(31);
    let (mut some, mut none) = (0, 0);
    for k in 0..200 {
        let code = outlines::random_code(8 + k % 7, &mut random);
        let outline = boundary(&code);
        let tried = outlines::count_rhombi_by_trying(&code, 4).into_iter().position(|count| count > 0);
        let found = tile_with_rhombi(&outline, k as u64, &options, &monitor).unwrap();
        match (found, tried) {
            (Some(found), Some(fewest)) => {
                assert_eq!(found.rhombi, fewest, "{code:?}");
                assert_eq!(found.tiling.count(Kind::Rhombus), fewest);
                assert_tiles(&found.tiling, &outline);
                let touches = |point: Point| outline.points().contains(&point);
                let rhombi = || found.tiling.tiles.iter().filter(|tile| tile.kind == Kind::Rhombus);
                assert_eq!(found.depth == 0.0, rhombi().all(|tile| tile.corners().any(touches)));
                some += usize::from(fewest > 0);
            }
            (Some(found), None) => assert!(found.rhombi > 4, "{code:?}"),
            (None, tried) => {
                assert_eq!(tried, None, "{code:?}");
                none += 1;
            }
        }
    }
    assert!(some > 50 && none > 5, "{some} {none}");
}

/// Polygons with opposite sides alike, of directions 30 degrees apart: none of these can be tiled, and rhombi are many.
#[test]
fn polygons_that_need_many_get_them() {
    let (options, monitor) = (Options::default(), Monitor::new());
    for sides in [[3, 1, 2, 2, 3, 1], [4, 3, 1, 3, 2, 2], [7, 2, 3, 7, 7, 5]] {
        let side = |&length: &usize| [vec![5], vec![6; length - 1]].concat();
        let code = sides.iter().flat_map(side).collect::<Vec<u8>>().repeat(2);
        let outline = boundary(&code);
        let found = tile_with_rhombi(&outline, 1, &options, &monitor).unwrap().unwrap();
        assert_tiles(&found.tiling, &outline);
        assert_eq!(found.tiling.count(Kind::Rhombus), found.rhombi);
        assert!(found.at_least <= found.rhombi && found.rhombi <= 2 * found.at_least, "{sides:?}: {}", found.rhombi);
        // The defect by areas: what is neither root 3 nor whole is rhombi.
        let defect = Certificate::new(outline.directions()).defect.unsigned_abs() as usize;
        assert!(found.at_least >= defect && (found.rhombi - defect).is_multiple_of(2));
    }
}

#[test]
fn a_search_for_rhombi_is_cancelled() {
    let side = |&length: &usize| [vec![5], vec![6; length - 1]].concat();
    let code = [9, 4, 7, 8, 5, 6].iter().flat_map(side).collect::<Vec<u8>>().repeat(2);
    let monitor = Monitor::new();
    monitor.cancel();
    let found = tile_with_rhombi(&boundary(&code), 1, &Options::default(), &monitor);
    assert!(matches!(found, Err(TilingError::Cancelled(_))));
}
