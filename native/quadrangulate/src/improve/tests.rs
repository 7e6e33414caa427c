//! Bad starts of several kinds, improved; an oracle of its own checks what must never change.

use super::*;
use std::collections::{BTreeMap, BTreeSet};
use surface::smooth_star::SurfacePoint;

struct Plane;
impl Reference for Plane {
    fn project_near(&self, p: DVec3, _: &mut u32) -> SurfacePoint {
        SurfacePoint { point: DVec3::new(p.x, p.y, 0.0), normal: DVec3::Z }
    }
}

struct Sphere(f64);
impl Reference for Sphere {
    fn project_near(&self, p: DVec3, _: &mut u32) -> SurfacePoint {
        SurfacePoint { point: p.normalize() * self.0, normal: p.normalize() }
    }
}

/// Pseudo-random integers below `n`, the same every run.
struct Random(u64);
impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n
    }
    fn signed(&mut self) -> f64 {
        self.below(2_000_001) as f64 / 1e6 - 1.0
    }
}

/// A band of `rings` by `around` cells with unit edges at its middle, and whether its middle ring is a feature.
struct Band {
    around: usize,
    rings: usize,
    sphere: Option<f64>,
    feature: bool,
}

struct Start {
    patch: QuadPatch,
    outside: Vec<u32>,
    features: Vec<[u32; 2]>,
    chains: Vec<Polyline>,
    sphere: Option<f64>,
}

impl Start {
    fn setting<'a>(&'a self, surfaces: &'a [&'a dyn Reference]) -> Setting<'a> {
        let Self { features, outside, chains, .. } = self;
        Setting { features, outside, chains, surfaces, slack: NEAREST }
    }
}

impl Band {
    fn position(&self, i: f64, j: f64) -> DVec3 {
        let (radius, angle) =
            (self.around as f64 / 6.3 + j - self.rings as f64 / 2.0, std::f64::consts::TAU * i / self.around as f64);
        let flat = DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
        self.sphere.map_or(flat, |r| DVec3::new(flat.x, flat.y, 0.7 * r).normalize() * r)
    }

    fn vertex(&self, i: usize, j: usize) -> u32 {
        (j * self.around + i % self.around) as u32
    }

    /// The regular grid of the band.
    fn start(&self) -> Start {
        let mut start = Start {
            patch: QuadPatch::default(),
            outside: vec![],
            features: vec![],
            chains: vec![],
            sphere: self.sphere,
        };
        for j in 0..=self.rings {
            let middle = self.feature && j == self.rings / 2;
            if middle {
                let ring: Vec<DVec3> =
                    (0..=self.around).map(|i| self.position((i % self.around) as f64, j as f64)).collect();
                start.chains.push(Polyline::new(ring));
            }
            for i in 0..self.around {
                let border = j % self.rings == 0;
                start.patch.positions.push(self.position(i as f64, j as f64));
                start.outside.push(if border { 2 } else { 0 });
                start.patch.constraints.push(match (border, middle) {
                    (true, _) => Constraint::Fixed,
                    (_, true) => Constraint::OnChain(0),
                    _ => Constraint::Free,
                });
                if middle {
                    start.features.push([self.vertex(i, j), self.vertex(i + 1, j)]);
                }
                if j < self.rings {
                    start.patch.quads.push([
                        self.vertex(i, j),
                        self.vertex(i, j + 1),
                        self.vertex(i + 1, j + 1),
                        self.vertex(i + 1, j),
                    ]);
                    start.patch.surface_of.push(0);
                }
            }
        }
        start
    }

    /// The grid after random operators, positions left where they are: tangled, but its best connectivity is known.
    fn scrambled(&self, operators: usize, seed: u64) -> Start {
        let mut start = self.start();
        let patch = start.patch;
        let n = patch.positions.len();
        let mut mesh =
            Editable::new(&patch.quads, patch.surface_of, patch.positions, patch.constraints, &start.features).unwrap();
        let mut random = Random(seed);
        let mut applied = 0;
        while applied < operators {
            let v = random.below(n) as u32;
            let choice = mesh.operators_at(v);
            if !choice.is_empty() && mesh.apply(choice[random.below(choice.len())]).is_some() {
                applied += 1;
            }
        }
        let (patch, source) = mesh.compact(n);
        let new: BTreeMap<u32, u32> = source.iter().enumerate().map(|(new, &old)| (old, new as u32)).collect();
        start.outside = source.iter().map(|&old| start.outside.get(old as usize).copied().unwrap_or(0)).collect();
        start.features = start.features.iter().map(|edge| edge.map(|v| new[&v])).collect();
        start.patch = patch;
        start
    }

