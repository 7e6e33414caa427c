//! Positions for a filling: laid over the patch's surface in a common flat domain, improved in a second, nearly
//! undistorted one, and lifted back onto the surface.
//!
//! Follows `QuadMixer` (Nuvoli et al. 2019), section 3.5: map the patch onto a regular polygon, put the quads there, map
//! back. Deviation: the quads are then optimised (see [`crate::optimise_flat`]) in a flat domain the caller supplies, a
//! conformal one for instance, since the polygon distorts slender patches.

use crate::flatten::{BorderPlace, border_places, domain_point, harmonic, mean_value_weights, uniform_weights};
use crate::{PatchTopology, optimise_flat};
use glam::{DVec2, DVec3};
use mesh::{Cancelled, Monitor, Topology};
use surface::parametrize::{Flat, Location};

/// A patch of surface: a triangulated disk.
#[derive(Debug, Clone, Copy)]
pub struct DiskSurface<'a> {
    /// Vertex positions, scene units.
    pub positions: &'a [DVec3],
    /// Vertex triples, counter-clockwise.
    pub triangles: &'a [[u32; 3]],
    /// Border vertices, counter-clockwise (each step along a triangle), from corner 0, or from anywhere without corners.
    pub border: &'a [u32],
    /// Where the corners are in `border`: rising, the first 0; empty without corners.
    pub corners: &'a [usize],
}

/// Why a filling cannot be placed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlaceError {
    /// The triangles are not a disk with this border.
    #[error("the patch is not a disk bounded by the given loop: {reason}; cut or repair it first")]
    NotADisk {
        /// What is wrong.
        reason: &'static str,
    },
    /// Corners must rise from 0 and lie on the border.
    #[error("corner {corner} of the patch is out of order or beyond its border")]
    Corner {
        /// Index of the corner.
        corner: usize,
    },
    /// Two inputs that must match do not.
    #[error("{what}: expected {expected}, got {got}")]
    Count {
        /// What was counted.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        got: usize,
    },
    /// The caller wants to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Positions of all vertices of `filling` on `surface`.
///
/// `sides` are the side counts it was filled for (the whole loop as one side when there are no corners), and
/// `border_positions` where its border vertices go: they are taken as they are, one for each, corner 0 first, and sit
/// along each side of the surface by their relative arc length. `flat` is a low-distortion flat map of the surface's
/// vertices, preserving orientation; without it the quads stay as the polygon gives them, which costs shape.
///
/// Cost: O(n sqrt n) to flatten n triangles, and some 120 evaluations of the quads' energy.
///
/// # Errors
/// [`PlaceError`].
pub fn place(
    filling: &PatchTopology,
    sides: &[u32],
    border_positions: &[DVec3],
    surface: &DiskSurface<'_>,
    flat: Option<&[DVec2]>,
    monitor: &Monitor,
) -> Result<Vec<DVec3>, PlaceError> {
    let perimeter = filling.border.len();
    surface.check()?;
    let corner_count = surface.corners.len();
    expect("sides", corner_count.max(1), sides.len())?;
    expect("edges on the sides", perimeter, sides.iter().map(|&s| s as usize).sum())?;
    expect("border positions", perimeter, border_positions.len())?;
    if let Some(flat) = flat {
        expect("flat positions", surface.positions.len(), flat.len())?;
    }

    // The surface over the domain.
    let rim: Vec<DVec3> = surface.border.iter().map(|&v| surface.positions[v as usize]).collect();
    let rim_places = border_places(&rim, surface.corners);
    let mut fixed = vec![None; surface.positions.len()];
    for (&v, &p) in surface.border.iter().zip(&rim_places) {
        fixed[v as usize] = Some(domain_point(corner_count, p));
    }
    let domain = harmonic(&mean_value_weights(surface.positions, surface.triangles), &fixed, monitor)?;

    // The quads over the domain.
    let mut starts = Vec::with_capacity(corner_count);
    let mut passed = 0;
    for &side in sides.iter().take(corner_count) {
        starts.push(passed);
        passed += side as usize;
    }
    let border = border_places(border_positions, &starts);
    let mut fixed = vec![None; filling.vertex_count];
    for (slot, &p) in fixed.iter_mut().zip(&border) {
        *slot = Some(domain_point(corner_count, p));
    }
    let quads = harmonic(&uniform_weights(&filling.quads), &fixed, monitor)?;

    // Through the domain to the surface.
    let mut inner = locations(domain, surface.triangles, &quads[perimeter..])?;
    if let Some(flat) = flat {
        let rim: Vec<DVec2> = surface.border.iter().map(|&v| flat[v as usize]).collect();
        let mut points: Vec<DVec2> = border.iter().map(|&p| on_rim(&rim, &rim_places, p)).collect();
        points.extend(inner.iter().map(|place| {
            let [a, b, c] = surface.triangles[place.triangle as usize].map(|v| flat[v as usize]);
            a * place.weights.x + b * place.weights.y + c * place.weights.z
        }));
        let fixed: Vec<bool> = (0..points.len()).map(|v| v < perimeter).collect();
        optimise_flat(&filling.quads, &mut points, &fixed, monitor)?;
        inner = locations(flat.to_vec(), surface.triangles, &points[perimeter..])?;
    }
    let mut positions = border_positions.to_vec();
    positions.extend(inner.iter().map(|place| {
        let [a, b, c] = surface.triangles[place.triangle as usize].map(|v| surface.positions[v as usize]);
        a * place.weights.x + b * place.weights.y + c * place.weights.z
    }));
    Ok(positions)
}

