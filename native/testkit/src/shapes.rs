//! Meshes by formula: closed and pure quad unless they say otherwise, facing outwards, centred on the origin.

use glam::DMat3;
use mesh::{DVec3, PolygonMesh, TriangleMesh};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, TAU};

/// A box of the given size with `n` by `n` quads a side.
pub fn cuboid(size: DVec3, n: u32) -> PolygonMesh {
    let mut verts = BTreeMap::<[u32; 3], u32>::new();
    let mut positions = Vec::new();
    let mut vert = |at: [u32; 3]| {
        *verts.entry(at).or_insert_with(|| {
            positions.push(size * (DVec3::from_array(at.map(f64::from)) / f64::from(n) - 0.5));
            positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::new();
    for axis in 0..3 {
        for (level, flip) in [(0, true), (n, false)] {
            for i in 0..n {
                for j in 0..n {
                    let mut face = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[u, v]| {
                        let mut at = [level; 3];
                        at[(axis + 1) % 3] = u;
                        at[(axis + 2) % 3] = v;
                        vert(at)
                    });
                    if flip {
                        face.reverse();
                    }
                    faces.push(face);
                }
            }
        }
    }
    built(positions, faces)
}

/// A unit sphere: the cube with `n` by `n` quads a side, blown up with even angles.
pub fn sphere(n: u32) -> PolygonMesh {
    let cube = cuboid(DVec3::splat(2.0), n);
    let even = |p: &DVec3| DVec3::from_array(p.to_array().map(|x| (x * FRAC_PI_4).tan())).normalize();
    cube.with_positions(cube.positions.iter().map(even).collect())
}

/// A torus round the z axis: `around` quads along the ring and `across` along the tube, at least 3 each.
pub fn torus(major: f64, minor: f64, around: u32, across: u32) -> PolygonMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (TAU * f64::from(i) / f64::from(around), TAU * f64::from(j) / f64::from(across));
            let radius = major + minor * v.cos();
            positions.push(DVec3::new(radius * u.cos(), radius * u.sin(), minor * v.sin()));
            let at = |i: u32, j: u32| i % around * across + j % across;
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    built(positions, faces)
}

/// A cylinder along z with `4 n` quads round it and `layers` up it. Its caps are O-grids: a square of `n` by `n` quads
/// within `n` rings.
pub fn cylinder(radius: f64, height: f64, n: u32, layers: u32) -> PolygonMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let fraction = |k: u32, n: u32| f64::from(k) / f64::from(n);
    // The square of a cap, and its border vertices counter-clockwise from the low corner.
    let mut square = |z: f64, flip: bool, positions: &mut Vec<DVec3>| {
        let first = positions.len() as u32;
        let at = |i: u32, j: u32| first + i * (n + 1) + j;
        for i in 0..=n {
            for j in 0..=n {
                positions.push(DVec3::new(radius * (fraction(i, n) - 0.5), radius * (fraction(j, n) - 0.5), z));
                if i < n && j < n {
                    let mut face = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    if flip {
                        face.reverse();
                    }
                    faces.push(face);
                }
            }
        }
        let sides: [&dyn Fn(u32) -> u32; 4] = [&|k| at(k, 0), &|k| at(n, k), &|k| at(n - k, n), &|k| at(0, n - k)];
        sides.iter().flat_map(|side| (0..n).map(side)).collect::<Vec<u32>>()
    };
    let bottom = square(-height / 2.0, true, &mut positions);
    let top = square(height / 2.0, false, &mut positions);

    // Loops of 4 n vertices from the one square out to the rim, up the side and in to the other.
    let circle: Vec<DVec3> = (0..4 * n)
        .map(|k| {
            let angle = TAU * (fraction(k, 4 * n) - 0.375);
            radius * DVec3::new(angle.cos(), angle.sin(), 0.0)
        })
        .collect();
    let rim: Vec<DVec3> = bottom.iter().map(|&v| positions[v as usize]).collect();
    let mut loops = vec![bottom];
    let mut add_loop = |points: Vec<DVec3>| {
        let first = positions.len() as u32;
        positions.extend(points);
        loops.push((first..first + 4 * n).collect());
    };
    let ring = |k: u32, z: f64| -> Vec<DVec3> {
        rim.iter().zip(&circle).map(|(s, c)| s.lerp(*c, fraction(k, n)).with_z(z)).collect()
    };
    (1..n).for_each(|k| add_loop(ring(k, -height / 2.0)));
    (0..=layers).for_each(|k| add_loop(ring(n, height * (fraction(k, layers) - 0.5))));
    (1..n).rev().for_each(|k| add_loop(ring(k, height / 2.0)));
    loops.push(top);
    for pair in loops.windows(2) {
        for k in 0..4 * n as usize {
            let next = (k + 1) % (4 * n as usize);
            faces.push([pair[0][k], pair[0][next], pair[1][next], pair[1][k]]);
        }
    }
    built(positions, faces)
}

