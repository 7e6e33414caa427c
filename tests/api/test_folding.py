"""Foldings and polyhedra: lengths and angles are measured anew; what cannot be made is named."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, cube_positions, polygons
from test_surface_tiling import edge_uses, euler


def outline(*sides: tuple[int, int]) -> list[int]:
    """The boundary code of sides given by direction (units of 30 degrees) and length."""
    directions = [d for d, n in sides for _ in range(n)]
    return [(18 + directions[k - 1] - directions[k]) % 12 for k in range(len(directions))]


def tiling(*sides: tuple[int, int]) -> quadloom.Mesh:
    return quadloom.find_tiling(outline(*sides)).mesh


def at(mesh: quadloom.Mesh, x: float, y: float) -> int:
    off = np.linalg.norm(mesh.positions[:, :2] - (x, y), axis=1)
    assert off.min() < 1e-9
    return int(off.argmin())


def departure(mesh: quadloom.Mesh) -> float:
    """How far edges are from their mean and diagonals of quads from sqrt 2 of it, in edges."""
    points, faces = polygons(mesh)
    edges = [np.linalg.norm(points[a] - points[b]) for a, b in edge_uses(faces)]
    mean = float(np.mean(edges))
    diagonals = [np.linalg.norm(points[f[i]] - points[f[i + 2]]) for f in faces if len(f) == 4 for i in (0, 1)]
    return max(
        np.abs(np.array(edges) / mean - 1).max(),
        np.abs(np.array([*diagonals, mean * math.sqrt(2)]) / mean - math.sqrt(2)).max(),
    )


def check_mesh(mesh: quadloom.Mesh, chi: int) -> None:
    points, faces = polygons(mesh)
    assert max(edge_uses(faces).values()) == 1
    assert euler(points, faces) == chi


def test_a_hexagon_without_a_sixth_is_a_pyramid_of_one_panel_type():
    mesh = tiling(*((d, 4) for d in (0, 2, 4, 6, 8, 10)))
    centre = at(mesh, 2.0, math.sqrt(12))
    points, faces = polygons(mesh)
    middles = np.array([points[f].mean(axis=0) for f in faces]) - points[centre]
    angles = np.degrees(np.arctan2(middles[:, 1], middles[:, 0]))
    cut = np.flatnonzero((angles > -60) & (angles < 0))
    result = quadloom.fold_tiling(mesh, cut=cut, zips=[(centre, 4)])
    assert result.regular
    assert departure(result.mesh) < 1e-6
    check_mesh(result.mesh, 1)
    assert len(result.panels.type_names) == 1
    assert len(result.face_source) == len(faces) - len(cut)
    tip = result.vert_target[centre]
    assert dict(zip(result.irregular_verts.tolist(), result.defects.tolist(), strict=True))[int(tip)] == 2
    assert np.ptp(result.mesh.positions[:, 2]) > 0.5


@pytest.mark.parametrize("removed", [1, 2])
def test_a_dodecagon_without_some_sixths_is_a_cupola_of_two_panel_types(removed):
    # Six triangles about the centre, six squares, six triangles between these.
    mesh = quadloom.tilings([5] * 12)[0].mesh
    points, faces = polygons(mesh)
    centre = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())
    middles = np.array([points[f].mean(axis=0) for f in faces]) - points[centre]
    angles = np.round(np.degrees(np.arctan2(middles[:, 1], middles[:, 0])), 6) % 360
    result = quadloom.fold_tiling(mesh, cut=np.flatnonzero(angles < 60 * removed), zips=[(centre, 2)])
    assert result.regular
    assert departure(result.mesh) < 1e-6
    check_mesh(result.mesh, 1)
    assert [name[0] for name in result.panels.type_names] == ["T", "Q"]
    assert result.panels.type_counts.tolist() == [2 * (6 - removed), 6 - removed]
    assert result.mesh.positions[:, 2].argmax() == result.vert_target[centre], "the tip is on top"


def test_a_strip_of_triangles_and_squares_becomes_a_tube_of_two_panel_types():
    height = 2 + math.sqrt(3) / 2
    mesh = tiling((0, 12), (3, 1), (2, 1), (3, 1), (6, 12), (9, 1), (8, 1), (9, 1))
    corners = [at(mesh, 12, 0), at(mesh, 12.5, height), at(mesh, 0, 0), at(mesh, 0.5, height)]
    result = quadloom.fold_tiling(mesh, runs=[corners])
    assert result.regular
    assert departure(result.mesh) < 1e-6
    check_mesh(result.mesh, 0)
    assert len(result.panels.type_names) == 2
    # The same by vertices, named one by one.
    side = lambda x: [at(mesh, x, 0), at(mesh, x, 1), at(mesh, x + 0.5, 1 + math.sqrt(3) / 2), at(mesh, x + 0.5, height)]  # noqa: E731
    same = quadloom.fold_tiling(mesh, glue=[(side(12), side(0))])
    np.testing.assert_array_equal(same.mesh.positions, result.mesh.positions)


def test_what_cannot_be_glued_is_named():
    mesh = tiling((0, 3), (3, 2), (6, 3), (9, 2))
    row = lambda y: [at(mesh, x, y) for x in range(4)]  # noqa: E731
    column = lambda x: [at(mesh, x, y) for y in range(3)]  # noqa: E731
    cases = {
        "glue_lengths": [(row(0), column(0))],
        "glue_orientation": [(row(0), row(2)[::-1])],
        "glue_border": [(row(1), row(2))],
        "glue_twice": [(row(0), row(2)), (row(0), row(2))],
        "glue_surface": [(row(0), row(2)), (column(0), column(3))],
    }
    for code, glue in cases.items():
        with pytest.raises(quadloom.InfeasibleError) as caught:
            quadloom.fold_tiling(mesh, glue=glue)
        assert caught.value.code == code
    moved = mesh.positions.copy()
    moved[0] += 0.3
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.fold_tiling(quadloom.Mesh(moved, mesh.face_offsets, mesh.corner_verts))
    assert caught.value.code == "not_tiles"
    with pytest.raises(quadloom.QuadloomError):
        quadloom.fold_tiling(mesh, cut=[100])
    with pytest.raises(quadloom.QuadloomError):
        quadloom.fold_tiling(mesh, glue=[row(0)])


def ambo(positions: np.ndarray, faces: list[list[int]]) -> quadloom.Mesh:
    """Conway's a: a vertex on each edge, a face for each face and each vertex."""
    middle: dict[frozenset[int], int] = {}
    points = []
    for face in faces:
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            if frozenset((a, b)) not in middle:
                middle[frozenset((a, b))] = len(points)
                points.append((positions[a] + positions[b]) / 2)
    made = [[middle[frozenset(pair)] for pair in zip(f, f[1:] + f[:1], strict=True)] for f in faces]
    for v in range(len(positions)):
        # Around a vertex each face leads from one edge to the next.
        steps = {}
        for f in faces:
            if v in f:
                k = f.index(v)
                steps[middle[frozenset((v, f[(k + 1) % len(f)]))]] = middle[frozenset((f[k - 1], v))]
        ring = [next(iter(steps))]
        while steps[ring[-1]] != ring[0]:
            ring.append(steps[ring[-1]])
        made.append(ring)
    return quadloom.Mesh.from_polygons(points, made)


