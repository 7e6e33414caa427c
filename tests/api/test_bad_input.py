"""quadloom.boolean on bad input: each kind has its own code and names exactly its elements, worked out here by hand."""

from __future__ import annotations

import numpy as np
import pytest
import quadloom
from meshes import polygons, shipped

Polygons = tuple[np.ndarray, list[list[int]]]
Case = tuple[Polygons, str, str, object]
"""The mesh, the code, the kind of elements, and the elements: a set of indices or of vertex pairs."""


@pytest.fixture(scope="module")
def good() -> quadloom.Mesh:
    """A closed mesh about the origin, 1 across."""
    return shipped("osd_righthanded")


def sound() -> Polygons:
    """A cube of quads, to be damaged."""
    positions, faces = polygons(shipped("lagrange_cube_edge_sharp", move=(0.2, 0.1, 0.15)))
    return positions.copy(), faces


def sides(face: list[int]) -> set[frozenset[int]]:
    return {frozenset((face[k], face[(k + 1) % len(face)])) for k in range(len(face))}


def no_faces() -> Case:
    return (np.zeros((0, 3)), []), "empty", "faces", set()


def not_a_number() -> Case:
    positions, faces = sound()
    positions[[3, 8], 1] = np.nan, np.inf
    return (positions, faces), "not_finite", "verts", {3, 8}


def a_triangle_pair() -> Case:
    positions, faces = sound()
    a, b, c, d = faces.pop(4)
    faces += [[a, b, c], [a, c, d]]
    return (positions, faces), "not_quads", "faces", {len(faces) - 2, len(faces) - 1}


def an_ngon() -> Case:
    """A quad joined with the neighbour behind its first side."""
    positions, faces = sound()
    a, b, c, d = faces[0]
    other = next(face for face in faces[1:] if {a, b} <= set(face))
    at = other.index(a)  # the neighbour runs b a x y, as neighbours run against each other
    x, y = other[(at + 1) % 4], other[(at + 2) % 4]
    faces = [face for face in faces if face not in (faces[0], other)] + [[a, x, y, b, c, d]]
    return (positions, faces), "not_quads", "faces", {len(faces) - 1}


def a_repeated_corner() -> Case:
    positions, faces = sound()
    faces[6] = [faces[6][0], faces[6][1], faces[6][0], faces[6][3]]
    return (positions, faces), "degenerate", "faces", {6}


def a_doubled_face() -> Case:
    positions, faces = sound()
    faces.append(faces[10][2:] + faces[10][:2])
    return (positions, faces), "duplicate", "faces", {len(faces) - 1}


def a_fin() -> Case:
    """A face more on an edge that has two."""
    positions, faces = sound()
    a, b = faces[0][:2]
    count = len(positions)
    positions = np.concatenate([positions, 3 * positions[[a, b]]])
    faces.append([a, b, count + 1, count])
    return (positions, faces), "non_manifold", "edges", {frozenset((a, b))}


def a_hole() -> Case:
    positions, faces = sound()
    return (positions, faces), "open", "edges", sides(faces.pop(7))


def a_flipped_face() -> Case:
    positions, faces = sound()
    faces[7].reverse()
    return (positions, faces), "misoriented", "edges", sides(faces[7])


def two_parts_at_a_vertex() -> Case:
    positions, faces = sound()
    corner = int(positions.sum(axis=1).argmax())
    mirrored = 2 * positions[corner] - positions
    other = [[corner if v == corner else v + len(positions) for v in reversed(face)] for face in faces]
    # The second part's own corner would be loose: leave it where it is used.
    both = np.concatenate([positions, mirrored])
    return (both, faces + other), "non_manifold_vertex", "verts", {corner}


def a_face_on_a_line() -> Case:
    """Its corners at 0, 1/2, 1 and 1/4 of a stretch along an axis: nothing is rounded."""
    positions, faces = sound()
    start = positions[faces[9][0]].astype(np.float32).round(3)
    for vertex, part in zip(faces[9], (0, 0.5, 1, 0.25), strict=True):
        positions[vertex] = (*start[:2], part / 16)
    return (positions, faces), "zero_area", "faces", {9}


