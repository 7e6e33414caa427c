//! Finishing grids of the plane that were disturbed in known ways.

use super::*;
use crate::fill::test_region::region;
use glam::{DVec2, DVec3};
use mesh::{Topology, scaled_jacobian};
use testkit::plane_region::subdivided;
use testkit::random::Random;

const WIDTH: usize = 8;
const HEIGHT: usize = 6;

/// A rectangle and the grid that fills it.
fn grid() -> (Region, Fill) {
    let corners = [(0, 0), (WIDTH, 0), (WIDTH, HEIGHT), (0, HEIGHT)];
    let rim = subdivided(&corners.map(|(x, y)| DVec2::new(x as f64, y as f64)), 1.0);
    let region = region(&[rim], |p| p.extend(0.0));
    let mut fill = Fill::default();
    let rim = &region.surface.positions[..region.rim_count];
    let vertices: Vec<u32> = (0..=HEIGHT)
        .flat_map(|y| (0..=WIDTH).map(move |x| DVec3::new(x as f64, y as f64, 0.0)))
        .map(|p| {
            let on_rim = rim.iter().position(|r| r.distance(p) < 1e-9);
            let number = on_rim.unwrap_or(rim.len() + fill.positions.len());
            if on_rim.is_none() {
                fill.positions.push(p);
            }
            number as u32
        })
        .collect();
    for (x, y) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))) {
        let at = |dx: usize, dy: usize| vertices[(y + dy) * (WIDTH + 1) + x + dx];
        fill.quads.push([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
    }
    region.verify(&fill).unwrap();
    (region, fill)
}

fn irregular(region: &Region, fill: &Fill) -> usize {
    let count = region.rim_count + fill.positions.len();
    let topology = Topology::new(count, &fill.quads);
    (region.rim_count..count).filter(|&v| topology.around(v as u32).count() != 4).count()
}

fn worst_jacobian(region: &Region, fill: &Fill) -> f64 {
    let points = region.points(fill);
    fill.quads.iter().map(|q| scaled_jacobian(q.map(|v| points[v as usize]))).fold(1.0, f64::min)
}

#[test]
fn smoothing_a_scrambled_grid_moves_vertices_only() {
    let (region, grid) = grid();
    let mut random = Random::new(3);
    let mut scrambled = grid.clone();
    for p in &mut scrambled.positions {
        *p += DVec3::new(random.between(-0.6, 0.6), random.between(-0.6, 0.6), 0.0);
    }
    assert!(worst_jacobian(&region, &scrambled) < 0.0);
    let smooth = smooth(&region, &scrambled, &Monitor::new()).unwrap();
    assert_eq!(smooth.quads, grid.quads);
    assert!(worst_jacobian(&region, &smooth) > 0.95, "{}", worst_jacobian(&region, &smooth));
}

#[test]
fn a_rotated_edge_is_found_and_turned_back() {
    let (region, mut fill) = grid();
    // Two neighbouring quads in the middle: the edge between them joins two other corners of their hexagon instead.
    let first = 2 * WIDTH + 3;
    let [p, q] = [fill.quads[first], fill.quads[first + 1]];
    assert_eq!([p[1], p[2]], [q[0], q[3]], "they share an edge");
    let hexagon = [p[0], p[1], q[1], q[2], p[2], p[3]];
    fill.quads[first] = [hexagon[0], hexagon[1], hexagon[2], hexagon[3]];
    fill.quads[first + 1] = [hexagon[3], hexagon[4], hexagon[5], hexagon[0]];
    region.verify(&fill).unwrap();
    assert_eq!(irregular(&region, &fill), 4);
    let better = finish(&region, &fill, &Monitor::new()).unwrap();
    region.verify(&better).unwrap();
    assert_eq!(irregular(&region, &better), 0);
    assert!(worst_jacobian(&region, &better) > 0.95);
}

#[test]
fn a_cancelled_finish_is_cancelled_not_declined() {
    let (region, fill) = grid();
    let monitor = Monitor::new();
    monitor.cancel();
    assert!(matches!(finish(&region, &fill, &monitor), Err(Declined::Cancelled(_))));
}