@pytest.mark.parametrize("edge_length", [None, 0.3])
def test_the_cubes_ambo_becomes_regular(edge_length):
    polyhedron = ambo(cube_positions(), CUBE_FACES)
    assert len(polyhedron.face_offsets) - 1 == 14
    result = quadloom.tile_polyhedron(polyhedron, edge_length)
    check_mesh(result.mesh, 2)
    assert result.regular
    assert departure(result.mesh) < 1e-6
    assert len(result.panels.type_names) == 2
    assert result.defects.sum() == 24
    assert len(result.patch_graph.patch_offsets) - 1 == 14
    if edge_length is None:
        assert len(result.panels) == 14


def test_a_polyhedron_takes_zigzags():
    result = quadloom.tile_polyhedron(quadloom.Mesh.from_polygons(cube_positions(), CUBE_FACES), 1 / 6)
    edited = result.zigzag_patch(0)
    check_mesh(edited.mesh, 2)
    assert edited.irregular_verts.tolist() == result.irregular_verts.tolist() == list(range(8))
    assert edited.defects.tolist() == [3] * 8
    assert edited.report["triangles"] > 0
    with pytest.raises(quadloom.QuadloomError):
        result.zigzag(12)


def test_unusable_polyhedra_are_named():
    positions = cube_positions()
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.tile_polyhedron(quadloom.Mesh.from_polygons(positions, [*CUBE_FACES, CUBE_FACES[0]]))
    assert caught.value.code == "duplicate"
    for length, rounds in itertools.product((0.0, math.nan), (400,)):
        with pytest.raises(quadloom.QuadloomError):
            quadloom.tile_polyhedron(quadloom.Mesh.from_polygons(positions, CUBE_FACES), length, rounds=rounds)
    with pytest.raises(quadloom.QuadloomError):
        quadloom.tile_polyhedron(quadloom.Mesh.from_polygons(positions, CUBE_FACES), rounds=-1)
