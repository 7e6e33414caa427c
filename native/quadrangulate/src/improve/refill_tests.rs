//! Disks filled anew, on the same bad starts.

use super::*;

/// Most quads in a disk here.
const MOST: usize = 200;

fn refilled(start: &Start, stays: &[bool]) -> Improved {
    let sphere = start.sphere.map(Sphere);
    let surfaces: [&dyn Reference; 1] = [sphere.as_ref().map_or(&Plane as &dyn Reference, |s| s)];
    let setting = start.setting(&surfaces);
    let refilled = refill(start.patch.clone(), &setting, stays, MOST, &Monitor::new()).unwrap();
    check(start, &refilled);
    assert_eq!(refilled.report.smooth, None);
    refilled
}

/// A start with what one operator can mend: no doublets, and no turned quads.
fn combed(start: Start) -> Start {
    let sphere = start.sphere.map(Sphere);
    let surfaces: [&dyn Reference; 1] = [sphere.as_ref().map_or(&Plane as &dyn Reference, |s| s)];
    let setting = start.setting(&surfaces);
    let options = ImproveOptions { depth: 1, ..ImproveOptions::default() };
    let Improved { patch, source, features, .. } =
        improve(start.patch.clone(), &setting, &options, &Monitor::new()).unwrap();
    let outside = source.iter().map(|&old| start.outside.get(old as usize).copied().unwrap_or(0)).collect();
    Start { patch, outside, features, ..start }
}

#[test]
fn irregular_vertices_go_and_what_must_stay_stays() {
    for (name, sphere, feature) in
        [("flat", None, false), ("flat curve", None, true), ("sphere curve", Some(12.0), true)]
    {
        let start = combed(band(sphere, feature).paired(0.3, 7));
        let made = refilled(&start, &[]);
        let [before, after] = [&start.patch, &made.patch].map(irregular_oracle);
        println!("{name}: {before} to {after} irregular vertices, {} changes", made.report.changes);
        assert!(2 * after <= before, "{name}: {before} to {after} irregular vertices");
        let drift = made.patch.quads.len().abs_diff(start.patch.quads.len());
        assert!(50 * drift <= start.patch.quads.len(), "{name}: {drift} quads more or fewer");
        let (least, _) = sines(&made.patch, sphere.is_some());
        assert!(least > 0.0, "{name}: a quad is turned over");
    }
}

#[test]
fn quads_that_stay_are_not_replaced() {
    let start = combed(band(None, false).paired(0.3, 7));
    let stays: Vec<bool> = (0..start.patch.quads.len()).map(|q| q % 3 == 0).collect();
    let made = refilled(&start, &stays);
    let named: BTreeSet<[u32; 4]> = made.patch.quads.iter().map(|q| q.map(|v| made.source[v as usize])).collect();
    let kept = start.patch.quads.iter().zip(&stays).filter(|(_, stays)| **stays);
    assert!(kept.into_iter().all(|(q, _)| named.contains(q)));
    let none = refilled(&start, &vec![true; start.patch.quads.len()]);
    assert_eq!((none.patch.quads, none.report.changes), (start.patch.quads, 0));
}

#[test]
fn refilling_gives_the_same_bytes_and_can_be_cancelled() {
    let start = combed(band(None, true).paired(0.3, 11));
    assert_eq!(refilled(&start, &[]), refilled(&start, &[]));
    let setting = start.setting(&[&Plane]);
    let monitor = Monitor::new();
    monitor.cancel();
    let stopped = refill(start.patch.clone(), &setting, &[], MOST, &monitor).unwrap_err();
    assert_eq!(stopped, ImproveError::Cancelled(Cancelled));
}