    /// Triangles of the grid with random diagonals, paired at random; what is left over makes every face split at its centre.
    fn paired(&self, jitter: f64, seed: u64) -> Start {
        let grid = self.start();
        let mut random = Random(seed);
        let mut positions = grid.patch.positions.clone();
        for (p, c) in positions.iter_mut().zip(&grid.patch.constraints) {
            if *c == Constraint::Free {
                *p += DVec3::new(random.signed(), random.signed(), 0.0) * jitter;
            }
        }
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for q in &grid.patch.quads {
            let k = random.below(2);
            let at = |i: usize| q[(k + i) % 4];
            triangles.extend([[at(0), at(1), at(2)], [at(0), at(2), at(3)]]);
        }
        let features: BTreeSet<(u32, u32)> = grid.features.iter().flat_map(|&[a, b]| [(a, b), (b, a)]).collect();
        let owner: BTreeMap<(u32, u32), usize> = triangles
            .iter()
            .enumerate()
            .flat_map(|(t, tri)| (0..3).map(move |k| ((tri[k], tri[(k + 1) % 3]), t)))
            .collect();
        let mut faces: Vec<Vec<u32>> = Vec::new();
        let mut taken = vec![false; triangles.len()];
        for t in 0..triangles.len() {
            if taken[t] {
                continue;
            }
            taken[t] = true;
            let first = random.below(3);
            let partner = (0..3).map(|k| (first + k) % 3).find_map(|k| {
                let (a, b) = (triangles[t][k], triangles[t][(k + 1) % 3]);
                let other = *owner.get(&(b, a))?;
                (!taken[other] && !features.contains(&(a, b))).then_some((k, other))
            });
            let tri = triangles[t];
            if let Some((k, other)) = partner {
                taken[other] = true;
                let (a, b, c) = (tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]);
                let d = *triangles[other].iter().find(|&&w| w != a && w != b).unwrap();
                faces.push(vec![a, d, b, c]);
            } else {
                faces.push(tri.to_vec());
            }
        }
        let mut start = Start {
            patch: QuadPatch { positions, constraints: grid.patch.constraints.clone(), ..QuadPatch::default() },
            outside: grid.outside.clone(),
            features: vec![],
            chains: grid.chains.clone(),
            sphere: self.sphere,
        };
        let mut middle: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for face in &faces {
            let n = face.len();
            let mean = |vs: &[u32], p: &[DVec3]| vs.iter().map(|&v| p[v as usize]).sum::<DVec3>() / vs.len() as f64;
            let centre = start.patch.positions.len() as u32;
            start.patch.positions.push(mean(face, &start.patch.positions));
            start.patch.constraints.push(Constraint::Free);
            start.outside.push(0);
            let mids: Vec<u32> = (0..n)
                .map(|k| {
                    let (a, b) = (face[k], face[(k + 1) % n]);
                    *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        let border = !(owner.contains_key(&(a, b)) && owner.contains_key(&(b, a)));
                        start.patch.positions.push(mean(&[a, b], &start.patch.positions));
                        start.outside.push(if border { 2 } else { 0 });
                        start.patch.constraints.push(match (border, features.contains(&(a, b))) {
                            (true, _) => Constraint::Fixed,
                            (_, true) => Constraint::OnChain(0),
                            _ => Constraint::Free,
                        });
                        start.patch.positions.len() as u32 - 1
                    })
                })
                .collect();
            for k in 0..n {
                start.patch.quads.push([face[k], mids[k], centre, mids[(k + n - 1) % n]]);
                start.patch.surface_of.push(0);
            }
        }
        for [a, b] in grid.features {
            let m = middle[&(a.min(b), a.max(b))];
            start.features.extend([[a, m], [m, b]]);
        }
        start
    }
}

