//! Listing, sampling, the best and the symmetric tilings, checked on the whole list; limits and cancelling.

use mesh::Monitor;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};
use testkit::random::Random;
use testkit::{dodecagonal, outlines};
use tiling::{BigUint, Boundary, Certificate, Isometry, Kind, Options, Point, Tile, Tiling, TilingError, Tilings};

fn boundary(code: &[u8]) -> Boundary {
    Boundary::new(code).unwrap()
}

fn tilings(code: &[u8]) -> Tilings {
    Tilings::new(&boundary(code), &Options::default(), &Monitor::new()).unwrap()
}

fn list(tilings: &mut Tilings) -> Vec<Tiling> {
    let count: u32 = tilings.count().try_into().unwrap();
    (0..count).map(|k| tilings.get(&k.into(), &Monitor::new()).unwrap().unwrap()).collect()
}

fn as_set(tiling: &Tiling) -> BTreeSet<Tile> {
    tiling.tiles.iter().map(|tile| tile.normalised()).collect()
}

/// The edges of the tiles cancel but for the outline's, and the tiles are those that the certificate promises: so they
/// cover the region once, as their areas add up to it and their edges fit.
fn assert_tiles(tiling: &Tiling, boundary: &Boundary) {
    let mut edges = BTreeSet::new();
    for tile in &tiling.tiles {
        let corners: Vec<Point> = tile.corners().collect();
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            if !edges.remove(&(b, a)) {
                assert!(edges.insert((a, b)), "an edge twice on one side");
            }
        }
    }
    let points = boundary.points();
    let outline = (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()])).collect();
    assert_eq!(edges, outline);
    let certificate = Certificate::new(boundary.directions());
    let squares = tiling.tiles.iter().filter(|tile| tile.kind == Kind::Square).count();
    assert_eq!(squares, certificate.square_count() as usize);
    assert_eq!(tiling.tiles.len() - squares, certificate.triangle_count() as usize);
}

/// An outline of a dodecagonal tiling with this many tilings, at most.
fn disc(radius: f64, seed: u64, most: u32) -> Vec<u8> {
    let mut random = Random::new(seed);
    let plane = dodecagonal::tiling(2, &mut random);
    loop {
        let centre = [random.between(-9.0, 9.0), random.between(-9.0, 9.0)];
        let Some((code, _)) = dodecagonal::disc(&plane, centre, radius) else { continue };
        if (most / 4..most).contains(&tilings(&code).count().try_into().unwrap()) {
            return code;
        }
    }
}

#[test]
fn the_list_has_each_tiling_once() {
    for code in [disc(5.0, 1, 200), disc(6.0, 2, 1000), [5, 6, 6, 5, 6].repeat(6)] {
        let mut all = tilings(&code);
        let listed = list(&mut all);
        for tiling in &listed {
            assert_tiles(tiling, &boundary(&code));
        }
        assert_eq!(listed.iter().map(as_set).collect::<BTreeSet<_>>().len(), listed.len());
        let past_the_end = all.count().clone();
        assert_eq!(all.get(&past_the_end, &Monitor::new()), Ok(None));
        assert_eq!(list(&mut tilings(&code)), listed, "another run lists them in another order");
    }
}

/// Independent of the state graph's classes: configurations are read off the tiles of every tiling.
#[test]
fn the_best_is_the_best_of_the_list() {
    for code in [disc(5.0, 3, 200), disc(6.0, 4, 1000), [5, 6, 5].repeat(6)] {
        let mut all = tilings(&code);
        let counts: Vec<[usize; 4]> = list(&mut all).iter().map(Tiling::configuration_counts).collect();
        for weights in [[0, 0, 0, 1], [0, 0, 0, -1], [3, -2, 5, 1], [0, 1, 0, 0], [-7, 0, 2, 0]] {
            let sum = |counts: &[usize; 4]| (0..4).map(|k| counts[k] as i64 * weights[k]).sum::<i64>();
            let (best, least) = all.best(weights, &Monitor::new()).unwrap().unwrap();
            assert_tiles(&best, &boundary(&code));
            assert_eq!(sum(&best.configuration_counts()), least);
            assert_eq!(Some(least), counts.iter().map(sum).min());
        }
    }
}

