//! Polychord refinement (section 3.4, Fig. 12): where a piece of the band has an odd number of border edges, no quad mesh
//! of it exists. The shortest strip of kept quads that joins two such pieces is split lengthwise: both become even.
//!
//! Deviation: the paper refines before retraction; here the strip lies in the kept quads only, so that as few as possible
//! change. Strip quads count as new.

use crate::band::Band;
use crate::intersect::Input;
use crate::retract::Kept;
use mesh::{DVec3, NONE, sorted};
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

    /// Splits the shortest strip that joins two odd pieces of the band. `odd` says which border edges (input, sorted
    /// vertex pair) belong to which odd piece. Returns false when no strip joins two of them.
    ///
    /// Costs O(odd border edges times strip length).
    pub fn split_shortest(
        &mut self,
        inputs: &[Input<'_>; 2],
        kept: &Kept,
        odd: &BTreeMap<(u8, [u32; 2]), u32>,
    ) -> bool {
        let mut best: Option<(usize, Vec<u32>)> = None;
        for (&(m, [a, b]), &piece) in odd {
            let (input, keep) = (&inputs[m as usize], &kept[m as usize]);
            // Halves of an edge that another strip split end at its middle vertex.
            if b as usize >= input.quads.vertex_count() {
                continue;
            }
            let t = &input.topology;
            let inside = |h: &u32| keep[t.face[*h as usize] as usize];
            let Some(start) = [t.find(a, b), t.find(b, a)].into_iter().flatten().find(inside) else { continue };
            let mut entered = vec![start];
            let mut h = start;
            let end = loop {
                let far = t.next[t.next[h as usize] as usize];
                let over = t.twin[far as usize];
                if over == NONE || !inside(&over) {
                    break far;
                }
                if entered.len() > keep.len() {
                    break NONE;
                }
                h = over;
                entered.push(h);
            };
            if end == NONE {
                continue;
            }
            let exit = sorted(t.from(end), t.to(end));
            let joins = odd.get(&(m, exit)).is_some_and(|&other| other != piece);
            let free = !self.middle[m as usize].contains_key(&exit);
            if joins && free && best.as_ref().is_none_or(|(_, s)| entered.len() < s.len()) {
                best = Some((m as usize, entered));
            }
        }
        let Some((m, strip)) = best else { return false };
        self.split_along(&inputs[m], m, &strip);
        true
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

/// The border edges of the band's odd pieces (connected components with an odd number of border edges).
pub fn odd_borders(band: &Band) -> BTreeMap<(u8, [u32; 2]), u32> {
    let (piece, count) = crate::band::flood(&band.topology, |_| false, band.surface.triangles.len());
    let mut borders: Vec<Vec<(u8, [u32; 2])>> = vec![vec![]; count];
    for h in (0..band.topology.len() as u32).filter(|&h| band.topology.is_border(h)) {
        let [from, to] = [band.topology.from(h), band.topology.to(h)].map(|v| band.border_vertex[v as usize]);
        if let (Some((m, a)), Some((_, b))) = (from, to) {
            borders[piece[(h / 3) as usize] as usize].push((m, sorted(a, b)));
        }
    }
    let odd = borders.into_iter().enumerate().filter(|(_, edges)| edges.len() % 2 == 1);
    odd.flat_map(|(p, edges)| edges.into_iter().map(move |e| (e, p as u32))).collect()
}

#[cfg(test)]
#[path = "polychord_tests.rs"]
mod tests;
