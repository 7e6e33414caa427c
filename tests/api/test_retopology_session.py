"""quadloom.RetopologySession: the same as retopologize at first, local after edits; templates; fields."""

from __future__ import annotations

import itertools
import json

import meshcheck
import numpy as np
import pytest
import quadloom
from meshes import polygons
from test_retopology import sides

AROUND, ACROSS = 60, 30
FACES = 1500


@pytest.fixture(scope="module")
def torus() -> quadloom.Mesh:
    u, v = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, 2 * np.pi * np.arange(ACROSS) / ACROSS, indexing="ij")
    ring = 2 + 0.7 * np.cos(v)
    positions = np.stack([ring * np.cos(u), ring * np.sin(u), 0.7 * np.sin(v)], axis=-1).reshape(-1, 3)
    faces = [
        [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i, j in itertools.product(range(AROUND), range(ACROSS))
    ]
    return quadloom.Mesh.from_polygons(positions, faces)


def at(i: int, j: int) -> int:
    return i % AROUND * ACROSS + j % ACROSS


def path(i: int, j: int, n: int) -> np.ndarray:
    """(n, 2) edges the long way round."""
    return np.array([[at(i + k, j), at(i + k + 1, j)] for k in range(n)], np.int32)


def same(first: quadloom.RetopologyResult, second: quadloom.RetopologyResult) -> bool:
    pairs = ((first.mesh.positions, second.mesh.positions), (first.mesh.corner_verts, second.mesh.corner_verts),
             (first.feature_edges, second.feature_edges), (first.corner_source.weights, second.corner_source.weights),
             (first.base.positions, second.base.positions))  # fmt: skip
    return all(np.array_equal(a, b) for a, b in pairs)


def judged(mesh: quadloom.Mesh, marks: np.ndarray, result: quadloom.RetopologyResult) -> None:
    """What holds for every result: valid, and the marks are edges of it, chain by chain."""
    found = meshcheck.topology(*polygons(result.mesh))
    assert found["pure_quad"]
    assert found["euler"] == 0
    assert found["closed_manifold"]
    assert result.report["faces"] == pytest.approx(FACES, rel=0.05)
    marked = {frozenset(edge) for edge in marks.tolist()}
    assert {frozenset(edge) for edge in result.feature_source.tolist()} <= marked
    a, b = (mesh.positions[marks[:, k]] for k in (0, 1))
    p, q = (result.mesh.positions[result.feature_edges[:, k]] for k in (0, 1))
    middle, along = ((a + b) / 2)[:, None], (q - p)[None]
    t = np.clip(((middle - p[None]) * along).sum(axis=2) / (along**2).sum(axis=2), 0, 1)
    away = np.linalg.norm(middle - p[None] - t[..., None] * along, axis=2).min(axis=1)
    edge = (4 * np.pi**2 * 2 * 0.7 / FACES) ** 0.5
    assert (away < 0.05 * edge).all()
    assert result.report["chains"] == len(np.unique(result.feature_chain))


def test_a_new_session_gives_what_retopologize_gives(torus):
    marks = np.concatenate([path(10, 5, 8), path(30, 20, 6)])
    session = quadloom.RetopologySession(torus, marks, target_faces=FACES)
    assert same(session.quads(), quadloom.retopologize(torus, marks, target_faces=FACES, improve=False))
    assert same(session.quads(), session.quads())
    assert session.quads().report["base_triangles_edited"] is None
    np.testing.assert_array_equal(session.feature_edges, marks)
    base, result = session.base(), session.quads()
    np.testing.assert_array_equal(base.mesh.positions, result.base.positions)
    np.testing.assert_array_equal(base.edges, result.base_edges)


def test_edits_are_local_and_keep_every_promise(torus):
    marks = path(10, 5, 8)
    session = quadloom.RetopologySession(torus, marks, target_faces=FACES, base_vertices=200)
    before = {tuple(p) for p in session.base().mesh.positions.tolist()}
    local = 0
    for change, marks in (
        (lambda: session.add_features(path(30, 20, 6)), np.concatenate([path(10, 5, 8), path(30, 20, 6)])),
        (lambda: session.move_features(path(10, 5, 8), path(11, 9, 8)), np.concatenate([path(30, 20, 6), path(11, 9, 8)])),
        (lambda: session.remove_features(path(33, 20, 3)), np.concatenate([path(30, 20, 3), path(11, 9, 8)])),
        (lambda: session.set_features(path(11, 9, 8)), path(11, 9, 8)),
    ):
        done = change()
        assert done["removed"] > 0
        local += not done["whole"]
        result = session.quads()
        judged(torus, marks, result)
        if not done["whole"]:
            assert result.report["base_triangles_edited"] == done["added"]
    assert local >= 3
    after = {tuple(p) for p in session.base().mesh.positions.tolist()}
    assert len(before & after) > 0.4 * len(before), "most base vertices stay where they are"
    assert session.set_features(path(11, 9, 8)) == {"removed": 0, "added": 0, "whole": False}


def test_quads_away_from_an_edit_stay_bit_for_bit(torus):
    marks = np.concatenate([path(10, 5, 8), path(30, 20, 6)])
    session = quadloom.RetopologySession(torus, marks, target_faces=FACES, base_vertices=200)
    before = session.quads()
    assert before.report["patches_kept"] == 0
    for moved in (path(11, 9, 8), path(14, 12, 5)):
        marks = np.concatenate([moved, path(30, 20, 6)])
        assert not session.set_features(marks)["whole"]
        after = session.quads()
        judged(torus, marks, after)
        assert after.report["patches_kept"] > 0.5 * after.report["patches"]
        old, new = ({tuple(p) for p in result.mesh.positions.tolist()} for result in (before, after))
        assert len(old & new) > 0.5 * len(new)
        # What moved lies near what was edited.
        changed = np.array(sorted(new - old))
        edited = torus.positions[np.unique(moved)]
        away = np.linalg.norm(changed[:, None] - edited[None], axis=2).min(axis=1)
        assert away.max() < 0.5 * np.ptp(torus.positions[:, 0])
        before = after


def test_the_base_is_sound_after_any_number_of_edits(torus):
    rng = np.random.default_rng(4)
    curves = [path(6 * k, 3 * k % ACROSS, 5) for k in range(8)]
    session = quadloom.RetopologySession(torus, np.concatenate(curves), target_faces=FACES, base_vertices=150)
    local = 0
    for _ in range(25):
        k, turn = int(rng.integers(8)), int(rng.integers(1, 4))
        moved = (curves[k] + turn * ACROSS) % (AROUND * ACROSS)
        taken = {frozenset(edge) for j, curve in enumerate(curves) if j != k for edge in curve.tolist()}
        if taken & {frozenset(edge) for edge in moved.tolist()}:
            continue
        local += not session.set_features(np.concatenate([*curves[:k], moved, *curves[k + 1 :]]))["whole"]
        curves[k] = moved
        base = session.base()
        assert {frozenset(side) for side in sides(base.mesh).tolist()} == {frozenset(edge) for edge in base.edges.tolist()}
        found = meshcheck.topology(*polygons(base.mesh))
        assert found["closed_manifold"]
        assert found["euler"] == 0
    assert local > 10
    judged(torus, np.concatenate(curves), session.quads())


def test_a_draft_has_the_quads_of_the_result(torus):
    session = quadloom.RetopologySession(torus, path(10, 5, 8), target_faces=FACES)
    draft, result = session.quads(draft=True), session.quads()
    judged(torus, path(10, 5, 8), draft)
    assert draft.report["patches"] == result.report["patches"]
    assert draft.report["faces"] == result.report["faces"]
    assert draft.report["angle_deviation"] >= result.report["angle_deviation"]


def test_an_edit_that_is_refused_changes_nothing(torus):
    session = quadloom.RetopologySession(torus, path(10, 5, 8), target_faces=FACES)
    before = session.quads()
    with pytest.raises(quadloom.QuadloomError) as caught:
        session.add_features([[0, 5 * ACROSS]])
    assert caught.value.code == "feature_not_edge"
    with pytest.raises(quadloom.QuadloomError) as caught:
        session.remove_features(path(9, 5, 2))
    assert caught.value.code == "feature_not_marked"
    assert caught.value.elements["features"].tolist() == [0]
    with pytest.raises(quadloom.QuadloomError) as caught:
        session.add_features(path(10, 5, 1))
    assert caught.value.code == "feature_repeated"
    with pytest.raises(quadloom.Cancelled):
        session.set_features(path(20, 3, 9), progress=lambda stage, fraction: False)
    assert same(session.quads(), before)
    np.testing.assert_array_equal(session.feature_edges, path(10, 5, 8))


def test_a_symmetric_session_stays_symmetric(torus):
    across = path(0, 0, AROUND)
    session = quadloom.RetopologySession(torus, across, target_faces=FACES, symmetry="z")
    marks = np.concatenate([across, path(10, 6, 9), path(10, ACROSS - 6, 9)])
    session.set_features(marks)
    result = session.quads()
    positions = result.mesh.positions
    np.testing.assert_allclose(positions[result.mirror], positions * (1, 1, -1), atol=1e-12)
    with pytest.raises(quadloom.QuadloomError) as caught:
        session.add_features(path(40, 6, 2))
    assert caught.value.code == "features_not_symmetric"


def test_a_template_is_laid_over_the_pair_nearest_to_a_point(torus):
    session = quadloom.RetopologySession(torus, path(10, 5, 8), target_faces=FACES)
    plain = session.quads()
    place = torus.positions[at(40, 3)]
    result = session.quads(templates=[(place.tolist(), "knuckle")])
    judged(torus, path(10, 5, 8), result)
    assert np.array_equal(result.base.positions, plain.base.positions), "the base stays"
    # The knuckle has four vertices of valence 3 around its middle and four of valence 5 about them.
    valence = np.bincount(result.mesh.corner_verts)
    odd = result.mesh.positions[valence != 4]
    near = np.linalg.norm(odd - place, axis=1) < 0.8
    assert near.sum() >= 8
    again = quadloom.retopologize(
        torus, path(10, 5, 8), target_faces=FACES, templates=[(place.tolist(), "knuckle")], improve=False
    )
    assert same(again, result)
    # By the number of the base edge as well.
    middles = np.array([points[len(points) // 2] for points in result.base_paths])
    free = np.flatnonzero(result.base_chain < 0)
    edge = int(free[np.linalg.norm(middles[free] - place, axis=1).argmin()])
    assert quadloom.retopologize(torus, path(10, 5, 8), target_faces=FACES, templates=[(edge, "knuckle", 1)]).report["faces"]


def test_templates_of_ones_own_come_from_a_file(torus):
    book = json.loads(quadloom.template_catalogue())
    assert [template["name"] for template in book["templates"]] == ["plain", "knuckle"]
    two = {"name": "two", "sides": [[0, 1, 2], [2, 3], [3, 4, 5], [5, 0]], "quads": [[0, 1, 4, 5], [1, 2, 3, 4]]}
    own = json.dumps({"templates": [*book["templates"], two]})
    place = torus.positions[at(40, 3)].tolist()
    result = quadloom.retopologize(torus, target_faces=FACES, catalogue=own, templates=[(place, "two", 1)])
    assert meshcheck.topology(*polygons(result.mesh))["closed_manifold"]


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"templates": [((0, 0, 0), "none")]}, "no template named"),
        ({"templates": [(10**6, "knuckle")]}, "no diagonal of a pair"),
        ({"templates": ["knuckle"]}, "templates must be pairs"),
        ({"templates": [((0, 0), "knuckle")]}, "templates must be pairs"),
        ({"catalogue": "{"}, "catalogue cannot be read"),
        ({"catalogue": json.dumps({"templates": [{"name": "t", "sides": [[0, 1]], "quads": []}]})}, "four sides"),
    ],
)
def test_bad_templates_are_refused_with_a_reason(torus, options, says):
    with pytest.raises(quadloom.QuadloomError, match=says) as caught:
        quadloom.retopologize(torus, target_faces=FACES, **options)
    assert caught.value.code == "option"


def test_a_field_is_one_on_its_feature_harmonic_and_zero_on_the_others(torus):
    first, second = path(0, 5, AROUND), path(0, 20, AROUND)
    session = quadloom.RetopologySession(torus, np.concatenate([first, second]), target_faces=FACES)
    field = session.field(first)
    assert field.shape == (len(torus.positions),)
    assert (field[first] == 1).all()
    assert (field[second] == 0).all()
    assert field.min() >= -1e-9
    assert field.max() <= 1 + 1e-9
    # The base's own vertices are zero, so that only part of the surface is above.
    grid = field.reshape(AROUND, ACROSS)
    assert 0.1 < grid[:, 6].mean() < 1
    assert grid[:, 6].mean() > grid[:, 9].mean()
    with pytest.raises(quadloom.QuadloomError):
        session.field([[0, 5 * ACROSS]])