/// Directed edges with their counts.
fn directed_edges(quads: &[[u32; 4]]) -> BTreeMap<(u32, u32), usize> {
    let mut edges = BTreeMap::new();
    for q in quads {
        for k in 0..4 {
            *edges.entry((q[k], q[(k + 1) % 4])).or_insert(0) += 1;
        }
    }
    edges
}

fn euler(patch: &QuadPatch) -> i64 {
    let edges: BTreeSet<(u32, u32)> = directed_edges(&patch.quads).keys().map(|&(a, b)| (a.min(b), a.max(b))).collect();
    let vertices: BTreeSet<u32> = patch.quads.iter().flatten().copied().collect();
    vertices.len() as i64 - edges.len() as i64 + patch.quads.len() as i64
}

fn border(quads: &[[u32; 4]]) -> BTreeSet<(u32, u32)> {
    let edges = directed_edges(quads);
    edges.keys().copied().filter(|&(a, b)| !edges.contains_key(&(b, a))).collect()
}

/// Irregular vertices of a band whose every border and feature vertex is straight: interior and feature 4, border 2 quads.
fn irregular_oracle(patch: &QuadPatch) -> usize {
    let on_border: BTreeSet<u32> = border(&patch.quads).into_iter().flat_map(|(a, b)| [a, b]).collect();
    let mut count = vec![0; patch.positions.len()];
    for &v in patch.quads.iter().flatten() {
        count[v as usize] += 1;
    }
    (0..count.len())
        .filter(|&v| count[v] != 0 && count[v] != if on_border.contains(&(v as u32)) { 2 } else { 4 })
        .count()
}

/// Least and mean sine over corners, signed against the outward direction.
fn sines(patch: &QuadPatch, sphere: bool) -> (f64, f64) {
    let (mut least, mut sum) = (f64::INFINITY, 0.0);
    for q in &patch.quads {
        let p = q.map(|v| patch.positions[v as usize]);
        let mut worst = f64::INFINITY;
        for k in 0..4 {
            let up = if sphere { p[k].normalize() } else { DVec3::Z };
            let (e, f) = (p[(k + 1) % 4] - p[k], p[(k + 3) % 4] - p[k]);
            worst = worst.min(e.cross(f).dot(up) / (e.length() * f.length()));
        }
        least = least.min(worst);
        sum += worst;
    }
    (least, sum / patch.quads.len() as f64)
}

fn run(name: &str, start: &Start) -> Improved {
    let sphere = start.sphere.map(Sphere);
    let surfaces: [&dyn Reference; 1] = [sphere.as_ref().map_or(&Plane as &dyn Reference, |s| s)];
    let setting = start.setting(&surfaces);
    let mut smoothed = start.patch.clone();
    smoothed.smooth(&setting, &SmoothOptions::default(), &Monitor::new()).unwrap();
    let clock = std::time::Instant::now();
    let improved = improve(start.patch.clone(), &setting, &ImproveOptions::default(), &Monitor::new()).unwrap();
    let seconds = clock.elapsed().as_secs_f64();
    let curved = sphere.is_some();
    let ((a, b), (c, d), (e, f)) =
        (sines(&start.patch, curved), sines(&smoothed, curved), sines(&improved.patch, curved));
    println!(
        "{name:24} quads {:5} -> {:5}  irregular {:4} -> {:4}  min sine {a:5.2} -> {c:5.2} -> {e:5.2}  mean {b:4.2} -> {d:4.2} -> {f:4.2}  trials {:4} kept {:4}  {seconds:.2} s",
        start.patch.quads.len(),
        improved.patch.quads.len(),
        irregular_oracle(&start.patch),
        irregular_oracle(&improved.patch),
        improved.report.trials,
        improved.report.changes,
    );
    if let Ok(folder) = std::env::var("QUADLOOM_PICTURES") {
        draw(&smoothed, &start.features, &format!("{folder}/{}-smoothed.svg", name.replace(' ', "-")));
        draw(&improved.patch, &improved.features, &format!("{folder}/{}-improved.svg", name.replace(' ', "-")));
    }
    check(start, &improved);
    improved
}