def inside_out() -> Case:
    positions, faces = sound()
    return (positions, [face[::-1] for face in faces]), "inside_out", "faces", set(range(len(faces)))


def a_part_in_a_part() -> Case:
    """It should face inwards, to bound a void."""
    positions, faces = sound()
    middle = (positions.min(axis=0) + positions.max(axis=0)) / 2
    inner = [[v + len(positions) for v in face] for face in faces]
    both = np.concatenate([positions, middle + (positions - middle) / 4])
    return (both, faces + inner), "inside_out", "faces", set(range(len(faces), 2 * len(faces)))


def too_small() -> Case:
    positions, faces = sound()
    return (1 + 1e-12 * positions, faces), "too_small", "verts", set(range(len(positions)))


CASES = [
    no_faces,
    not_a_number,
    a_triangle_pair,
    an_ngon,
    a_repeated_corner,
    a_doubled_face,
    a_fin,
    a_hole,
    a_flipped_face,
    two_parts_at_a_vertex,
    a_face_on_a_line,
    inside_out,
    a_part_in_a_part,
    too_small,
]


@pytest.mark.parametrize("position", [0, 1])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_is_refused_with_its_code_and_elements(case, position, good):
    shape, code, kind, elements = case()
    meshes = [good, good]
    meshes[position] = quadloom.Mesh.from_polygons(*shape)
    with pytest.raises(quadloom.InvalidMeshError) as caught:
        quadloom.boolean(*meshes)
    error = caught.value
    assert (error.code, error.mesh) == (code, position), error
    assert str(error).startswith("AB"[position])
    assert list(error.elements) == [kind]
    found = error.elements[kind].tolist()
    assert len(found) == len(elements)
    assert {frozenset(row) if kind == "edges" else row for row in found} == elements


@pytest.mark.parametrize("scale", [1e-30, 1e-6, 1e9, 1e30])
def test_any_scale_works(scale):
    """Powers of ten are not exact, so only the topology has to be the same."""
    pair = shipped("lagrange_cube_edge_sharp"), shipped("osd_righthanded", move=(0.2, 0.1, 0.15), scale=0.5)
    once = quadloom.boolean(*pair)
    scaled = quadloom.boolean(*(quadloom.Mesh(m.positions * scale, m.face_offsets, m.corner_verts) for m in pair))
    assert abs(len(scaled.mesh.positions) - len(once.mesh.positions)) < 0.02 * len(once.mesh.positions)
    assert scaled.report["faces_kept"] == once.report["faces_kept"]


def test_a_region_that_cannot_be_filled_names_the_faces_under_it():
    """Rings take annuli only: the part of B outside of A, all of it remade, is a disk."""
    a = shipped("lagrange_cube_edge_sharp")
    b = shipped("osd_torus", move=(0.0, 0.0, 0.0), scale=0.4)
    with pytest.raises(quadloom.InfeasibleError) as caught:
        quadloom.boolean(a, move_to_side(a, b), filler="rings", retraction_distance=10.0)
    error = caught.value
    assert (error.code, error.mesh) == ("no_fill", None)
    assert set(error.elements) <= {"a_faces", "b_faces"}
    assert sum(len(faces) for faces in error.elements.values())
    for mesh, kind in zip((a, b), ("a_faces", "b_faces"), strict=True):
        faces = error.elements.get(kind, np.empty(0, int))
        assert ((faces >= 0) & (faces < len(mesh.face_offsets) - 1)).all()
        assert len(np.unique(faces)) == len(faces)


def move_to_side(a: quadloom.Mesh, b: quadloom.Mesh) -> quadloom.Mesh:
    """B with its centre on the side of A."""
    return quadloom.Mesh(b.positions + (a.positions[:, 0].max(), 0.01, 0.02), b.face_offsets, b.corner_verts)
