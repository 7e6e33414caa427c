"""quadloom.boolean: the result's arrays, judged by code that shares nothing with the library; options; errors."""

from __future__ import annotations

import time

import meshcheck
import numpy as np
import pytest
import quadloom
from meshes import polygons, shipped

OPERATIONS = ("union", "intersection", "difference")


@pytest.fixture(scope="module")
def pair() -> tuple[quadloom.Mesh, quadloom.Mesh]:
    """A cube with one sharp edge, and a rounded character letter half its size through its side."""
    return shipped("lagrange_cube_edge_sharp"), shipped("osd_righthanded", move=(0.2, 0.1, 0.15), scale=0.5)


@pytest.fixture(scope="module", params=OPERATIONS)
def made(request, pair):
    """An operation and its result."""
    return request.param, quadloom.boolean(*pair, request.param)


def test_the_result_is_what_the_exact_boolean_is_but_in_quads(made, pair):
    operation, result = made
    positions, faces = polygons(result.mesh)
    judged = meshcheck.topology(positions, faces)
    exact = meshcheck.check_boolean((positions, faces), *map(polygons, pair), operation, np.random.default_rng(1))
    assert judged["closed_manifold"]
    assert judged["pure_quad"]
    assert judged["euler"] == exact["reference_euler"]
    assert judged["components"] == exact["reference_components"]
    assert exact["distance_max"] < 0.01
    assert exact["volume_error"] < 0.01
    assert meshcheck.self_intersections(positions, meshcheck.triangulate(positions, faces)[0]) == 0
    assert meshcheck.quad_quality(positions, faces)["inverted_quads"] == 0


def test_a_blend_moves_only_what_lies_near_the_curve(pair):
    sharp = quadloom.boolean(*pair, "union")
    soft = quadloom.boolean(*pair, "union", blend_radius=0.05)
    assert np.array_equal(sharp.mesh.corner_verts, soft.mesh.corner_verts)
    moved = np.linalg.norm(soft.mesh.positions - sharp.mesh.positions, axis=1)
    # Distance from the edges of the curve, not from its vertices only.
    start, end = (sharp.mesh.positions[sharp.intersection_edges[:, side]][None] for side in (0, 1))
    points, along = sharp.mesh.positions[:, None], end - start
    t = np.clip(((points - start) * along).sum(axis=2) / (along**2).sum(axis=2), 0, 1)
    away = np.linalg.norm(points - start - t[..., None] * along, axis=2).min(axis=1)
    assert moved[np.unique(sharp.intersection_edges)].max() > 1e-4
    # The distance along the surface is at least the straight one.
    assert not moved[away > 0.05].any()
    touched = moved[soft.mesh.corner_verts.reshape(-1, 4)].any(axis=1) & (soft.face_source[:, 0] >= 0)
    assert soft.report["faces_moved"] >= touched.sum()


def test_kept_faces_are_the_inputs_bit_for_bit(made, pair):
    operation, result = made
    inputs = [polygons(mesh) for mesh in pair]
    positions, faces = polygons(result.mesh)
    kept = 0
    for face, (source, index) in zip(faces, result.face_source, strict=True):
        if source == -1:
            assert index == -1
            continue
        input_positions, input_faces = inputs[source]
        expected = input_positions[input_faces[index]]
        if operation == "difference" and source == 1:
            # What is left of B bounds the hole: it faces the other way.
            expected = expected[::-1]
        turns = [np.roll(expected, step, axis=0) for step in range(4)]
        assert any(np.array_equal(positions[face], turn) for turn in turns)
        kept += 1
    assert kept == result.report["faces_kept"]
    assert kept + result.report["faces_new"] == len(faces)


def test_corner_sources_lie_under_their_corners(made, pair):
    _, result = made
    sources = result.corner_source
    corners = len(result.mesh.corner_verts)
    assert sources.mesh.shape == sources.face.shape == (corners,)
    assert sources.weights.shape == (corners, 4)
    np.testing.assert_allclose(sources.weights.sum(axis=1), 1, atol=1e-9)
    quads = [mesh.positions[mesh.corner_verts.reshape(-1, 4)] for mesh in pair]
    under = np.array(
        [weights @ quads[mesh][face] for mesh, face, weights in zip(sources.mesh, sources.face, sources.weights, strict=True)]
    )
    away = np.linalg.norm(under - result.mesh.positions[result.mesh.corner_verts], axis=1)
    assert away.max() < 0.01 * np.linalg.norm(np.ptp(pair[0].positions, axis=0))


