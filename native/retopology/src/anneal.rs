//! The valence-aware programme's solver: patches exchanged a few at a time, at a falling temperature.
//!
//! A step frees the triangles of one patch and of some patches beside it, lists all ways to cover them by patches, and
//! draws one by the heat-bath rule (Geman and Geman, "Stochastic relaxation", 1984): the chance of a cover falls
//! exponentially with its cost over the temperature. The random numbers are a fixed sequence, so that the result
//! repeats. A general solver (`HiGHS`) proves optimality, but took 5 to 10 s for 300 triangles with 4,800 candidates.

use mesh::{Cancelled, Monitor, NONE};

/// A patch that may be taken.
pub(crate) struct Choice {
    /// Its triangles.
    pub triangles: Vec<u32>,
    /// What it costs by itself.
    pub cost: f64,
    /// Quads that it brings to sectors.
    pub quads: Vec<(u32, i32)>,
}

/// What is wanted of the quads at a sector of a vertex.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Goal {
    /// The vertex.
    pub vertex: u32,
    /// Wanted number of quads; the squared deviation counts.
    pub ideal: f64,
    /// Fewest quads here, and fewest at the vertex.
    pub least: i32,
    pub least_at_vertex: i32,
}

/// Costs of a quad missing at a vertex: more than any other cost can gain.
pub(crate) const MISSING: f64 = 50.0;
/// Steps for each triangle.
const STEPS: usize = 60;
/// Temperatures, in irregular vertices.
const HOT: f64 = 1.0;
const COLD: f64 = 0.06;
/// Triangles freed at most, and ways to cover them that are looked at.
const MOST_FREE: usize = 5;
const MOST_COVERS: usize = 400;

/// Picks choices that hold every triangle once. `start` is such a pick; the result costs no more. Only `movable` triangles change
/// their choice; `neighbours`, one list for each triangle, name no others. Another `run` goes another way. Cost: some 10 µs a step.
pub(crate) fn choose(
    choices: &[Choice],
    movable: &[u32],
    neighbours: &[Vec<u32>],
    goals: &[Goal],
    start: &[u32],
    run: u64,
    monitor: &Monitor,
) -> Result<Vec<u32>, Cancelled> {
    let mut search = Search::new(choices, neighbours.len(), goals, start);
    search.random = Random(FIRST_STATE.wrapping_mul(2 * run + 1));
    let mut best = (search.total(), search.taken());
    let steps = STEPS * movable.len();
    for step in 0..steps {
        if step % 256 == 0 {
            monitor.check()?;
        }
        search.temperature = HOT * (COLD / HOT).powf(step as f64 / steps as f64);
        let first = search.random.below(movable.len());
        search.free(movable[first], neighbours);
        search.cover();
    }
    search.temperature = 0.0;
    // Downhill until nothing moves, from every triangle.
    loop {
        let before = search.total();
        for &t in movable {
            monitor.check()?;
            search.free(t, neighbours);
            search.cover();
        }
        if search.total() > before - 1e-9 {
            break;
        }
    }
    if search.total() < best.0 {
        best.1 = search.taken();
    }
    Ok(best.1)
}

/// Cost of a pick of choices.
#[cfg(test)]
pub(crate) fn cost(choices: &[Choice], triangle_count: usize, goals: &[Goal], taken: &[u32]) -> f64 {
    Search::new(choices, triangle_count, goals, taken).total()
}

/// State of the random numbers in run 0: the golden ratio's digits.
const FIRST_STATE: u64 = 0x9E37_79B9_7F4A_7C15;

/// Marsaglia's xorshift with a multiplication, 2003.
#[derive(Debug)]
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() >> 33) as usize) % n.max(1)
    }

    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

struct Search<'a> {
    choices: &'a [Choice],
    goals: &'a [Goal],
    /// Choices that hold each triangle as their first.
    of_triangle: Vec<Vec<u32>>,
    /// The choice each triangle is in, [`NONE`] while free.
    choice_of: Vec<u32>,
    quads: Vec<i32>,
    at_vertex: Vec<i32>,
    free: Vec<u32>,
    sectors: Vec<u32>,
    /// A cover in the making, and the one drawn so far with its key.
    cover: Vec<u32>,
    drawn: (f64, Vec<u32>),
    covers: usize,
    temperature: f64,
    random: Random,
}

