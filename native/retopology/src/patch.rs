//! Patches: base triangles merged across edges that need not stay, with the corners where one quad will do.

use crate::base::Base;
use crate::measures::{Corner, Measures, next};
use crate::templates::Chosen;
use mesh::NONE;

/// A disk of base triangles that is filled as one.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Patch {
    /// Its base triangles, ascending.
    pub triangles: Vec<u32>,
    /// The half-edges round it, counter-clockwise, from a corner on.
    pub border: Vec<Corner>,
    /// Where sides start: rising indices into `border`, the first 0. At a border vertex that starts no side two quads meet.
    pub corners: Vec<usize>,
    /// Its template among those chosen, if it has one.
    pub template: Option<usize>,
    /// Whether the first of its three sides counts as two, as long as the second and the third; see [`crate::lines`].
    pub split: bool,
}

/// What is filled: patches on a surface, and how large their quads shall be beside one another.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan<'a> {
    pub base: &'a Base,
    pub measures: &'a Measures,
    pub patches: &'a [Patch],
    pub templates: &'a [Chosen],
    /// Relative edge length at each vertex of the surface.
    pub size: &'a [f64],
    /// The edge length wanted there before curvature and bends were looked at, scene units: what counts as near is a part of it.
    pub plain: &'a [f64],
    /// Fewest quads along each base edge.
    pub least: &'a [u32],
}

/// The rim of a few base triangles.
#[derive(Debug, Clone)]
pub(crate) struct Rim {
    /// Half-edges, counter-clockwise.
    pub border: Vec<Corner>,
    /// Angle inside the rim where each of them starts, radians.
    pub angles: Vec<f64>,
}

impl Rim {
    /// The rim of some triangles without the edges between them that may go; `None` unless they are then a disk that
    /// touches itself nowhere and has no vertex inside.
    pub fn new(base: &Base, measures: &Measures, triangles: &[u32]) -> Option<Self> {
        let inside = |h: Corner| {
            let rail = measures.rails[base.triangle_edges[h as usize / 3][h as usize % 3] as usize];
            let twin = measures.twins[h as usize];
            !rail && twin != NONE && triangles.contains(&(twin / 3))
        };
        let corners = || triangles.iter().flat_map(|&t| 3 * t..3 * t + 3);
        let start = corners().find(|&h| !inside(h))?;
        let (mut border, mut angles) = (vec![start], vec![]);
        loop {
            let mut h = next(*border.last()?);
            let mut angle = measures.angles[h as usize];
            while inside(h) {
                h = next(measures.twins[h as usize]);
                angle += measures.angles[h as usize];
            }
            angles.push(angle);
            if h == start {
                break;
            }
            border.push(h);
            if border.len() > 3 * triangles.len() {
                return None;
            }
        }
        // The angles belong to the starts of the second half-edge, the third, ..., the first.
        angles.rotate_right(1);
        let vertices: Vec<u32> = border.iter().map(|&h| base.triangles[h as usize / 3][h as usize % 3]).collect();
        let distinct = (0..vertices.len()).all(|i| !vertices[..i].contains(&vertices[i]));
        (distinct && border.len() == triangles.len() + 2).then_some(Self { border, angles })
    }

    /// The patch with these corners, indices into `border`.
    pub fn patch(&self, triangles: &[u32], corners: &[usize]) -> Patch {
        let first = corners.first().copied().unwrap_or(0);
        let mut border = self.border.clone();
        border.rotate_left(first);
        let mut triangles = triangles.to_vec();
        triangles.sort_unstable();
        Patch { triangles, border, corners: corners.iter().map(|c| c - first).collect(), template: None, split: false }
    }
}

impl Patch {
    /// The same patch, with sides counted from another corner.
    pub fn turned(mut self, from: usize) -> Self {
        let start = self.corners[from % self.corners.len()];
        let count = self.border.len();
        self.border.rotate_left(start);
        self.corners = self.corners.iter().map(|c| (c + count - start) % count).collect();
        self.corners.sort_unstable();
        self
    }

    /// Whether with these counts along its three sides it is a grid, as the end of a line; without one count for each chord of the
    /// layout it may be a triangle like others.
    pub fn is_grid(&self, sides: &[u32]) -> bool {
        self.split && matches!(*sides, [first, second, third] if first == second + third)
    }

    /// The half-edges of each side.
    pub fn sides(&self) -> impl Iterator<Item = &[Corner]> {
        (0..self.corners.len()).map(|i| {
            let end = self.corners.get(i + 1).copied().unwrap_or(self.border.len());
            &self.border[self.corners[i]..end]
        })
    }
}
