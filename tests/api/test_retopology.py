"""quadloom.retopologize: the result's arrays, judged by code that shares nothing with the library; options; bad input."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time

import meshcheck
import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, ROOT, cube_positions, polygons, shipped

FACES = 1200
# Chains are corner to corner; where features meet is a corner.
MARKED, DETECTED, BORDER = 0, 1, 2
SHARP = np.radians(40)
SURFACES = {
    "tri/plate_holes": "CAD part of genus 5",
    "tri/fish_low_tri": "organic, triangles",
    "spot_quad": "organic, quads",
    "osd_toroidal_tet": "genus 3, few quads",
    "tri/vault_tri": "open, with a hole",
    "reject/spot_control_mixed": "triangles, quads and n-gons",
    "reject/osd_pawn_open": "open, quads",
    "reject/cube_soup": "six parts, all borders",
}
# The judge splits bent n-gons into fans; distances from them are those of the coarse mesh's own bends.
LIMITS = {"reject/spot_control_mixed": 0.05, "osd_toroidal_tet": 0.05}


def sides(mesh: quadloom.Mesh) -> np.ndarray:
    """(C, 2) the vertex of each corner and the next of its face."""
    following = np.arange(len(mesh.corner_verts)) + 1
    following[mesh.face_offsets[1:] - 1] = mesh.face_offsets[:-1]
    return np.stack([mesh.corner_verts, mesh.corner_verts[following]], axis=1)


def normals(mesh: quadloom.Mesh) -> np.ndarray:
    positions, faces = polygons(mesh)
    found = [
        sum(np.cross(positions[a] - positions[f[0]], positions[b] - positions[f[0]]) for a, b in itertools.pairwise(f[1:]))
        for f in faces
    ]
    return np.array(found) / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300)


def sharp_edges(mesh: quadloom.Mesh, angle: float = SHARP) -> np.ndarray:
    """(E, 2) edges between faces whose normals differ by more than the angle."""
    normal, face = normals(mesh), np.repeat(np.arange(len(mesh.face_offsets) - 1), np.diff(mesh.face_offsets))
    beside: dict[tuple[int, int], list[int]] = {}
    for (a, b), f in zip(sides(mesh).tolist(), face.tolist(), strict=True):
        beside.setdefault((min(a, b), max(a, b)), []).append(f)
    sharp = [edge for edge, at in beside.items() if len(at) == 2 and normal[at[0]] @ normal[at[1]] < np.cos(angle)]
    return np.array(sharp, int).reshape(-1, 2)


def border_count(faces: list[list[int]]) -> int:
    """Border loops, by following the sides that have no partner."""
    directed = {(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))}
    following = {a: b for b, a in directed if (a, b) not in directed}
    loops = 0
    while following:
        loops += 1
        start, at = following.popitem()
        while at != start:
            at = following.pop(at)
    return loops


@pytest.fixture(scope="module", params=SURFACES)
def made(request) -> tuple[quadloom.Mesh, np.ndarray, quadloom.RetopologyResult]:
    """A surface, its sharp edges, and the retopology along them."""
    mesh = shipped(request.param)
    edges = sharp_edges(mesh)
    return mesh, edges, quadloom.retopologize(mesh, edges, target_faces=FACES)


def test_the_result_is_all_quads_with_the_topology_of_the_input(made):
    mesh, _, result = made
    given, judged = meshcheck.topology(*polygons(mesh)), meshcheck.topology(*polygons(result.mesh))
    assert judged["pure_quad"]
    for name in ("euler", "components", "nonmanifold_edges", "nonmanifold_vertices", "flipped_edges", "degenerate_faces"):
        assert judged[name] == given[name], name
    assert border_count(polygons(result.mesh)[1]) == border_count(polygons(mesh)[1])
    assert len(result.mesh.positions) == len(np.unique(result.mesh.corner_verts)), "no loose vertex"


def test_the_result_lies_on_the_input(made, request):
    mesh, _, result = made
    positions, faces = polygons(mesh)
    away = meshcheck.distances(result.mesh.positions, positions, meshcheck.triangulate(positions, faces)[0])
    assert away.max() < LIMITS.get(request.node.callspec.params["made"], 0.01), "of the diagonal, which is 1"


def test_feature_edges_are_edges_in_chains_that_end_at_exact_corners(made):
    mesh, edges, result = made
    own = {frozenset(side) for side in sides(result.mesh).tolist()}
    assert all(frozenset(edge) in own for edge in result.feature_edges.tolist())
    assert len({frozenset(edge) for edge in result.feature_edges.tolist()}) == len(result.feature_edges)
    marked = {frozenset(edge) for edge in edges.tolist()}
    for source, kind in zip(result.feature_source.tolist(), result.feature_kind, strict=True):
        assert (kind == MARKED) == (frozenset(source) in marked)
    # Each vertex of the network where other than two features meet is a vertex of the result, bit for bit.
    directed = {tuple(side) for side in sides(mesh).tolist()}
    network = {*marked, *(frozenset((a, b)) for a, b in directed if (b, a) not in directed)}
    valence = np.bincount([v for edge in network for v in edge], minlength=len(mesh.positions))
    corners = mesh.positions[(valence != 0) & (valence != 2)]
    there = {tuple(p) for p in result.mesh.positions.tolist()}
    missing = sum(tuple(corner) not in there for corner in corners.tolist())
    assert missing <= 2 * result.report["edges_dropped"]
    # And a chain is a path or a loop: its inner vertices have two of its edges.
    for chain in np.unique(result.feature_chain):
        ends = np.bincount(result.feature_edges[result.feature_chain == chain].ravel())
        assert (ends <= 2).all()
        assert (ends == 1).sum() in (0, 2)


def test_the_features_length_is_reproduced(made):
    mesh, edges, result = made
    directed = {tuple(side) for side in sides(mesh).tolist()}
    borders = np.array([side for side in directed if side[::-1] not in directed], int).reshape(-1, 2)
    network = np.concatenate([edges, borders])
    if len(network) == 0:
        assert len(result.feature_edges) == 0
        return
    a, b = (mesh.positions[network[:, k]] for k in (0, 1))
    p, q = (result.mesh.positions[result.feature_edges[:, k]] for k in (0, 1))
    along = (q - p)[None]
    t = np.clip((((a + b)[:, None] / 2 - p[None]) * along).sum(axis=2) / (along**2).sum(axis=2), 0, 1)
    away = np.linalg.norm((a + b)[:, None] / 2 - p[None] - t[..., None] * along, axis=2)
    lengths = np.linalg.norm(b - a, axis=1)
    edge = np.linalg.norm(np.diff(result.mesh.positions[sides(result.mesh)], axis=1), axis=2).mean()
    cosine = np.abs(((b - a)[:, None] * along).sum(axis=2)) / (lengths[:, None] * np.linalg.norm(q - p, axis=1)[None])
    followed = ((away <= 0.05 * edge) & (cosine >= np.cos(np.radians(10)))).any(axis=1)
    share = lengths[followed].sum() / lengths.sum()
    assert share > 0.8
    assert result.report["features_reproduced"] == pytest.approx(share, abs=0.02)
    assert result.report["feature_length"] == pytest.approx(lengths.sum(), rel=1e-9)


def test_corner_sources_lie_under_their_corners_on_their_own_side(made):
    mesh, _, result = made
    source = result.corner_source
    face = np.repeat(np.arange(len(mesh.face_offsets) - 1), np.diff(mesh.face_offsets))
    assert (face[source.corners] == source.face[:, None]).all()
    assert (source.weights >= 0).all()
    np.testing.assert_allclose(source.weights.sum(axis=1), 1, atol=1e-12)
    under = np.einsum("ck,ckd->cd", source.weights, mesh.positions[mesh.corner_verts[source.corners]])
    assert np.linalg.norm(under - result.mesh.positions[result.mesh.corner_verts], axis=1).max() < 0.01
    # On a feature between two faces that turn sharply the corner takes the face that its own quad lies on.
    quads, normal = normals(result.mesh), normals(mesh)
    agreement = (quads[np.arange(len(source.face)) // 4] * normal[source.face]).sum(axis=1)
    assert (agreement > 0).mean() > 0.995


def test_the_base_is_a_triangulation_with_its_edges_on_the_surface(made, request):
    mesh, _, result = made
    given, judged = meshcheck.topology(*polygons(mesh)), meshcheck.topology(*polygons(result.base))
    assert set(np.diff(result.base.face_offsets)) == {3}
    for name in ("euler", "components"):
        assert judged[name] == given[name]
    assert len(result.base_paths) == len(result.base_edges) == len({frozenset(side) for side in sides(result.base).tolist()})
    positions, faces = polygons(mesh)
    triangles = meshcheck.triangulate(positions, faces)[0]
    for (a, b), path in zip(result.base_edges, result.base_paths, strict=True):
        np.testing.assert_allclose(path[[0, -1]], result.base.positions[[a, b]], atol=1e-12)
    away = meshcheck.distances(np.concatenate(result.base_paths), positions, triangles)
    assert away.max() < LIMITS.get(request.node.callspec.params["made"], 0.01)
    assert {int(c) for c in result.base_chain if c >= 0} == {int(c) for c in result.feature_chain}


def test_the_report_agrees_with_the_mesh(made):
    _, _, result = made
    report = result.report
    quality = meshcheck.quad_quality(*polygons(result.mesh))
    assert report["faces"] == len(result.mesh.face_offsets) - 1
    assert report["base_triangles"] == len(result.base.face_offsets) - 1
    assert report["base_vertices"] == len(result.base.positions)
    assert report["chains"] == len(np.unique(result.feature_chain))
    assert report["scaled_jacobian_min"] == pytest.approx(quality["scaled_jacobian_min"], abs=1e-6)
    assert report["scaled_jacobian_mean"] == pytest.approx(quality["scaled_jacobian_mean"], abs=1e-6)
    assert all(seconds >= 0 for seconds in report["seconds"].values())
    assert set(report["seconds"]) >= {"check", "fields", "cut", "pairing", "density", "fill", "optimise"}


@pytest.mark.parametrize("target", [500, 2000, 8000, 20000])
@pytest.mark.parametrize("name", ["tri/plate_holes", "spot_quad", "tri/vault_tri"])
def test_the_face_count_is_met(name, target):
    result = quadloom.retopologize(shipped(name), target_faces=target)
    assert result.report["faces"] == pytest.approx(target, rel=0.05)
    assert result.report["target"] == target


def test_the_edge_length_is_met_at_any_scale_and_place():
    for scale, move in ((1.0, (0, 0, 0)), (1e-4, (0, 0, 0)), (1000.0, (5000, -3000, 100))):
        mesh = shipped("spot_quad", move, scale)
        result = quadloom.retopologize(mesh, edge_length=0.03 * scale)
        lengths = np.linalg.norm(np.diff(result.mesh.positions[sides(result.mesh)], axis=1), axis=2)
        # Edges are shorter where the surface bends.
        assert 0.7 < lengths.mean() / (0.03 * scale) < 1.1
        assert result.report["target"] is None


@pytest.mark.parametrize("scale", [1e-30, 1e9, 1e150])
def test_any_scale_works(scale):
    mesh = quadloom.Mesh.from_polygons(cube_positions() * scale, CUBE_FACES)
    result = quadloom.retopologize(mesh, detect=True, target_faces=600)
    assert result.report["chains"] == 12
    there = {tuple(p) for p in result.mesh.positions.tolist()}
    assert all(tuple(corner) in there for corner in mesh.positions.tolist())


def test_denser_where_the_density_is_greater():
    mesh = shipped("osd_torus")
    right = mesh.positions[:, 0] > 0
    result = quadloom.retopologize(mesh, density=np.where(right, 3.0, 1.0), coarseness=0.25, target_faces=3000)
    quads = result.mesh.positions[result.mesh.corner_verts.reshape(-1, 4)]
    area = np.linalg.norm(np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]), axis=1) / 2
    middle = quads.mean(axis=1)[:, 0]
    assert area[middle < -0.1].mean() > 3 * area[middle > 0.1].mean()
    same = quadloom.retopologize(mesh, density=np.full(len(mesh.positions), 7.0), target_faces=3000)
    assert same.report["faces"] == pytest.approx(3000, rel=0.05)


def test_marked_and_detected_edges_at_once(cube):
    marked = [[0, 1]]
    result = quadloom.retopologize(cube, marked, detect=True, target_faces=600)
    assert result.report["edges_detected"] == 11
    assert set(result.feature_kind) == {MARKED, DETECTED}
    on_marked = result.feature_source[result.feature_kind == MARKED]
    assert {tuple(sorted(edge)) for edge in on_marked.tolist()} == {(0, 1)}
    assert quadloom.retopologize(cube, detect=True, detect_angle=2.0, target_faces=600).report["chains"] == 0
    assert quadloom.retopologize(cube, detect=True, detect_length=1.0, target_faces=600).report["chains"] == 12


def test_the_diagonal_of_a_bent_quad_is_no_sharp_edge():
    """A saddle of one quad: its diagonal turns sharply, and is no edge."""
    mesh = quadloom.Mesh.from_polygons([[0, 0, 1], [1, 0, 0], [1, 1, 1], [0, 1, 0]], [[0, 1, 2, 3]])
    result = quadloom.retopologize(mesh, detect=True, target_faces=200)
    assert result.report["edges_detected"] == 0
    assert (result.feature_kind == BORDER).all()


def test_marked_vertices_are_vertices():
    mesh = shipped("spot_quad")
    chosen = [3, 700, 2500]
    there = {tuple(p) for p in quadloom.retopologize(mesh, None, chosen, FACES).mesh.positions.tolist()}
    assert all(tuple(mesh.positions[v].tolist()) in there for v in chosen)


@pytest.mark.parametrize("options", [{"pairing": "matching"}, {"improve": False}, {"coarseness": 0.0}, {"coarseness": 1.0}])
def test_every_option_gives_a_valid_mesh(options):
    mesh = shipped("tri/vault_tri")
    result = quadloom.retopologize(mesh, target_faces=FACES, **options)
    judged = meshcheck.topology(*polygons(result.mesh))
    assert judged["pure_quad"]
    assert judged["euler"] == meshcheck.topology(*polygons(mesh))["euler"]
    assert len(result.corner_source.face) == len(result.mesh.corner_verts)


def test_a_coarser_layout_has_fewer_irregular_vertices():
    results = [quadloom.retopologize(shipped("osd_torus"), coarseness=c, improve=False).report for c in (0.0, 1.0)]
    assert results[1]["irregular_vertices"] < results[0]["irregular_vertices"]
    assert results[1]["base_complex"] < results[0]["base_complex"] / 4


def test_irregular_vertices_are_taken_out():
    laid, improved = (quadloom.retopologize(shipped("osd_torus"), improve=improve).report for improve in (False, True))
    assert improved["irregular_vertices"] <= laid["irregular_vertices"] / 2


def test_the_same_input_gives_the_same_bytes_for_any_number_of_threads():
    script = (
        "import sys, hashlib; sys.path.insert(0, sys.argv[1]); import quadloom; from meshes import shipped\n"
        "r = quadloom.retopologize(shipped('tri/plate_holes'), detect=True, target_faces=1500)\n"
        "parts = [r.mesh.positions, r.mesh.corner_verts, r.feature_edges, r.corner_source.weights, r.base.positions]\n"
        "print(hashlib.sha256(b''.join(p.tobytes() for p in parts)).hexdigest())"
    )
    found = set()
    for threads in ("1", "2", "2"):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads}
        command = [sys.executable, "-c", script, str(ROOT / "tests" / "api")]
        found.add(subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout)
    assert len(found) == 1


# Bad input


def no_faces():
    return (np.zeros((3, 3)), []), "empty", "faces", set()


def not_a_number():
    positions = cube_positions()
    positions[[2, 5], 1] = np.nan, np.inf
    return (positions, CUBE_FACES), "not_finite", "verts", {2, 5}


def too_small():
    return (1 + 1e-12 * cube_positions(), CUBE_FACES), "too_small", "verts", set(range(8))


def a_repeated_corner():
    return (cube_positions(), [*CUBE_FACES[:5], [1, 5, 1, 3]]), "degenerate", "faces", {5}


def a_doubled_face():
    return (cube_positions(), [*CUBE_FACES, CUBE_FACES[2][1:] + CUBE_FACES[2][:1]]), "duplicate", "faces", {6}


def a_fin():
    positions = np.concatenate([cube_positions(), [[0, 2, 0], [0, 2, 1]]])
    return (positions, [*CUBE_FACES, [2, 3, 9, 8]]), "non_manifold", "edges", {frozenset((2, 3))}


def a_flipped_face():
    face = CUBE_FACES[3][::-1]
    ring = {frozenset((face[k], face[(k + 1) % 4])) for k in range(4)}
    return (cube_positions(), [*CUBE_FACES[:3], face, *CUBE_FACES[4:]]), "misoriented", "edges", ring


def two_parts_at_a_vertex():
    corners = {7: 7, **{v: v + 8 for v in range(7)}}
    other = [[corners[v] for v in reversed(face)] for face in CUBE_FACES]
    positions = np.concatenate([cube_positions(), 2 - cube_positions()[:7]])
    return (positions, CUBE_FACES + other), "non_manifold_vertex", "verts", {7}


def a_line():
    positions = [[0, 0, 0], [1, 1, 1], [2, 2, 2], [3, 3, 3]]
    return (positions, [[0, 1, 2], [0, 2, 3]]), "zero_area", "faces", {0, 1}


@pytest.mark.parametrize(
    "case",
    [
        no_faces, not_a_number, too_small, a_repeated_corner, a_doubled_face, a_fin, a_flipped_face,
        two_parts_at_a_vertex, a_line,
    ],
    ids=lambda case: case.__name__,
)  # fmt: skip
def test_a_bad_mesh_is_refused_with_its_code_and_elements(case):
    shape, code, kind, elements = case()
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.retopologize(quadloom.Mesh.from_polygons(*shape))
    error = caught.value
    assert (error.code, error.mesh, list(error.elements)) == (code, None, [kind])
    assert {frozenset(row) if kind == "edges" else row for row in error.elements[kind].tolist()} == elements
    assert str(error).startswith("the mesh ")


def test_a_face_without_area_among_others_is_no_obstacle():
    """A triangle between two faces of the cube, with a vertex in the middle of their edge 0-1 as its third corner."""
    positions = np.concatenate([cube_positions(), [[0, 0, 0.5]]])
    faces = [face for face in CUBE_FACES if not {0, 1, 4} <= set(face)] + [[0, 4, 5, 1, 8], [0, 8, 1]]
    mesh = quadloom.Mesh.from_polygons(positions, faces)
    defects = quadloom.check(mesh)
    assert defects.manifold
    assert defects.closed
    assert len(defects.zero_area_faces) == 1
    result = quadloom.retopologize(mesh, detect=True, target_faces=600)
    judged = meshcheck.topology(*polygons(result.mesh))
    assert judged["closed_manifold"]
    assert judged["euler"] == 2


@pytest.mark.parametrize(
    ("edges", "verts", "code", "kind", "at"),
    [
        ([[0, 1], [0, 7]], None, "feature_not_edge", "features", [1]),
        ([[0, 3]], None, "feature_not_edge", "features", [0]),
        ([[0, 99], [4, 4]], None, "feature_not_edge", "features", [0, 1]),
        ([[0, 1], [2, 3], [1, 0]], None, "feature_repeated", "features", [2]),
        (None, [1, 8], "feature_not_vertex", "feature_verts", [1]),
    ],
)
def test_a_bad_feature_is_refused_with_its_position(cube, edges, verts, code, kind, at):
    """0-3 and 0-7 are diagonals: no edges, although the triangulation may have them."""
    with pytest.raises(quadloom.QuadloomError) as caught:
        quadloom.retopologize(cube, edges, verts)
    assert caught.value.code == code
    assert not isinstance(caught.value, quadloom.InvalidMeshError)
    assert {k: v.tolist() for k, v in caught.value.elements.items()} == {kind: at}


@pytest.mark.parametrize(
    ("option", "says"),
    [
        ({"target_faces": 0}, "target_faces"),
        ({"target_faces": -5}, "target_faces"),
        ({"target_faces": 10**12}, "target_faces"),
        ({"edge_length": 0.0}, "edge_length"),
        ({"edge_length": float("nan")}, "edge_length"),
        ({"edge_length": 1e-6}, "million quads"),
        ({"density": [1.0]}, "density has 1 values"),
        ({"density": [0.0] * 8}, "density"),
        ({"density": [float("nan")] * 8}, "density"),
        ({"density": [[1.0] * 8]}, "density has the shape"),
        ({"coarseness": 1.5}, "coarseness"),
        ({"coarseness": float("nan")}, "coarseness"),
        ({"pairing": "best"}, "one of: valence, matching"),
        ({"base_vertices": 3}, "base_vertices"),
        ({"corner_angle": 4.0}, "corner_angle"),
        ({"detect": True, "detect_angle": -1.0}, "option detect_angle must"),
        ({"detect": True, "detect_continue_angle": 1.0}, "detect_continue_angle must be 0 to detect_angle"),
        ({"detect": True, "detect_length": 2.0}, "detect_length"),
        ({"feature_edges": [[0, 1, 2]]}, r"feature_edges has the shape \[1, 3\]"),
        ({"feature_verts": [[0, 1]]}, "feature_verts has the shape"),
    ],
)
def test_an_option_out_of_range_is_named(cube, option, says):
    with pytest.raises(quadloom.QuadloomError, match=says) as caught:
        quadloom.retopologize(cube, **option)
    assert caught.value.code == "option"


def test_progress_rises_and_cancels_within_the_limit():
    heard = []

    def progress(stage, fraction):
        heard.append((stage, fraction, time.monotonic()))
        return len(heard) < 25

    mesh = shipped("spot_quad")
    with pytest.raises(quadloom.Cancelled):
        quadloom.retopologize(mesh, target_faces=20000, progress=progress)
    assert time.monotonic() - heard[-1][2] < 0.5
    fractions = [fraction for _, fraction, _ in heard]
    assert fractions == sorted(fractions)
    assert 0 <= fractions[0] <= fractions[-1] <= 1


@pytest.mark.parametrize("stage", ["triangulating", "straightening base edges", "density", "fill", "optimise"])
def test_every_stage_can_be_cancelled(stage):
    asked = None

    def progress(at, _):
        nonlocal asked
        if at == stage:
            asked = asked or time.monotonic()
        return asked is None

    try:
        quadloom.retopologize(shipped("spot_quad"), target_faces=20000, base_vertices=400, progress=progress)
    except quadloom.Cancelled:
        assert time.monotonic() - asked < 0.5
    else:
        assert asked is None, "the stage was over before it was asked"
