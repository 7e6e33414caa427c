//! Patterns that a caller brings along: checked, then multiplied along their strips like those of the catalogue.

use crate::disk::{Cost, Disk, Method, Outline, PatchTopology};
use crate::pattern::{Entry, Pattern};
use crate::strips;
use mesh::Topology;

/// Most quads of a custom pattern.
const MOST_QUADS: usize = 10_000;

/// A checked pattern.
#[derive(Debug)]
pub struct CustomPattern {
    pattern: Pattern,
    /// The sides that each strip ends on; none for one that closes in itself.
    ends: Vec<Vec<usize>>,
}

impl CustomPattern {
    /// Takes the vertices of each side, counter-clockwise, the last of a side being the first of the next, and the quads.
    /// O(quads log quads).
    ///
    /// # Errors
    /// A sentence that says what is wrong: the quads must be a disk with these sides as its border.
    pub fn new(name: &str, sides: &[Vec<u32>], quads: &[[u32; 4]]) -> Result<Self, &'static str> {
        if !(2..=6).contains(&sides.len()) || sides.iter().any(|side| side.len() < 2) {
            return Err("it needs two to six sides of at least two vertices");
        }
        if quads.is_empty() || quads.len() > MOST_QUADS {
            return Err("it needs one to 10,000 quads");
        }
        let count = quads.iter().flatten().max().map_or(0, |&v| v as usize + 1);
        let mut used = vec![false; count.min(4 * quads.len())];
        for quad in quads {
            if (0..4).any(|k| (0..k).any(|i| quad[i] == quad[k])) {
                return Err("a quad names a vertex twice");
            }
            for &v in quad {
                match used.get_mut(v as usize) {
                    Some(used) => *used = true,
                    None => return Err("its vertices must be numbered from 0 without gaps"),
                }
            }
        }
        if used.len() != count || used.contains(&false) {
            return Err("its vertices must be numbered from 0 without gaps");
        }
        let mut border: Vec<u32> = Vec::new();
        for (k, side) in sides.iter().enumerate() {
            if side.last() != sides[(k + 1) % sides.len()].first() {
                return Err("each side must end where the next starts");
            }
            border.extend(&side[..side.len() - 1]);
        }
        let mut sorted = border.clone();
        sorted.sort_unstable();
        sorted.dedup();
        if sorted.len() != border.len() || border.iter().any(|&v| v as usize >= count) {
            return Err("its sides pass a vertex twice, or one that no quad has");
        }
        let topology = Topology::new(count, quads);
        let free = (0..topology.len() as u32).filter(|&h| topology.is_border(h)).count();
        let runs = (0..border.len())
            .all(|k| topology.find(border[k], border[(k + 1) % border.len()]).is_some_and(|h| topology.is_border(h)));
        if free != border.len() || !runs {
            return Err("the border of its quads is not its sides, counter-clockwise");
        }
        if count + quads.len() != topology.edges().count() + 1 {
            return Err("its quads are not a disk");
        }
        let pattern = Pattern::new(Entry { name: name.into(), sides: sides.to_vec(), quads: quads.to_vec() });
        let mut ends = vec![Vec::new(); pattern.strip_count];
        for (i, side) in sides.iter().enumerate() {
            for w in side.windows(2) {
                ends[pattern.strip_of_edge[&crate::pattern::edge_key(w[0], w[1])]].push(i);
            }
        }
        Ok(Self { pattern, ends })
    }

    /// Side counts nearest to wanted ones among those the pattern can have: each strip gets the mean of the even shares at
    /// its ends, at least 1.
    pub fn nearest_counts(&self, wanted: &[f64]) -> Vec<u32> {
        let share = |side: usize| wanted.get(side).map_or(1.0, |w| w / f64::from(self.pattern.base[side]));
        let mut counts = vec![0; self.pattern.sides.len()];
        for ends in self.ends.iter().filter(|ends| !ends.is_empty()) {
            let mean = ends.iter().map(|&side| share(side)).sum::<f64>() / ends.len() as f64;
            for &side in ends {
                counts[side] += mean.round().max(1.0) as u32;
            }
        }
        counts
    }

    /// The pattern multiplied so that its sides have these counts; `None` when it cannot have them.
    pub fn fill(&self, sides: &[u32]) -> Option<PatchTopology> {
        if sides.len() != self.pattern.sides.len() {
            return None;
        }
        let multiplied = strips::solve(&self.pattern, sides)?;
        let disk = Disk::unfold(&self.pattern, &multiplied).renumbered();
        let irregular = disk.irregularity(Outline::new(sides).corners.iter().map(|c| c.at));
        Some(PatchTopology {
            vertex_count: disk.vertex_count as usize,
            border: (0..disk.perimeter).collect(),
            quads: disk.quads,
            method: Method::Pattern(self.pattern.name.clone()),
            irregular: irregular.vertices,
            cost: Cost {
                irregular_corners: irregular.corners,
                valence_excess: irregular.excess,
                moves: 0,
                unevenness: f64::from(irregular.high),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of two by one.
    fn domino() -> (Vec<Vec<u32>>, Vec<[u32; 4]>) {
        (vec![vec![0, 1, 2], vec![2, 5], vec![5, 4, 3], vec![3, 0]], vec![[0, 1, 4, 3], [1, 2, 5, 4]])
    }

    #[test]
    fn a_pattern_is_multiplied() {
        let (sides, quads) = domino();
        let pattern = CustomPattern::new("domino", &sides, &quads).unwrap();
        assert_eq!(pattern.nearest_counts(&[5.9, 3.2, 6.3, 2.8]), [6, 3, 6, 3]);
        assert_eq!(pattern.fill(&[6, 3, 6, 3]).unwrap().quads.len(), 18);
        assert_eq!(pattern.fill(&[6, 3, 5, 3]), None);
    }

    #[test]
    fn faults_are_told() {
        let (sides, quads) = domino();
        let mut turned = quads.clone();
        turned[1].reverse();
        let mut gap = quads.clone();
        gap[1] = [1, 2, 9, 4];
        let mut open = sides.clone();
        open[1] = vec![2, 4];
        for (sides, quads) in [(&sides, &turned), (&sides, &gap), (&open, &quads), (&sides, &quads[..1].to_vec())] {
            assert!(CustomPattern::new("bad", sides, quads).is_err());
        }
        assert!(CustomPattern::new("bad", &sides[..1], &quads).is_err());
        assert!(CustomPattern::new("bad", &sides, &[]).is_err());
    }
}
