//! Validation: the result is judged by the same measures as acceptance, before the caller sees it.

use crate::Cancelled;
use crate::band::Band;
use crate::intersect::Cut;
use crate::stitch::Stitched;
use mesh::{DVec3, Monitor, NONE, PolygonMesh, Topology, TriangleMesh, scaled_jacobian, volume};
use rayon::prelude::*;
use solve::components::connected_components;
use surface::closest::ClosestPoint;

/// Distance from the exact boolean that fillers aim for, as a fraction of the diagonal.
pub const DISTANCE_GOAL: f64 = 0.005;

/// Distance at which a result is rejected: the bar is 1%, and sampling misses a little.
const DISTANCE_LIMIT: f64 = 0.009;

/// Distance between the samples on a triangle, as a fraction of the diagonal, and the most steps along a side of one.
const SAMPLE_STEP: f64 = 0.005;
const MOST_STEPS: f64 = 8.0;

/// Largest allowed change of volume, relative.
pub const VOLUME_LIMIT: f64 = 0.01;

/// A result whose worst quad has a smaller scaled Jacobian is worth another try.
const WANTED_JACOBIAN: f64 = 0.06;

/// What was found.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// What is wrong with the topology; it should be closed, manifold and oriented, with the exact boolean's Euler
    /// characteristic and number of components.
    pub topology: Option<String>,
    /// New faces whose scaled Jacobian is not positive.
    pub inverted: Vec<u32>,
    /// Pairs of faces, one of them new, that intersect.
    pub intersecting: Vec<[u32; 2]>,
    /// Largest distance between the band and the new faces, fraction of the diagonal.
    pub distance: f64,
    /// Relative error of the volume.
    pub volume_error: f64,
    /// Least scaled Jacobian of the new faces.
    pub jacobian_min: f64,
    /// Mean scaled Jacobian of the new faces.
    pub jacobian_mean: f64,
    /// Vertices of new faces whose valence is not four.
    pub irregular: usize,
    /// Where smaller quads might mend what is wrong: the middles of new faces that are at fault, and the place furthest from
    /// the exact boolean if that is too far. Empty when nothing is wrong, or nowhere in particular.
    pub spots: Vec<DVec3>,
}

impl Verdict {
    /// Nothing to complain of.
    pub fn is_valid(&self) -> bool {
        self.topology.is_none()
            && self.inverted.is_empty()
            && self.intersecting.is_empty()
            && self.distance <= DISTANCE_LIMIT
            && self.volume_error <= VOLUME_LIMIT
    }

    /// The worst new quad has a sound shape.
    pub fn is_shapely(&self) -> bool {
        self.jacobian_min >= WANTED_JACOBIAN
    }

    /// Measures the shape of the new faces.
    pub fn measure_shape(&mut self, stitched: &Stitched) {
        let new = stitched.new_faces();
        let mut sum = 0.0;
        self.inverted.clear();
        self.jacobian_min = 1.0;
        for &f in &new {
            let jacobian = jacobian(&stitched.mesh, f);
            sum += jacobian;
            self.jacobian_min = self.jacobian_min.min(jacobian);
            if jacobian <= 0.0 {
                self.inverted.push(f);
            }
        }
        self.jacobian_mean = if new.is_empty() { 1.0 } else { sum / new.len() as f64 };
    }

    /// Lower is better; an invalid topology is infinitely bad.
    pub fn score(&self) -> f64 {
        if self.topology.is_some() {
            return f64::INFINITY;
        }
        (self.inverted.len() + self.intersecting.len()) as f64
            + (self.distance / DISTANCE_LIMIT - 1.0).max(0.0)
            + (self.volume_error / VOLUME_LIMIT - 1.0).max(0.0)
            + 0.1 * (1.0 - self.jacobian_mean)
            + 0.1 * (1.0 - self.jacobian_min)
    }

    /// The complaints in words.
    pub fn complaints(&self) -> String {
        let mut words = Vec::new();
        if let Some(reason) = &self.topology {
            words.push(reason.clone());
        }
        if !self.inverted.is_empty() {
            words.push(format!("{} inverted quads", self.inverted.len()));
        }
        if !self.intersecting.is_empty() {
            words.push(format!("{} pairs of intersecting faces", self.intersecting.len()));
        }
        if self.distance > DISTANCE_LIMIT {
            words.push(format!("{:.2}% of the diagonal away from the exact boolean", 100.0 * self.distance));
        }
        if self.volume_error > VOLUME_LIMIT {
            words.push(format!("{:.2}% of the volume lost or won", 100.0 * self.volume_error));
        }
        if self.jacobian_min < WANTED_JACOBIAN {
            words.push(format!("a quad with scaled Jacobian {:.3}", self.jacobian_min));
        }
        words.join(", ")
    }
}

/// Scaled Jacobian of a quad.
fn jacobian(mesh: &PolygonMesh, face: u32) -> f64 {
    let p: Vec<DVec3> = mesh.face_points(face as usize).collect();
    scaled_jacobian([p[0], p[1], p[2], p[3]])
}

/// Vertices, edges and faces in use: V - E + F and the number of pieces.
pub fn euler_and_components(vertex_count: usize, topology: &Topology) -> (i64, usize) {
    let edges: Vec<(u32, u32)> = topology.edges().map(|h| (topology.from(h), topology.to(h))).collect();
    let is_used = |v: &u32| topology.outgoing[*v as usize] != NONE;
    let used = (0..vertex_count as u32).filter(is_used).count();
    let count = edges.len() as i64;
    // A vertex without a face is a component by itself.
    let components = connected_components(vertex_count, edges).iter().filter(|c| is_used(&c[0])).count();
    let faces = topology.face.last().map_or(0, |f| *f as usize + 1);
    (used as i64 - count + faces as i64, components)
}

