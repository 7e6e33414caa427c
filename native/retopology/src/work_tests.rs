use super::*;
use crate::test_bases;

#[test]
fn vertices_around_quads_that_got_worse_go_back() {
    let sheet = test_bases::all().into_iter().find(|(name, _)| *name == "sheet").expect("a sheet").1;
    let ground = Ground::new(&sheet).expect("a sound base");
    let rails = Rails::new(&sheet, &ground.measures, &[]);
    // A grid in the middle of the sheet, which rises by 0.2 x y.
    let n = 12;
    let at = |k: u32| 0.1 * f64::from(k) - 0.6;
    let points = (0..=n).flat_map(|i| (0..=n).map(move |j| (at(i), at(j))));
    let positions: Vec<DVec3> = points.map(|(x, y)| DVec3::new(x, y, 0.2 * x * y)).collect();
    let corner = |i: u32, j: u32| i * (n + 1) + j;
    let cells = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let quads: Vec<[u32; 4]> =
        cells.map(|(i, j)| [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]).collect();
    let filled = Filled {
        places: vec![Place::Patch(0); positions.len()],
        stays: vec![false; positions.len()],
        patch_of: vec![0; quads.len()],
        along: vec![vec![]; sheet.edges.len()],
        positions,
        quads,
    };
    let patches = [Patch { triangles: vec![0], ..Patch::default() }];
    let mut work = Work::new(&ground, &rails, &patches, filled);
    let before = work.filled.positions.clone();
    let (smooth, monitor) = (SmoothOptions::default(), Monitor::new());
    assert!(!work.put_back(&before, (0.1, &[]), (1, false), &smooth, &monitor).unwrap(), "nothing got worse");

    // One vertex slips past its neighbour; one far from it moves where it may.
    let (slipped, moved) = (corner(3, 3) as usize, corner(9, 9) as usize);
    work.filled.positions[slipped].x += 0.15;
    work.filled.positions[moved].x += 0.02;
    assert!(!work.inverted().is_empty());
    assert!(work.put_back(&before, (0.1, &[]), (1, false), &smooth, &monitor).unwrap());
    assert_eq!(work.filled.positions[slipped], before[slipped]);
    assert_eq!(work.constraints[slipped], Constraint::Fixed);
    assert!(work.inverted().is_empty());
    assert_ne!(work.filled.positions[moved], before[moved]);
    assert_eq!(work.constraints[moved], Constraint::Free);

    // And around a point that is told.
    let point = work.filled.positions[moved];
    assert!(work.put_back(&before, (0.1, &[point]), (1, false), &smooth, &monitor).unwrap());
    assert_eq!(work.filled.positions[moved], before[moved]);
}
