"""quadloom.retopologize(symmetry=...): mirrored by index and by place, features and attributes of both sides, refusals."""

from __future__ import annotations

import functools

import meshcheck
import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, ROOT, cube_positions, polygons, shipped
from test_retopology import sharp_edges, sides

FACES = 1200
# Mesh -> the plane it is symmetric about, and how nearly.
SURFACES = {
    "tri/plate_holes": ("x", 0.01),
    "spot_quad": ("x", 0.01),
    "osd_torus": ("z", 0.01),
    "tri/fish_low_tri": (((0, 0, 0), (0.0, 1.0, 0.0)), np.inf),
    "tri/mirror": ("y", np.inf),
}


def axis_and_place(symmetry) -> tuple[np.ndarray, np.ndarray]:
    if isinstance(symmetry, str):
        return np.eye(3)["xyz".index(symmetry)], np.zeros(3)
    point, normal = np.array(symmetry, float)
    return normal / np.linalg.norm(normal), point


def mirrored(positions: np.ndarray, symmetry) -> np.ndarray:
    normal, point = axis_and_place(symmetry)
    return positions - 2 * np.outer((positions - point) @ normal, normal)


@functools.cache
def retopologized(name: str):
    mesh = shipped(name)
    symmetry, tolerance = SURFACES[name]
    edges = sharp_edges(mesh)
    options = {"symmetry": symmetry, "symmetry_tolerance": tolerance, "target_faces": FACES}
    return mesh, edges, symmetry, quadloom.retopologize(mesh, edges, **options)


@pytest.fixture(params=SURFACES)
def made(request):
    """Every surface; of those with an infinite tolerance the kept side decides."""
    return retopologized(request.param)


@pytest.fixture(params=[name for name, (_, tolerance) in SURFACES.items() if tolerance < np.inf])
def symmetric(request):
    """The surfaces that are symmetric themselves."""
    return retopologized(request.param)


def test_the_result_is_its_own_mirror_image_by_index(made):
    _, _, symmetry, result = made
    positions, mirror = result.mesh.positions, result.mirror
    assert (mirror[mirror] == np.arange(len(positions))).all()
    away = np.linalg.norm(positions[mirror] - mirrored(positions, symmetry), axis=1)
    assert away.max() < 1e-9, "of the diagonal, which is 1"
    quads = {frozenset(face) for face in result.mesh.corner_verts.reshape(-1, 4).tolist()}
    assert {frozenset(mirror[list(face)].tolist()) for face in quads} == quads
    directed = {tuple(side) for side in sides(result.mesh).tolist()}
    assert {(mirror[b], mirror[a]) for a, b in directed} == directed, "turned over as a mirror does"
    features = {frozenset(edge) for edge in result.feature_edges.tolist()}
    assert {frozenset(mirror[list(edge)].tolist()) for edge in features} == features


def test_the_result_is_as_valid_as_any(made):
    _, _, _, result = made
    judged = meshcheck.topology(*polygons(result.mesh))
    assert judged["pure_quad"]
    for name in ("nonmanifold_edges", "nonmanifold_vertices", "flipped_edges", "degenerate_faces"):
        assert judged[name] == 0, name
    assert result.report["faces"] == pytest.approx(FACES, rel=0.05)
    assert result.report["symmetry_deviation"] >= 0
    base = meshcheck.topology(*polygons(result.base))
    assert base["euler"] == judged["euler"]


def test_what_is_symmetric_keeps_its_topology_and_its_features(symmetric):
    mesh, edges, _, result = symmetric
    given, judged = meshcheck.topology(*polygons(mesh)), meshcheck.topology(*polygons(result.mesh))
    assert (judged["euler"], judged["components"]) == (given["euler"], given["components"])
    marked = {frozenset(edge) for edge in edges.tolist()}
    of_marks = result.feature_source[result.feature_kind == 0]
    assert {frozenset(edge) for edge in of_marks.tolist()} <= marked
    # A mark of its own side lies under each.
    middles = result.mesh.positions[result.feature_edges].mean(axis=1)
    p, q = (mesh.positions[result.feature_source[:, k]] for k in (0, 1))
    t = np.clip(((middles - p) * (q - p)).sum(axis=1) / ((q - p) ** 2).sum(axis=1), 0, 1)
    away = np.linalg.norm(middles - p - t[:, None] * (q - p), axis=1)
    assert away.max(initial=0.0) < 0.01
    lengths = np.linalg.norm(np.diff(mesh.positions[edges], axis=1), axis=2).sum()
    assert result.report["feature_length"] == pytest.approx(lengths, rel=0.03, abs=1e-9)


