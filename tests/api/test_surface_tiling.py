"""Surface tiling and panel schedules: what comes out is measured anew, in numpy; bad inputs are named."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import os
import re
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest
import quadloom
from meshes import ROOT, polygons

# A border is as near to the surface's as this part of an edge.
BORDER = 0.05


def grid(n: int, m: int, place, *, around: bool = False) -> quadloom.Mesh:
    """n by m quads at place(u, v), u and v from 0 to 1; `around` joins the end of u to its beginning."""
    columns = n if around else n + 1
    points = [place(i / n, j / m) for i in range(columns) for j in range(m + 1)]
    at = lambda i, j: (i % columns) * (m + 1) + j  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(m)]
    return quadloom.Mesh.from_polygons(points, faces)


def dome(u: float, v: float) -> tuple[float, float, float]:
    x, y = 2 * u - 1, 2 * v - 1
    return (3 * x, 3 * y, 2 - x * x - y * y)


def saddle(u: float, v: float) -> tuple[float, float, float]:
    x, y = 2 * u - 1, 2 * v - 1
    return (3 * x, 3 * y, x * x - y * y)


def tower(u: float, v: float) -> tuple[float, float, float]:
    angle = math.tau * u + 1.2 * v
    radius = 1 + 0.25 * math.cos(2 * math.tau * u)
    return (radius * math.cos(angle), radius * math.sin(angle), 4 * v)


def sphere() -> quadloom.Mesh:
    """A cube's grid, blown up: closed."""
    points, index, faces = [], {}, []
    n = 12
    for axis in range(3):
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        at = [0, 0, 0]
                        at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3] = side, i + di, j + dj
                        if tuple(at) not in index:
                            index[tuple(at)] = len(points)
                            p = np.tan((2 * np.array(at) / n - 1) * math.pi / 4)
                            points.append(p / np.linalg.norm(p))
                        corners.append(index[tuple(at)])
                    faces.append(corners if side else corners[::-1])
    return quadloom.Mesh.from_polygons(points, faces)


def torus() -> quadloom.Mesh:
    """Closed, of genus one."""
    n, m = 40, 16
    angle, around = math.tau * np.arange(n) / n, math.tau * np.arange(m) / m
    radius = 2 + 0.7 * np.cos(around)
    points = [(r * math.cos(a), r * math.sin(a), 0.7 * math.sin(b)) for a in angle for r, b in zip(radius, around, strict=True)]
    at = lambda i, j: (i % n) * m + j % m  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(m)]
    return quadloom.Mesh.from_polygons(points, faces)


SURFACES = {
    "dome": (lambda: grid(14, 14, dome), 400),
    "saddle": (lambda: grid(14, 14, saddle), 400),
    "tower": (lambda: grid(40, 30, tower, around=True), 600),
    "sphere": (sphere, 1000),
    "torus": (torus, 500),
}


def edge_uses(faces) -> Counter:
    return Counter((f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f)))


def euler(positions: np.ndarray, faces) -> int:
    used = {v for f in faces for v in f}
    edges = {frozenset(edge) for edge in edge_uses(faces)}
    return len(used) - len(edges) + len(faces)


def border_segments(positions: np.ndarray, faces) -> np.ndarray:
    uses = edge_uses(faces)
    return np.array([[positions[a], positions[b]] for a, b in uses if (b, a) not in uses]).reshape(-1, 2, 3)


