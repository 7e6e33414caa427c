"""Triangle-quad tilings: counts, the sequence of tilings, the best and the symmetric ones, and what is said of bad codes."""

from __future__ import annotations

import itertools
import math
import threading
import time

import numpy as np
import pytest
import quadloom

DODECAGON = [5] * 12


def dodecagon(a: int, b: int) -> list[int]:
    return ([5] + [6] * (a - 1) + [5] + [6] * (b - 1)) * 6


def area(mesh: quadloom.Mesh) -> float:
    total = 0.0
    for begin, end in itertools.pairwise(mesh.face_offsets):
        x, y, _ = mesh.positions[mesh.corner_verts[begin:end]].T
        total += 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return total


@pytest.mark.parametrize(("a", "b"), [(1, 1), (2, 3), (6, 6), (40, 40)])
def test_dodecagons_have_binomially_many(a, b):
    assert quadloom.count_tilings(dodecagon(a, b)) == math.comb(a + b, a)


def test_codes_may_be_arrays():
    assert quadloom.count_tilings(np.array(DODECAGON, dtype=np.uint8)) == 2


def test_tilings_are_a_sequence():
    tilings = quadloom.tilings(dodecagon(2, 2))
    assert (len(tilings), tilings.count, bool(tilings)) == (6, 6, True)
    meshes = [tiling.mesh for tiling in tilings]
    assert len(meshes) == 6
    assert len({mesh.positions.tobytes() + mesh.corner_verts.tobytes() for mesh in meshes}) == 6
    assert np.array_equal(tilings[-1].mesh.positions, meshes[-1].positions)
    for index in (6, -7, 10**30):
        with pytest.raises(IndexError):
            tilings[index]


def test_each_tiling_is_a_mesh_of_unit_tiles_over_the_outline():
    boundary = quadloom.explain_boundary(dodecagon(2, 1))
    x, y = boundary.points.T
    outline_area = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    for tiling in quadloom.tilings(dodecagon(2, 1)):
        mesh = tiling.mesh
        sizes = np.diff(mesh.face_offsets)
        assert (np.count_nonzero(sizes == 3), np.count_nonzero(sizes == 4)) == (sum(boundary.triangles), sum(boundary.squares))
        for begin, end in itertools.pairwise(mesh.face_offsets):
            face = mesh.positions[mesh.corner_verts[begin:end]]
            assert np.allclose(np.linalg.norm(face - np.roll(face, -1, axis=0), axis=1), 1)
        assert area(mesh) == pytest.approx(outline_area)
        assert quadloom.check(mesh).is_valid
        assert tiling.svg().count("<polygon") == len(sizes) == len(tiling.orientations)


def test_samples_repeat_and_vary():
    tilings = quadloom.tilings(dodecagon(4, 4))
    keys = [[t.mesh.positions.tobytes() for t in tilings.sample(30, seed)] for seed in (1, 1, 2)]
    assert keys[0] == keys[1] != keys[2]
    assert len(set(keys[0])) > 10


def test_best_is_the_best_of_all():
    tilings = quadloom.tilings([5, 6, 5] * 6)
    butterflies = [tiling.configurations["butterfly"] for tiling in tilings]
    regular, least = tilings.best("regular")
    fractured, most = tilings.best("fractured")
    assert regular.configurations["butterfly"] == least == min(butterflies)
    assert fractured.configurations["butterfly"] == -most == max(butterflies)
    weighted = [3 * t.configurations["squares"] - 2 * t.configurations["rows"] for t in tilings]
    assert tilings.best({"squares": 3, "rows": -2})[1] == min(weighted)


