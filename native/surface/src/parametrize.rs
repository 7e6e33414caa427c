//! Flat maps of disks (`QuadMixer`, Nuvoli et al. 2019, section 3.5) and finding the triangle under a point of one.
//!
//! - [`lscm`]: least-squares conformal map with any pinned vertices (Lévy et al. 2002). Two pins leave the border free, which
//!   keeps angles and is the domain to optimise quads in. It may fold: ask [`Flat::flipped`].
//! - [`Flat::locate`] finds the triangle under a point of the plane.
//!
//! Deviation: the paper lifts quads through this map with the border pinned to a polygon; here they are lifted through
//! mean values, which cannot fold (`quadrangulate`'s `flatten.rs`).

use glam::{DVec2, DVec3};
use mesh::{Topology, TriangleMesh};
use solve::SolveError;
use solve::cholesky::Factor;

/// Why there is no map.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParametrizeError {
    /// Only a disk has such a map.
    #[error(
        "the mesh is not a disk: it has {loops} border loops and Euler characteristic {euler_characteristic}; cut it first"
    )]
    NotDisk {
        /// Number of border loops; 1 for a disk.
        loops: usize,
        /// 1 for a disk.
        euler_characteristic: i64,
    },
    /// A triangle without area has no shape to keep.
    #[error("triangle {triangle} has no area; remesh or collapse it first")]
    Degenerate {
        /// The first such triangle.
        triangle: u32,
    },
    /// Fewer than two distinct vertices are pinned, or one of them does not exist.
    #[error("pin at least two different vertices of the mesh; pin {pin} does not count")]
    Pins {
        /// Index of the first pin that does not count, or the number of pins.
        pin: usize,
    },
    /// The factorisation failed.
    #[error("the map's equations could not be solved: {0}")]
    Solve(#[from] SolveError),
}

/// A point of a triangle mesh: the triangle and the weights of its corners, which sum to one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// The triangle.
    pub triangle: u32,
    /// Weights of its corners.
    pub weights: DVec3,
}

impl Location {
    /// The point on a mesh with the map's triangles.
    pub fn point(&self, mesh: &TriangleMesh) -> DVec3 {
        let [a, b, c] = mesh.points(self.triangle as usize);
        a * self.weights.x + b * self.weights.y + c * self.weights.z
    }
}

/// A mesh laid flat, with a grid for finding triangles.
#[derive(Debug, Clone)]
pub struct Flat {
    /// Position in the plane of each vertex.
    pub uv: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
    low: DVec2,
    cell: f64,
    columns: usize,
    rows: usize,
    /// Triangles whose box meets each cell: cell `c` holds `entries[first[c]..first[c + 1]]`.
    first: Vec<u32>,
    entries: Vec<u32>,
}

impl Flat {
    /// Takes a flat position for each vertex of the triangles.
    pub fn new(uv: Vec<DVec2>, triangles: Vec<[u32; 3]>) -> Self {
        let used = || triangles.iter().flatten().map(|&v| uv[v as usize]);
        let (low, high) = used().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let extent = if triangles.is_empty() { DVec2::ONE } else { (high - low).max(DVec2::splat(f64::MIN_POSITIVE)) };
        // About one cell a triangle, however long and thin the map is.
        let cell = (extent.x * extent.y / triangles.len().max(1) as f64).sqrt().max(extent.max_element() / 1000.0);
        let (columns, rows) = ((extent.x / cell) as usize + 1, (extent.y / cell) as usize + 1);
        let mut flat =
            Self { uv, triangles, low, cell, columns, rows, first: vec![0; columns * rows + 1], entries: vec![] };
        let mut pairs = Vec::new();
        for t in 0..flat.triangles.len() {
            let [a, b, c] = flat.corners(t);
            let (from, to) = (flat.cell_of(a.min(b).min(c)), flat.cell_of(a.max(b).max(c)));
            for row in from[1]..=to[1] {
                pairs.extend((from[0]..=to[0]).map(|column| (row * columns + column, t as u32)));
            }
        }
        pairs.sort_unstable();
        for &(cell, _) in &pairs {
            flat.first[cell + 1] += 1;
        }
        for cell in 0..columns * rows {
            flat.first[cell + 1] += flat.first[cell];
        }
        flat.entries = pairs.into_iter().map(|(_, t)| t).collect();
        flat
    }