/// The symmetric tilings are those of the list that equal their image.
#[test]
fn symmetric_tilings_are_those_of_the_list() {
    let ring = [5, 6, 5].repeat(6);
    let stadium = [vec![6; 4], vec![5; 6], vec![6; 4], vec![5; 6]].concat();
    let star = [3, 8, 5, 5, 8].repeat(4);
    let mut some = 0;
    for code in [vec![5; 12], ring, stadium, star, vec![3, 6, 3, 6, 3, 6, 3, 6]] {
        let Ok(outline) = Boundary::new(&code) else { continue };
        let listed = list(&mut tilings(&code));
        let symmetries = outline.symmetries();
        assert_eq!(symmetries[0], Isometry::default());
        for pair in symmetries.iter().flat_map(|f| symmetries.iter().map(move |g| [*f, *g])) {
            let mut symmetric = Tilings::symmetric(&outline, &pair, &Options::default(), &Monitor::new()).unwrap();
            let is_symmetric = |tiling: &&Tiling| {
                let image = |g: &Isometry| tiling.tiles.iter().map(|tile| tile.mapped(*g).normalised()).collect();
                pair.iter().all(|g| as_set(tiling) == image(g))
            };
            let expected: BTreeSet<_> = listed.iter().filter(is_symmetric).map(as_set).collect();
            assert_eq!(list(&mut symmetric).iter().map(as_set).collect::<BTreeSet<_>>(), expected, "{code:?} {pair:?}");
            some += expected.len();
        }
    }
    assert!(some > 100);
}

#[test]
fn a_foreign_symmetry_is_refused() {
    let quarter = Isometry { mirror: false, turn: 3, shift: Point::ORIGIN };
    let refused = Tilings::symmetric(&boundary(&[3; 4]), &[quarter], &Options::default(), &Monitor::new());
    assert!(matches!(refused, Err(TilingError::Option(_))));
}

/// Chi-squared with 100 draws a tiling: beyond five standard deviations once in millions of seeds.
fn assert_uniform(all: &Tilings) {
    let count: u32 = all.count().try_into().unwrap();
    let draws = 100 * count as usize;
    let mut seen: BTreeMap<BigUint, u32> = BTreeMap::new();
    for index in all.sample(draws, 7) {
        *seen.entry(index).or_default() += 1;
    }
    let expected = draws as f64 / f64::from(count);
    let missing = f64::from(count) - seen.len() as f64;
    let chi: f64 =
        seen.values().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum::<f64>() + missing * expected;
    let freedom = f64::from(count - 1);
    assert!((chi - freedom).abs() < 5.0 * (2.0 * freedom).sqrt(), "{chi} with {freedom} degrees of freedom");
}

#[test]
fn samples_are_uniform_and_repeat() {
    let all = tilings(&disc(6.0, 6, 1000));
    assert_uniform(&all);
    assert!(all.sample(9, 7).eq(all.sample(9, 7)) && all.sample(9, 7).ne(all.sample(9, 8)));
}

/// An outline of 50 edges and 176 tiles; that samples are all different tilings is for the tiles to say.
#[test]
fn samples_of_895_tilings_are_uniform() {
    let code = [
        2, 9, 3, 7, 4, 9, 2, 9, 5, 3, 10, 2, 9, 5, 3, 10, 2, 9, 5, 3, 10, 2, 10, 3, 5, 9, 2, 7, 9, 2, 7, 7, 2, 9, 5, 5,
        8, 2, 9, 4, 7, 5, 5, 7, 5, 5, 7, 5, 5, 9,
    ];
    let mut all = tilings(&code);
    assert_eq!(all.count(), &895u32.into());
    assert_uniform(&all);
    assert_eq!(list(&mut all).iter().map(as_set).collect::<BTreeSet<_>>().len(), 895);
}

#[test]
fn a_tiling_is_found_without_counting() {
    let monitor = Monitor::new();
    let find = |code: &[u8], seed| tiling::find_tiling(&boundary(code), seed, &Options::default(), &monitor).unwrap();
    // Some 1,200 tiles, far too many to count.
    let mut random = Random::new(3);
    let plane = dodecagonal::tiling(2, &mut random);
    let code = (0..).find_map(|k| dodecagonal::disc(&plane, [0.1 * f64::from(k), 0.3], 15.0)).unwrap().0;
    let found: Vec<Tiling> = (0..3).map(|seed| find(&code, seed).unwrap()).collect();
    for tiling in &found {
        assert_tiles(tiling, &boundary(&code));
    }
    assert_ne!(found[0], found[1]);
    assert_eq!(find(&code, 2).as_ref(), Some(&found[2]));
    for _ in 0..200 {
        let code = outlines::random_code(8 + random.index(12), &mut random);
        assert_eq!(find(&code, 1).is_some(), outlines::count_by_trying(&code) > 0);
    }
}

#[test]
fn counts_pass_128_bits() {
    // Dodecagons in a chain, a square between neighbours: each has two tilings.
    let chain = |dodecagons: usize| {
        let end = [&[8], &[5; 10][..], &[8]].concat();
        let middle = [8, 5, 5, 5, 5, 8].repeat(dodecagons - 2);
        [&end[..], &middle, &end, &middle].concat()
    };
    assert_eq!(outlines::count_by_trying(&chain(2)), 4);
    let code = chain(130);
    let mut all = tilings(&code);
    assert_eq!(all.count(), &(BigUint::from(1u32) << 130));
    let last = all.count() - 1u32;
    assert_tiles(&all.get(&last, &Monitor::new()).unwrap().unwrap(), &boundary(&code));
}