def test_attributes_come_from_the_corners_own_side(symmetric):
    mesh, _, _, result = symmetric
    source = result.corner_source
    face = np.repeat(np.arange(len(mesh.face_offsets) - 1), np.diff(mesh.face_offsets))
    assert (face[source.corners] == source.face[:, None]).all()
    np.testing.assert_allclose(source.weights.sum(axis=1), 1, atol=1e-12)
    under = np.einsum("ck,ckd->cd", source.weights, mesh.positions[mesh.corner_verts[source.corners]])
    assert np.linalg.norm(under - result.mesh.positions[result.mesh.corner_verts], axis=1).max() < 0.015


def test_the_other_side_can_decide():
    positions = cube_positions() - 0.5
    positions[positions[:, 0] > 0] *= (1, 0.5, 0.5)
    mesh = quadloom.Mesh.from_polygons(positions, CUBE_FACES)
    for sign in (1, -1):
        plane = ((0, 0, 0), (sign, 0, 0))
        result = quadloom.retopologize(mesh, symmetry=plane, symmetry_tolerance=np.inf, target_faces=400)
        widest = np.abs(result.mesh.positions[:, 1]).max()
        assert widest == pytest.approx(0.375 if sign > 0 else 0.5, abs=0.01)


def test_no_edge_spans_a_narrow_part_from_plane_to_plane():
    """At this size one would: it would be one with its mirror image, an edge of four faces. There are more quads then."""
    mesh = shipped("tri/fish_low_tri")
    edges = meshcheck.read_edges(str(ROOT / "blend_fixtures" / "meshes" / "tri" / "fish_low_tri.edges40"))
    result = quadloom.retopologize(mesh, edges, target_faces=1500, symmetry="x", symmetry_tolerance=np.inf)
    judged = meshcheck.topology(*polygons(result.mesh))
    assert judged["pure_quad"]
    assert (judged["nonmanifold_edges"], judged["nonmanifold_vertices"]) == (0, 0)
    assert result.report["faces"] < 1575 or any("instead of 1500" in text for text in result.report["warnings"])


def test_a_surface_that_is_not_symmetric_is_refused_with_its_vertices():
    mesh = shipped("tri/fish_low_tri")
    with pytest.raises(quadloom.InvalidMeshError, match="not symmetric about the plane") as caught:
        quadloom.retopologize(mesh, symmetry="y")
    assert caught.value.code == "not_symmetric"
    assert 0 < len(caught.value.elements["verts"]) <= len(mesh.positions)


def test_marks_on_one_side_only_are_refused_with_their_edges():
    mesh = shipped("osd_torus")
    border = sides(mesh)
    edge = border[(mesh.positions[border][:, :, 2] > 0.02).all(axis=1)][:1]
    with pytest.raises(quadloom.QuadloomError, match="no like on the other side") as caught:
        quadloom.retopologize(mesh, edge, symmetry="z")
    assert caught.value.code == "features_not_symmetric"
    assert caught.value.elements["edges"].tolist() == [sorted(edge[0].tolist())]


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ({"symmetry": "w"}, "symmetry must be"),
        ({"symmetry": (0, 0, 1)}, "symmetry must be"),
        ({"symmetry": ((0, 0, 0), (0, 0, 0))}, "normal that is not zero"),
        ({"symmetry": "x", "symmetry_tolerance": -1.0}, "symmetry_tolerance"),
        ({"symmetry": "x", "symmetry_tolerance": float("nan")}, "symmetry_tolerance"),
    ],
)
def test_a_bad_plane_is_named(cube, option, says):
    with pytest.raises(quadloom.QuadloomError, match=says) as caught:
        quadloom.retopologize(cube, **option)
    assert caught.value.code == "option"


def test_a_plane_beside_the_surface_keeps_nothing(cube):
    with pytest.raises(quadloom.InvalidMeshError, match="nothing on the kept side") as caught:
        quadloom.retopologize(cube, symmetry=((2, 0, 0), (1, 0, 0)), symmetry_tolerance=np.inf)
    assert caught.value.code == "nothing_kept"
