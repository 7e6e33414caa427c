//! Times the editing loop on a generated torus of 20,000 vertices with 70 curves: for each edit the base triangulation, then the
//! quads. Prints a row for each.
//!
//! `cargo run -p quadloom-retopology --example edits`

use mesh::Monitor;
use retopology::Options;
use retopology::features::Features;
use retopology::project::Project;
use std::time::Instant;
use testkit::shapes;

/// Vertices the long way round, and across.
const AROUND: u32 = 200;
const ACROSS: u32 = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = shapes::triangulated(&shapes::torus(2.0, 0.8, AROUND, ACROSS));
    let at = |i: u32, j: u32| (i % AROUND) * ACROSS + j % ACROSS;
    let curve = |(i, j): (u32, u32)| (0..8).map(move |k| [at(i + k, j), at(i + k + 1, j)]);
    let mut curves: Vec<(u32, u32)> = (0..70).map(|k| (20 * (k % 10), 14 * (k / 10) + 3)).collect();
    let features =
        |curves: &[(u32, u32)]| Features { edges: curves.iter().copied().flat_map(curve).collect(), vertices: vec![] };
    // As it is: the irregular vertices of the whole go when editing is done.
    let mut options = Options::default();
    options.layout.improve = false;
    let monitor = Monitor::new();
    let start = Instant::now();
    let mut project = Project::new(mesh, &features(&curves), &options, &monitor)?;
    println!("base {:.3} s", start.elapsed().as_secs_f64());
    let mut before = Vec::new();
    for (k, to) in [(0, (0, 3)), (0, (2, 5)), (23, (61, 33)), (35, (110, 50)), (69, (181, 86))] {
        curves[k] = to;
        let start = Instant::now();
        let edit = project.set_features(&features(&curves), &monitor)?;
        let base = start.elapsed().as_secs_f64();
        let made = project.quads(&monitor)?;
        let all = start.elapsed().as_secs_f64();
        let known = made
            .mesh
            .positions
            .iter()
            .filter(|p| before.binary_search(&p.to_array().map(f64::to_bits)).is_ok())
            .count();
        println!(
            "edit {base:.3} s, with quads {all:.3} s: {edit:?}, {} quads, {} of {} patches and {known} vertices kept, \
             {} inverted, least scaled Jacobian {:.2}, mean angle deviation {:.1}, {:?}",
            made.report.faces,
            made.report.patches_kept,
            made.report.patches,
            made.report.inverted,
            made.report.scaled_jacobian_min,
            made.report.angle_deviation,
            made.report.seconds,
        );
        before = made.mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        before.sort_unstable();
    }
    Ok(())
}
