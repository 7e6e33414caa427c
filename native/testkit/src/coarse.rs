//! Coarse triangle meshes laid over shapes: a surface in pieces, whose edges are known by construction.

use mesh::{DVec3, PolygonMesh};
use std::collections::BTreeMap;

/// A coarse triangle mesh and its even subdivision.
#[derive(Debug, Clone, Default)]
pub struct Divided {
    /// Vertices of the fine mesh; those of the coarse one come first.
    pub positions: Vec<DVec3>,
    /// Fine triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Coarse triangle of each fine one.
    pub owner: Vec<u32>,
    /// Coarse triangles.
    pub coarse: Vec<[u32; 3]>,
    /// Ends of each coarse edge, and the fine vertices along it from the first end to the second.
    pub edges: Vec<([u32; 2], Vec<u32>)>,
    /// Coarse edges of each coarse triangle; edge `k` joins corners `k` and `k + 1`.
    pub triangle_edges: Vec<[u32; 3]>,
}

/// Cuts each edge of a triangle mesh into `n` pieces, each triangle into `n * n`, and moves all vertices by `shape`.
///
/// # Panics
/// When a face is no triangle.
pub fn divide(mesh: &PolygonMesh, n: u32, shape: impl Fn(DVec3) -> DVec3) -> Divided {
    let mut out = Divided { positions: mesh.positions.clone(), ..Divided::default() };
    let mut known = BTreeMap::<[u32; 2], u32>::new();
    for (owner, face) in mesh.faces().enumerate() {
        let corners: [u32; 3] = face.try_into().expect("triangles");
        let edges = [0, 1, 2].map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *known.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                let (from, to) = (out.positions[a as usize], out.positions[b as usize]);
                let mut path = vec![a];
                for i in 1..n {
                    path.push(out.positions.len() as u32);
                    out.positions.push(from.lerp(to, f64::from(i) / f64::from(n)));
                }
                path.push(b);
                out.edges.push(([a, b], path));
                out.edges.len() as u32 - 1
            })
        });
        // Fine vertex at the corner weights (n - i - j, i, j) / n.
        let along = |k: usize, i: u32| {
            let (ends, path) = &out.edges[edges[k] as usize];
            path[if ends[0] == corners[k] { i } else { n - i } as usize]
        };
        let [a, b, c] = corners.map(|v| out.positions[v as usize]);
        let mut fine = BTreeMap::new();
        let mut inner = Vec::new();
        for j in 0..=n {
            for i in 0..=n - j {
                let vertex = if j == 0 {
                    along(0, i)
                } else if i == 0 {
                    along(2, n - j)
                } else if i + j == n {
                    along(1, j)
                } else {
                    let [u, v] = [i, j].map(|x| f64::from(x) / f64::from(n));
                    inner.push(a + (b - a) * u + (c - a) * v);
                    (out.positions.len() + inner.len() - 1) as u32
                };
                fine.insert((i, j), vertex);
            }
        }
        out.positions.extend(inner);
        for j in 0..n {
            for i in 0..n - j {
                out.triangles.push([fine[&(i, j)], fine[&(i + 1, j)], fine[&(i, j + 1)]]);
                if i + j + 1 < n {
                    out.triangles.push([fine[&(i + 1, j)], fine[&(i + 1, j + 1)], fine[&(i, j + 1)]]);
                }
            }
        }
        out.owner.resize(out.triangles.len(), owner as u32);
        out.coarse.push(corners);
        out.triangle_edges.push(edges);
    }
    for p in &mut out.positions {
        *p = shape(*p);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{oracle, shapes};

    #[test]
    fn a_divided_sphere_is_the_sphere_in_pieces() {
        let coarse = shapes::triangulated(&shapes::cuboid(DVec3::splat(2.0), 1));
        let fine = divide(&coarse, 8, DVec3::normalize);
        let mesh = PolygonMesh::from_polygons(fine.positions.clone(), &fine.triangles).unwrap();
        assert_eq!(oracle::closed_manifold(&mesh), Ok(()));
        assert_eq!(oracle::euler(&mesh), 2);
        assert!((oracle::volume(&mesh) / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.05);
        assert_eq!((fine.triangles.len(), fine.edges.len()), (12 * 64, 18));
        for (owner, edges) in fine.triangle_edges.iter().enumerate() {
            for (k, &edge) in edges.iter().enumerate() {
                let (ends, path) = &fine.edges[edge as usize];
                let own = [fine.coarse[owner][k], fine.coarse[owner][(k + 1) % 3]];
                assert!(*ends == own || *ends == [own[1], own[0]]);
                assert_eq!([path[0], path[8]], *ends);
            }
        }
    }
}
