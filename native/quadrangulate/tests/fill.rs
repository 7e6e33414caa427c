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
        q.iter().for_each(|&v| around[v as usize].push(f));
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
            if let Some(g) = faces_at.get(&(q[(k + 1) % 4], q[k])) {
                if reached.insert(g[0]) {
                    stack.push(g[0]);
                }
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
        if sum % 2 == 0 && sum >= 4 && least == t {
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
