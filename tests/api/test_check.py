"""quadloom.check: every kind of defect, with its elements."""

from __future__ import annotations

import meshcheck
import numpy as np
import pytest
import quadloom
from meshes import CUBE_FACES, ROOT, cube_positions, polygons, shipped

SHIPPED = sorted(
    path.relative_to(ROOT / "blend_fixtures" / "meshes") for path in (ROOT / "blend_fixtures" / "meshes").rglob("*.obj")
)


def test_a_sound_mesh_has_no_defects(cube):
    defects = quadloom.check(cube)
    assert not defects
    assert defects.is_valid
    assert defects.closed
    assert defects.manifold
    assert defects.pure_quad
    assert (defects.components, defects.euler) == (1, 2)
    assert defects.summary == "no defects"


def test_a_border_is_listed_but_is_no_defect():
    defects = quadloom.check(quadloom.Mesh.from_polygons(cube_positions(), CUBE_FACES[:5]))
    assert not defects
    assert not defects.closed
    assert defects.border_edges.tolist() == [[1, 3], [1, 5], [3, 7], [5, 7]]
    assert defects.summary == "no defects; 4 border edges"


def test_every_kind_of_index_arrives():
    two_cubes = np.vstack([cube_positions(), cube_positions() + 0.5, [[np.nan, 0, 0]]])
    faces = [*CUBE_FACES[:5], CUBE_FACES[5][::-1], *(np.array(CUBE_FACES) + 8).tolist(), CUBE_FACES[0], [0, 0, 1, 3]]
    defects = quadloom.check(quadloom.Mesh.from_polygons(two_cubes, faces))
    assert defects
    assert not defects.is_valid
    assert defects.nonfinite_verts.tolist() == defects.isolated_verts.tolist() == [16]
    assert defects.degenerate_faces.tolist() == [13]
    assert [0, 12] in defects.duplicate_faces.tolist()
    assert [0, 1] in defects.nonmanifold_edges.tolist()
    assert [5, 7] in defects.misoriented_edges.tolist()
    assert defects.self_intersecting_faces.shape[1] == 2
    assert "1 non-finite vertex, 1 vertex without a face" in defects.summary


def test_an_inside_out_component_is_named_with_its_faces():
    positions = np.vstack([cube_positions(), cube_positions() + 3])
    faces = CUBE_FACES + [[v + 8 for v in face[::-1]] for face in CUBE_FACES]
    (component,) = quadloom.check(quadloom.Mesh.from_polygons(positions, faces)).inside_out_components
    assert component.tolist() == [6, 7, 8, 9, 10, 11]


@pytest.mark.parametrize("path", SHIPPED, ids=str)
def test_agrees_with_the_judge_on_every_shipped_mesh(path):
    mesh = shipped(str(path.with_suffix("")))
    judged = meshcheck.topology(*polygons(mesh))
    defects = quadloom.check(mesh)
    found = {
        "components": defects.components,
        "euler": defects.euler,
        "boundary_edges": len(defects.border_edges),
        "nonmanifold_edges": len(defects.nonmanifold_edges),
        "flipped_edges": len(defects.misoriented_edges),
        "degenerate_faces": len(defects.degenerate_faces),
        "triangles": len(defects.triangles),
        "ngons": len(defects.ngons),
        "pure_quad": defects.pure_quad,
        "closed_manifold": defects.closed and defects.manifold,
    }
    if judged["degenerate_faces"]:
        # The judge counts a side that runs from a vertex to itself as an edge; quadloom does not.
        del found["euler"], found["nonmanifold_edges"]
    assert found == {name: judged[name] for name in found}
