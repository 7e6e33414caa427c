//! The cutting of chords against all cuts.

use super::*;
use proptest::prelude::*;

/// The cost of runs, from the definition.
fn cost(terms: &[Term], runs: &[Vec<usize>], price: f64) -> f64 {
    let spread = |run: &Vec<usize>| {
        let weight: f64 = run.iter().map(|&i| terms[i].weight).sum();
        let mean = run.iter().map(|&i| terms[i].weight * terms[i].value).sum::<f64>() / weight;
        let value = run.iter().filter_map(|&i| terms[i].least).fold(mean, f64::max);
        run.iter().map(|&i| terms[i].weight * (terms[i].value - value).powi(2)).sum::<f64>()
    };
    runs.iter().map(spread).sum::<f64>() + price * (runs.len() as f64 - 1.0)
}

proptest! {
    #[test]
    fn an_open_chord_is_cut_as_well_as_can_be(
        given in prop::collection::vec((0.1..5.0f64, 0.0..3.0f64, prop::option::of(0.0..4.0f64)), 1..9),
        price in 0.1..4.0f64,
    ) {
        let terms: Vec<Term> =
            given.iter().map(|&(weight, value, least)| Term { weight, value, least }).collect();
        let found = cost(&terms, &cut(&terms, false, price), price);
        let n = terms.len();
        let best = (0..1_u32 << (n - 1))
            .map(|splits| {
                let mut runs = vec![vec![0]];
                for i in 1..n {
                    if splits >> (i - 1) & 1 == 1 {
                        runs.push(vec![]);
                    }
                    runs.last_mut().unwrap().push(i);
                }
                cost(&terms, &runs, price)
            })
            .fold(f64::INFINITY, f64::min);
        prop_assert!((found - best).abs() < 1e-9 * (1.0 + best), "{found} {best}");
    }
}
