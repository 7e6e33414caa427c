"""quadloom.Mesh: what it takes, what it refuses, what it gives back."""

from __future__ import annotations

import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, cube_positions

OFFSETS = np.arange(0, 25, 4)
CORNERS = np.ravel(CUBE_FACES)


def test_gives_back_what_it_was_given_in_blenders_types(cube):
    assert cube.positions.dtype == np.float64
    assert cube.face_offsets.dtype == cube.corner_verts.dtype == np.int32
    np.testing.assert_array_equal(cube.positions, cube_positions())
    np.testing.assert_array_equal(cube.face_offsets, OFFSETS)
    np.testing.assert_array_equal(cube.corner_verts, CORNERS)
    assert repr(cube) == "quadloom.Mesh(8 vertices, 6 faces)"


def test_arrays_are_read_only_and_kept(cube):
    assert cube.positions is cube.positions
    for array in (cube.positions, cube.face_offsets, cube.corner_verts):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize(
    "positions",
    [
        pytest.param(cube_positions().astype(np.float32), id="float32"),
        pytest.param(cube_positions().astype(np.int8), id="int8"),
        pytest.param(cube_positions().astype(">f8"), id="big-endian"),
        pytest.param(np.asfortranarray(cube_positions()), id="Fortran order"),
        pytest.param(np.repeat(cube_positions(), 2, axis=0)[::2], id="strided"),
        pytest.param(cube_positions()[::-1][::-1], id="negative strides"),
        pytest.param(cube_positions().tolist(), id="lists"),
        pytest.param(np.frombuffer(b"x" + cube_positions().tobytes(), np.uint8)[1:].view(float).reshape(-1, 3), id="unaligned"),
    ],
)
def test_takes_any_array_of_positions(positions):
    mesh = quadloom.Mesh(positions, OFFSETS, CORNERS)
    np.testing.assert_array_equal(mesh.positions, cube_positions())


@pytest.mark.parametrize("dtype", [np.int32, np.int64, np.uint8, np.uint64, ">i4"])
def test_takes_any_integers_as_indices(dtype):
    mesh = quadloom.Mesh(cube_positions(), OFFSETS.astype(dtype), np.repeat(CORNERS, 2).astype(dtype)[::2])
    np.testing.assert_array_equal(mesh.corner_verts, CORNERS)


def test_an_empty_mesh_is_a_mesh():
    mesh = quadloom.Mesh([], [0], [])
    assert mesh.positions.shape == (0, 3)
    assert not quadloom.check(mesh)


@pytest.mark.parametrize(
    ("arrays", "code", "says", "elements"),
    [
        ((cube_positions()[:, :2], OFFSETS, CORNERS), "array", r"positions has the shape \[8, 2\].*\(V, 3\)", {}),
        ((cube_positions().ravel(), OFFSETS, CORNERS), "array", r"positions has the shape \[24\]", {}),
        ((cube_positions() + 1j, OFFSETS, CORNERS), "array", "positions has the type complex128", {}),
        (("a mesh", OFFSETS, CORNERS), "array", "positions has the type", {}),
        (([[0, 1], [2]], OFFSETS, CORNERS), "array", "positions is not an array of float64", {}),
        ((cube_positions(), OFFSETS.astype(float), CORNERS), "array", "face_offsets has the type float64", {}),
        ((cube_positions(), OFFSETS, CORNERS.reshape(-1, 4)), "array", r"corner_verts has the shape \[6, 4\].*\(N,\)", {}),
        ((cube_positions(), [0, 4], [0, 1, 2, -1]), "array", "corner_verts holds -1 at position 3", {}),
        ((cube_positions(), [0, 4], [0, 1, 2**32, 2]), "array", "corner_verts holds 4294967296 at position 2", {}),
        ((cube_positions(), [0, 4], [0, 1, 2, 8]), "vertex_out_of_range", "vertex 8, but there are 8", {"corners": [3]}),
        ((cube_positions(), [0, 2], [0, 1]), "offsets", "face 0 does not", {"faces": [0]}),
        ((cube_positions(), [0, 4, 4], [0, 1, 2, 3]), "offsets", "face 1 does not", {"faces": [1]}),
        ((cube_positions(), [0, 4], CORNERS), "offsets", r"number of corners \(24\)", {"faces": [1]}),
        ((cube_positions(), [], []), "offsets", "must start at 0", {"faces": [0]}),
    ],
)
def test_names_what_is_wrong_with_arrays(arrays, code, says, elements):
    with pytest.raises(quadloom.InvalidMeshError, match=says) as caught:
        quadloom.Mesh(*arrays)
    assert caught.value.code == code
    assert caught.value.mesh is None
    assert {kind: index.tolist() for kind, index in caught.value.elements.items()} == elements


def test_polygons_may_be_any_iterable_of_any_array():
    mesh = quadloom.Mesh.from_polygons(cube_positions(), (np.array(face) for face in CUBE_FACES))
    np.testing.assert_array_equal(mesh.corner_verts, CORNERS)
    with pytest.raises(quadloom.InvalidMeshError, match="polygon 1 has the type float64"):
        quadloom.Mesh.from_polygons(cube_positions(), [[0, 1, 2], [0.5, 1.0, 2.0]])


def test_later_changes_of_the_arrays_do_not_reach_the_mesh():
    positions = cube_positions()
    mesh = quadloom.Mesh(positions, OFFSETS, CORNERS)
    positions[:] = 7
    np.testing.assert_array_equal(mesh.positions, cube_positions())
