"""Patches chosen by hand and patch graphs that are drawn: what comes out is measured anew; graphs that do not fit are named."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
import quadloom
from meshes import polygons


def sheet(place, n: int = 12) -> quadloom.Mesh:
    """n by n quads at place(u, v), u and v from 0 to 1."""
    points = [place(i / n, j / n) for i in range(n + 1) for j in range(n + 1)]
    at = lambda i, j: i * (n + 1) + j  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(n)]
    return quadloom.Mesh.from_polygons(points, faces)


def cap(u: float, v: float) -> tuple[float, float, float]:
    a, b = u * math.pi / 3, v * math.pi / 3
    return (math.sin(a), math.cos(a) * math.sin(b), math.cos(a) * math.cos(b))


def floor(u: float, v: float) -> tuple[float, float, float]:
    return (2 * u, 2 * v, 0.0)


def euler(mesh: quadloom.Mesh) -> int:
    _, faces = polygons(mesh)
    edges = {frozenset((f[k], f[(k + 1) % len(f)])) for f in faces for k in range(len(f))}
    return len({v for f in faces for v in f}) - len(edges) + len(faces)


def defects_of(graph: quadloom.PatchGraph) -> list[int]:
    """The total interior defect of each patch, from its c-indices."""
    bounds = zip(graph.patch_offsets[:-1], graph.patch_offsets[1:], strict=True)
    return [12 - int((6 - graph.c_indices[low:high]).sum()) for low, high in bounds]


CROSS = {
    "nodes": [(1, 0, 0), (1, 2, 0), (0, 1, 0), (2, 1, 0), (1, 1, 0)],
    "side_nodes": [(0, 4), (4, 1), (2, 4), (4, 3)],
}


def flattened(design: quadloom.PatchDesign, tries: list[int]) -> quadloom.PatchDesign | None:
    """The design with all parts flat, by the best partitions that lead there."""
    if not design.defects.any():
        return design
    tries[0] += 1
    if tries[0] > 80:
        return None
    graph = design.patch_graph
    assert graph is None or defects_of(graph) == design.defects.tolist()
    part = int(np.abs(design.defects).argmax())
    found = design.partitions(part)
    whole = abs(design.defects[part])
    order = [(bool((np.abs(partition.defects) == whole).any()), partition.score) for partition in found]
    assert order == sorted(order)
    for partition in found:
        assert np.abs(partition.defects).max() <= abs(design.defects[part])
        assert [12 - int((6 - c).sum()) for c in partition.c_indices] == partition.defects.tolist()
        assert len(partition.curves) >= 1
    for partition in found[:4]:
        before = len(design.defects)
        made = design.divided(partition)
        assert len(design.defects) == before, "a design does not change"
        assert made.defects[-len(partition.defects) :].tolist() == partition.defects.tolist()
        done = flattened(made, tries)
        if done is not None:
            return done
    return None


def test_parts_are_divided_until_all_are_flat():
    design = flattened(quadloom.PatchDesign(sheet(cap), target_panels=200), [0])
    assert design is not None
    result = design.tile()
    assert euler(result.mesh) == 1
    assert len(result.patch_graph.patch_offsets) - 1 == len(design.defects)
    assert result.report["triangles"] + result.report["quads"] == pytest.approx(200, rel=0.3)


def test_curves_lie_on_the_surface():
    design = quadloom.PatchDesign(sheet(cap, 24), target_panels=200)
    for partition in design.partitions(0)[:5]:
        for curve in partition.curves:
            assert np.linalg.norm(curve, axis=1) == pytest.approx(np.ones(len(curve)), abs=0.01)


def test_partitions_are_the_same_each_time():
    def lists() -> list[tuple[float, list[int]]]:
        design = quadloom.PatchDesign(sheet(cap), target_panels=200)
        return [(partition.score, partition.defects.tolist()) for partition in design.partitions(0)]

    assert lists() == lists() != []


def test_a_partition_of_another_design_is_refused():
    first, second = (quadloom.PatchDesign(sheet(cap), target_panels=200) for _ in range(2))
    with pytest.raises(quadloom.QuadloomError, match="another design"):
        second.divided(first.partitions(0)[0])
    with pytest.raises(quadloom.QuadloomError, match="part is 7"):
        first.partitions(7)


def test_an_unfinished_design_is_finished_when_it_is_tiled():
    design = quadloom.PatchDesign(sheet(cap), target_panels=200)
    assert design.defects.any()
    result = design.tile()
    assert euler(result.mesh) == 1
    assert set(defects_of(result.patch_graph)) == {0}


def test_a_drawn_cross_makes_four_patches():
    design = quadloom.PatchDesign(sheet(floor), 0.2, patch_graph=quadloom.PatchGraph(**CROSS))
    assert design.defects.tolist() == [0] * 4
    graph = design.patch_graph
    assert sorted(np.diff(graph.patch_offsets).tolist()) == [4] * 4
    assert Counter(graph.c_indices.tolist()) == {3: 16}
    result = design.tile()
    positions, faces = polygons(result.mesh)
    assert {len(face) for face in faces} == {4}
    # The sides drawn are chains of edges.
    edges = {frozenset((f[k], f[(k + 1) % len(f)])) for f in faces for k in range(len(f))}
    for axis in (0, 1):
        on = np.abs(positions[:, axis] - 1) < 1e-6
        along = [np.ptp(positions[list(edge)], axis=0).max() for edge in edges if on[list(edge)].all()]
        assert sum(along) == pytest.approx(2)


def test_a_drawing_may_be_off_the_surface_and_off_its_corners():
    rough = {
        **CROSS,
        "nodes": np.array(CROSS["nodes"], float) + [[0, 0.03, 0.1], [0, 0, -0.1], [0.02, 0, 0], [0, 0, 0], [0, 0, 0.1]],
    }
    design = quadloom.PatchDesign(sheet(floor), 0.2, patch_graph=quadloom.PatchGraph(**rough))
    nodes = design.patch_graph.nodes
    assert np.abs(nodes[:, 2]).max() < 1e-9
    on_border = [(np.abs(p[:2] % 2) < 1e-9).any() for p in nodes]
    assert sum(on_border) == 8, "four corners and four ends"


def test_a_graph_that_was_found_is_the_same_when_it_is_given():
    mesh = sheet(cap)
    found = quadloom.tile_surface(mesh, target_panels=200, partition="patches").patch_graph
    given = quadloom.PatchDesign(mesh, target_panels=200, patch_graph=found)
    graph = given.patch_graph
    assert (given.defects == 0).all()
    assert len(graph.patch_offsets) == len(found.patch_offsets)

    def corners(graph: quadloom.PatchGraph) -> Counter:
        # The corners that are none of 180 degrees, by the nearest node found and c-index.
        apart = np.linalg.norm(graph.nodes[graph.corner_nodes][:, None] - found.nodes, axis=2)
        assert apart.min(axis=1)[graph.c_indices != 6].max() < 0.01
        return Counter((int(n), int(c)) for n, c in zip(apart.argmin(axis=1), graph.c_indices, strict=True) if c != 6)

    assert corners(graph) == corners(found)
    assert euler(given.tile().mesh) == 1


def test_known_c_indices_stay_and_others_follow():
    # A square whose corners are known as 60 and 120 degrees: one known pair decides the other.
    square = {"nodes": [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], "side_nodes": [(0, 1), (1, 2), (2, 3), (3, 0)]}

    def c_indices(known) -> list[int]:
        graph = quadloom.PatchGraph(**square, side_c_indices=[(c, 0) for c in known])
        return sorted(quadloom.PatchDesign(sheet(floor), 0.2, patch_graph=graph).patch_graph.c_indices.tolist())

    assert c_indices([0, 0, 0, 0]) == [3, 3, 3, 3]
    assert c_indices([2, 4, 2, 4]) == [2, 2, 4, 4]
    # These do not close: the least change does.
    assert sum(c_indices([2, 4, 2, 3])) == 12
    # What is far from the angle was another corner's.
    assert c_indices([9, 3, 3, 3]) == [3, 3, 3, 3]


RING = [(0.5, 0.5, 0), (1.5, 0.5, 0), (1.5, 1.5, 0), (0.5, 1.5, 0)]
BOW = [(0.5, 0, 0), (0.7, 0.6, 0), (1, 0.7, 0), (1.3, 0.6, 0), (1.5, 0, 0)]
BAD = {
    "graph_far": (([(0, 1, 5), (2, 1, 5)], [(0, 1)]), "nodes", [0, 1]),
    "graph_open": (([(0, 1, 0), (1, 1, 0), (2, 1, 0)], [(0, 1)]), "sides", [0]),
    "graph_not_flat": ((RING, [(0, 1), (1, 2), (2, 3), (3, 0)]), "sides", [0, 1, 2, 3]),
    # A lens has two corners: no angles of them close.
    "graph_not_closing": ((BOW[::4], [(0, 1)], [0, 5], BOW), "sides", [0]),
}


@pytest.mark.parametrize("code", BAD)
def test_graphs_that_are_no_partition_are_named(code):
    arguments, kind, expected = BAD[code]
    with pytest.raises(quadloom.InfeasibleError) as caught:
        quadloom.PatchDesign(sheet(floor), 0.2, patch_graph=quadloom.PatchGraph(*arguments))
    assert caught.value.code == code
    assert caught.value.elements[kind].tolist() == expected


def test_arrays_that_are_no_graph_are_refused():
    for arguments, words in (
        (([(0, 0, 0)], [(0, 1)]), "there are 1 nodes"),
        (([(0, 0, 0), (1, 0, 0)], [(0, 1)], [0, 1], [(0, 0, 0)]), "side_offsets must rise"),
        (([(0, 0, 0), (1, 0, 0)], [(0, 1)], [0, 2]), "belong together"),
    ):
        with pytest.raises(quadloom.QuadloomError, match=words):
            quadloom.PatchGraph(*arguments)
    with pytest.raises(quadloom.QuadloomError, match="side_c_indices"):
        quadloom.PatchGraph([(0, 0, 0), (1, 0, 0)], [(0, 1)], side_c_indices=[(1, 2), (3, 4)])


@pytest.mark.parametrize("seed", range(8))
def test_random_drawings_close_or_are_refused(seed):
    """Chords between random places on the border of a dome: panels that hold together, or an error with elements."""
    rng = np.random.default_rng(seed)
    dome = sheet(lambda u, v: (3 * u, 2 * v, math.sin(math.pi * u) * math.sin(math.pi * v)), 16)

    def border() -> tuple[float, float, float]:
        t, side = rng.uniform(0.2, 0.8), rng.integers(4)
        return [(3 * t, 0, 0), (3, 2 * t, 0), (3 * t, 2, 0), (0, 2 * t, 0)][side]

    nodes = [border() for _ in range(4)]
    graph = quadloom.PatchGraph(nodes, [(0, 1), (2, 3)])
    refusal = None
    try:
        design = quadloom.PatchDesign(dome, 0.2, patch_graph=graph)
        result = design.tile(shaping_rounds=10, flattening_rounds=0)
    except quadloom.InfeasibleError as error:
        refusal = error
    if refusal is not None:
        assert refusal.code.startswith("graph_") or refusal.code == "no_lengths"
        return
    assert (design.defects == 0).all()
    assert euler(result.mesh) == 1


def test_progress_can_cancel():
    with pytest.raises(quadloom.Cancelled):
        quadloom.PatchDesign(sheet(cap), target_panels=200, progress=lambda stage, fraction: False)