impl<'a> Search<'a> {
    fn new(choices: &'a [Choice], triangle_count: usize, goals: &'a [Goal], start: &[u32]) -> Self {
        let mut of_triangle = vec![Vec::new(); triangle_count];
        for (i, choice) in choices.iter().enumerate() {
            for &t in &choice.triangles {
                of_triangle[t as usize].push(i as u32);
            }
        }
        let vertices = goals.iter().map(|g| g.vertex as usize + 1).max().unwrap_or(0);
        let mut search = Self {
            choices,
            goals,
            of_triangle,
            choice_of: vec![NONE; triangle_count],
            quads: vec![0; goals.len()],
            at_vertex: vec![0; vertices],
            free: vec![],
            sectors: vec![],
            cover: vec![],
            drawn: (f64::NEG_INFINITY, vec![]),
            covers: 0,
            temperature: 0.0,
            random: Random(FIRST_STATE),
        };
        for &choice in start {
            search.put(choice, 1);
        }
        search
    }

    /// Takes a choice, or with -1 gives it back.
    fn put(&mut self, choice: u32, sign: i32) {
        let Choice { triangles, quads, .. } = &self.choices[choice as usize];
        for &t in triangles {
            self.choice_of[t as usize] = if sign > 0 { choice } else { NONE };
        }
        for &(sector, quads) in quads {
            self.quads[sector as usize] += sign * quads;
            self.at_vertex[self.goals[sector as usize].vertex as usize] += sign * quads;
        }
    }

    fn sector_cost(&self, sector: u32) -> f64 {
        let goal = &self.goals[sector as usize];
        let quads = self.quads[sector as usize];
        let missing =
            (goal.least - quads).max(0) + (goal.least_at_vertex - self.at_vertex[goal.vertex as usize]).max(0);
        (f64::from(quads) - goal.ideal).powi(2) + MISSING * f64::from(missing)
    }

    fn taken(&self) -> Vec<u32> {
        let mut taken = self.choice_of.clone();
        taken.sort_unstable();
        taken.dedup();
        taken
    }

    fn total(&self) -> f64 {
        let own: f64 = self.taken().iter().map(|&c| self.choices[c as usize].cost).sum();
        own + (0..self.goals.len() as u32).map(|s| self.sector_cost(s)).sum::<f64>()
    }

    /// Frees the patch of a triangle and patches beside it.
    fn free(&mut self, triangle: u32, neighbours: &[Vec<u32>]) {
        self.free.clear();
        self.release(self.choice_of[triangle as usize]);
        for _ in 0..6 {
            let from = self.free[self.random.below(self.free.len())];
            let around = &neighbours[from as usize];
            if around.is_empty() {
                continue;
            }
            let next = self.choice_of[around[self.random.below(around.len())] as usize];
            if next != NONE && self.free.len() + self.choices[next as usize].triangles.len() <= MOST_FREE {
                self.release(next);
            }
        }
        self.free.sort_unstable();
    }

    fn release(&mut self, choice: u32) {
        self.free.extend(&self.choices[choice as usize].triangles);
        self.put(choice, -1);
    }

    /// Covers what is free by one of the ways, by chance or, at temperature 0, the best.
    fn cover(&mut self) {
        self.cover.clear();
        self.sectors.clear();
        for &t in &self.free {
            for &choice in &self.of_triangle[t as usize] {
                if self.choices[choice as usize].triangles == [t] {
                    self.sectors.extend(self.choices[choice as usize].quads.iter().map(|q| q.0));
                }
            }
        }
        self.sectors.sort_unstable();
        self.sectors.dedup();
        (self.covers, self.drawn.0) = (0, f64::NEG_INFINITY);
        self.extend(0.0);
        let drawn = std::mem::take(&mut self.drawn.1);
        for &choice in &drawn {
            self.put(choice, 1);
        }
        self.drawn.1 = drawn;
    }

    /// Lists the covers of the free triangles that are still bare.
    fn extend(&mut self, cost: f64) {
        if self.covers >= MOST_COVERS {
            return;
        }
        let Some(&bare) = self.free.iter().find(|&&t| self.choice_of[t as usize] == NONE) else {
            let total = cost + self.sectors.iter().map(|&s| self.sector_cost(s)).sum::<f64>();
            self.covers += 1;
            // The greatest of the exponents, each with Gumbel noise, is drawn with the chance of its exponential.
            let noise = if self.temperature > 0.0 {
                -self.temperature * (-self.random.unit().max(f64::MIN_POSITIVE).ln()).ln()
            } else {
                0.0
            };
            if noise - total > self.drawn.0 {
                self.drawn.0 = noise - total;
                self.drawn.1.clone_from(&self.cover);
            }
            return;
        };
        for i in 0..self.of_triangle[bare as usize].len() {
            let choice = self.of_triangle[bare as usize][i];
            let fits = |t: &u32| self.choice_of[*t as usize] == NONE && self.free.binary_search(t).is_ok();
            if self.choices[choice as usize].triangles.iter().all(fits) {
                self.put(choice, 1);
                self.cover.push(choice);
                self.extend(cost + self.choices[choice as usize].cost);
                self.cover.pop();
                self.put(choice, -1);
            }
        }
    }
}