    fn corners(&self, t: usize) -> [DVec2; 3] {
        self.triangles[t].map(|v| self.uv[v as usize])
    }

    fn cell_of(&self, p: DVec2) -> [usize; 2] {
        let q = (p - self.low) / self.cell;
        // Casting clamps negative values to zero.
        [(q.x as usize).min(self.columns - 1), (q.y as usize).min(self.rows - 1)]
    }

    /// Triangles that are upside down or flat in the plane, ascending. Empty for a one-to-one map with a convex border.
    pub fn flipped(&self) -> Vec<u32> {
        (0..self.triangles.len() as u32)
            .filter(|&t| {
                let [a, b, c] = self.corners(t as usize);
                (b - a).perp_dot(c - a) <= 0.0
            })
            .collect()
    }

    /// The place on the mesh over a point of the plane; for a point outside the map, the nearest place. `None` for an empty
    /// mesh only. Costs O(1) on average inside the map, more the farther outside.
    pub fn locate(&self, p: DVec2) -> Option<Location> {
        let [column, row] = self.cell_of(p);
        let mut best: Option<(f64, Location)> = None;
        for ring in 0..self.columns.max(self.rows) {
            // Cells of this ring are at least this far away.
            let reach = (ring as f64 - 1.0) * self.cell;
            if best.is_some_and(|(distance, _)| distance <= reach.max(0.0)) {
                break;
            }
            for r in row.saturating_sub(ring)..=(row + ring).min(self.rows - 1) {
                for c in column.saturating_sub(ring)..=(column + ring).min(self.columns - 1) {
                    if r.abs_diff(row).max(c.abs_diff(column)) != ring {
                        continue;
                    }
                    let cell = r * self.columns + c;
                    for &t in &self.entries[self.first[cell] as usize..self.first[cell + 1] as usize] {
                        let (distance, weights) = nearest(self.corners(t as usize), p);
                        if best.is_none_or(|(least, _)| distance < least) {
                            best = Some((distance, Location { triangle: t, weights }));
                        }
                    }
                }
            }
        }
        best.map(|(_, location)| location)
    }
}

