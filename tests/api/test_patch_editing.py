"""Zigzags on patch graphs: what comes out is counted anew; what cannot take one is named."""

from __future__ import annotations

import numpy as np
import pytest
import quadloom
from meshes import polygons
from test_surface_tiling import check_result, dome, grid


def sheet(n: int = 9, m: int = 6) -> quadloom.Mesh:
    return grid(n, m, lambda u, v: (float(n) * u, float(m) * v, 0.0))


def tiled(mesh: quadloom.Mesh, edge_length: float, **options) -> quadloom.SurfaceResult:
    result = quadloom.tile_surface(mesh, edge_length, partition="patches", **options)
    assert result.patch_graph is not None
    return result


def course(graph: quadloom.PatchGraph, side: int) -> list[int]:
    return graph.side_courses[graph.course_offsets[side] : graph.course_offsets[side + 1]].tolist()


def along(graph: quadloom.PatchGraph, side: int) -> list[int]:
    return graph.side_verts[graph.side_vert_offsets[side] : graph.side_vert_offsets[side + 1]].tolist()


def inner_defects(mesh: quadloom.Mesh) -> dict[int, int]:
    """Vertices off the border whose corners are no full turn, and what is missing, in units of 30 degrees."""
    _, faces = polygons(mesh)
    pairs = {(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))}
    rim = {v for a, b in pairs if (b, a) not in pairs for v in (a, b)}
    left: dict[int, int] = {}
    for face in faces:
        for v in face:
            left[v] = left.get(v, 12) - (2 if len(face) == 3 else 3)
    return {v: defect for v, defect in left.items() if defect and v not in rim}


def tiles_of(result, patch: int) -> list[list[int]]:
    """The faces of a patch by the order in which their vertices are met: the same for patches that are tiled alike."""
    _, faces = polygons(result.mesh)
    met: dict[int, int] = {}
    return [[met.setdefault(v, len(met)) for v in faces[f]] for f in np.flatnonzero(result.patch_graph.face_patches == patch)]


def check_edit(before, after) -> None:
    old, new = before.patch_graph, after.patch_graph
    assert inner_defects(after.mesh) == inner_defects(before.mesh)
    edited = after.report["edited_sides"], after.report["edited_patches"]
    for side in range(len(new.side_nodes)):
        if side not in edited[0]:
            assert course(new, side) == course(old, side)
        line = along(new, side)
        assert [line[0], line[-1]] == new.side_nodes[side].tolist()
        assert len(line) == len(course(new, side)) + 1
    for patch in range(len(new.patch_offsets) - 1):
        corners = slice(new.patch_offsets[patch], new.patch_offsets[patch + 1])
        beside = bool(set(new.corner_sides[corners].tolist()) & set(edited[0]))
        assert (patch in edited[1]) == beside
        if not beside:
            assert tiles_of(after, patch) == tiles_of(before, patch)
        # Twelve less the turns at the corners is the defect inside.
        assert 12 - (6 - new.c_indices[corners]).sum() == 0
    np.testing.assert_array_equal(old.c_indices, new.c_indices)


def test_zigzags_make_a_sheet_of_squares_more_fractured():
    mesh = sheet()
    result = tiled(mesh, 0.5)
    assert all(len(face) == 4 for face in polygons(result.mesh)[1])
    assert sorted(result.patch_graph.face_patches.tolist()) == [0] * len(result.panels)
    triangles = 0
    for _ in range(2):
        edited = result.zigzag_patch(0)
        check_edit(result, edited)
        check_result(mesh, edited)
        more = sum(len(face) == 3 for face in polygons(edited.mesh)[1])
        assert more > triangles
        result, triangles = edited, more


