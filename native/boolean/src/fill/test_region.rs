//! Regions for the tests of the fillers.

use super::{Region, Under};
use crate::intersect::Source;
use glam::{DVec2, DVec3};
use mesh::Topology;
use surface::closest::ClosestPoint;
use testkit::plane_region::plane_region;

/// The region between plane loops, lifted, its rim first. The target edge length is the mean one of the loops.
pub fn region(loops: &[Vec<DVec2>], lift: impl Fn(DVec2) -> DVec3) -> Region {
    let surface = plane_region(loops, lift);
    let topology = Topology::of_triangles(&surface);
    let walk = |w: Vec<u32>| w.into_iter().map(|h| topology.from(h)).collect::<Vec<u32>>();
    let loops: Vec<Vec<u32>> = topology.border_loops().into_iter().map(walk).collect();
    let rim_count = loops.iter().map(Vec::len).sum();
    let edge = |w: &Vec<u32>, k: usize| {
        surface.positions[w[k] as usize].distance(surface.positions[w[(k + 1) % w.len()] as usize])
    };
    let total: f64 = loops.iter().flat_map(|w| (0..w.len()).map(move |k| edge(w, k))).sum();
    let triangles = surface.triangles.len();
    Region {
        rim_count,
        rim: (0..rim_count as u32).collect(),
        loops,
        inner_lines: vec![],
        line_edges: vec![],
        outside: vec![0; rim_count],
        size: vec![total / rim_count as f64; surface.positions.len()],
        under: Under {
            closest: ClosestPoint::new(&surface),
            normals: (0..triangles).map(|t| surface.area_normal(t).normalize()).collect(),
            source: vec![Source { mesh: 0, triangle: 0 }; triangles],
        },
        surface,
    }
}
