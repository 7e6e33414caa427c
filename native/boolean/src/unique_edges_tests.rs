//! Edges that are repeated on purpose, in the fill of a disk of a sphere through the side of a cube.

use super::*;
use crate::fill::fill_all;
use crate::plan::plan;
use crate::resample::resample;
use crate::test_setting::TestSetting;
use crate::{Filler, Operation};
use mesh::{Monitor, PolygonMesh};
use testkit::shapes;

/// The regions of a small case with their fills, handed to `then` with what [`make_edges_unique`] wants beside them.
fn with_fills(then: impl FnOnce(&TestSetting<'_>, &Resampled, &mut Vec<Region>, &mut Vec<Fill>)) {
    let a: PolygonMesh = shapes::cuboid(DVec3::ONE * 2.0, 8);
    let b = shapes::transformed(&shapes::sphere(4), glam::DMat3::IDENTITY * 0.6, DVec3::new(1.2, 0.03, 0.02));
    let setting = TestSetting::new(&a, &b, Operation::Union);
    let (monitor, volume) = (Monitor::new(), mesh::volume(&setting.cut.surface));
    let plan = plan(&setting.inputs, &setting.band, setting.diagonal, volume, 1.0, &[], &monitor).expect("a plan");
    let band = resample(&setting.inputs, &setting.band, &plan, &monitor).expect("divided lines");
    let mut regions = band.regions(&setting.inputs, Operation::Union, &setting.kept, &setting.band).expect("regions");
    let (mut fills, _) = fill_all(&regions, None, Filler::Auto, 0.5, setting.diagonal, &monitor).expect("fills");
    then(&setting, &band, &mut regions, &mut fills);
}

/// All edges of all fills as pairs of the result's vertices, those on rims once for each fill they belong to, with how
/// often each occurs inside of a fill.
fn repeats(regions: &[Region], fills: &[Fill]) -> usize {
    let mut seen: BTreeMap<[(usize, u32); 2], usize> = BTreeMap::new();
    for (r, (region, fill)) in regions.iter().zip(fills).enumerate() {
        let name = |v: u32| region.rim.get(v as usize).map_or((r + 1, v), |&b| (0, b));
        let mut quads_at: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for quad in &fill.quads {
            for k in 0..4 {
                *quads_at.entry(sorted(quad[k], quad[(k + 1) % 4])).or_default() += 1;
            }
        }
        for [a, b] in quads_at.into_iter().filter(|&(_, n)| n == 2).map(|(edge, _)| edge) {
            let mut ends = [name(a), name(b)];
            ends.sort_unstable();
            *seen.entry(ends).or_default() += 1;
        }
    }
    seen.values().filter(|&&n| n > 1).count()
}

#[test]
fn nothing_repeated_nothing_changed() {
    with_fills(|setting, band, regions, fills| {
        let before: Vec<_> = fills.iter().map(|f| f.quads.clone()).collect();
        let changed = make_edges_unique(&setting.inputs, &setting.kept, &Strips::default(), band, regions, fills);
        assert_eq!(changed, Vec::<usize>::new());
        assert_eq!(fills.iter().map(|f| f.quads.clone()).collect::<Vec<_>>(), before);
    });
}

#[test]
fn an_inner_vertex_joined_twice_to_one_vertex_of_the_rim_gets_another_between() {
    with_fills(|setting, band, regions, fills| {
        // An inner vertex with two rim neighbours that no quad holds both: the region is made to touch itself there.
        let found = regions.iter().zip(fills.iter()).enumerate().find_map(|(r, (region, fill))| {
            let shared = |u: u32, w: u32| fill.quads.iter().any(|q| q.contains(&u) && q.contains(&w));
            let edges: BTreeSet<[u32; 2]> = inner_edges(region, fill).into_keys().collect();
            let rim = region.rim_count as u32;
            (rim..rim + fill.positions.len() as u32).find_map(|x| {
                let near: Vec<u32> = (0..rim).filter(|&u| edges.contains(&[u, x])).collect();
                let pair = near.iter().flat_map(|&u| near.iter().map(move |&w| (u, w)));
                pair.into_iter().find(|&(u, w)| u < w && !shared(u, w)).map(|(u, w)| (r, u, w))
            })
        });
        let (r, u, w) = found.expect("a thin place");
        regions[r].rim[w as usize] = regions[r].rim[u as usize];
        assert_eq!(repeats(regions, fills), 1);
        let before: Vec<usize> = fills.iter().map(|f| f.quads.len()).collect();
        let changed = make_edges_unique(&setting.inputs, &setting.kept, &Strips::default(), band, regions, fills);
        assert_eq!(changed, [r]);
        assert_eq!(repeats(regions, fills), 0);
        assert_eq!(fills[r].quads.len(), before[r] + 1, "two quads become three");
        regions[r].verify(&fills[r]).expect("still a fill of the region");
    });
}

#[test]
fn an_edge_that_the_lines_have_already_is_divided() {
    with_fills(|setting, band, regions, fills| {
        let (r, edge, at) = regions
            .iter()
            .zip(fills.iter())
            .enumerate()
            .find_map(|(r, (region, fill))| inner_edges(region, fill).into_iter().next().map(|(e, at)| (r, e, at)))
            .expect("an inner edge");
        let taken = BTreeSet::from([named(&regions[r], edge)]);
        assert_eq!(first_repeated(&regions[r], &fills[r], &taken), Some(at));
        let (quads, vertices) = (fills[r].quads.len(), fills[r].positions.len());
        assert!(divide(&regions[r], &mut fills[r], at));
        assert_eq!((fills[r].quads.len(), fills[r].positions.len()), (quads + 1, vertices + 1));
        assert_eq!(first_repeated(&regions[r], &fills[r], &taken), None);
        regions[r].verify(&fills[r]).expect("still a fill of the region");
        let taken = edges_before(&setting.inputs, &setting.kept, &Strips::default(), band);
        // Every edge of the planned lines is there, and none that is new.
        assert!(
            band.arcs.iter().flat_map(|p| p.windows(2)).all(|w| taken.contains(&sorted(w[0], w[1]).map(Vertex::Band)))
        );
        assert!(!taken.iter().any(is_new));
    });
}
