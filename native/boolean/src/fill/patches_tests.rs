//! The paper's filler on plane regions whose right answer is known.

use super::*;
use crate::fill::test_region::region;
use mesh::Topology;
use std::f64::consts::{PI, TAU};
use testkit::plane_region::{circle, subdivided};

fn filled(region: &Region) -> Fill {
    let fill = fill(region, 1.0, 0.5, &Monitor::new()).unwrap();
    region.verify(&fill).unwrap();
    fill
}

fn polygon(corners: &[(f64, f64)]) -> Vec<DVec2> {
    subdivided(&corners.iter().map(|&c| DVec2::from(c)).collect::<Vec<_>>(), 1.0)
}

/// Twice the signed area of a quad of the plane, by the cross product of its diagonals.
fn double_area(p: [DVec3; 4]) -> f64 {
    (p[2] - p[0]).cross(p[3] - p[1]).z
}

fn irregular(region: &Region, fill: &Fill) -> usize {
    let count = region.rim_count + fill.positions.len();
    let topology = Topology::new(count, &fill.quads);
    (region.rim_count..count).filter(|&v| topology.around(v as u32).count() != 4).count()
}

#[test]
fn a_rectangle_becomes_its_grid() {
    let rectangle = region(&[polygon(&[(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (0.0, 4.0)])], |p| p.extend(0.0));
    let fill = filled(&rectangle);
    assert_eq!((fill.quads.len(), irregular(&rectangle, &fill)), (24, 0));
    for p in &fill.positions {
        // Finishing straightens what is left.
        assert!(p.distance(p.round()) < 0.05, "{p} is no point of the grid");
    }
}

#[test]
fn a_bent_strip_is_covered_once() {
    let l = [(0.0, 0.0), (8.0, 0.0), (8.0, 3.0), (3.0, 3.0), (3.0, 8.0), (0.0, 8.0)];
    let strip = region(&[polygon(&l)], |p| p.extend(0.0));
    let fill = filled(&strip);
    let points = strip.points(&fill);
    let areas: Vec<f64> = fill.quads.iter().map(|q| 0.5 * double_area(q.map(|v| points[v as usize]))).collect();
    assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
    assert!((areas.iter().sum::<f64>() - 39.0).abs() < 1e-9);
    // A grid of unit squares: the concave corner needs no irregular vertex.
    assert_eq!((fill.quads.len(), irregular(&strip, &fill)), (39, 0));
}

/// By the index theorem for quads a disk without corners has 4 more three-valent vertices than five-valent ones, counted
/// against two quads at each border vertex.
#[test]
fn a_disk_gets_the_irregular_vertices_that_it_must_have() {
    let disk = region(&[circle(DVec2::ZERO, 20.0 / TAU, 20)], |p| p.extend(0.3 * p.length_squared() / PI));
    let fill = filled(&disk);
    let count = disk.rim_count + fill.positions.len();
    let topology = Topology::new(count, &fill.quads);
    let wanted = |v: usize| if v < disk.rim_count { 2 } else { 4 };
    let index: i64 = (0..count).map(|v| wanted(v) - topology.around(v as u32).count() as i64).sum();
    assert_eq!(index, 4);
    assert!(irregular(&disk, &fill) <= 8);
    // Vertices on traces lie on the remeshed surface, the others on the exact one.
    assert!(fill.positions.iter().all(|&p| disk.under.distance(p) < 0.05));
}

#[test]
fn more_quads_than_traces_pay_for_are_declined() {
    let mut square = region(&[polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])], |p| p.extend(0.0));
    square.size.fill(0.05);
    let Err(Declined::Because(reason)) = fill(&square, 1.0, 0.5, &Monitor::new()) else { panic!("6400 quads") };
    assert!(reason.contains("6400 quads"), "{reason}");
}

#[test]
fn a_cancelled_fill_is_cancelled_not_declined() {
    let square = region(&[polygon(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])], |p| p.extend(0.0));
    let monitor = Monitor::new();
    monitor.cancel();
    assert!(matches!(fill(&square, 1.0, 0.5, &monitor), Err(Declined::Cancelled(_))));
}
