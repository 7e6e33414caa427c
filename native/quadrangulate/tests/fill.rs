//! Every filling is a disk with the wanted border: judged by an oracle that shares no code with the crate.

use quadrangulate::{FillError, Filler, Method, PatchTopology, fill_disk, fill_loop};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Checks a filling and returns (irregular vertices, irregular corners).
fn judge(patch: &PatchTopology, sides: &[u32], perimeter: u32) -> (u32, u32) {
    let p = perimeter as usize;
    let border: Vec<u32> = (0..perimeter).collect();
    assert_eq!(patch.border, border, "{sides:?}");
    let mut faces_at: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (f, q) in patch.quads.iter().enumerate() {
        assert_eq!(q.iter().collect::<BTreeSet<_>>().len(), 4, "{sides:?}: quad {q:?} repeats a vertex");
        for k in 0..4 {
            assert!((q[k] as usize) < patch.vertex_count);
            faces_at.entry((q[k], q[(k + 1) % 4])).or_default().push(f);
        }
    }
    let mut edges = BTreeSet::new();
    let mut on_border = BTreeSet::new();
    for (&(a, b), faces) in &faces_at {
        assert_eq!(faces.len(), 1, "{sides:?}: edge {a}-{b} used twice in one direction");
        edges.insert((a.min(b), a.max(b)));
        if !faces_at.contains_key(&(b, a)) {
            on_border.insert((a, b));
        }
    }
    let expected: BTreeSet<_> = (0..perimeter).map(|v| (v, (v + 1) % perimeter)).collect();
    assert_eq!(on_border, expected, "{sides:?}: the border");
    assert_eq!(patch.vertex_count + patch.quads.len(), edges.len() + 1, "{sides:?}: Euler characteristic");
    // One fan at every vertex: the quads around it are connected through edges at it.
    let mut around: Vec<Vec<usize>> = vec![vec![]; patch.vertex_count];
    for (f, q) in patch.quads.iter().enumerate() {
        for &v in q {
            around[v as usize].push(f);
        }
    }
    for (v, faces) in around.iter().enumerate() {
        assert!(!faces.is_empty(), "{sides:?}: vertex {v} unused");
        let mut fan = BTreeSet::from([faces[0]]);
        for _ in 0..faces.len() {
            for &f in faces {
                let q = patch.quads[f];
                let k = q.iter().position(|&u| u as usize == v).unwrap();
                for u in [q[(k + 1) % 4], q[(k + 3) % 4]] {
                    let other = |e: &(u32, u32)| faces_at.get(e).map(|s| s[0]);
                    let v = v as u32;
                    if [other(&(u, v)), other(&(v, u))].into_iter().flatten().any(|g| fan.contains(&g)) {
                        fan.insert(f);
                    }
                }
            }
        }
        assert_eq!(fan.len(), faces.len(), "{sides:?}: vertex {v} is pinched");
        assert!(v < p || faces.len() >= 3, "{sides:?}: doublet at vertex {v}");
    }
    // Connected.
    let mut reached = BTreeSet::from([0usize]);
    let mut stack = vec![0usize];
    while let Some(f) = stack.pop() {
        let q = patch.quads[f];
        for k in 0..4 {
            if let Some(g) = faces_at.get(&(q[(k + 1) % 4], q[k]))
                && reached.insert(g[0])
            {
                stack.push(g[0]);
            }
        }
    }
    assert_eq!(reached.len(), patch.quads.len(), "{sides:?}: connected");

    let mut corners = BTreeSet::new();
    let mut at = 0;
    for side in sides {
        corners.insert(at as usize);
        at += side;
    }
    let bad_corners = corners.iter().filter(|&&c| around[c].len() != 1).count() as u32;
    let irregular = (0..patch.vertex_count)
        .filter(|v| !corners.contains(v) && around[*v].len() != if *v < p { 2 } else { 4 })
        .count() as u32;
    assert_eq!((patch.irregular, patch.cost.irregular_corners), (irregular, bad_corners), "{sides:?}: counts");
    (irregular, bad_corners)
}

/// All canonical tuples of `n` sides up to `most` with an even sum and at least four edges.
fn tuples(n: u32, most: u32) -> Vec<Vec<u32>> {
    let mut all = Vec::new();
    for code in 0..u64::from(most).pow(n) {
        let t: Vec<u32> = (0..n).map(|i| 1 + (code / u64::from(most).pow(i) % u64::from(most)) as u32).collect();
        let sum: u32 = t.iter().sum();
        let turned = |mirror: bool, first: usize| -> Vec<u32> {
            let m = t.len();
            (0..m).map(|i| t[if mirror { first + m - i } else { first + i } % m]).collect()
        };
        let least = (0..t.len()).flat_map(|f| [turned(false, f), turned(true, f)]).min().unwrap();
        if sum.is_multiple_of(2) && sum >= 4 && least == t {
            all.push(t);
        }
    }
    all
}

#[derive(Default)]
struct Tally {
    methods: BTreeMap<String, u32>,
    irregular: BTreeMap<u32, u32>,
    corners: BTreeMap<u32, u32>,
    micros: Vec<u128>,
}