def test_intersection_edges_are_edges_between_the_two_surfaces(made, pair):
    _, result = made
    quads = result.mesh.corner_verts.reshape(-1, 4)
    sides = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges = {tuple(side) for side in sides}
    assert len(result.intersection_edges)
    assert all(tuple(sorted(edge)) in edges for edge in result.intersection_edges.tolist())
    diagonal = np.linalg.norm(np.ptp(pair[0].positions, axis=0))
    on_curve = result.mesh.positions[np.unique(result.intersection_edges)]
    for mesh in pair:
        positions, faces = polygons(mesh)
        away = meshcheck.distances(on_curve, positions, meshcheck.triangulate(positions, faces)[0])
        assert away.max() < 0.01 * diagonal


def test_the_report_is_plain_data(made):
    _, result = made
    report = result.report
    assert set(report["seconds"]) >= {"check", "intersect"}
    assert all(seconds >= 0 for seconds in report["seconds"].values())
    assert all(set(region) >= {"filler", "quads", "scores"} for region in report["regions"])
    assert report["curves"] >= 1


def test_the_same_input_gives_the_same_bytes(pair):
    first, second = (quadloom.boolean(*pair) for _ in range(2))
    for name in ("positions", "face_offsets", "corner_verts"):
        assert getattr(first.mesh, name).tobytes() == getattr(second.mesh, name).tobytes()
    assert first.face_source.tobytes() == second.face_source.tobytes()
    assert first.corner_source.weights.tobytes() == second.corner_source.weights.tobytes()


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ({"operation": "xor"}, 'operation is "xor"; it must be one of: union, intersection, difference'),
        ({"layout": "grid"}, 'layout is "grid"; it must be one of: motorcycle, separatrices'),
        ({"regroup": ""}, "regroup is"),
        ({"filler": "best"}, "one of: auto, patches, rings, matching"),
        ({"alpha": 1.0}, "alpha"),
        ({"alpha": float("nan")}, "alpha"),
        ({"retraction_distance": -1.0}, "retraction"),
        ({"blend_radius": -1.0}, "blend"),
        ({"sharp_angle": 100.0}, "sharp"),
        ({"feature_edges": ([[0, 1, 2]], [])}, r"feature_edges\[0\] has the shape \[1, 3\]"),
        ({"feature_edges": ([[0, 10**6]], [])}, "feature"),
    ],
)
def test_an_option_out_of_range_is_named(pair, option, says):
    with pytest.raises(quadloom.QuadloomError, match=says) as caught:
        quadloom.boolean(*pair, **option)
    assert caught.value.code == "option"
    assert not isinstance(caught.value, quadloom.InvalidMeshError)


@pytest.mark.parametrize("position", [0, 1])
@pytest.mark.parametrize(
    ("name", "code", "kind", "count"),
    [
        ("reject/osd_helmet_open", "open", "edges", 26),
        ("reject/spot_control_mixed", "not_quads", "faces", 20),
        ("reject/nonmanifold_edge", "non_manifold", "edges", 1),
        ("reject/nonmanifold_vertex", "open", "edges", 8),
        ("reject/nonoriented_edge", "open", "edges", 6),
        ("reject/cube_soup", "not_quads", "faces", 12),
        ("reject/osd_nonmanifold_quadpole", "degenerate", "faces", 64),
        ("bob_control", "self_intersecting", "faces", 6),
    ],
)
def test_a_bad_file_is_refused_with_its_elements(pair, name, code, kind, count, position):
    meshes = list(pair)
    meshes[position] = shipped(name)
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.boolean(*meshes)
    error = caught.value
    assert (error.code, error.mesh, list(error.elements)) == (code, position, [kind])
    assert len(error.elements[kind]) == count
    assert str(error).startswith("AB"[position])


def test_an_empty_result_is_a_message(pair):
    a, _ = pair
    far = shipped("lagrange_cube_edge_sharp", move=(3, 0, 0))
    with pytest.raises(quadloom.InfeasibleError) as caught:
        quadloom.boolean(a, far, "intersection")
    assert caught.value.code == "empty"


def test_cancels_within_the_limit():
    blub = shipped("blub_quad"), shipped("blub_quad", move=(0.15, 0.1, 0.05))
    stages = []

    def progress(stage, _):
        stages.append((stage, time.monotonic()))
        return len(stages) < 4

    with pytest.raises(quadloom.Cancelled):
        quadloom.boolean(*blub, progress=progress)
    assert time.monotonic() - stages[-1][1] < 0.5