fn draw(patch: &QuadPatch, features: &[[u32; 2]], path: &str) {
    use std::fmt::Write;
    let reach = patch.positions.iter().fold(0.0_f64, |r, p| r.max(p.x.abs()).max(p.y.abs())) * 1.03;
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='900' viewBox='{} {} {} {}'>",
        -reach,
        -reach,
        2.0 * reach,
        2.0 * reach
    );
    svg += "<rect x='-999' y='-999' width='1998' height='1998' fill='white'/>";
    let mut count = vec![0; patch.positions.len()];
    for quad in &patch.quads {
        let points: Vec<String> =
            quad.iter().map(|&v| patch.positions[v as usize]).map(|p| format!("{:.3},{:.3}", p.x, -p.y)).collect();
        writeln!(
            svg,
            "<polygon points='{}' fill='#dde8f5' stroke='#335' stroke-width='{}'/>",
            points.join(" "),
            reach / 500.0
        )
        .unwrap();
        for &v in quad {
            count[v as usize] += 1;
        }
    }
    for edge in features {
        let [a, b] = edge.map(|v| patch.positions[v as usize]);
        writeln!(
            svg,
            "<line x1='{}' y1='{}' x2='{}' y2='{}' stroke='red' stroke-width='{}'/>",
            a.x,
            -a.y,
            b.x,
            -b.y,
            reach / 200.0
        )
        .unwrap();
    }
    let on_border: BTreeSet<u32> = border(&patch.quads).into_iter().flat_map(|(a, b)| [a, b]).collect();
    for (v, p) in patch.positions.iter().enumerate() {
        let ideal = if on_border.contains(&(v as u32)) { 2 } else { 4 };
        if count[v] != ideal {
            let colour = if count[v] < ideal { "#06c" } else { "#c30" };
            writeln!(svg, "<circle cx='{}' cy='{}' r='{}' fill='{colour}'/>", p.x, -p.y, reach / 110.0).unwrap();
        }
    }
    svg += "</svg>";
    std::fs::write(path, svg).unwrap();
}

/// What must hold whatever the search does.
fn check(start: &Start, improved: &Improved) {
    let (before, after) = (&start.patch, &improved.patch);
    let edges = directed_edges(&after.quads);
    assert!(edges.values().all(|&n| n == 1), "an edge repeats");
    assert_eq!(euler(before), euler(after));
    let back: BTreeSet<(u32, u32)> =
        border(&after.quads).iter().map(|&(a, b)| (improved.source[a as usize], improved.source[b as usize])).collect();
    assert_eq!(back, border(&before.quads), "the border");
    assert_eq!(improved.features.len(), start.features.len());
    for (new, old) in improved.features.iter().zip(&start.features) {
        assert_eq!(new.map(|v| improved.source[v as usize]), *old);
        assert!(
            edges.contains_key(&(new[0], new[1])) && edges.contains_key(&(new[1], new[0])),
            "a feature edge is gone"
        );
    }
    let mut sets: Vec<BTreeSet<u32>> = after.quads.iter().map(|q| q.iter().copied().collect()).collect();
    assert!(sets.iter().all(|s| s.len() == 4));
    sets.sort();
    assert!(sets.windows(2).all(|w| w[0] != w[1]), "a quad repeats");
    let on_border: BTreeSet<u32> = border(&after.quads).into_iter().flat_map(|(a, b)| [a, b]).collect();
    let mut count = vec![0; after.positions.len()];
    for &v in after.quads.iter().flatten() {
        count[v as usize] += 1;
    }
    for (v, &n) in count.iter().enumerate() {
        assert!(n >= 3 || on_border.contains(&(v as u32)), "vertex {v} has valence {n}");
        let old = improved.source[v];
        if after.constraints[v] == Constraint::Fixed {
            assert_eq!(after.positions[v], before.positions[old as usize], "fixed vertex {v} moved");
        }
        if let Some(radius) = start.sphere
            && after.constraints[v] == Constraint::Free
        {
            assert!((after.positions[v].length() - radius).abs() < 1e-9);
        }
    }
    // The report also counts a feature vertex with one quad on one side and three on the other.
    assert!(improved.report.irregular >= irregular_oracle(after));
}

