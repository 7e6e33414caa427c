//! Strip multiplicities: positive integers `x` with `B x = l` for one pattern and one tuple of side counts.
//!
//! Every column of `B` is `e_i + e_j`, so this is a perfect b-matching on at most six nodes. Strips joining the same two
//! sides are solved as a group and split evenly. A nonnegative least-squares solution proves most infeasible cases and
//! takes the bulk off long sides; what is left is small enough for depth-first search; exchanges then even the strips out.

use crate::pattern::Pattern;

/// Least-squares sweeps; tiny systems converge to well below [`FEASIBLE_DISTANCE`] within these.
const SWEEPS: usize = 200;

/// The cone `{B y : y >= 0}` is cut out by conditions "the counts of some sides sum to at most those of their partners",
/// normals of entries 0 and +-1 on at most six sides: an integer point outside is at least 1 / sqrt(6) = 0.41 away.
const FEASIBLE_DISTANCE: f64 = 0.3;

/// How far below the real solution the integer search may go in each group.
const SEARCH_DEPTH: f64 = 3.0;

/// Multiplicities, one a strip, each at least 1, that give the pattern these side counts; `None` when there are none.
pub(crate) fn solve(pattern: &Pattern, lengths: &[u32]) -> Option<Vec<u32>> {
    let mut rest = Vec::with_capacity(lengths.len());
    for (&length, &base) in lengths.iter().zip(&pattern.base) {
        rest.push(i64::from(length.checked_sub(base)?));
    }
    let real = nonnegative_least_squares(pattern, &rest)?;
    // Whole multiples are safe to take: they sum to at most the side count plus the distance, which is below one.
    let mut sums: Vec<i64> = real.iter().map(|y| (y.floor() - SEARCH_DEPTH).max(0.0) as i64).collect();
    for (group, sum) in pattern.groups.iter().zip(&sums) {
        group.ends.iter().for_each(|&side| rest[side] -= sum);
    }
    let mut open = vec![0; rest.len()];
    for group in &pattern.groups {
        group.ends.iter().for_each(|&side| open[side] += 1);
    }
    let target: Vec<i64> = real.iter().zip(&sums).map(|(y, s)| y.round() as i64 - s).collect();
    let mut added = vec![0; sums.len()];
    if !search(pattern, 0, &mut rest, &mut open, &target, &mut added) {
        return None;
    }
    sums.iter_mut().zip(&added).for_each(|(sum, a)| *sum += a);
    even_out(pattern, &mut sums);

    let mut strips = vec![1; pattern.strip_count];
    for (group, &sum) in pattern.groups.iter().zip(&sums) {
        let count = group.strips.len() as i64;
        for (k, &strip) in group.strips.iter().enumerate() {
            strips[strip] += ((sum + k as i64) / count) as u32;
        }
    }
    Some(strips)
}

/// Minimises `|B y - rest|` over `y >= 0` by cyclic coordinate descent; `None` when the distance proves that no solution
/// exists.
fn nonnegative_least_squares(pattern: &Pattern, rest: &[i64]) -> Option<Vec<f64>> {
    let mut degree = vec![0.0; rest.len()];
    for group in &pattern.groups {
        group.ends.iter().for_each(|&side| degree[side] += 1.0);
    }
    // Start from an even share: of the many solutions, descent then ends near a balanced one.
    let share = |side: usize| rest[side] as f64 / degree[side];
    let mut y: Vec<f64> = pattern.groups.iter().map(|g| share(g.ends[0]).min(share(g.ends[1]))).collect();
    let mut error: Vec<f64> = rest.iter().map(|&r| -(r as f64)).collect();
    for (group, value) in pattern.groups.iter().zip(&y) {
        group.ends.iter().for_each(|&side| error[side] += value);
    }
    for _ in 0..SWEEPS {
        let mut moved: f64 = 0.0;
        for (group, value) in pattern.groups.iter().zip(&mut y) {
            let [i, j] = group.ends;
            // Column e_i + e_j has squared norm 2, 2 e_i has 4 and twice the gradient: the same step for both halves.
            let step = if i == j { error[i] / 2.0 } else { f64::midpoint(error[i], error[j]) };
            let change = (*value - step).max(0.0) - *value;
            *value += change;
            error[i] += change;
            error[j] += change;
            moved = moved.max(change.abs());
        }
        if moved < 1e-4 {
            break;
        }
    }
    (error.iter().map(|e| e * e).sum::<f64>().sqrt() < FEASIBLE_DISTANCE).then_some(y)
}

