//! Finds placements that go wrong: places shipped meshes on one another at random, runs the boolean and prints a line
//! for each, with the reasons of every fault. Failing ones are written as OBJ files to look at.
//!
//!     cargo run --release -p quadloom-boolean --example placements -- [--count N] [--first SEED] [--only SEED]
//!         [--filler auto|patches|rings|matching] [--write DIR] [--all]

use boolean::{BooleanError, Filler, Operation, Options, boolean};
use mesh::{Monitor, PolygonMesh};
use std::path::PathBuf;
use std::time::Instant;
use testkit::{fixture, obj, placement_fixtures, random};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| arguments.iter().position(|a| a == name).and_then(|k| arguments.get(k + 1)).cloned();
    let number = |name: &str, default: u64| value(name).map_or(default, |v| v.parse().expect("a whole number"));
    let only = value("--only").map(|v| v.parse::<u64>().expect("a seed"));
    let first = only.unwrap_or_else(|| number("--first", 0));
    let count = if only.is_some() { 1 } else { number("--count", 40) };
    let write = value("--write").map(PathBuf::from);
    let all = arguments.iter().any(|a| a == "--all");
    let filler = match value("--filler").as_deref() {
        None | Some("auto") => Filler::Auto,
        Some("patches") => Filler::Patches,
        Some("rings") => Filler::Rings,
        Some("matching") => Filler::Matching,
        Some(other) => panic!("no filler is called {other}"),
    };
    let names = placement_fixtures();
    let meshes: Vec<PolygonMesh> = names.iter().map(|name| fixture(name)).collect();
    let options = Options { filler, ..Options::default() };
    let (mut good, mut empty) = (0, 0);
    for seed in first..first + count {
        let mut random = random::Random::new(seed);
        let [a, b] = [random.index(names.len()), random.index(names.len())];
        let operation = [Operation::Union, Operation::Intersection, Operation::Difference][random.index(3)];
        let placed = random::placement(&meshes[a], &meshes[b], seed);
        let start = Instant::now();
        let result = boolean(&meshes[a], &placed, operation, &options, &Monitor::new());
        let seconds = start.elapsed().as_secs_f64();
        let title = format!("{seed:4} {} {} {operation:?}", names[a], names[b]);
        let (failed, line) = match &result {
            Ok(output) => {
                let r = &output.report;
                let fillers: Vec<&str> = r.regions.iter().map(|x| &x.filler[..1]).collect();
                let seconds: Vec<_> = r.seconds.iter().filter(|(_, s)| **s > 0.01).collect();
                (
                    r.warnings.iter().any(|w| w.contains("flawless")),
                    format!(
                        "kept {} of {} new {} irregular {} jacobian {:.2}/{:.2} {fillers:?} retries {:?} {:?} {seconds:.2?}",
                        r.faces_kept,
                        r.quads_whole,
                        r.faces_new,
                        r.irregular_vertices,
                        r.scaled_jacobian_min,
                        r.scaled_jacobian_mean,
                        r.retries,
                        r.warnings
                    ),
                )
            }
            Err(BooleanError::Empty(why)) => {
                empty += 1;
                (false, (*why).to_owned())
            }
            Err(error) => (true, error.to_string()),
        };
        good += usize::from(!failed);
        println!("{} {title}: {seconds:.2} s {line}", if failed { "FAIL" } else { "ok  " });
        if let (Some(folder), true) = (&write, failed || all) {
            std::fs::create_dir_all(folder).expect("a folder that can be written");
            let save = |name: &str, mesh: &PolygonMesh| {
                std::fs::write(folder.join(format!("{seed}_{name}.obj")), obj::write(mesh)).expect("a file");
            };
            save("a", &meshes[a]);
            save("b", &placed);
            if let Ok(output) = &result {
                save("result", &output.mesh);
            }
        }
    }
    println!("{good} of {count} good, {empty} of them empty");
}
