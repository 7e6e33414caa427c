//! Polygon meshes as Wavefront OBJ text: `v` and `f` lines.

use mesh::{DVec3, PolygonMesh};
use std::fmt::Write;

/// Reads positions and faces; texture and normal indices, and all other lines, are passed over.
///
/// # Errors
/// A sentence that names the first line that is no valid `v` or `f`.
pub fn read(text: &str) -> Result<PolygonMesh, String> {
    let (mut positions, mut faces) = (Vec::new(), Vec::<Vec<u32>>::new());
    for (number, line) in text.lines().enumerate() {
        let bad = || format!("line {}: cannot read {line:?}", number + 1);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).collect();
                let &[x, y, z] = &numbers[..] else { return Err(bad()) };
                positions.push(DVec3::new(x, y, z));
            }
            Some("f") => {
                let corner = |word: &str| {
                    // Counted from 1, or backwards from the last vertex so far.
                    let index: i64 = word.split('/').next()?.parse().ok()?;
                    u32::try_from(if index > 0 { index - 1 } else { positions.len() as i64 + index }).ok()
                };
                faces.push(words.map(corner).collect::<Option<_>>().ok_or_else(bad)?);
            }
            _ => {}
        }
    }
    PolygonMesh::from_polygons(positions, faces).map_err(|error| error.to_string())
}

/// Writes a mesh so that [`read`] gives back the same bits.
pub fn write(mesh: &PolygonMesh) -> String {
    let mut text = String::new();
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("a string takes all");
    }
    for face in mesh.faces() {
        text.push('f');
        for v in face {
            write!(text, " {}", v + 1).expect("a string takes all");
        }
        text.push('\n');
    }
    text
}

/// Reads marked edges: vertex pairs, `i j` a line; a line of another length, such as a count, is passed over.
///
/// # Errors
/// A word that is no number.
pub fn read_edges(text: &str) -> Result<Vec<[u32; 2]>, std::num::ParseIntError> {
    let numbers = |line: &str| line.split_whitespace().map(str::parse).collect::<Result<Vec<u32>, _>>();
    let rows = text.lines().map(numbers).collect::<Result<Vec<_>, _>>()?;
    Ok(rows.into_iter().filter_map(|row| <[u32; 2]>::try_from(row).ok()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read(mesh in crate::strategy::closed_quad_mesh()) {
            prop_assert_eq!(read(&write(&mesh)), Ok(mesh));
        }
    }

    #[test]
    fn reads_slashes_and_backward_indices() {
        let mesh = read("# a triangle\nv 0 0 0 1\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1/1 2//1 -1\n").unwrap();
        assert_eq!(mesh.face(0), [0, 1, 2]);
    }

    #[test]
    fn names_the_bad_line() {
        assert_eq!(read("v 0 0 0\nv 0 zero 0\n"), Err("line 2: cannot read \"v 0 zero 0\"".into()));
        assert_eq!(read("f 1 x 2\n"), Err("line 1: cannot read \"f 1 x 2\"".into()));
        assert!(read("v 0 0 0\nf 1 2 3\n").is_err());
    }
}
