//! Fills of an attempt that the next one takes over.

use super::test_region::region;
use super::*;
use glam::DVec2;
use testkit::plane_region::subdivided;

fn rectangle(width: f64, height: f64) -> Region {
    let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(|(x, y)| DVec2::new(x, y));
    region(&[subdivided(&corners, 1.0)], |p| p.extend(0.0))
}

#[test]
fn only_regions_that_are_the_same_keep_their_fill() {
    let monitor = Monitor::new();
    let fill = |regions: &[Region], before: Option<&Filled>, filler: Filler| {
        fill_all(regions, before, filler, 0.5, 10.0, &monitor).expect("rectangles can be filled")
    };
    let regions = vec![rectangle(6.0, 4.0), rectangle(5.0, 3.0)];
    let (mut fills, reports) = fill(&regions, None, Filler::Auto);
    // The mark by which a fill is known that was taken over.
    for fill in &mut fills {
        fill.positions[0].z = 0.125;
    }
    let mut before = Filled { regions, fills, filler: Filler::Auto, reports };
    let is_taken_over = |fill: &Fill| fill.positions[0].z == 0.125;

    let mut next = vec![rectangle(5.0, 3.0), rectangle(6.0, 4.0), rectangle(7.0, 3.0)];
    // Numbers in the band do not matter, edge lengths do.
    next[0].rim.iter_mut().for_each(|v| *v += 40);
    let taken: Vec<bool> = fill(&next, Some(&before), Filler::Auto).0.iter().map(is_taken_over).collect();
    assert_eq!(taken, [true, true, false]);
    next[1].size[3] *= 0.9;
    let taken: Vec<bool> = fill(&next, Some(&before), Filler::Auto).0.iter().map(is_taken_over).collect();
    assert_eq!(taken, [true, false, false]);
    assert!(!fill(&next, Some(&before), Filler::Matching).0.iter().any(is_taken_over), "another filler was asked for");
    before.filler = Filler::Matching;
    assert!(is_taken_over(&fill(&next, Some(&before), Filler::Matching).0[0]));
}