impl Tally {
    fn add(&mut self, sides: &[u32]) {
        let start = Instant::now();
        let patch = Filler::new().fill(sides).unwrap();
        self.micros.push(start.elapsed().as_micros());
        let (irregular, corners) = judge(&patch, sides, sides.iter().sum());
        let method = match &patch.method {
            Method::Pattern(_) => "pattern".to_string(),
            other => format!("{other:?}"),
        };
        *self.methods.entry(method).or_default() += 1;
        *self.irregular.entry(irregular).or_default() += 1;
        *self.corners.entry(corners).or_default() += 1;
    }

    fn report(&mut self, what: &str) {
        self.micros.sort_unstable();
        let n = self.micros.len();
        println!(
            "{what}: {n} tuples; {:?}; irregular {:?}; bad corners {:?}; us median {} p99 {} max {}",
            self.methods,
            self.irregular,
            self.corners,
            self.micros[n / 2],
            self.micros[n * 99 / 100],
            self.micros[n - 1]
        );
    }
}

#[test]
fn every_small_tuple_fills() {
    for (n, most) in [(1, 30), (2, 12), (3, 12), (4, 12), (5, 8), (6, 6)] {
        let mut tally = Tally::default();
        for sides in tuples(n, most) {
            tally.add(&sides);
        }
        tally.report(&format!("{n} sides"));
    }
}

/// 0 to 12 corners, mostly short sides: nothing fails, and the border is as asked.
#[test]
fn random_disks_fill() {
    let mut random = Random(7);
    let mut tally = Tally::default();
    for _ in 0..3000 {
        let n = random.below(13);
        if n == 0 {
            let perimeter = 4 + 2 * random.below(30);
            let (irregular, _) = judge(&fill_loop(perimeter).unwrap(), &[], perimeter);
            assert_eq!(irregular, 4, "a loop needs four vertices of valence 3");
            continue;
        }
        let mut sides: Vec<u32> = (0..n).map(|_| 1 + random.below(9)).collect();
        sides[0] += sides.iter().sum::<u32>() % 2;
        if sides.iter().sum::<u32>() >= 4 {
            tally.add(&sides);
        }
    }
    tally.report("random disks");
    assert!(tally.irregular.keys().max() <= Some(&16));
}

/// Long sides cost no more than the quads they make.
#[test]
fn long_sides_fill() {
    for sides in
        [vec![400, 3], vec![90, 120, 70], vec![200, 37, 190, 51], vec![60, 9, 80, 33, 40], vec![99, 30, 31, 70, 8, 40]]
    {
        let patch = fill_disk(&sides).map(|patch| judge(&patch, &sides, sides.iter().sum()));
        assert_eq!(patch.is_err(), sides.iter().sum::<u32>() % 2 == 1);
    }
}

#[test]
fn turned_sides_give_the_same_filling() {
    let sides = [3, 5, 4, 7, 1];
    let first = fill_disk(&sides).unwrap();
    for turn in 0..5 {
        let mut turned = sides.to_vec();
        turned.rotate_left(turn);
        let one = fill_disk(&turned).unwrap();
        turned.reverse();
        let other = fill_disk(&turned).unwrap();
        for patch in [one, other] {
            assert_eq!((patch.cost, patch.quads.len()), (first.cost, first.quads.len()));
        }
    }
}

#[test]
fn candidates_differ_and_come_best_first() {
    let mut filler = Filler::new();
    for sides in tuples(4, 6).into_iter().chain(tuples(6, 3)).chain([vec![9, 7, 8, 5, 6, 7]]) {
        let found = filler.candidates(&sides, 4).unwrap();
        assert!((1..=4).contains(&found.len()));
        assert!(found[0].cost <= Filler::new().fill(&sides).unwrap().cost, "{sides:?}");
        for (k, patch) in found.iter().enumerate() {
            judge(patch, &sides, sides.iter().sum());
            assert!(found[..k].iter().all(|p| p.cost <= patch.cost && p.quads != patch.quads), "{sides:?}");
        }
    }
}

#[test]
fn blunt_corners_get_two_quads() {
    let sides = [4, 3, 3, 4, 6, 4];
    let right = std::f64::consts::FRAC_PI_2;
    let angles = [right, right, 2.0 * right, right, right, 3.0 * right];
    for patch in Filler::new().candidates_with_angles(&sides, &angles, 3).unwrap() {
        let (_, bad) = judge(&patch, &sides, 24);
        assert_eq!((bad, patch.method), (2, Method::Flattened));
        assert_eq!(patch.quads.iter().flatten().filter(|&&v| v == 10).count(), 1, "corner 3 is sharp");
    }
}

#[test]
fn impossible_borders_say_why() {
    assert_eq!(fill_disk(&[2, 2, 3]), Err(FillError::OddPerimeter { perimeter: 7 }));
    assert_eq!(fill_disk(&[1, 1]), Err(FillError::PerimeterOutOfRange { perimeter: 2 }));
    assert_eq!(fill_disk(&[2, 0, 2, 4]), Err(FillError::EmptySide { side: 1 }));
    assert_eq!(fill_disk(&[u32::MAX, 1]), Err(FillError::PerimeterOutOfRange { perimeter: 1 << 32 }));
    assert_eq!(fill_loop(5), Err(FillError::OddPerimeter { perimeter: 5 }));
    assert!(fill_disk(&[]).is_err());
    assert!(Filler::new().candidates_with_angles(&[2, 2], &[1.0], 1).is_err());
}

struct Random(u64);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(n)) as u32
    }
}
