//! `quadloom.PatchGraph`: how a surface was divided before it was tiled.

use crate::arrays;
use crate::errors::{self, QuadloomError};
use ::tiling::{DrawnGraph, PatchTiles, Side};
use mesh::DVec3;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// The patches that a surface was divided into: disks that can be laid flat, with corners at multiples of 30 degrees.
///
/// One can be made for `PatchDesign`, of nodes (N, 3) and sides between them: `side_nodes` (S, 2), straight, or along the
/// points (P, 3) of `side_points`, those of side s from `side_offsets[s]` to `side_offsets[s + 1]`, both ends included, near a
/// surface. `side_c_indices` as the attribute; None where nothing is known. It has no patches yet: the design finds them.
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
    /// (S, 2) int32: the c-index where each side begins, in the patch on its left, and where it ends, in the patch on its
    /// right; 0 where there is no patch, or it is not known.
    side_c_indices: Py<PyArray2<i32>>,
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

#[pymethods]
impl PatchGraph {
    #[new]
    #[pyo3(signature = (nodes, side_nodes, side_offsets = None, side_points = None, *, side_c_indices = None))]
    fn of_arrays(
        py: Python<'_>,
        nodes: Bound<'_, PyAny>,
        side_nodes: Bound<'_, PyAny>,
        side_offsets: Option<Bound<'_, PyAny>>,
        side_points: Option<Bound<'_, PyAny>>,
        side_c_indices: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let drawn = drawn(&nodes, &side_nodes, side_offsets.as_ref(), side_points.as_ref(), side_c_indices.as_ref());
        let drawn = drawn.map_err(|sentence| errors::raise_plain::<QuadloomError>(py, "option", sentence))?;
        let graph = ::tiling::PatchGraph { nodes: drawn.nodes, sides: drawn.sides, patches: Vec::new() };
        Self::of_parts(py, &graph, &drawn.c_indices, None)
    }
}

fn drawn(
    nodes: &Bound<'_, PyAny>,
    side_nodes: &Bound<'_, PyAny>,
    offsets: Option<&Bound<'_, PyAny>>,
    points: Option<&Bound<'_, PyAny>>,
    c_indices: Option<&Bound<'_, PyAny>>,
) -> Result<DrawnGraph, String> {
    let nodes = arrays::points(nodes, "nodes")?;
    let ends = arrays::pairs(side_nodes, "side_nodes")?;
    if let Some([a, b]) = ends.iter().find(|ends| ends.iter().any(|&n| n as usize >= nodes.len())) {
        return Err(format!("side_nodes has the pair {a}, {b}; there are {} nodes", nodes.len()));
    }
    let straight = |ends: &[u32; 2]| ends.map(|n| nodes[n as usize]).to_vec();
    let lines: Vec<Vec<DVec3>> = match (offsets, points) {
        (None, None) => ends.iter().map(straight).collect(),
        (Some(offsets), Some(points)) => {
            let (offsets, points) = (arrays::indices(offsets, "side_offsets")?, arrays::points(points, "side_points")?);
            let is_rising = offsets.windows(2).all(|w| w[0] + 2 <= w[1]);
            let is_whole = offsets.first() == Some(&0) && offsets.last().map(|&n| n as usize) == Some(points.len());
            if offsets.len() != ends.len() + 1 || !is_rising || !is_whole {
                let (sides, points) = (ends.len(), points.len());
                return Err(format!(
                    "side_offsets must rise from 0 to {points}, by 2 or more for each of the {sides} sides"
                ));
            }
            offsets.windows(2).map(|w| points[w[0] as usize..w[1] as usize].to_vec()).collect()
        }
        _ => return Err("side_offsets and side_points belong together; give both or neither".to_owned()),
    };
    let c_indices = c_indices.map_or(Ok(vec![]), |given| arrays::pairs(given, "side_c_indices"))?;
    if (!c_indices.is_empty() && c_indices.len() != ends.len()) || c_indices.iter().flatten().any(|&c| c > 12) {
        return Err(format!("side_c_indices must be {} rows of two numbers from 0 to 12", ends.len()));
    }
    let known = |c: u32| (c > 0).then_some(c as u8);
    let mut c_indices: Vec<[Option<u8>; 2]> = c_indices.into_iter().map(|pair| pair.map(known)).collect();
    c_indices.resize(ends.len(), [None; 2]);
    let sides = ends.into_iter().zip(lines).map(|(ends, points)| Side { ends, points }).collect();
    Ok(DrawnGraph { nodes, sides, c_indices })
}

/// The inverse of [`PatchGraph::of_arrays`]: what is to be drawn.
pub fn to_drawn(graph: &Bound<'_, PatchGraph>) -> Result<DrawnGraph, String> {
    let (py, graph) = (graph.py(), graph.get());
    drawn(
        graph.nodes.bind(py),
        graph.side_nodes.bind(py),
        Some(graph.side_offsets.bind(py)),
        Some(graph.side_points.bind(py)),
        Some(graph.side_c_indices.bind(py)),
    )
}

impl PatchGraph {
    /// As arrays.
    pub fn new(py: Python<'_>, graph: &::tiling::PatchGraph, tiles: Option<&PatchTiles>) -> PyResult<Self> {
        Self::of_parts(py, graph, &DrawnGraph::from(graph).c_indices, tiles)
    }

    fn of_parts(
        py: Python<'_>,
        graph: &::tiling::PatchGraph,
        side_c_indices: &[[Option<u8>; 2]],
        tiles: Option<&PatchTiles>,
    ) -> PyResult<Self> {
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
            side_c_indices: {
                let numbers = |pair: &[Option<u8>; 2]| pair.map(|c| c.map_or(0, i32::from));
                arrays::rows(py, &side_c_indices.iter().map(numbers).collect::<Vec<_>>())?.unbind()
            },
            face_patches: arrays::index_array(py, &tiles.patch_of).unbind(),
            side_vert_offsets: offsets(&mut tiles.along.iter().map(Vec::len)),
            side_verts: arrays::index_array(py, &tiles.along.concat()).unbind(),
            course_offsets: offsets(&mut tiles.courses.iter().map(Vec::len)),
            side_courses: PyArray1::from_iter(py, tiles.courses.iter().flatten().map(|&offset| offset.into())).unbind(),
        })
    }
}