/// A flat open sheet in the xy plane, facing up, of unit squares, `n` by `m`.
pub fn sheet(n: u32, m: u32) -> PolygonMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let at = |i: u32, j: u32| i * (m + 1) + j;
    for i in 0..=n {
        for j in 0..=m {
            positions.push(DVec3::new(f64::from(i) - f64::from(n) / 2.0, f64::from(j) - f64::from(m) / 2.0, 0.0));
            if i < n && j < m {
                faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    built(positions, faces)
}

/// All faces split into triangles.
pub fn triangulated(mesh: &PolygonMesh) -> PolygonMesh {
    TriangleMesh::from_polygons(mesh).0.to_polygons()
}

/// All faces turned over.
pub fn reversed(mesh: &PolygonMesh) -> PolygonMesh {
    built(mesh.positions.clone(), mesh.faces().map(|face| face.iter().rev().copied().collect::<Vec<_>>()))
}

/// The mesh under `linear`, then moved.
pub fn transformed(mesh: &PolygonMesh, linear: DMat3, translation: DVec3) -> PolygonMesh {
    mesh.with_positions(mesh.positions.iter().map(|&p| linear * p + translation).collect())
}

/// Meshes side by side in one, nothing merged.
pub fn joined(meshes: &[PolygonMesh]) -> PolygonMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = positions.len() as u32;
        positions.extend(&mesh.positions);
        faces.extend(mesh.faces().map(|face| face.iter().map(|v| v + first).collect::<Vec<_>>()));
    }
    built(positions, faces)
}

fn built<F: AsRef<[u32]>>(positions: Vec<DVec3>, faces: impl IntoIterator<Item = F>) -> PolygonMesh {
    PolygonMesh::from_polygons(positions, faces).expect("indices in range by construction")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle;
    use std::f64::consts::PI;

    #[track_caller]
    fn is_shape(mesh: &PolygonMesh, euler: i64, volume: f64, area: f64) {
        assert_eq!(oracle::closed_manifold(mesh), Ok(()));
        assert!(mesh.is_pure_quad());
        assert_eq!((oracle::euler(mesh), oracle::components(mesh)), (euler, 1));
        assert!((oracle::volume(mesh) / volume - 1.0).abs() < 0.02, "volume {} {volume}", oracle::volume(mesh));
        assert!((oracle::area(mesh) / area - 1.0).abs() < 0.02, "area {} {area}", oracle::area(mesh));
        let triangles = triangulated(mesh);
        assert_eq!(oracle::closed_manifold(&triangles), Ok(()));
        assert_eq!(triangles.face_count(), 2 * mesh.face_count());
        assert!(oracle::volume(&reversed(mesh)) < 0.0);
    }

    #[test]
    fn shapes_have_their_topology_and_size() {
        for n in 1..4 {
            is_shape(&cuboid(DVec3::new(1.0, 2.0, 3.0), n), 2, 6.0, 22.0);
        }
        is_shape(&sphere(16), 2, 4.0 / 3.0 * PI, 4.0 * PI);
        is_shape(&torus(2.0, 0.5, 48, 24), 0, PI * PI, 4.0 * PI * PI);
        is_shape(&cylinder(1.0, 2.0, 6, 3), 2, 2.0 * PI, 6.0 * PI);
        is_shape(&cylinder(0.9, 1.0, 1, 1), 2, 2.0 * 0.81, 4.0 * 0.81 + 4.0 * 0.9 * 2f64.sqrt());
    }

    #[test]
    fn a_sheet_is_open_and_joined_shapes_stay_apart() {
        let sheet = sheet(3, 2);
        assert!(oracle::closed_manifold(&sheet).is_err());
        assert_eq!((oracle::euler(&sheet), oracle::area(&sheet)), (1, 6.0));
        let both = joined(&[sphere(2), torus(2.0, 0.5, 8, 6)]);
        assert_eq!((oracle::components(&both), oracle::euler(&both)), (2, 2));
    }
}