fn band(sphere: Option<f64>, feature: bool) -> Band {
    Band { around: 40, rings: 6, sphere, feature }
}

#[test]
fn random_pairing_loses_half_its_irregular_vertices() {
    for (name, b) in [
        ("pairs flat", band(None, false)),
        ("pairs flat curve", band(None, true)),
        ("pairs sphere curve", band(Some(12.0), true)),
    ] {
        let start = b.paired(0.35, 7);
        let improved = run(name, &start);
        assert!(2 * irregular_oracle(&improved.patch) <= irregular_oracle(&start.patch));
        let (least, mean) = sines(&improved.patch, start.sphere.is_some());
        assert!(least > 0.3 && mean > 0.85, "{name}: {least} {mean}");
    }
}

#[test]
fn a_scrambled_band_is_combed() {
    for (name, b, operators) in [
        ("scramble flat 20", band(None, false), 20),
        ("scramble flat 150", band(None, false), 150),
        ("scramble curve 60", band(None, true), 60),
        ("scramble sphere 60", band(Some(12.0), true), 60),
    ] {
        let start = b.scrambled(operators, 3);
        let improved = run(name, &start);
        assert!(2 * irregular_oracle(&improved.patch) <= irregular_oracle(&start.patch));
        let (least, mean) = sines(&improved.patch, start.sphere.is_some());
        assert!(least > 0.1 && mean > 0.75, "{name}: {least} {mean}");
    }
}

#[test]
fn the_same_start_gives_the_same_bytes() {
    let start = band(None, true).scrambled(40, 9);
    let setting = start.setting(&[&Plane]);
    let run = || improve(start.patch.clone(), &setting, &ImproveOptions::default(), &Monitor::new()).unwrap();
    assert_eq!(run(), run());
}

#[test]
fn bad_starts_and_cancelling_are_errors() {
    let start = band(None, true).start();
    let setting = start.setting(&[&Plane]);
    let run = |patch: &QuadPatch, setting: &Setting<'_>, monitor: &Monitor| {
        improve(patch.clone(), setting, &ImproveOptions::default(), monitor).unwrap_err()
    };
    let monitor = Monitor::new();
    let mut doubled = start.patch.clone();
    doubled.quads.push(doubled.quads[3]);
    doubled.surface_of.push(0);
    assert_eq!(run(&doubled, &setting, &monitor), ImproveError::NotManifold { quad: doubled.quads.len() - 1 });
    let loose = Setting { features: &[[0, 50]], ..setting };
    assert_eq!(run(&start.patch, &loose, &monitor), ImproveError::NoSuchFeature { feature: 0 });
    let short = Setting { outside: &[], ..setting };
    let wanted = start.patch.positions.len();
    let length = SmoothError::Length { array: "outside", found: 0, wanted };
    assert_eq!(run(&start.patch, &short, &monitor), ImproveError::Input(length));
    monitor.cancel();
    assert_eq!(run(&start.patch, &setting, &monitor), ImproveError::Cancelled(Cancelled));
}

#[path = "refill_tests.rs"]
mod refill_tests;

#[test]
fn a_corner_keeps_its_quads_within_the_slack() {
    // A corner of 130 degrees with two quads: 1.44 quads are nearer to one than to two.
    let to = |degrees: f64, r: f64| DVec3::new(r * degrees.to_radians().cos(), r * degrees.to_radians().sin(), 0.0);
    let positions = vec![DVec3::ZERO, to(0.0, 1.0), to(35.0, 1.5), to(65.0, 1.0), to(95.0, 1.5), to(130.0, 1.0)];
    let wanted = |slack: f64| {
        let setting = Setting { features: &[], outside: &[0; 6], chains: &[], surfaces: &[&Plane], slack };
        let constraints = vec![Constraint::Fixed; 6];
        let quads = [[0, 1, 2, 3], [0, 3, 4, 5]];
        let mut mesh = Editable::new(&quads, vec![0; 2], positions.clone(), constraints, &[]).unwrap();
        set_ideals(&mut mesh, &setting);
        mesh.missing(0, 0)
    };
    assert_eq!([NEAREST, 0.5, 0.6, 1.0].map(wanted), [-1, -1, 0, 0]);
}