fn check_topology(mesh: &PolygonMesh, topology: &Topology, cut: &Cut) -> Result<(), String> {
    let open = (0..topology.len() as u32).filter(|&h| topology.is_border(h)).count();
    if open > 0 {
        return Err(format!("{open} open or non-manifold edges"));
    }
    let mut corners = vec![0; mesh.vertex_count()];
    for &v in &topology.origin {
        corners[v as usize] += 1;
    }
    let pinched = (0..mesh.vertex_count()).filter(|&v| corners[v] != topology.around(v as u32).count()).count();
    if pinched > 0 {
        return Err(format!("{pinched} vertices where the surface touches itself"));
    }
    let (euler, components) = euler_and_components(mesh.vertex_count(), topology);
    let (wanted, pieces) = euler_and_components(cut.surface.positions.len(), &cut.topology);
    if euler != wanted || components != pieces {
        return Err(format!(
            "Euler characteristic {euler} in {components} pieces, where the exact boolean has {wanted} in {pieces}"
        ));
    }
    Ok(())
}

/// Judges a stitched result. Costs O(n) for the topology and O(k log n) for the k new faces.
///
/// # Errors
/// [`Cancelled`].
pub fn validate(
    stitched: &Stitched,
    cut: &Cut,
    band: &Band,
    diagonal: f64,
    monitor: &Monitor,
) -> Result<Verdict, Cancelled> {
    let mesh = &stitched.mesh;
    let topology = Topology::of(mesh);
    let mut verdict = Verdict { topology: check_topology(mesh, &topology, cut).err(), ..Verdict::default() };
    let new = stitched.new_faces();
    verdict.measure_shape(stitched);
    let mut vertices: Vec<u32> = new.iter().flat_map(|&f| mesh.face(f as usize).iter().copied()).collect();
    vertices.sort_unstable();
    vertices.dedup();
    verdict.irregular = vertices.iter().filter(|&&v| topology.around(v).count() != 4).count();

    let (triangles, face_of) = TriangleMesh::from_polygons(mesh);
    let subset: Vec<u32> = (0..triangles.triangles.len() as u32)
        .filter(|&t| stitched.face_source[face_of[t as usize] as usize][0] < 0)
        .collect();
    let mut pairs: Vec<[u32; 2]> = mesh::self_intersections_of(&triangles, &subset, monitor)?
        .into_iter()
        .map(|p| p.map(|t| face_of[t as usize]))
        .collect();
    pairs.dedup();
    verdict.intersecting = pairs;
    // Pieces of split quads lie in the kept surface, not in the band.
    let filled: Vec<u32> =
        subset.into_iter().filter(|&t| stitched.face_region[face_of[t as usize] as usize] != NONE).collect();
    if !filled.is_empty() {
        let (distance, furthest) = distance(&triangles, &filled, band, diagonal, monitor)?;
        verdict.distance = distance / diagonal;
        verdict.spots.extend((verdict.distance > DISTANCE_LIMIT).then_some(furthest));
    }
    let is_narrow = |f: u32| jacobian(mesh, f) < WANTED_JACOBIAN;
    let mut at_fault: Vec<u32> =
        verdict.intersecting.iter().flatten().copied().filter(|f| new.binary_search(f).is_ok()).collect();
    at_fault.extend(new.iter().copied().filter(|&f| is_narrow(f)));
    at_fault.sort_unstable();
    at_fault.dedup();
    verdict.spots.extend(at_fault.iter().map(|&f| mesh.face_points(f as usize).sum::<DVec3>() / 4.0));
    let exact = volume(&cut.surface);
    verdict.volume_error = (volume(&triangles) - exact).abs() / exact.abs().max(1e-300);
    Ok(verdict)
}

/// Largest distance between the band and the new triangles, both ways, and where it is; sampled on a grid of
/// [`SAMPLE_STEP`] on each triangle, corners and border included.
fn distance(
    triangles: &TriangleMesh,
    new: &[u32],
    band: &Band,
    diagonal: f64,
    monitor: &Monitor,
) -> Result<(f64, DVec3), Cancelled> {
    let made = TriangleMesh {
        positions: triangles.positions.clone(),
        triangles: new.iter().map(|&t| triangles.triangles[t as usize]).collect(),
    };
    let further = |a: (f64, DVec3), b: (f64, DVec3)| if b.0 > a.0 { b } else { a };
    let mut worst = (0.0, DVec3::ZERO);
    for (from, to) in [(&made, &band.surface), (&band.surface, &made)] {
        let target = ClosestPoint::new(to);
        let furthest = |t: usize| {
            let [a, b, c] = from.points(t);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let steps = (longest / (SAMPLE_STEP * diagonal)).ceil().clamp(2.0, MOST_STEPS) as u32;
            let grid = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)));
            let at = |(i, j)| {
                let [u, v] = [i, j].map(|k: u32| f64::from(k) / f64::from(steps));
                a + (b - a) * u + (c - a) * v
            };
            grid.map(|place| (target.project(at(place)).distance, at(place))).fold((0.0, a), further)
        };
        let found = (0..from.triangles.len()).into_par_iter().map(|t| {
            monitor.check()?;
            Ok(furthest(t))
        });
        // In order: of equal distances the first counts, whatever the threads.
        worst = found.collect::<Result<Vec<_>, _>>()?.into_iter().fold(worst, further);
    }
    Ok(worst)
}

#[cfg(test)]
#[path = "validate_tests.rs"]
mod tests;
