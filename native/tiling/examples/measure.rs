//! Measures the tilings: how long counting, sampling and optimising take, on discs cut from random dodecagonal tilings;
//! how many outlines are refuted without a search; and how the state graph compares with the integer programme.
//!
//! `cargo run --release -p quadloom-tiling --example measure`

use mesh::Monitor;
use std::time::{Duration, Instant};
use testkit::random::Random;
use testkit::{dodecagonal, outlines};
use tiling::{BigUint, Boundary, Options, TilingError, Tilings};

fn main() -> Result<(), TilingError> {
    let monitor = Monitor::new();
    println!(
        "discs of about 370 tiles: edges, tiles, tilings, states; count, 1000 samples, fewest and most butterflies"
    );
    for (code, tiles) in discs(8.4, 6) {
        let boundary = Boundary::new(&code)?;
        let (mut tilings, count) = timed(|| Tilings::new(&boundary, &Options::default(), &monitor))?;
        let (drawn, sample) = timed(|| {
            let drawn: Vec<BigUint> = tilings.sample(1000, 1).collect();
            drawn.iter().map(|index| tilings.get(index, &monitor)).collect::<Result<Vec<_>, _>>()
        })?;
        let (fewest, minimum) = timed(|| tilings.best([0, 0, 0, 1], &monitor))?;
        let (most, maximum) = timed(|| tilings.best([0, 0, 0, -1], &monitor))?;
        let extreme = |best: Option<(_, i64)>| best.map_or(0, |(_, cost)| cost.abs());
        println!(
            "{} {tiles} {} {}; {count:.0?}, {sample:.0?} for {}, {} in {minimum:.0?}, {} in {maximum:.0?}",
            code.len(),
            tilings.count(),
            tilings.states(),
            drawn.len(),
            extreme(fewest),
            extreme(most)
        );
    }

    println!("\ndiscs of about 520 tiles: edges, tiles, tilings, states; count");
    for (code, tiles) in discs(10.0, 3) {
        let boundary = Boundary::new(&code)?;
        let (tilings, count) = timed(|| Tilings::new(&boundary, &Options::default(), &monitor))?;
        println!("{} {tiles} {} {}; {count:.0?}", code.len(), tilings.count(), tilings.states());
    }

    println!("\n75 edges, about 370 tiles: tilings, states; count");
    let seventy_five = |(code, tiles): &(Vec<u8>, usize)| code.len() == 75 && (360..=380).contains(tiles);
    for (code, _) in random_discs(8.4).filter(seventy_five).take(1) {
        let boundary = Boundary::new(&code)?;
        let (tilings, count) = timed(|| Tilings::new(&boundary, &Options::default(), &monitor))?;
        println!("{} {}; {count:.1?}", tilings.count(), tilings.states());
    }

    println!("\nrandom outlines without tilings: how many are refuted without a search, and how fast");
    let mut random = Random::new(1);
    let codes: Vec<Boundary> =
        (0..1000).map(|k| Boundary::new(&outlines::random_code(12 + k % 20, &mut random))).collect::<Result<_, _>>()?;
    let (refuted, time) =
        timed(|| codes.iter().map(|b| tiling::refute(b, &monitor)).collect::<Result<Vec<_>, TilingError>>())?;
    let untileable: Vec<bool> = codes
        .iter()
        .map(|boundary| Ok(!tiling::is_tileable(boundary, &Options::default(), &monitor)?))
        .collect::<Result<_, TilingError>>()?;
    println!(
        "{} of {} in {:.1?} each",
        refuted.iter().flatten().count(),
        untileable.iter().filter(|&&none| none).count(),
        time / codes.len() as u32
    );

    println!("\nstate graph and integer programme: edges, tilings; graph, programme for up to 10 tilings");
    for (code, _) in discs(2.5, 3).into_iter().chain(discs(3.5, 3)) {
        let boundary = Boundary::new(&code)?;
        let (tilings, graph) = timed(|| Tilings::new(&boundary, &Options::default(), &monitor))?;
        let (found, programme) = timed(|| tiling::tilings_by_programme(&boundary, 10, &monitor))?;
        let times = programme.as_secs_f64() / graph.as_secs_f64();
        println!(
            "{} {}; {graph:.0?}, {programme:.0?} for {}: {times:.0} times",
            code.len(),
            tilings.count(),
            found.len()
        );
    }
    Ok(())
}

fn timed<T>(job: impl FnOnce() -> Result<T, TilingError>) -> Result<(T, Duration), TilingError> {
    let start = Instant::now();
    let result = job()?;
    Ok((result, start.elapsed()))
}

/// Outlines of random discs with their numbers of tiles.
fn discs(radius: f64, count: usize) -> Vec<(Vec<u8>, usize)> {
    random_discs(radius).take(count).collect()
}

fn random_discs(radius: f64) -> impl Iterator<Item = (Vec<u8>, usize)> {
    let mut random = Random::new(5);
    let plane = dodecagonal::tiling(2, &mut random);
    let draw = move || dodecagonal::disc(&plane, [random.between(-12.0, 12.0), random.between(-12.0, 12.0)], radius);
    std::iter::repeat_with(draw).flatten()
}
