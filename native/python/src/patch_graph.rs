//! `quadloom.PatchGraph`: how a surface was divided before it was tiled.

use crate::arrays;
use ::tiling::PatchTiles;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// The patches that a surface was divided into: disks that can be laid flat, with corners at multiples of 30 degrees.
#[pyclass(frozen, get_all, module = "quadloom")]
pub struct PatchGraph {
    /// (N, 3) float64: where sides end, scene units.
    nodes: Py<PyArray2<f64>>,
    /// (N,) int32: the curvature at each node in units of 30 degrees: 12 less the c-indices there, on the border 6 less them.
    defects: Py<PyArray1<i32>>,
    /// (S + 1,) int32: where the points of each side begin in `side_points`, and their number.
    side_offsets: Py<PyArray1<i32>>,
    /// (P, 3) float64: the sides as polylines on the surface, both ends included; scene units.
    side_points: Py<PyArray2<f64>>,
    /// (S, 2) int32: the nodes where each side begins and ends.
    side_nodes: Py<PyArray2<i32>>,
    /// (F + 1,) int32: where the corners of each patch begin, and their number.
    patch_offsets: Py<PyArray1<i32>>,
    /// (C,) int32: the node at each corner, counter-clockwise about its patch.
    corner_nodes: Py<PyArray1<i32>>,
    /// (C,) int32: the interior angle at each corner in units of 30 degrees; 6 where the border passes a node straight.
    c_indices: Py<PyArray1<i32>>,
    /// (C,) int32: the side that leaves each corner.
    corner_sides: Py<PyArray1<i32>>,
    /// (F,) int32: the patch of each panel. This and what follows is empty with pattern="random", whose panels lie across sides.
    face_patches: Py<PyArray1<i32>>,
    /// (S + 1,) int32: where the vertices of each side begin in `side_verts`, and their number.
    side_vert_offsets: Py<PyArray1<i32>>,
    /// (K,) int32: the vertices of the panels along each side as it runs, both ends included; vertex n is node n.
    side_verts: Py<PyArray1<i32>>,
    /// (S + 1,) int32: where the edges of each side begin in `side_courses`, and their number.
    course_offsets: Py<PyArray1<i32>>,
    /// (E,) int32: where each edge along a side goes, in units of 30 degrees from the side's own direction: 0 straight on,
    /// 1 to the left, -1 to the right. Between 0 and another lies a vertex with the c-indices 5 and 7.
    side_courses: Py<PyArray1<i32>>,
}

impl PatchGraph {
    /// As arrays.
    pub fn new(py: Python<'_>, graph: &::tiling::PatchGraph, tiles: Option<&PatchTiles>) -> PyResult<Self> {
        let nothing = PatchTiles::default();
        let tiles = tiles.unwrap_or(&nothing);
        let offsets = |sizes: &mut dyn Iterator<Item = usize>| {
            let mut offsets = vec![0];
            offsets.extend(sizes.scan(0, |sum, size| {
                *sum += size as u32;
                Some(*sum)
            }));
            arrays::index_array(py, &offsets).unbind()
        };
        let rows = |points: &mut dyn Iterator<Item = &mesh::DVec3>| -> PyResult<Py<PyArray2<f64>>> {
            Ok(arrays::rows(py, &points.map(mesh::DVec3::to_array).collect::<Vec<_>>())?.unbind())
        };
        let corners = || graph.patches.iter().flat_map(|patch| &patch.corners);
        let of_corners =
            |of: fn(&::tiling::Corner) -> u32| arrays::index_array(py, &corners().map(of).collect::<Vec<_>>()).unbind();
        Ok(Self {
            nodes: rows(&mut graph.nodes.iter())?,
            defects: PyArray1::from_vec(py, graph.node_defects()).unbind(),
            side_offsets: offsets(&mut graph.sides.iter().map(|side| side.points.len())),
            side_points: rows(&mut graph.sides.iter().flat_map(|side| &side.points))?,
            side_nodes: arrays::index_pairs(py, &graph.sides.iter().map(|side| side.ends).collect::<Vec<_>>())?
                .unbind(),
            patch_offsets: offsets(&mut graph.patches.iter().map(|patch| patch.corners.len())),
            corner_nodes: of_corners(|corner| corner.node),
            c_indices: of_corners(|corner| corner.c_index.into()),
            corner_sides: of_corners(|corner| corner.side),
            face_patches: arrays::index_array(py, &tiles.patch_of).unbind(),
            side_vert_offsets: offsets(&mut tiles.along.iter().map(Vec::len)),
            side_verts: arrays::index_array(py, &tiles.along.concat()).unbind(),
            course_offsets: offsets(&mut tiles.courses.iter().map(Vec::len)),
            side_courses: PyArray1::from_iter(py, tiles.courses.iter().flatten().map(|&offset| offset.into())).unbind(),
        })
    }
}
