//! What came of shaping, measured.

use super::super::SurfaceError;
use super::super::pattern::Place;
use super::super::rim::Rim;
use super::{Far, Shaper, is_turned};
use mesh::{DVec3, Monitor, NONE, PolygonMesh, TriangleMesh, sorted};
use std::collections::{BTreeMap, BTreeSet};
use surface::closest::ClosestPoint;

impl Shaper<'_> {
    /// Of each tile the greatest distance to the surface, of its corners and its middle, and from the surface, of those of its vertices that
    /// are nearest to the tile; and which of these are off by at least half as much as any, with their distances.
    pub(super) fn off_surface(&self, positions: &[DVec3], monitor: &Monitor) -> Result<(Vec<f64>, Far), SurfaceError> {
        let own = |tile: &Vec<u32>| {
            let middle = tile.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / tile.len() as f64;
            let points = tile.iter().map(|&v| positions[v as usize]).chain([middle]);
            points.map(|p| self.closest.project_near(p, self.triangle[tile[0] as usize]).distance).fold(0.0, f64::max)
        };
        let mut off: Vec<f64> = self.pattern.tiles.iter().map(own).collect();
        let (mesh, tile_of) =
            TriangleMesh::from_polygons(&PolygonMesh::from_polygons(positions.to_vec(), &self.pattern.tiles)?);
        let tiles = ClosestPoint::new(&mesh);
        let used: BTreeSet<u32> = self.surface.triangles.iter().flatten().copied().collect();
        let (mut near, mut far) = (NONE, Vec::new());
        for (k, v) in used.into_iter().enumerate() {
            if k % 1024 == 0 {
                monitor.check()?;
            }
            let found = tiles.project_near(self.surface.positions[v as usize], near);
            near = found.triangle;
            if near != NONE {
                let off = &mut off[tile_of[near as usize] as usize];
                *off = off.max(found.distance);
                far.push((found.distance, v));
            }
        }
        far.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let most = far.first().map_or(0.0, |far| far.0);
        far.truncate(far.partition_point(|&(distance, _)| distance >= most / 2.0));
        Ok((off, far))
    }

    /// Distance of each vertex from its curve, wherever on it; 0 of those on none.
    pub(super) fn off_curves(&self, positions: &[DVec3]) -> Vec<f64> {
        let far = |(&place, &p): (&Place, &DVec3)| match place {
            Place::Free | Place::Fixed => 0.0,
            Place::OnCurve(curve) => self.curves[curve as usize].project(p).0.distance(p),
        };
        self.pattern.places.iter().zip(positions).map(far).collect()
    }

    /// Of each tile the greatest distance of its border edges from the border of the surface, and of that from them; 0 of those without any.
    pub(super) fn off_border(&self, positions: &[DVec3]) -> Vec<f64> {
        let mut off = vec![0.0; self.pattern.tiles.len()];
        let Some(rim) = Rim::of(self.surface) else { return off };
        let mut of_edge: BTreeMap<[u32; 2], (usize, usize)> = BTreeMap::new();
        for (t, tile) in self.pattern.tiles.iter().enumerate() {
            for (k, &v) in tile.iter().enumerate() {
                let (uses, _) = of_edge.entry(sorted(v, tile[(k + 1) % tile.len()])).or_insert((0, t));
                *uses += 1;
            }
        }
        let border: Vec<([u32; 2], usize)> =
            of_edge.into_iter().filter(|(_, (uses, _))| *uses == 1).map(|(edge, (_, t))| (edge, t)).collect();
        let edges: Vec<[DVec3; 2]> = border.iter().map(|(edge, _)| edge.map(|v| positions[v as usize])).collect();
        for (distance, &(_, t)) in rim.off(&edges).into_iter().zip(&border) {
            off[t] = distance.max(off[t]);
        }
        off
    }

    /// Tiles that are turned over.
    pub(super) fn turned(&self, positions: &[DVec3]) -> Vec<u32> {
        (0..self.pattern.tiles.len() as u32)
            .filter(|&t| self.is_over(&self.pattern.tiles[t as usize], positions))
            .collect()
    }

    /// Whether a corner of a tile faces away from the surface below the tile's middle: from the triangle there, which may be a sliver that
    /// faces anywhere, and from what is around it.
    pub(super) fn is_over(&self, tile: &[u32], positions: &[DVec3]) -> bool {
        let middle = tile.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / tile.len() as f64;
        let below = self.closest.project_near(middle, self.triangle[tile[0] as usize]).triangle;
        if below == NONE {
            return true;
        }
        let up = self.surface.area_normal(below as usize);
        let around: DVec3 = self.surface.triangles[below as usize].iter().map(|&v| self.normals[v as usize]).sum();
        is_turned(tile, positions, up) && is_turned(tile, positions, around)
    }
}
