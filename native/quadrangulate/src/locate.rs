//! Finding the triangle of a flat mesh that holds a point.

use glam::{DVec2, DVec3};

/// A place on a triangle mesh: a triangle and barycentric weights, none negative, of sum 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub triangle: usize,
    pub weights: DVec3,
}

/// A flat triangle mesh binned in a regular grid, about one triangle a cell. Built in O(triangles) for even meshes.
pub(crate) struct Locator<'a> {
    points: &'a [DVec2],
    triangles: &'a [[u32; 3]],
    low: DVec2,
    cell: DVec2,
    cells: [usize; 2],
    /// Triangles whose bounding box meets each cell.
    bins: Vec<Vec<u32>>,
}

impl<'a> Locator<'a> {
    pub(crate) fn new(points: &'a [DVec2], triangles: &'a [[u32; 3]]) -> Self {
        let bounds = |vertices: &mut dyn Iterator<Item = u32>| {
            vertices.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high): (DVec2, DVec2), v| {
                (low.min(points[v as usize]), high.max(points[v as usize]))
            })
        };
        let (low, high) = bounds(&mut triangles.iter().flatten().copied());
        let n = (triangles.len() as f64).sqrt().ceil().clamp(1.0, 512.0) as usize;
        let cell = ((high - low) / n as f64).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut locator = Self { points, triangles, low, cell, cells: [n, n], bins: vec![vec![]; n * n] };
        for (t, triangle) in triangles.iter().enumerate() {
            let (from, to) = bounds(&mut triangle.iter().copied());
            let ([x0, y0], [x1, y1]) = (locator.cell_of(from), locator.cell_of(to));
            for y in y0..=y1 {
                for x in x0..=x1 {
                    locator.bins[y * n + x].push(t as u32);
                }
            }
        }
        locator
    }

    /// The place of a point; of points outside, the closest place. O(1) inside, O(triangles) outside.
    pub(crate) fn find(&self, point: DVec2) -> Place {
        let [x, y] = self.cell_of(point);
        let here = self.bins[y * self.cells[0] + x].iter().map(|&t| t as usize);
        let inside =
            here.map(|t| (t, self.weights(t, point))).max_by(|a, b| a.1.min_element().total_cmp(&b.1.min_element()));
        if let Some((triangle, weights)) = inside
            && weights.min_element() >= -1e-9
        {
            let weights = weights.max(DVec3::ZERO);
            return Place { triangle, weights: weights / weights.element_sum() };
        }
        let mut best = (f64::INFINITY, Place { triangle: 0, weights: DVec3::X });
        for triangle in 0..self.triangles.len() {
            let weights = self.closest(triangle, point);
            let distance = self.at(triangle, weights).distance_squared(point);
            if distance < best.0 {
                best = (distance, Place { triangle, weights });
            }
        }
        best.1
    }

    fn cell_of(&self, point: DVec2) -> [usize; 2] {
        let at = (point - self.low) / self.cell;
        [(at.x as usize).min(self.cells[0] - 1), (at.y as usize).min(self.cells[1] - 1)]
    }

    fn corners(&self, triangle: usize) -> [DVec2; 3] {
        self.triangles[triangle].map(|v| self.points[v as usize])
    }

    fn at(&self, triangle: usize, weights: DVec3) -> DVec2 {
        let [a, b, c] = self.corners(triangle);
        a * weights.x + b * weights.y + c * weights.z
    }

    /// Barycentric coordinates; all minus infinity in a triangle without area.
    fn weights(&self, triangle: usize, p: DVec2) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        let area = (b - a).perp_dot(c - a);
        let parts = DVec3::new((b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p));
        if area == 0.0 { DVec3::NEG_INFINITY } else { parts / area }
    }

    /// Weights of the point of the triangle's outline closest to an outside point.
    fn closest(&self, triangle: usize, p: DVec2) -> DVec3 {
        let corners = self.corners(triangle);
        let mut best = (f64::INFINITY, DVec3::X);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let length = (b - a).length_squared();
            let t = if length > 0.0 { ((p - a).dot(b - a) / length).clamp(0.0, 1.0) } else { 0.0 };
            let distance = a.lerp(b, t).distance_squared(p);
            if distance < best.0 {
                let mut weights = [0.0; 3];
                weights[k] = 1.0 - t;
                weights[(k + 1) % 3] += t;
                best = (distance, DVec3::from_array(weights));
            }
        }
        best.1
    }
}
