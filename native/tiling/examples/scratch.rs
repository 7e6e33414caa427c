use mesh::Monitor;
use std::time::Instant;
use testkit::random::Random;
use testkit::{dodecagonal, outlines};
use tiling::*;
fn exchange(code: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let n = code.len();
    let k = random.index(n);
    let change: i8 = match code[k] { 5 => -1, 7 => 1, _ => return None };
    let mut c = code.to_vec();
    c[k] = 12 - code[k];
    for j in [(k + n - 1) % n, (k + 1) % n] { c[j] = c[j].checked_add_signed(change)?; }
    (c.iter().all(|a| (2..12).contains(a)) && Boundary::new(&c).is_ok()).then_some(c)
}
fn main() {
    let monitor = Monitor::new();
    let mut random = Random::new(5);
    let args: Vec<String> = std::env::args().collect();
    let which = args[1].as_str();
    let n: usize = args[2].parse().unwrap();
    let plane = dodecagonal::tiling(2, &mut random);
    for case in 0..args[3].parse().unwrap() {
        let code = match which {
            "patch" => loop {
                let sides = 3 + random.index(4);
                let angles: Vec<u8> = (0..sides).map(|_| 2 + random.index(6) as u8).collect();
                let code: Vec<u8> = angles.iter().flat_map(|&a| { let l = 1 + random.index(n); [vec![a], vec![6; l - 1]].concat() }).collect();
                if Boundary::new(&code).is_ok() { break code }
            },
            "given" => args[5].split(',').map(|a| a.trim().parse().unwrap()).collect(),
            "zono" => loop {
                let l: Vec<usize> = (0..6).map(|_| random.index(n)).collect();
                let dirs: Vec<i32> = (0..12).flat_map(|d| vec![d as i32; l[d % 6]]).collect();
                let m = dirs.len();
                let code: Vec<u8> = (0..m).map(|k| (dirs[(k + m - 1) % m] + 18 - dirs[k]).rem_euclid(12) as u8).collect();
                if Boundary::new(&code).is_ok() { break code }
            },
            "random" => outlines::random_code(n, &mut random),
            _ => {
                let r = n as f64 / 8.9;
                let (mut code, _) = loop { if let Some(c) = dodecagonal::disc(&plane, [random.between(-9.0, 9.0), random.between(-9.0, 9.0)], r) { break c } };
                let mut done = 0;
                while done < 1 + case % 4 { if let Some(c) = exchange(&code, &mut random) { code = c; done += 1; } }
                code
            }
        };
        let b = Boundary::new(&code).unwrap();
        let c = Certificate::new(b.directions());
        let t = Instant::now();
        let found = tile_with_rhombi(&b, 0, &Options { memory: args.get(4).map_or(1 << 30, |m| m.parse().unwrap()) }, &monitor);
        match found {
            Ok(Some(f)) => println!("{} tiles {} defect {} -> {}>={} rhombi depth {:.2} in {:.1?}", code.len(), f.tiling.tiles.len(), c.defect, f.rhombi, f.at_least, f.depth, t.elapsed()),
            Ok(None) => println!("{} defect {} none {:?} in {:.1?}", code.len(), c.defect, c, t.elapsed()),
            Err(e) => println!("{} {e} in {:.1?} {code:?}", code.len(), t.elapsed()),
        }
    }
}