/// Distance from `p` to a triangle of the plane (0 inside) and the weights of the nearest point.
fn nearest(corners: [DVec2; 3], p: DVec2) -> (f64, DVec3) {
    let [a, b, c] = corners;
    let area = (b - a).perp_dot(c - a);
    let weights = DVec3::new((b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)) / area;
    if area.abs() > 0.0 && weights.min_element() >= 0.0 {
        return (0.0, weights);
    }
    let mut best = (f64::INFINITY, DVec3::X);
    for k in 0..3 {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let along = to - from;
        let t = ((p - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance = p.distance(from.lerp(to, t));
        if distance < best.0 {
            let mut weights = DVec3::ZERO;
            weights[k] = 1.0 - t;
            weights[(k + 1) % 3] = t;
            best = (distance, weights);
        }
    }
    best
}

/// Maps a disk to the plane with the least change of angles, with some vertices pinned. Two pins far apart are enough; see
/// [`Flat::flipped`] for whether it folds.
///
/// Costs one sparse factorisation of twice as many unknowns as there are free vertices.
///
/// # Errors
/// [`ParametrizeError`].
pub fn lscm(mesh: &TriangleMesh, pins: &[(u32, DVec2)]) -> Result<Flat, ParametrizeError> {
    let topology = check_disk(mesh)?;
    let mut uv: Vec<Option<DVec2>> = vec![None; mesh.positions.len()];
    for (pin, &(v, position)) in pins.iter().enumerate() {
        let used = topology.outgoing.get(v as usize).is_some_and(|&h| h != mesh::NONE);
        if !used || uv[v as usize].replace(position).is_some() {
            return Err(ParametrizeError::Pins { pin });
        }
    }
    if pins.len() < 2 {
        return Err(ParametrizeError::Pins { pin: pins.len() });
    }
    let free: Vec<usize> = (0..uv.len()).filter(|&v| uv[v].is_none() && topology.outgoing[v] != mesh::NONE).collect();
    let mut unknown = vec![None; uv.len()];
    for (i, &v) in free.iter().enumerate() {
        unknown[v] = Some(2 * i);
    }
    let mut system = LeastSquares::new(2 * free.len());
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.points(t);
        let x = (b - a).normalize();
        let y = mesh.area_normal(t).normalize().cross(x);
        let flat = [a, b, c].map(|p| DVec2::new((p - a).dot(x), (p - a).dot(y)));
        let scale = 1.0 / mesh.area_normal(t).length().sqrt();
        // Cauchy-Riemann: the sum over corners of (opposite edge as a complex number) times (position) vanishes.
        let (mut real, mut imaginary) = (Vec::with_capacity(6), Vec::with_capacity(6));
        let mut right = DVec2::ZERO;
        for k in 0..3 {
            let w = (flat[(k + 2) % 3] - flat[(k + 1) % 3]) * scale;
            let v = mesh.triangles[t][k] as usize;
            match (uv[v], unknown[v]) {
                (Some(p), _) => right -= w.rotate(p),
                (None, Some(i)) => {
                    real.extend([(i, w.x), (i + 1, -w.y)]);
                    imaginary.extend([(i, w.y), (i + 1, w.x)]);
                }
                (None, None) => {}
            }
        }
        system.add(&real, [right.x, 0.0]);
        system.add(&imaginary, [right.y, 0.0]);
    }
    let [solution, _] = system.solve()?;
    let place = |(v, known): (usize, &Option<DVec2>)| {
        known.or(unknown[v].map(|i| DVec2::new(solution[i], solution[i + 1]))).unwrap_or(DVec2::ZERO)
    };
    Ok(Flat::new(uv.iter().enumerate().map(place).collect(), mesh.triangles.clone()))
}

/// Sparse linear least squares with two right-hand sides, by normal equations.
struct LeastSquares {
    triplets: Vec<(usize, usize, f64)>,
    right: [Vec<f64>; 2],
}

impl LeastSquares {
    fn new(size: usize) -> Self {
        Self { triplets: Vec::new(), right: [vec![0.0; size], vec![0.0; size]] }
    }

    fn add(&mut self, row: &[(usize, f64)], value: [f64; 2]) {
        for &(i, a) in row {
            self.triplets.extend(row.iter().filter(|&&(j, _)| j <= i).map(|&(j, b)| (i, j, a * b)));
            for (right, value) in self.right.iter_mut().zip(value) {
                right[i] += a * value;
            }
        }
    }

    fn solve(mut self) -> Result<[Vec<f64>; 2], SolveError> {
        let size = self.right[0].len();
        if size > 0 {
            let factor = Factor::new(size, &self.triplets)?;
            for right in &mut self.right {
                factor.solve(right)?;
            }
        }
        Ok(self.right)
    }
}

fn check_disk(mesh: &TriangleMesh) -> Result<Topology, ParametrizeError> {
    let topology = Topology::of_triangles(mesh);
    let used = topology.outgoing.iter().filter(|&&h| h != mesh::NONE).count() as i64;
    let euler_characteristic = used - topology.edges().count() as i64 + mesh.triangles.len() as i64;
    let loops = topology.border_loops().len();
    if loops != 1 || euler_characteristic != 1 {
        return Err(ParametrizeError::NotDisk { loops, euler_characteristic });
    }
    match (0..mesh.triangles.len()).find(|&t| mesh.area_normal(t) == DVec3::ZERO) {
        Some(t) => Err(ParametrizeError::Degenerate { triangle: t as u32 }),
        None => Ok(topology),
    }
}

#[cfg(test)]
#[path = "parametrize_tests.rs"]
mod tests;
