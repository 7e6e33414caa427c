//! The plan of the lines of a sphere through the side of a cube, whose curve is a circle known beforehand.

use super::*;
use crate::Operation;
use crate::test_setting::TestSetting;
use mesh::{DVec3, PolygonMesh};
use testkit::{random, shapes};

/// Border edges of each region if its arcs are divided as planned, counted triangle by triangle and arc by arc.
fn borders(band: &Band, plan: &Plan) -> Vec<usize> {
    let mut sides: Vec<Vec<usize>> = vec![vec![]; band.region_count];
    for (t, corners) in band.surface.triangles.iter().enumerate() {
        let single = (0..3).filter(|&k| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            !band.surface.triangles.iter().any(|o| (0..3).any(|j| o[j] == b && o[(j + 1) % 3] == a))
        });
        sides[band.region[t] as usize].push(single.count());
    }
    let mut border: Vec<usize> = sides.iter().map(|s| s.iter().sum()).collect();
    for (arc, positions) in band.arcs.iter().zip(&plan.positions) {
        border[arc.regions[0] as usize] += positions.len() + 1;
        border[arc.regions[1] as usize] += positions.len() + 1;
    }
    border
}

fn planned(setting: &TestSetting<'_>, scale: f64) -> Plan {
    planned_about(setting, scale, &[])
}

fn planned_about(setting: &TestSetting<'_>, scale: f64, spots: &[DVec3]) -> Plan {
    let volume = mesh::volume(&setting.cut.surface);
    plan(&setting.inputs, &setting.band, setting.diagonal, volume, scale, spots, &Monitor::new()).expect("even borders")
}

fn sphere_in_a_side() -> (PolygonMesh, PolygonMesh) {
    let a = shapes::cuboid(DVec3::ONE * 2.0, 10);
    let b = shapes::transformed(&shapes::sphere(12), glam::DMat3::IDENTITY * 0.6, DVec3::new(1.2, 0.03, 0.02));
    (a, b)
}

#[test]
fn every_border_is_even_and_at_least_four() {
    let shapes = [shapes::sphere(6), shapes::cuboid(DVec3::ONE, 5), shapes::torus(1.0, 0.4, 20, 8)];
    for seed in 0..9 {
        let (a, b) = (&shapes[seed as usize % 3], &shapes[seed as usize / 3]);
        let b = random::placement(a, b, seed);
        let setting = TestSetting::new(a, &b, Operation::Union);
        let plan = planned(&setting, 1.0);
        for (r, border) in borders(&setting.band, &plan).into_iter().enumerate() {
            assert!(border % 2 == 0 && border >= 4, "seed {seed}: region {r} has a border of {border}");
        }
        for positions in &plan.positions {
            let all: Vec<f64> = [0.0].into_iter().chain(positions.iter().copied()).chain([1.0]).collect();
            assert!(all.windows(2).all(|w| w[0] < w[1]), "seed {seed}: {positions:?}");
        }
        assert!(plan.size.iter().all(|s| s.is_finite() && *s > 0.0));
    }
}

#[test]
fn chords_stay_near_the_circle() {
    let (a, b) = sphere_in_a_side();
    let setting = TestSetting::new(&a, &b, Operation::Union);
    let plan = planned(&setting, 1.0);
    let curves: Vec<usize> = (0..setting.band.arcs.len()).filter(|&k| setting.band.arcs[k].on_curve).collect();
    let [curve] = curves[..] else { panic!("{} curves", curves.len()) };
    // The plane x = 1 cuts the sphere in a circle.
    let (centre, radius) = (DVec3::new(1.0, 0.03, 0.02), (0.36_f64 - 0.04).sqrt());
    let points: Vec<DVec3> = setting.band.arcs[curve].points(&setting.band.surface).collect();
    let off = |p: DVec3| (p.distance(centre) - radius).abs();
    // What the flat quads of the sphere are off themselves.
    let own = points.iter().copied().map(off).fold(0.0, f64::max);
    let lengths: Vec<f64> = points.windows(2).map(|w| w[0].distance(w[1])).collect();
    let whole: f64 = lengths.iter().sum();
    let at = |part: f64| {
        let mut left = part * whole;
        for (w, &length) in points.windows(2).zip(&lengths) {
            if left <= length {
                return w[0].lerp(w[1], left / length);
            }
            left -= length;
        }
        points[0]
    };
    let vertices: Vec<DVec3> =
        [0.0].into_iter().chain(plan.positions[curve].iter().copied()).chain([1.0]).map(at).collect();
    for w in vertices.windows(2) {
        assert!(off(w[0]) <= own + 1e-9);
        let sag = off(w[0].midpoint(w[1]));
        assert!(sag <= CHORD_ERROR * setting.diagonal + own, "{sag}");
    }
}

#[test]
fn half_the_size_gives_about_twice_the_edges() {
    let (a, b) = sphere_in_a_side();
    let setting = TestSetting::new(&a, &b, Operation::Difference);
    let edges = |scale: f64| planned(&setting, scale).positions.iter().map(|p| p.len() + 1).sum::<usize>() as f64;
    let ratio = edges(0.5) / edges(1.0);
    assert!((1.5..2.2).contains(&ratio), "{ratio}");
}

#[test]
fn the_curve_takes_the_finer_length_when_they_differ_much() {
    assert_eq!(curve_length(1.0, 1.0), 1.0);
    assert_eq!(curve_length(1.0, 4.0), 2.0);
    assert_eq!(curve_length(1.0, 100.0), LARGEST_STEP);
    assert_eq!(curve_length(100.0, 1.0), LARGEST_STEP);
}

#[test]
fn edges_are_smaller_about_a_spot_and_the_same_elsewhere() {
    let (a, b) = sphere_in_a_side();
    let setting = TestSetting::new(&a, &b, Operation::Union);
    let positions = &setting.band.surface.positions;
    let on_curve = setting.band.arcs.iter().find(|arc| arc.on_curve).expect("a curve").vertices[0] as usize;
    let spot = positions[on_curve];
    let before = planned(&setting, 1.0);
    let once = planned_about(&setting, 1.0, &[spot]);
    let twice = planned_about(&setting, 1.0, &[spot, spot]);
    assert!((once.size[on_curve] - 0.6 * before.size[on_curve]).abs() < 1e-12);
    assert!((twice.size[on_curve] - 0.36 * before.size[on_curve]).abs() < 1e-12);
    let reach = before.size.iter().copied().fold(0.0, f64::max) / GRADING;
    for (v, position) in positions.iter().enumerate() {
        assert!(once.size[v] <= before.size[v]);
        if position.distance(spot) > reach || setting.band.topology.is_border_vertex(v as u32) {
            assert_eq!(once.size[v], before.size[v]);
        }
    }
    let counts = |plan: &Plan| plan.positions.iter().map(Vec::len).sum::<usize>();
    assert!(counts(&twice) > counts(&before));
}