def distance_to_segments(point: np.ndarray, segments: np.ndarray) -> float:
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    t = np.clip(((point - start) * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    return float(np.linalg.norm(start + t[:, None] * along - point, axis=1).min())


def check_result(mesh: quadloom.Mesh, result: quadloom.SurfaceResult) -> None:
    source_points, source_faces = polygons(mesh)
    points, faces = polygons(result.mesh)
    assert {len(face) for face in faces} <= {3, 4}
    uses = edge_uses(faces)
    assert max(uses.values()) == 1, "no edge runs twice in one direction"
    assert euler(points, faces) == euler(source_points, source_faces)
    edge = result.report["edge_length_mean"]
    rim, own_rim = border_segments(source_points, source_faces), border_segments(points, faces)
    assert (len(rim) == 0) == (len(own_rim) == 0)
    if len(rim):
        assert max(distance_to_segments(p, rim) for p in own_rim[:, 0]) < BORDER * edge
        lengths = [np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() for segments in (rim, own_rim)]
        assert lengths[1] == pytest.approx(lengths[0], rel=0.05)
    # Corners of triangles count 60 degrees, of squares 90.
    on_rim = {v for pair in uses if pair[::-1] not in uses for v in pair}
    defect = np.full(len(points), 12)
    defect[list(on_rim)] = 6
    for face in faces:
        defect[face] -= 2 if len(face) == 3 else 3
    assert result.irregular_verts.tolist() == np.flatnonzero(defect).tolist()
    assert result.defects.tolist() == defect[defect != 0].tolist()
    assert result.defects.sum() == 12 * euler(points, faces)
    assert result.report["irregular_vertices"] == len(set(result.irregular_verts.tolist()) - on_rim)
    assert len(result.turned_faces) == 0


@pytest.mark.parametrize("pattern", ["regular", "random"])
@pytest.mark.parametrize("name", SURFACES)
def test_a_surface_becomes_panels_with_its_topology_and_border(name, pattern):
    make, count = SURFACES[name]
    mesh = make()
    result = quadloom.tile_surface(mesh, target_panels=count, pattern=pattern)
    check_result(mesh, result)
    assert len(result.panels) == pytest.approx(count, rel=0.1)
    assert result.report["edge_length_spread"] < 0.2
    assert result.report["planarity_mean"] < 0.02


@pytest.mark.parametrize("name", SURFACES)
def test_patches_are_flat_disks_and_the_curvature_is_at_their_corners(name):
    make, count = SURFACES[name]
    mesh = make()
    result = quadloom.tile_surface(mesh, target_panels=count, partition="patches")
    check_result(mesh, result)
    graph = result.patch_graph
    assert graph is not None, result.report["warnings"]
    assert len(result.panels) == pytest.approx(count, rel=0.3)
    assert result.report["patches"] == len(graph.patch_offsets) - 1
    for begin, end in itertools.pairwise(graph.patch_offsets):
        # The turns at the corners add up to a full one.
        assert (6 - graph.c_indices[begin:end]).sum() == 12
        nodes, sides = graph.corner_nodes[begin:end], graph.corner_sides[begin:end]
        for node, after, side in zip(nodes, np.roll(nodes, -1), sides, strict=True):
            assert sorted(graph.side_nodes[side]) == sorted([node, after])
    assert graph.defects.sum() == 12 * euler(*polygons(mesh))
    assert set(Counter(graph.corner_sides.tolist()).values()) <= {1, 2}
    for (begin, end), ends in zip(itertools.pairwise(graph.side_offsets), graph.side_nodes, strict=True):
        # Where charts meet, a side ends on a chord of the surface.
        assert np.allclose(graph.side_points[[begin, end - 1]], graph.nodes[ends], atol=0.25 * result.edge_length)


@pytest.mark.parametrize("pattern", ["fractured", "symmetric"])
def test_patterns_mix_both_panels_within_patches(pattern):
    mesh = grid(16, 16, dome)
    made = {
        name: quadloom.tile_surface(mesh, target_panels=300, partition="patches", pattern=name, seed=3)
        for name in ("regular", pattern)
    }

    def mixed(result: quadloom.SurfaceResult) -> int:
        kinds = np.diff(result.mesh.face_offsets)
        of_patch = result.patch_graph.face_patches
        return sum(len(np.unique(kinds[of_patch == patch])) == 2 for patch in np.unique(of_patch))

    for result in made.values():
        check_result(mesh, result)
        tilings = result.report["patch_tilings"]
        assert len(tilings) == result.report["patches"]
        assert all(count is None or count >= 1 for count in tilings)
    assert mixed(made[pattern]) > mixed(made["regular"])


def test_given_corners_are_corners_of_patches():
    mesh = grid(12, 12, dome)
    # A corner, which gets 90 degrees by itself; and the middle of a side, which is none by itself.
    for vertex, corners, wanted in (0, None, 3), (0, [[0, 2]], 2), (0, [[0, 4]], 4), (6, [[6, 5]], 5), (6, [[6, 7]], 7):
        result = quadloom.tile_surface(mesh, 0.55, partition="patches", corners=corners)
        check_result(mesh, result)
        graph = result.patch_graph
        at = np.linalg.norm(graph.nodes - mesh.positions[vertex], axis=1).argmin()
        assert np.allclose(graph.nodes[at], mesh.positions[vertex], atol=1e-6)
        assert graph.defects[at] == 6 - wanted


def measured(points: np.ndarray, faces) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deviation, planarity and area by ways of their own: for quads the distance of the diagonals as lines."""
    deviation, planarity, area = [], [], []
    for face in faces:
        p = points[face]
        if len(face) == 3:
            deviation.append(0.0)
            planarity.append(0.0)
            area.append(np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / 2)
            continue
        first, second = p[2] - p[0], p[3] - p[1]
        normal = np.cross(first, second)
        off = abs(np.linalg.det([first, second, p[1] - p[0]])) / np.linalg.norm(normal) / 2
        deviation.append(off)
        planarity.append(4 * off / (np.linalg.norm(first) + np.linalg.norm(second)))
        area.append(np.linalg.norm(normal) / 2)
    return np.array(deviation), np.array(planarity), np.array(area)


def test_panels_are_measured_right():
    result = quadloom.tile_surface(grid(12, 12, saddle), 0.3, flattening_rounds=0)
    points, faces = polygons(result.mesh)
    deviation, planarity, area = measured(points, faces)
    panels = result.panels
    assert panels.deviation == pytest.approx(deviation, abs=1e-12)
    assert panels.planarity == pytest.approx(planarity, abs=1e-12)
    assert panels.area == pytest.approx(area, rel=1e-9)
    assert deviation.max() > 1e-3
    # No plane is nearer: neither the one of least squares nor any of many near to it.
    random = np.random.default_rng(3)
    for face in [face for face in faces if len(face) == 4][:20]:
        p = points[face] - points[face].mean(axis=0)
        normal = np.linalg.svd(p)[2][2]
        best = panels.deviation[faces.index(face)]
        for tilt in [np.zeros(3), *random.normal(0, 0.02, (50, 3))]:
            heights = p @ ((normal + tilt) / np.linalg.norm(normal + tilt))
            assert np.ptp(heights) / 2 > best - 1e-9
    lengths = np.linalg.norm(points[panels.edges[:, 0]] - points[panels.edges[:, 1]], axis=1)
    assert panels.edge_lengths == pytest.approx(lengths, rel=1e-12)
    report = result.report
    quads = np.array([len(face) == 4 for face in faces])
    assert report["planarity_mean"] == pytest.approx(planarity[quads].mean())
    assert report["edge_length_spread"] == pytest.approx(lengths.std() / lengths.mean())
    assert (report["triangles"], report["quads"]) == ((~quads).sum(), quads.sum())


def test_the_edge_length_is_that_of_the_edges():
    for length in (0.2, 0.4):
        result = quadloom.tile_surface(grid(12, 12, dome), length)
        assert result.edge_length == pytest.approx(length)
        assert result.report["edge_length_mean"] == pytest.approx(length, rel=0.1)


def test_a_count_that_cannot_be_met_is_said():
    fine = quadloom.tile_surface(grid(10, 10, dome), target_panels=300)
    assert fine.report["warnings"] == []
    # Every face of the surface has lines all round that panels have to end at.
    mesh = grid(10, 10, dome)
    every = np.unique(np.sort([(f[k], f[(k + 1) % 4]) for f in polygons(mesh)[1] for k in range(4)], axis=1), axis=0)
    result = quadloom.tile_surface(mesh, None, every, target_panels=20)
    assert len(result.panels) > 60
    assert any("20 panels" in warning for warning in result.report["warnings"])


def slice_of_a_sphere() -> quadloom.Mesh:
    """60 degrees of the unit sphere between two meridians, from pole to pole."""
    rows, columns = 24, 8
    points = [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    for row in range(1, rows):
        polar = math.pi * row / rows
        for column in range(columns + 1):
            azimuth = math.pi / 3 * column / columns
            points.append((math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)))
    at = lambda row, column: 0 if row == 0 else 1 if row == rows else 2 + (row - 1) * (columns + 1) + column  # noqa: E731
    corners = [
        [at(row, column), at(row + 1, column), at(row + 1, column + 1), at(row, column + 1)]
        for row in range(rows)
        for column in range(columns)
    ]
    return quadloom.Mesh.from_polygons(points, [list(dict.fromkeys(face)) for face in corners])


def test_sides_of_half_edges_end_in_regular_nodes():
    mesh = slice_of_a_sphere()
    result = quadloom.tile_surface(mesh, 0.109, partition="patches")
    check_result(mesh, result)
    halfway = result.report["halfway_nodes"]
    assert halfway, "no sides of half edges"
    assert not set(halfway) & set(result.irregular_verts.tolist())
    graph = result.patch_graph
    assert set(graph.defects[halfway].tolist()) == {0}
    assert result.report["edge_length_spread"] < 0.1
    assert result.report["missed_bars"] == []


def test_slivers_of_a_noisy_mesh_are_no_creases():
    # A dome with a few vertices pulled up: sharp spikes, far smaller than panels.
    mesh = grid(40, 40, dome)
    points, faces = mesh.positions.copy(), polygons(mesh)[1]
    spikes = [41 * 10 + 12, 41 * 20 + 25, 41 * 31 + 8]
    points[spikes, 2] += 0.3
    result = quadloom.tile_surface(quadloom.Mesh.from_polygons(points, faces), target_panels=150)
    assert len(result.panels) == pytest.approx(150, rel=0.1)
    assert result.report["edge_length_spread"] < 0.2
    assert len(result.turned_faces) == 0


def test_flattening_flattens_and_closeness_holds():
    def made(**options) -> tuple[float, float]:
        result = quadloom.tile_surface(grid(24, 24, saddle), 0.35, **options)
        x, y, z = result.mesh.positions.T
        return result.report["planarity_mean"], float(np.abs(z - (x * x - y * y) / 9).max())

    shaped, flat, loose = made(flattening_rounds=0), made(), made(closeness=0.02)
    assert flat[0] < 0.7 * shaped[0]
    assert shaped[1] < flat[1] < loose[1]


def test_sharp_edges_of_a_box_are_followed():
    mesh = quadloom.Mesh.from_polygons(
        CUBE, [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    for angle, expected in ((None, 12), (math.pi, 0)):
        options = {} if angle is None else {"feature_angle": angle}
        result = quadloom.tile_surface(mesh, target_panels=400, **options)
        check_result(mesh, result)
        p = result.mesh.positions
        at_side = ((p < 1e-6) | (p > 1 - 1e-6)).sum(axis=1) >= 2
        edges = result.panels.edges[at_side[result.panels.edges].all(axis=1)]
        # Along one edge of the cube, not across a corner of it.
        along = (np.abs(np.diff(p[edges], axis=1)[:, 0]) > 1e-6).sum(axis=1) == 1
        total = np.linalg.norm(np.diff(p[edges], axis=1), axis=2)[along].sum()
        assert total == pytest.approx(expected, abs=1e-6)


def test_marked_edges_become_lines_of_edges():
    mesh = grid(16, 16, dome)
    # The line x = 0: the ninth row of vertices.
    row = [8 * 17 + j for j in range(17)]
    marked = list(itertools.pairwise(row))
    for features, expected in ((marked, True), (None, False)):
        result = quadloom.tile_surface(mesh, 0.4, features)
        on_line = np.abs(result.mesh.positions[:, 0]) < 1e-6
        edges = result.panels.edges[on_line[result.panels.edges].all(axis=1)]
        covered = np.linalg.norm(np.diff(result.mesh.positions[edges], axis=1), axis=2).sum()
        length = sum(np.linalg.norm(mesh.positions[a] - mesh.positions[b]) for a, b in marked)
        assert (covered > 0.98 * length) == expected


def test_seeds_give_other_patterns_and_the_same_ones_again():
    mesh = grid(10, 10, dome)
    made = [quadloom.tile_surface(mesh, 0.4, pattern="random", seed=seed).mesh for seed in (1, 1, 2)]
    faces = [m.corner_verts.tobytes() + m.face_offsets.tobytes() for m in made]
    assert faces[0] == faces[1] != faces[2]
    assert made[0].positions.tobytes() == made[1].positions.tobytes()


def test_the_number_of_threads_changes_nothing():
    script = """
import hashlib, sys
sys.path.insert(0, "tests/api")
import quadloom
from test_surface_tiling import dome, grid
r = quadloom.tile_surface(grid(12, 12, dome), 0.3, pattern="random", seed=4)
print(hashlib.sha256(r.mesh.positions.tobytes() + r.mesh.corner_verts.tobytes() + r.panels.to_json().encode()).hexdigest())
"""
    hashes = set()
    for threads in ("1", "2", "5"):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", script], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
        )
        hashes.add(done.stdout)
    assert len(hashes) == 1


@pytest.mark.parametrize(("scale", "shift"), [(1e-9, 0), (1e9, 0), (1e-120, 0), (1e120, 0), (1, 1e6), (1e-3, 1e3)])
def test_tiny_huge_and_far_surfaces_are_tiled_like_others(scale, shift):
    plain = grid(10, 10, dome)
    expected = quadloom.tile_surface(plain, target_panels=300)
    moved = quadloom.Mesh(plain.positions * scale + shift, plain.face_offsets, plain.corner_verts)
    result = quadloom.tile_surface(moved, target_panels=300)
    assert len(result.panels) == pytest.approx(len(expected.panels), rel=0.05)
    assert result.report["edge_length_mean"] == pytest.approx(scale * expected.report["edge_length_mean"], rel=0.05)
    assert np.isfinite(result.mesh.positions).all()
    assert len(result.turned_faces) == 0
    lengths = np.linalg.norm((result.mesh.positions - shift) / scale, axis=1)
    assert lengths.max() < 6


def test_polygons_of_any_kind_are_taken():
    # An L of one face with six corners, and a square beside it.
    points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0), (2, 2, 0)]
    mesh = quadloom.Mesh.from_polygons(points, [[0, 1, 2, 3, 4, 5], [3, 2, 6, 4]])
    result = quadloom.tile_surface(mesh, 0.2)
    check_result(mesh, result)
    assert result.panels.area.sum() == pytest.approx(4, rel=1e-6)


CUBE = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
BAD = {
    "empty": ([[0, 0, 0]] * 3, [], "empty", "faces", []),
    "not a number": ([[0, 0, 0], [1, 0, 0], [0, math.nan, 0]], [[0, 1, 2]], "not_finite", "verts", [2]),
    "infinite": ([[0, 0, 0], [1, 0, 0], [0, math.inf, 0]], [[0, 1, 2]], "not_finite", "verts", [2]),
    "three faces at an edge": (CUBE, [[0, 1, 3], [1, 0, 5], [0, 1, 7]], "non_manifold", "edges", [[0, 1]]),
    "opposite faces": (CUBE, [[0, 1, 3], [0, 1, 5]], "misoriented", "edges", [[0, 1]]),
    "no area": ([[0, 0, 0], [1, 1, 1], [2, 2, 2]], [[0, 1, 2]], "zero_area", "faces", [0]),
    "one point": ([[1, 1, 1]] * 3, [[0, 1, 2]], "too_small", "verts", [0, 1, 2]),
    "a corner twice": (CUBE, [[0, 1, 3], [4, 5, 4, 7]], "degenerate", "faces", [1]),
    "doubled": (CUBE, [[0, 1, 3], [1, 3, 0]], "duplicate", "faces", [1]),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_mesh_is_refused_with_its_code_and_elements(case):
    points, faces, code, kind, elements = BAD[case]
    mesh = quadloom.Mesh.from_polygons(points, faces)
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.tile_surface(mesh, 0.1)
    assert caught.value.code == code
    assert caught.value.elements[kind].tolist() == elements
    assert str(caught.value).startswith("the mesh ")


def test_sheets_that_touch_in_a_vertex_are_taken_apart():
    mesh = quadloom.Mesh.from_polygons([[0, 0, 0], [2, 0, 0], [0, 2, 0], [-2, 0, 0], [0, -2, 0]], [[0, 1, 2], [0, 3, 4]])
    result = quadloom.tile_surface(mesh, 0.3)
    points, faces = polygons(result.mesh)
    assert max(edge_uses(faces).values()) == 1
    assert result.panels.area.sum() == pytest.approx(4, rel=1e-6)
    assert euler(points, faces) == 2, "two disks"
    assert result.report["warnings"][0] == "the surface touches itself at 1 vertex (0); the panels are apart there"
    assert result.report["taken_apart"] == [0]


@pytest.mark.parametrize(
    "options",
    [
        {"edge_length": 0.0}, {"edge_length": -1.0}, {"edge_length": math.nan}, {"edge_length": 1e-7}, {"target_panels": 0},
        {"target_panels": 10**9}, {"pattern": "pretty"}, {"pattern": "random", "patch_panels": 3}, {"closeness": 0.0},
        {"partition": "none"}, {"corners": [[0, 12]]}, {"corners": [[999, 3]]},
        {"feature_angle": -0.1}, {"corner_angle": 4.0}, {"shaping_rounds": -1}, {"flattening_rounds": 5000},
        {"type_tolerance": 0.0}, {"type_tolerance": math.nan}, {"feature_edges": [[0, 1, 2]]}, {"feature_edges": "x"},
    ],
)  # fmt: skip
def test_options_out_of_range_are_refused(options):
    mesh = grid(4, 4, dome)
    with pytest.raises(quadloom.QuadloomError) as caught:
        quadloom.tile_surface(mesh, **{"target_panels": 50, **options})
    assert caught.value.code == "option"


def test_a_feature_that_is_no_edge_is_named():
    with pytest.raises(quadloom.QuadloomError) as caught:
        quadloom.tile_surface(grid(4, 4, dome), 0.5, [[0, 1], [0, 23]])
    assert caught.value.code == "feature_not_edge"
    assert caught.value.elements["features"].tolist() == [1]


def test_it_is_cancelled_in_time():
    asked = None

    def progress(stage, fraction):
        nonlocal asked
        assert 0 <= fraction <= 1
        if time.monotonic() - start < 0.5:
            return True
        asked = asked or time.monotonic()
        return False

    start = time.monotonic()
    with pytest.raises(quadloom.Cancelled):
        quadloom.tile_surface(grid(40, 40, dome), 0.03, progress=progress)
    assert time.monotonic() - asked < 0.5


# Schedules


def squares_and_triangles() -> quadloom.Mesh:
    """Three unit squares in a row, one of them skewed, and two triangles, mirror images, apart."""
    points = [[x, y, 0] for x in range(4) for y in range(2)]
    points[7] = [3.2, 1, 0]
    points += [[10, 0, 0], [12, 0, 0], [10, 1, 0], [22, 0, 0], [20, 0, 0], [22, 1, 0]]
    faces = [[0, 2, 3, 1], [2, 4, 5, 3], [4, 6, 7, 5], [8, 9, 10], [11, 13, 12]]
    return quadloom.Mesh.from_polygons(points, faces)


def test_types_and_counts_are_those_known():
    schedule = quadloom.panel_schedule(squares_and_triangles(), tolerance=1e-6)
    assert schedule.type_names == ["T1", "T2", "Q1", "Q2"]
    assert schedule.types.tolist() == [2, 2, 3, 0, 1]
    assert schedule.type_counts.tolist() == [1, 1, 2, 1]
    mirrored = quadloom.panel_schedule(squares_and_triangles(), tolerance=1e-6, mirror=True)
    assert mirrored.type_names == ["T1", "Q1", "Q2"]
    assert mirrored.mirrored.tolist() == [False, False, False, False, True]
    assert len(schedule) == 5


def test_a_plane_tiling_has_two_types():
    mesh = quadloom.tilings([5, 6, 5] * 6)[0].mesh
    schedule = quadloom.panel_schedule(mesh)
    sizes = np.diff(mesh.face_offsets)
    assert schedule.type_names == ["T1", "Q1"]
    assert schedule.type_counts.tolist() == [(sizes == 3).sum(), (sizes == 4).sum()]
    assert schedule.edge_classes.max() == 0


def test_json_reads_back_equal_and_tells_what_the_arrays_tell():
    schedule = quadloom.tile_surface(grid(8, 8, saddle), 0.5).panels
    again = quadloom.Schedule.from_json(schedule.to_json())
    assert again == schedule
    assert again != quadloom.panel_schedule(squares_and_triangles())
    data = json.loads(schedule.to_json())
    assert [panel["area"] for panel in data["panels"]] == schedule.area.tolist()
    assert [panel["kind"] for panel in data["panels"]] == schedule.types.tolist()
    assert [edge["length"] for edge in data["edges"]] == schedule.edge_lengths.tolist()
    for text in ("", "{}", schedule.to_json()[:-20], "[1]"):
        with pytest.raises(quadloom.QuadloomError) as caught:
            quadloom.Schedule.from_json(text)
        assert caught.value.code == "text"


def test_csv_tables_have_a_row_a_part():
    schedule = quadloom.panel_schedule(squares_and_triangles(), tolerance=1e-6)
    tables = {name: list(csv.DictReader(io.StringIO(schedule.to_csv(name)))) for name in ("panels", "types", "nodes", "edges")}
    assert {name: len(rows) for name, rows in tables.items()} == {"panels": 5, "types": 4, "nodes": 14, "edges": 16}
    assert [float(row["area"]) for row in tables["panels"]] == schedule.area.tolist()
    assert [row["type"] for row in tables["panels"]] == [schedule.type_names[kind] for kind in schedule.types]
    assert tables["panels"][0]["neighbour_2"] == "1"
    assert tables["panels"][3]["edge_4"] == ""
    assert [int(row["count"]) for row in tables["types"]] == schedule.type_counts.tolist()
    with pytest.raises(quadloom.QuadloomError):
        schedule.to_csv("screws")


def outline_area(points: np.ndarray) -> float:
    x, y = points.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def test_drawings_show_every_panel_at_its_size():
    schedule = quadloom.tile_surface(grid(8, 8, saddle), 0.5).panels
    svg = schedule.unrolled("svg", millimetres=10.0)
    listed = re.findall(r'<polygon id="panel-(\d+)" points="([^"]*)"', svg)
    assert sorted(int(panel) for panel, _ in listed) == list(range(len(schedule)))
    for panel, text in listed:
        points = np.array([[float(x) for x in word.split(",")] for word in text.split()])
        assert outline_area(points) == pytest.approx(100 * schedule.area[int(panel)], rel=1e-3)
    dxf = schedule.unrolled("dxf", millimetres=10.0, labels=False)
    assert dxf == schedule.unrolled("dxf", millimetres=10.0, labels=False)
    lines = dxf.split("\n")
    assert sum(line.strip() == "LWPOLYLINE" for line in lines) == len(schedule) + 1
    assert not any(line.strip() == "TEXT" for line in lines)
    assert svg.count("<text") > len(schedule)


def test_sheets_hold_what_fits_and_name_what_does_not():
    schedule = quadloom.panel_schedule(squares_and_triangles())
    # Two rows of triangles on the first sheet; no room for squares above them.
    assert schedule.unrolled("svg", sheet=(2.5, 2.5), gap=0.1).count("<rect") == 2
    with pytest.raises(quadloom.QuadloomError) as caught:
        schedule.unrolled("svg", sheet=(1.5, 1.5), gap=0.1)
    assert caught.value.code == "sheet"
    assert caught.value.elements["faces"].tolist() == [3, 4]
    for options in ({"sheet": (0, 1)}, {"gap": -1}, {"millimetres": 0}, {"format": "pdf"}):
        with pytest.raises(quadloom.QuadloomError):
            schedule.unrolled(**options)


@pytest.mark.parametrize(
    ("points", "faces", "code", "kind", "elements"),
    [
        ([[0, 0, 0]], [], "empty", "faces", []),
        ([[0, 0, 0], [1, 0, 0], [math.nan, 0, 0]], [[0, 1, 2]], "not_finite", "verts", [2]),
        ([[0, 0, 0], [1, 0, 0], [2, 1, 0], [1, 2, 0], [0, 1, 0]], [[0, 1, 2, 3, 4]], "ngons", "faces", [0]),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], "zero_area", "faces", [0]),
        ([[0, 0, 0], [1, 0, 0], [2, 1, 0]], [[0, 1, 2, 1]], "degenerate", "faces", [0]),
    ],
)
def test_a_bad_mesh_has_no_schedule(points, faces, code, kind, elements):
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.panel_schedule(quadloom.Mesh.from_polygons(points, faces))
    assert caught.value.code == code
    assert caught.value.elements[kind].tolist() == elements


def test_any_tri_quad_mesh_has_a_schedule_manifold_or_not():
    mesh = quadloom.Mesh.from_polygons(CUBE, [[0, 1, 3], [1, 0, 5], [0, 1, 7], [2, 3, 7, 6]])
    schedule = quadloom.panel_schedule(mesh)
    assert len(schedule) == 4
    edge = json.loads(schedule.to_json())["edges"][0]
    assert (edge["nodes"], edge["panels"]) == ([0, 1], [0, 1, 2])
