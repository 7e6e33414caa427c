//! Polychord refinement (section 3.4, Fig. 12): where a piece of the band has an odd number of border edges, no quad mesh
//! of it exists. Strips of kept quads that lead from one such piece to another, over pieces between if need be, are split
//! lengthwise: all become even, with as few quads split as possible.
//!
//! It always works: every border edge is the end of one strip, so that among pieces that strips connect the odd ones are
//! even in number, as in any graph the vertices of odd degree are.
//!
//! Deviation: the paper refines before retraction; here the strips lie in the kept quads only, so that as few as possible
//! change. Strip quads count as new.

use crate::band::Band;
use crate::intersect::Input;
use crate::retract::Kept;
use mesh::{DVec3, NONE, sorted};
use solve::CancelCheck;
use solve::tjoin::t_join;
use std::collections::BTreeMap;

/// Kept quads that are split. Empty for almost every placement.
#[derive(Debug, Clone, Default)]
pub struct Strips {
    /// For each input, quads to split: bit 0 through sides 0 and 2, bit 1 through sides 1 and 3.
    pub split: [BTreeMap<u32, u8>; 2],
    /// For each input, split edges (sorted vertex pairs) and the number of their middle vertex, counted on from the
    /// input's own vertices.
    pub middle: [BTreeMap<[u32; 2], u32>; 2],
    /// Middle and centre vertices of each input.
    pub positions: [Vec<DVec3>; 2],
}

/// A piece of a split quad: its corners as vertices (counted on past the input's own) and as weights of the quad's.
pub type Piece = [(u32, [f64; 4]); 4];

impl Strips {
    /// True when nothing is split.
    pub fn is_empty(&self) -> bool {
        self.split.iter().all(BTreeMap::is_empty)
    }

    /// Position of a vertex of input `m`, or of one of its middle vertices.
    pub fn position(&self, input: &Input<'_>, m: usize, v: u32) -> DVec3 {
        let own = input.quads.vertex_count();
        input.quads.positions.get(v as usize).copied().unwrap_or_else(|| self.positions[m][v as usize - own])
    }

    /// Splits strips so that the borders of all pieces of the band become even. `piece_of` says which piece each border edge
    /// (input, sorted vertex pair) belongs to. Returns false when something is split already, or no choice of strips helps.
    ///
    /// Costs O(border edges times strip length), plus that of a T-join.
    pub fn make_borders_even(
        &mut self,
        inputs: &[Input<'_>; 2],
        kept: &Kept,
        piece_of: &BTreeMap<(u8, [u32; 2]), u32>,
        cancelled: CancelCheck<'_>,
    ) -> bool {
        if !self.is_empty() {
            return false;
        }
        let mut strips = Vec::new();
        let mut joins = Vec::new();
        for (&(m, edge), &piece) in piece_of {
            let Some((strip, exit)) = walk(&inputs[m as usize], &kept[m as usize], edge) else { continue };
            // Each strip is met from both ends.
            if let Some(&other) = piece_of.get(&(m, exit)).filter(|_| edge < exit) {
                joins.push((piece, other, strip.len() as f64));
                strips.push((m as usize, strip));
            }
        }
        let count = piece_of.values().max().map_or(0, |&last| last as usize + 1);
        let mut edges = vec![0; count];
        for &piece in piece_of.values() {
            edges[piece as usize] += 1;
        }
        let odd: Vec<u32> = (0..count as u32).filter(|&p| edges[p as usize] % 2 == 1).collect();
        let Ok(chosen) = t_join(count, &joins, &odd, cancelled) else { return false };
        for &k in &chosen {
            let (m, strip) = &strips[k];
            self.split_along(&inputs[*m], *m, strip);
        }
        !chosen.is_empty()
    }

    fn split_along(&mut self, input: &Input<'_>, m: usize, strip: &[u32]) {
        let t = &input.topology;
        for &h in strip {
            let face = t.face[h as usize];
            let side = h - input.quads.face_corners(face as usize).start as u32;
            *self.split[m].entry(face).or_default() |= 1 << (side % 2);
            for edge in [h, t.next[t.next[h as usize] as usize]] {
                let (a, b) = (t.from(edge), t.to(edge));
                let fresh = (input.quads.vertex_count() + self.positions[m].len()) as u32;
                self.middle[m].entry(sorted(a, b)).or_insert_with(|| {
                    self.positions[m]
                        .push(input.quads.positions[a as usize].midpoint(input.quads.positions[b as usize]));
                    fresh
                });
            }
        }
    }

    /// The pieces of a split quad. A quad split both ways gets a centre vertex, made here.
    pub fn pieces(&mut self, input: &Input<'_>, m: usize, face: u32) -> Vec<Piece> {
        let mask = self.split[m][&face];
        let corners = input.quads.face(face as usize);
        let corner = |k: usize| {
            let mut w = [0.0; 4];
            w[k % 4] = 1.0;
            (corners[k % 4], w)
        };
        let middles: [_; 4] = std::array::from_fn(|k| {
            let mut w = [0.0; 4];
            w[k] = 0.5;
            w[(k + 1) % 4] = 0.5;
            self.middle[m].get(&sorted(corners[k], corners[(k + 1) % 4])).map(|&v| (v, w))
        });
        let middle = |k: usize| middles[k % 4].expect("a side that the strip crosses");
        if mask == 3 {
            let centre = corners.iter().map(|&v| input.quads.positions[v as usize]).sum::<DVec3>() / 4.0;
            let v = (input.quads.vertex_count() + self.positions[m].len()) as u32;
            self.positions[m].push(centre);
            return (0..4).map(|k| [corner(k), middle(k), (v, [0.25; 4]), middle(k + 3)]).collect();
        }
        let k = usize::from(mask == 2);
        vec![
            [corner(k), middle(k), middle(k + 2), corner(k + 3)],
            [middle(k), corner(k + 1), corner(k + 2), middle(k + 2)],
        ]
    }
}

/// The half-edges by which a strip enters its kept quads, from a border edge on, and the border edge where it leaves them.
fn walk(input: &Input<'_>, keep: &[bool], [a, b]: [u32; 2]) -> Option<(Vec<u32>, [u32; 2])> {
    let t = &input.topology;
    let inside = |h: &u32| keep[t.face[*h as usize] as usize];
    let mut h = [t.find(a, b), t.find(b, a)].into_iter().flatten().find(inside)?;
    let mut entered = vec![h];
    loop {
        let far = t.next[t.next[h as usize] as usize];
        let over = t.twin[far as usize];
        if over == NONE || !inside(&over) {
            return Some((entered, sorted(t.from(far), t.to(far))));
        }
        h = over;
        entered.push(h);
    }
}

/// The border edges of the band and the connected piece that each belongs to.
pub fn borders(band: &Band) -> BTreeMap<(u8, [u32; 2]), u32> {
    let (piece, _) = crate::band::flood(&band.topology, |_| false, band.surface.triangles.len());
    let border_edges = (0..band.topology.len() as u32).filter(|&h| band.topology.is_border(h)).filter_map(|h| {
        let [from, to] = [band.topology.from(h), band.topology.to(h)].map(|v| band.border_vertex[v as usize]);
        let ((m, a), (_, b)) = (from?, to?);
        Some(((m, sorted(a, b)), piece[(h / 3) as usize]))
    });
    border_edges.collect()
}

#[cfg(test)]
#[path = "polychord_tests.rs"]
mod tests;