/// Depth-first search for group sums with `B added = rest`, values nearest the real solution first. `open[side]` is the
/// number of group ends on the side still undecided.
fn search(pattern: &Pattern, g: usize, rest: &mut [i64], open: &mut [u32], target: &[i64], added: &mut [i64]) -> bool {
    let Some(group) = pattern.groups.get(g) else { return rest.iter().all(|&r| r == 0) };
    let [i, j] = group.ends;
    open[i] -= 1;
    open[j] -= 1;
    let most = if i == j { rest[i] / 2 } else { rest[i].min(rest[j]) };
    // The last group of a side must take all that is left of it.
    let mut least = 0;
    for side in [i, j] {
        if open[side] == 0 {
            least = least.max(if i == j { (rest[i] + 1) / 2 } else { rest[side] });
        }
    }
    let mut found = false;
    if least <= most {
        let start = target[g].clamp(least, most);
        let reach = (start - least).max(most - start);
        for value in (0..=reach).flat_map(|d| [start + d, start - d]).skip(1) {
            if value < least || value > most {
                continue;
            }
            rest[i] -= value;
            rest[j] -= value;
            added[g] = value;
            found = search(pattern, g + 1, rest, open, target, added);
            if found {
                break;
            }
            rest[i] += value;
            rest[j] += value;
        }
    }
    open[i] += 1;
    open[j] += 1;
    found
}

/// Lowers the sum of squared multiplicities by exchanges between groups until none helps.
fn even_out(pattern: &Pattern, sums: &mut [i64]) {
    // Squares of `count` strips that share `sum` evenly beyond one each.
    let squares = |g: usize, sum: i64| {
        let count = pattern.groups[g].strips.len() as i64;
        let (each, more) = (1 + sum / count, sum % count);
        count * each * each + more * (2 * each + 1)
    };
    let gain = |sums: &[i64], exchange: &[(usize, i64)], sign: i64| {
        let mut total = 0;
        for &(g, step) in exchange {
            let changed = sums[g] + sign * step;
            if changed < 0 {
                return 0;
            }
            total += squares(g, sums[g]) - squares(g, changed);
        }
        total
    };
    loop {
        let mut improved = false;
        for exchange in &pattern.exchanges {
            for sign in [1, -1] {
                while gain(sums, exchange, sign) > 0 {
                    for &(g, step) in exchange {
                        sums[g] += sign * step;
                    }
                    improved = true;
                }
            }
        }
        if !improved {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::PATTERNS;

    fn counts(pattern: &Pattern, strips: &[u32]) -> Vec<u32> {
        let strip = |w: &[u32]| strips[pattern.strip_of_edge[&crate::pattern::edge_key(w[0], w[1])]];
        pattern.sides.iter().map(|side| side.windows(2).map(strip).sum()).collect()
    }

    /// Any positive multiplicities give counts that the solver must find feasible again, however long the sides.
    #[test]
    fn feasible_counts_are_solved() {
        let mut state = 1u64;
        let mut random = |n: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % n
        };
        for p in PATTERNS.iter() {
            for round in 0..60 {
                let largest = [3, 12, 60][round % 3];
                let strips: Vec<u32> = (0..p.strip_count).map(|_| 1 + random(largest) as u32).collect();
                let lengths = counts(p, &strips);
                let solved = solve(p, &lengths).unwrap_or_else(|| panic!("{} missed {lengths:?}", p.name));
                assert_eq!(counts(p, &solved), lengths, "{}", p.name);
                assert!(solved.iter().all(|&x| x >= 1));
                let squares = |x: &[u32]| x.iter().map(|v| v * v).sum::<u32>();
                // Exchanges of at most four groups end in a local optimum, rarely more than a tenth above these.
                assert!(squares(&solved) <= squares(&strips) * 5 / 4, "{} {lengths:?}: uneven", p.name);
            }
        }
    }

    /// Against brute force on small counts: feasible exactly when an exhaustive search says so.
    #[test]
    fn agrees_with_brute_force() {
        fn reachable(p: &Pattern, g: usize, rest: &[i64]) -> bool {
            let Some(group) = p.groups.get(g) else { return rest.iter().all(|&r| r == 0) };
            (0..=rest[group.ends[0]].min(rest[group.ends[1]])).any(|v| {
                let mut next = rest.to_vec();
                group.ends.iter().for_each(|&e| next[e] -= v);
                next.iter().all(|&r| r >= 0) && reachable(p, g + 1, &next)
            })
        }
        for p in PATTERNS.iter().filter(|p| p.sides.len() <= 4) {
            let n = p.sides.len();
            for code in 0..7usize.pow(n as u32) {
                let lengths: Vec<u32> = (0..n).map(|i| 1 + (code / 7usize.pow(i as u32) % 7) as u32).collect();
                let rest: Vec<i64> = lengths.iter().zip(&p.base).map(|(&l, &b)| i64::from(l) - i64::from(b)).collect();
                let expected = rest.iter().all(|&r| r >= 0) && reachable(p, 0, &rest);
                assert_eq!(solve(p, &lengths).is_some(), expected, "{} {lengths:?}", p.name);
            }
        }
    }
}
