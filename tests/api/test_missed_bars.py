"""Bars that a tiling misses: measured again here, and named in the report and its warnings."""

from __future__ import annotations

import math

import numpy as np
import pytest
import quadloom
from meshes import polygons
from test_surface_tiling import border_segments, edge_uses, grid, sphere


def planarities(points: np.ndarray, faces) -> np.ndarray:
    """Of each face, the distance between its diagonals over their mean length; 0 of triangles."""
    found = []
    for face in faces:
        if len(face) == 3:
            found.append(0.0)
            continue
        p = points[face]
        first, second = p[2] - p[0], p[3] - p[1]
        across = np.cross(first, second)
        mean = (np.linalg.norm(first) + np.linalg.norm(second)) / 2
        found.append(abs((p[1] - p[0]) @ across) / np.linalg.norm(across) / mean)
    return np.array(found)


def missed(result: quadloom.SurfaceResult, bar: str) -> dict:
    (found,) = [item for item in result.report["missed_bars"] if item["bar"] == bar]
    # The sentence names the worst elements and says what helps.
    (sentence,) = [
        w for w in result.report["warnings"] if f"{found['kind'].replace('verts', 'vertices')} {found['elements'][0]}" in w
    ]
    assert "smaller panels" in sentence
    return found


def off_border(mesh: quadloom.Mesh, other: quadloom.Mesh) -> float:
    """The greatest distance of the border of one, at fourths of its edges, from that of the other."""
    edges, others = (border_segments(*polygons(mesh)) for mesh in (mesh, other))
    samples = np.concatenate([edges[:, 0] * (1 - part) + edges[:, 1] * part for part in (0, 0.25, 0.5, 0.75)])
    start, along = others[:, 0], others[:, 1] - others[:, 0]
    part = ((samples[:, None] - start) * along).sum(-1) / (along * along).sum(-1)
    nearest = start + np.clip(part, 0, 1)[..., None] * along
    return np.linalg.norm(samples[:, None] - nearest, axis=-1).min(axis=1).max()


def test_a_bar_that_is_missed_is_said_with_what_misses_it():
    # Squares along the straight lines of a saddle cannot be flat.
    twisted = grid(12, 12, lambda u, v: (4 * u, 4 * v, 3 * (u - 0.5) * (v - 0.5)))
    result = quadloom.tile_surface(twisted, 1.0, partition="patches")
    points, faces = polygons(result.mesh)
    bent = planarities(points, faces)
    quads = np.array([len(face) == 4 for face in faces])
    found = missed(result, "planarity")
    assert (found["kind"], found["allowed"]) == ("faces", 0.02)
    assert found["measured"] == pytest.approx(bent[quads].mean())
    assert found["measured"] > 0.02
    assert set(found["elements"]) == set(np.flatnonzero(bent > 0.02).tolist())
    assert np.all(np.diff(bent[found["elements"]]) <= 1e-9), "the worst first"


def test_panels_far_off_and_unequal_edges_are_said():
    ball = sphere()
    far = quadloom.tile_surface(ball, target_panels=100, shaping_rounds=0, flattening_rounds=60, closeness=0.001, planarity=100)
    points, faces = polygons(far.mesh)
    # From the sphere; the faces of the surface given are within 0.5% of it. Of each panel its corners and its middle.
    ways = [np.vstack([points[face], points[face].mean(axis=0)]) for face in faces]
    off = np.array([np.abs(np.linalg.norm(way, axis=1) - 1).max() for way in ways])
    off /= np.linalg.norm(points.max(axis=0) - points.min(axis=0))
    found = missed(far, "closeness")
    assert found["measured"] == pytest.approx(off.max(), abs=0.005)
    assert found["measured"] > 0.03
    assert off[found["elements"]].min() > 0.03 - 0.005
    # Two triangles that touch, of few panels.
    mesh = quadloom.Mesh.from_polygons([[0, 0, 0], [2, 0, 0], [0, 2, 0], [-2, 0, 0], [0, -2, 0]], [[0, 1, 2], [0, 3, 4]])
    uneven = quadloom.tile_surface(mesh, 0.9)
    points, faces = polygons(uneven.mesh)
    pairs = np.array(sorted({tuple(sorted(pair)) for pair in edge_uses(faces)}))
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    assert lengths.std() / lengths.mean() > 0.2
    assert missed(uneven, "spread")["measured"] == pytest.approx(lengths.std() / lengths.mean())


def test_faces_without_room_for_panels_are_named():
    # A pipe of radius 0.1, and a ball beside it with room for more.
    pipe = grid(12, 40, lambda u, v: (0.1 * math.cos(math.tau * u), 0.1 * math.sin(math.tau * u), 4 * v), around=True)
    points, faces = polygons(pipe)
    ball_points, ball_faces = polygons(sphere())
    ball = [[v + len(points) for v in face] for face in ball_faces]
    mesh = quadloom.Mesh.from_polygons(np.vstack([points, ball_points + [6, 0, 0]]), [*faces, *ball])
    result = quadloom.tile_surface(mesh, 0.5)
    assert result.edge_length < 0.5
    assert len(result.turned_faces) == 0
    narrow = result.report["narrow_faces"]
    assert narrow == sorted(set(narrow))
    assert 0 < len(narrow) < (len(faces) + len(ball)) / 4
    assert max(narrow) < len(faces) + len(ball)
    (sentence,) = [w for w in result.report["warnings"] if "have no room" in w]
    assert f"faces {narrow[0]}" in sentence
    assert f"{result.edge_length:.4f}" in sentence
    roomy = quadloom.tile_surface(sphere(), 0.3)
    assert (roomy.report["narrow_faces"], roomy.edge_length) == ([], 0.3)


def test_steps_of_a_border_smaller_than_panels_do_not_crumple_them():
    # A barrel vault with a round opening cut out of its faces, stair by stair.
    vault = grid(60, 30, lambda u, v: (4 * u, -1.5 * math.cos(math.pi * v), 1.5 * math.sin(math.pi * v)))
    points, faces = polygons(vault)

    def is_kept(face) -> bool:
        x, y, z = points[face].mean(axis=0)
        along = math.atan2(z, -y) / math.pi
        return ((x - 2) / 0.8) ** 2 + (along / 0.3) ** 2 > 1

    mesh = quadloom.Mesh.from_polygons(points, [face for face in faces if is_kept(face)])
    result = quadloom.tile_surface(mesh, target_panels=300)
    assert len(result.panels) == pytest.approx(300, rel=0.1)
    assert result.report["edge_length_spread"] < 0.19
    # Only that they are cut off is said, with the distance at which.
    assert [item["bar"] for item in result.report["missed_bars"]] == ["borders"]
    off = max(off_border(mesh, result.mesh), off_border(result.mesh, mesh))
    found = missed(result, "borders")
    points, faces = polygons(result.mesh)
    pairs = np.array(sorted({tuple(sorted(pair)) for pair in edge_uses(faces)}))
    edge = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1).mean()
    assert found["measured"] == pytest.approx(off / edge)
    assert found["measured"] > 0.05


def test_a_number_of_panels_is_changed_rather_than_a_bar_missed():
    # The same, by number: patches of so few squares cannot be flat, even panels can.
    twisted = grid(12, 12, lambda u, v: (4 * u, 4 * v, 3 * (u - 0.5) * (v - 0.5)))
    result = quadloom.tile_surface(twisted, target_panels=16, partition="patches")
    assert len(result.panels) == pytest.approx(16, rel=0.2)
    assert result.report["missed_bars"] == []
    assert result.patch_graph is None
    assert any("the panels are even instead" in w for w in result.report["warnings"])