def test_symmetric_tilings():
    tilings = quadloom.tilings(DODECAGON)
    assert (tilings.symmetric(6).count, tilings.symmetric(12).count, tilings.symmetric("reflection").count) == (2, 0, 2)
    mirrors = [symmetry for symmetry in tilings.symmetries if symmetry.reflection]
    assert len(mirrors) == 12
    assert sum(tilings.symmetric([mirror]).count for mirror in mirrors) == 12
    x, y = quadloom.explain_boundary(DODECAGON).points.mean(axis=0)
    for symmetry in tilings.symmetries[1:]:
        # Every axis and every centre runs through the middle.
        along = np.radians(symmetry.angle)
        dx, dy = x - symmetry.centre[0], y - symmetry.centre[1]
        off = dx * np.sin(along) - dy * np.cos(along) if symmetry.reflection else math.hypot(dx, dy)
        assert off == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("code", "verdict", "corners"),
    [
        ([3, 3, 12, 3], "angle", [2]),
        ([3, 3, 3], "turning", []),
        ([3, 3, 3, 4, 5], "open", []),
        ([3, 3, 3, 9, 3, 3, 3, 9], "not_simple", [2, 6, 2, 7, 3, 6, 3, 7]),
    ],
)
def test_a_bad_code_is_explained_and_refused(code, verdict, corners):
    boundary = quadloom.explain_boundary(code)
    assert (boundary.verdict, boundary.corners.tolist(), boundary.simple) == (verdict, corners, False)
    assert not boundary
    with pytest.raises(quadloom.QuadloomError) as caught:
        quadloom.count_tilings(code)
    assert (caught.value.code, caught.value.elements["corners"].tolist()) == (verdict, corners)
    assert str(caught.value) == boundary.sentence


def test_an_outline_without_tilings_says_why():
    code = [5, 6, 5, 5, 3, 5, 6, 5, 5, 3]
    boundary = quadloom.explain_boundary(code)
    assert (boundary.verdict, boundary.simple, boundary.tileable) == ("refuted", True, False)
    assert boundary.defect != 0 or min(boundary.squares + boundary.triangles) < 0
    tilings = quadloom.tilings(code)
    assert (len(tilings), list(tilings), tilings.sample(5), tilings.best("regular")) == (0, [], [], None)


@pytest.mark.parametrize("bad", [{"stars": 1}, "pretty", 3.5])
def test_a_bad_objective_is_refused(bad):
    with pytest.raises(quadloom.QuadloomError, match="objective"):
        quadloom.tilings(DODECAGON).best(bad)


@pytest.mark.parametrize("bad", [5, 0, "spiral", 2.5])
def test_a_bad_group_is_refused(bad):
    with pytest.raises(quadloom.QuadloomError, match=r"rotation|group"):
        quadloom.tilings(DODECAGON).symmetric(bad)


def wide() -> list[int]:
    """An outline that takes long to count."""
    return dodecagon(60, 60)


def test_the_memory_limit_counts_the_states():
    with pytest.raises(quadloom.QuadloomError, match=r"^\d+ states") as caught:
        quadloom.count_tilings(wide(), memory=100_000)
    assert caught.value.code == "memory"


def test_counting_is_cancelled_and_leaves_the_interpreter_free():
    asked = None
    ticks = 0
    stop = threading.Event()

    def count():
        nonlocal ticks
        while not stop.wait(0.01):
            ticks += 1

    def progress(stage, fraction):
        nonlocal asked
        assert 0 <= fraction <= 1
        if time.monotonic() - start < 0.4:
            return True
        asked = asked or time.monotonic()
        return False

    other = threading.Thread(target=count)
    other.start()
    start = time.monotonic()
    try:
        with pytest.raises(quadloom.Cancelled):
            quadloom.count_tilings(dodecagon(200, 200), progress=progress)
        assert time.monotonic() - asked < 0.5
    finally:
        stop.set()
        other.join()
    assert ticks > 5


def test_a_curve_gets_an_outline_that_can_be_tiled():
    angle = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    curve = np.column_stack((100 + 20 * np.cos(angle), 12 * np.sin(angle)))
    fit = quadloom.fit_boundary(curve, 2.5, tries=24)
    # Corners of the ellipse's outline, measured by its implicit equation, which is 1 on the curve.
    implicit = np.hypot((fit.points[:, 0] - 100) / 20, fit.points[:, 1] / 12)
    assert np.abs(implicit - 1).max() * 12 < 2.5
    assert 0 < fit.mean_distance < fit.greatest_distance < 1
    sin, cos = np.sin(fit.rotation), np.cos(fit.rotation)
    for tiling in (quadloom.tilings(fit.code)[0], fit.tiling):
        x, y = tiling.mesh.positions[:, :2].T
        placed = np.array(fit.origin) + fit.edge_length * np.column_stack((cos * x - sin * y, sin * x + cos * y))
        for corner in fit.points:
            assert np.linalg.norm(placed - corner, axis=1).min() < 1e-6
        assert area(tiling.mesh) * 2.5**2 == pytest.approx(np.pi * 20 * 12, rel=0.05)