/// The places of points on a flat surface, or of what is nearest to them.
fn locations(flat: Vec<DVec2>, triangles: &[[u32; 3]], points: &[DVec2]) -> Result<Vec<Location>, PlaceError> {
    let flat = Flat::new(flat, triangles.to_vec());
    let located: Option<Vec<Location>> = points.iter().map(|&p| flat.locate(p)).collect();
    located.ok_or(PlaceError::NotADisk { reason: "it has no triangles, or no finite ones" })
}

/// The point of a polyline border at a border place.
fn on_rim(rim: &[DVec2], places: &[BorderPlace], place: BorderPlace) -> DVec2 {
    let later = |p: &BorderPlace| (p.side, p.fraction) > (place.side, place.fraction);
    let after = places.iter().position(later).unwrap_or(places.len());
    let before = after.saturating_sub(1);
    // The next vertex may start the next side: there the fraction of this side is 1.
    let end = places.get(after).filter(|p| p.side == place.side).map_or(1.0, |p| p.fraction);
    let start = places[before].fraction;
    let t = if end > start { ((place.fraction - start) / (end - start)).clamp(0.0, 1.0) } else { 0.0 };
    rim[before].lerp(rim[after % rim.len()], t)
}

fn expect(what: &'static str, expected: usize, got: usize) -> Result<(), PlaceError> {
    if expected == got { Ok(()) } else { Err(PlaceError::Count { what, expected, got }) }
}

impl DiskSurface<'_> {
    fn check(&self) -> Result<(), PlaceError> {
        let wrong = |reason| Err(PlaceError::NotADisk { reason });
        let n = self.positions.len();
        if self.triangles.iter().flatten().any(|&v| v as usize >= n) || self.border.iter().any(|&v| v as usize >= n) {
            return wrong("an index is out of range");
        }
        let topology = Topology::new(n, self.triangles);
        if topology.outgoing.contains(&mesh::NONE) {
            return wrong("a vertex belongs to no triangle");
        }
        let border_edges = (0..topology.len() as u32).filter(|&h| topology.is_border(h)).count();
        let on_border = |k: usize| {
            let (from, to) = (self.border[k], self.border[(k + 1) % self.border.len()]);
            topology.find(from, to).is_some_and(|h| topology.is_border(h))
        };
        if border_edges != self.border.len() || !(0..self.border.len()).all(on_border) {
            return wrong("its border is another one, or runs the other way");
        }
        if n + self.triangles.len() != topology.edges().count() + 1 {
            return wrong("its Euler characteristic is not 1");
        }
        let limit = |k: usize| self.corners.get(k + 1).copied().unwrap_or(self.border.len());
        match (0..self.corners.len()).find(|&k| self.corners[k] >= limit(k) || (k == 0 && self.corners[0] != 0)) {
            Some(corner) => Err(PlaceError::Corner { corner }),
            None => Ok(()),
        }
    }
}