#[test]
fn the_memory_limit_is_an_error_that_counts_states() {
    let code = disc(6.0, 8, 4000);
    let options = Options { memory: 4000 };
    match Tilings::new(&boundary(&code), &options, &Monitor::new()) {
        Err(TilingError::Memory { states, bytes: 4000 }) => assert!(states > 1),
        other => panic!("{:?}", other.map(|tilings| tilings.states())),
    }
}

#[test]
fn cancelling_is_heard_in_time() {
    let mut random = Random::new(1);
    let plane = dodecagonal::tiling(2, &mut random);
    let code = (0..).find_map(|k| dodecagonal::disc(&plane, [0.1 * f64::from(k), 0.3], 13.0)).unwrap().0;
    let outline = boundary(&code);
    let monitor = Monitor::new();
    std::thread::scope(|scope| {
        let job = scope.spawn(|| Tilings::new(&outline, &Options::default(), &monitor).map(|tilings| tilings.states()));
        std::thread::sleep(Duration::from_millis(300));
        assert!(monitor.progress().0 == "count");
        let asked = Instant::now();
        monitor.cancel();
        assert!(matches!(job.join().unwrap(), Err(TilingError::Cancelled(_))));
        assert!(asked.elapsed() < Duration::from_millis(200), "{:?}", asked.elapsed());
    });
}

/// The certificate and the tiles along the border, without forced moves.
#[test]
fn most_untileable_codes_are_refuted_without_a_search() {
    let monitor = Monitor::new();
    let mut random = Random::new(4);
    let (mut untileable, mut refuted, mut in_one_pass, mut by_areas) = (0, 0, 0, 0);
    while untileable < 1000 {
        let code = match untileable % 3 {
            0 => outlines::random_code(8 + random.index(8), &mut random),
            1 => outlines::random_code(12 + random.index(18), &mut random),
            // Near one that can be tiled: two edges exchanged.
            _ => {
                let mut code = outlines::random_tileable(6 + random.index(25), &mut random);
                let k = random.index(code.len());
                let last = code.len() - 1;
                let turn: i8 = match code[k] {
                    5 => 1,
                    7 => -1,
                    _ => continue,
                };
                code[k] = 12 - code[k];
                for neighbour in [if k == 0 { last } else { k - 1 }, if k == last { 0 } else { k + 1 }] {
                    code[neighbour] = code[neighbour].wrapping_add_signed(-turn);
                }
                if Boundary::new(&code).is_err() {
                    continue;
                }
                code
            }
        };
        let outline = boundary(&code);
        let reason = tiling::refute(&outline, &monitor).unwrap();
        let certificate = Certificate::new(outline.directions());
        let conflict = certificate.border_conflict(outline.directions());
        if tiling::is_tileable(&outline, &Options::default(), &monitor).unwrap() {
            assert_eq!((reason, conflict), (None, None), "{code:?}");
        } else {
            untileable += 1;
            refuted += usize::from(reason.is_some());
            by_areas += usize::from(certificate.refutes());
            in_one_pass += usize::from(certificate.refutes() || conflict.is_some());
        }
    }
    println!("of 1000: {by_areas} by areas, {in_one_pass} with the border, {refuted} with forced moves");
    assert!(by_areas >= 900 && in_one_pass >= 985 && refuted >= in_one_pass, "{by_areas} {in_one_pass} {refuted}");
}

#[test]
fn a_border_that_no_tiles_fit_is_named() {
    let mut named = 0;
    let mut random = Random::new(2);
    for _ in 0..3000 {
        let outline = boundary(&outlines::random_code(8 + random.index(8), &mut random));
        let certificate = Certificate::new(outline.directions());
        if let (false, Some(conflict)) = (certificate.refutes(), certificate.border_conflict(outline.directions())) {
            assert_eq!(outlines::count_by_trying(outline.code()), 0);
            let found = tiling::explain_boundary(outline.code(), &Options::default(), &Monitor::new()).unwrap();
            assert_eq!((found.verdict, &found.sentence), (tiling::Verdict::Refuted, &conflict.to_string()));
            named += found.corners.len();
        }
    }
    assert!(named > 10, "{named}");
    // One that neither finds: the search does.
    let outline = boundary(&[7, 6, 7, 4, 2, 5, 7, 4, 10, 3, 5, 4, 4, 4]);
    assert_eq!(Certificate::new(outline.directions()).border_conflict(outline.directions()), None);
    assert!(!tiling::is_tileable(&outline, &Options::default(), &Monitor::new()).unwrap());
}