@pytest.mark.parametrize("points", [[[0, 0], [1, 1]], [[0, 0, 0]] * 4, [[0, 0], [1, 0], [0, np.nan]]])
def test_a_bad_curve_is_refused(points):
    with pytest.raises(quadloom.QuadloomError) as caught:
        quadloom.fit_boundary(points, 1.0)
    assert caught.value.code == "option"


def test_an_outline_without_tilings_is_repaired():
    spoilt = [5, 5, 4, 7, 4, 5, 5, 5, 5, 5, 5, 5]
    assert quadloom.count_tilings(spoilt) == 0
    repaired = quadloom.repair_boundary(spoilt)
    assert quadloom.count_tilings(repaired) > 0
    # One exchange of edges changes three angles.
    assert np.count_nonzero(repaired != np.array(spoilt)) == 3
    assert quadloom.repair_boundary(DODECAGON).tolist() == DODECAGON


def test_a_tiling_is_found_where_there_are_too_many_to_count():
    code = dodecagon(14, 14)
    found = [quadloom.find_tiling(code, seed).mesh for seed in (1, 1, 2)]
    assert np.array_equal(found[0].positions, found[1].positions)
    assert not np.array_equal(found[0].positions, found[2].positions)
    boundary = quadloom.explain_boundary(code)
    assert np.count_nonzero(np.diff(found[0].face_offsets) == 4) == sum(boundary.squares)
    assert quadloom.find_tiling([5, 5, 4, 7, 4, 5, 5, 5, 5, 5, 5, 5]) is None


SPOILT = [5, 5, 4, 7, 4, 5, 5, 5, 5, 5, 5, 5]


def test_an_outline_without_tilings_is_tiled_with_the_fewest_rhombi():
    assert quadloom.find_tiling(SPOILT) is None
    defect = quadloom.explain_boundary(SPOILT).defect
    found = quadloom.find_tiling(SPOILT, rhombi=True)
    rhombi = np.flatnonzero(found.kinds == 2)
    assert len(rhombi) == found.rhombi_at_least == abs(defect) == 1
    mesh = found.mesh
    assert quadloom.check(mesh).is_valid
    for face, kind in enumerate(found.kinds):
        corners = mesh.positions[mesh.corner_verts[mesh.face_offsets[face] : mesh.face_offsets[face + 1]]]
        sides = np.roll(corners, -1, axis=0) - corners
        assert np.allclose(np.linalg.norm(sides, axis=1), 1)
        # Areas of a triangle, a square and a rhombus with unit edges.
        x, y, _ = corners.T
        expected = (math.sqrt(3) / 4, 1.0, 0.5)[kind]
        assert 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == pytest.approx(expected)
        if kind == 2:
            along = math.degrees(math.atan2(sides[0][1], sides[0][0]))
            assert (along - 30 * found.orientations[face]) % 180 == pytest.approx(0, abs=1e-6)
    assert found.svg().count("#c2347e") == 1
    assert "1 rhombi" in repr(found)


def test_tilings_with_rhombi_are_counted():
    assert [quadloom.count_tilings(SPOILT, rhombi=k) for k in range(3)][::2] == [0, 0]
    assert quadloom.count_tilings(SPOILT, rhombi=1) > 0
    assert quadloom.count_tilings(DODECAGON, rhombi=0) == 2


def test_where_no_number_of_rhombi_helps_there_is_none():
    # The corner of a triangle, with a side too short for one.
    code = [5, 6, 5, 5, 3, 5, 6, 5, 5, 3]
    found = quadloom.find_tiling(code, rhombi=True)
    assert (found is None) == all(quadloom.count_tilings(code, rhombi=k) == 0 for k in range(8))
    without = quadloom.find_tiling(DODECAGON, rhombi=True)
    assert (without.rhombi_at_least, set(without.kinds)) == (0, {0, 1})
