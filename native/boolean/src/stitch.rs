//! Stitching: kept quads and fills become one mesh, by vertex index only.
//!
//! The authors' code joins by equal coordinates; most of its holes come from there. Here every rim vertex knows which
//! input vertex or line vertex it is from the start.

use crate::fill::{Fill, Region};
use crate::intersect::Input;
use crate::polychord::Strips;
use crate::resample::Resampled;
use crate::retract::Kept;
use crate::{CornerSource, Operation};
use mesh::{NONE, PolygonMesh};
use std::collections::BTreeMap;

/// The stitched mesh with what is needed to finish and report it.
#[derive(Debug, Clone)]
pub struct Stitched {
    /// The result.
    pub mesh: PolygonMesh,
    /// Source of each face, as in [`crate::Output::face_source`].
    pub face_source: Vec<[i32; 2]>,
    /// Region of each face, [`NONE`] for kept ones and pieces of kept ones. New faces follow the kept ones.
    pub face_region: Vec<u32>,
    /// Corner sources of the faces that are pieces of a split quad.
    pub piece_source: BTreeMap<u32, [CornerSource; 4]>,
    /// Output vertex of each vertex of the resampled band, [`NONE`] for those not on a rim.
    pub band_vertex: Vec<u32>,
}

/// Joins kept quads, pieces of split ones, and fills. `band` says which input vertices its border consists of.
pub fn stitch(
    inputs: &[Input<'_>; 2],
    operation: Operation,
    kept: &Kept,
    strips: &Strips,
    band: &Resampled,
    regions: &[Region],
    fills: &[Fill],
) -> Stitched {
    let mut strips = strips.clone();
    let mut positions = Vec::new();
    let mut corners: Vec<[u32; 4]> = Vec::new();
    let mut face_source = Vec::new();
    let mut number: [Vec<u32>; 2] = std::array::from_fn(|_| vec![]);
    let mut pieces: Vec<([u32; 4], [CornerSource; 4])> = Vec::new();
    for (m, input) in inputs.iter().enumerate() {
        let turned = m == 1 && operation == Operation::Difference;
        let split: Vec<_> = strips.split[m].keys().copied().collect();
        let split: Vec<_> =
            split.into_iter().flat_map(|f| strips.pieces(input, m, f).into_iter().map(move |p| (f, p))).collect();
        let mut used = vec![false; input.quads.vertex_count() + strips.positions[m].len()];
        for f in (0..kept[m].len()).filter(|&f| kept[m][f]) {
            for &v in input.quads.face(f) {
                used[v as usize] = true;
            }
        }
        for &(v, _) in split.iter().flat_map(|(_, piece)| piece) {
            used[v as usize] = true;
        }
        number[m] = vec![NONE; used.len()];
        for v in (0..used.len()).filter(|&v| used[v]) {
            number[m][v] = positions.len() as u32;
            positions.push(strips.position(input, m, v as u32));
        }
        for f in (0..kept[m].len()).filter(|&f| kept[m][f] && !strips.split[m].contains_key(&(f as u32))) {
            let face = input.quads.face(f);
            let mut quad: [u32; 4] = std::array::from_fn(|k| number[m][face[k] as usize]);
            if turned {
                // B's surface is turned inside out; the first corner stays first.
                quad.swap(1, 3);
            }
            corners.push(quad);
            face_source.push([m as i32, f as i32]);
        }
        for (face, piece) in split {
            let mut quad = piece.map(|(v, _)| number[m][v as usize]);
            let mut source = piece.map(|(_, weights)| CornerSource { mesh: m as u8, face, weights });
            if turned {
                quad.swap(1, 3);
                source.swap(1, 3);
            }
            pieces.push((quad, source));
        }
    }
    let mut piece_source = BTreeMap::new();
    for (quad, source) in pieces {
        piece_source.insert(corners.len() as u32, source);
        corners.push(quad);
        face_source.push([-1, -1]);
    }
    let mut face_region = vec![NONE; corners.len()];
    let mut band_vertex = vec![NONE; band.surface.positions.len()];
    for (slot, border) in band_vertex.iter_mut().zip(&band.border_vertex) {
        if let &Some((m, v)) = border {
            *slot = number[m as usize][v as usize];
        }
    }
    for region in regions {
        for &v in &region.rim {
            if band_vertex[v as usize] == NONE {
                band_vertex[v as usize] = positions.len() as u32;
                positions.push(band.surface.positions[v as usize]);
            }
        }
    }
    for (r, (region, fill)) in regions.iter().zip(fills).enumerate() {
        let first = positions.len() as u32;
        positions.extend_from_slice(&fill.positions);
        for quad in &fill.quads {
            corners.push(quad.map(|v| match region.rim.get(v as usize) {
                Some(&b) => band_vertex[b as usize],
                None => first + v - region.rim_count as u32,
            }));
            face_source.push([-1, -1]);
            face_region.push(r as u32);
        }
    }
    let mesh = PolygonMesh::from_polygons(positions, &corners).expect("indices from this function");
    Stitched { mesh, face_source, face_region, piece_source, band_vertex }
}

impl Stitched {
    /// Faces that are no input's.
    pub fn new_faces(&self) -> Vec<u32> {
        (0..self.face_source.len() as u32).filter(|&f| self.face_source[f as usize][0] < 0).collect()
    }
}