def test_one_side_makes_its_pair_and_the_old_result_stays():
    mesh = sheet()
    before = tiled(mesh, 0.5)
    corners = before.mesh.corner_verts.copy()
    left, right = before.zigzag(0, 2), before.zigzag(0, -2)
    for edited, letter in ((left, 1), (right, -1)):
        check_edit(before, edited)
        check_result(mesh, edited)
        assert course(edited.patch_graph, 0).count(letter) == 2
        assert len(edited.report["edited_sides"]) >= 2
    np.testing.assert_array_equal(before.mesh.corner_verts, corners)
    again = before.zigzag(0, 2)
    np.testing.assert_array_equal(again.mesh.positions, left.mesh.positions)
    np.testing.assert_array_equal(again.mesh.corner_verts, left.mesh.corner_verts)


def test_a_pair_of_its_own_lies_where_it_is_wished():
    before = tiled(sheet(), 0.5)
    edited = before.zigzag(0, 2, pair=True, position=0.5)
    check_edit(before, edited)
    edges = course(edited.patch_graph, 0)
    assert (edges.count(1), edges.count(-1)) == (2, 2)
    assert edges.index(1) < edges.index(-1)


def test_a_dome_takes_zigzags_and_far_patches_keep_their_panels():
    mesh = grid(14, 14, dome)
    before = tiled(mesh, 0.35)
    for side in range(len(before.patch_graph.side_nodes)):
        edited = before.zigzag(side)
        assert course(edited.patch_graph, side).count(1) > course(before.patch_graph, side).count(1)
        check_edit(before, edited)
        check_result(mesh, edited)


def test_what_cannot_take_a_zigzag_is_named():
    before = tiled(sheet(), 0.5)
    for call in (
        lambda: before.zigzag(4),
        lambda: before.zigzag(-1),
        lambda: before.zigzag(0, 0),
        lambda: before.zigzag(0, 1000),
        lambda: before.zigzag(0, position=2.0),
        lambda: before.zigzag_patch(1),
    ):
        with pytest.raises(quadloom.QuadloomError) as caught:
            call()
        assert caught.value.code == "option"
    even = quadloom.tile_surface(sheet(), 0.5)
    with pytest.raises(quadloom.InfeasibleError) as caught:
        even.zigzag(0)
    assert caught.value.code == "no_patches"


def test_an_edit_is_cancelled():
    with pytest.raises(quadloom.Cancelled):
        tiled(sheet(), 0.5).zigzag(0, progress=lambda stage, fraction: False)


def test_shaping_options():
    mesh = grid(14, 14, dome)
    plain = quadloom.tile_surface(mesh, 0.35, planarity=0.0)
    flat = quadloom.tile_surface(mesh, 0.35, planarity=20.0, flattening_rounds=40)
    quads = [len(face) == 4 for face in polygons(plain.mesh)[1]]
    assert flat.panels.planarity[quads].mean() < plain.panels.planarity[quads].mean()
    even = quadloom.tile_surface(mesh, 0.35, uniformity=4.0)
    spread = [r.panels.edge_lengths.std() / r.panels.edge_lengths.mean() for r in (plain, even)]
    assert spread[1] < spread[0]
    # Kept borders: the same places whatever the rounds, at equal steps between corners.
    rim = []
    for rounds in (0, 30):
        kept = quadloom.tile_surface(mesh, 0.35, borders="keep", shaping_rounds=rounds)
        _, faces = polygons(kept.mesh)
        pairs = {(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))}
        rim.append({v: kept.mesh.positions[v] for a, b in pairs if (b, a) not in pairs for v in (a, b)})
    assert rim[0].keys() == rim[1].keys()
    for v, place in rim[0].items():
        np.testing.assert_allclose(rim[1][v], place, atol=1e-9)
    for name in ("planarity", "fairness", "uniformity"):
        with pytest.raises(quadloom.QuadloomError):
            quadloom.tile_surface(mesh, 0.35, **{name: -1.0})
    with pytest.raises(quadloom.QuadloomError):
        quadloom.tile_surface(mesh, 0.35, borders="glide")
