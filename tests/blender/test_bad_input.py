"""Bad input: each defect has its own sentence, names the object, and ends up selected on it."""

import bpy
import numpy as np
import pytest
import shapes
from conftest import refused


def open_box():
    verts, faces = shapes.box(3)
    hole = faces.pop(0)
    ring = {frozenset((hole[k], hole[(k + 1) % 4])) for k in range(4)}
    return (verts, faces), {"edges": ring}


def four_faces_at_an_edge():
    """Two boxes that share one edge: four faces meet there."""
    verts, faces = shapes.box(1)
    shifted = verts + np.array((2.0, 2.0, 0.0))
    index = {tuple(v): k for k, v in enumerate(verts)}
    merged, names = list(verts), []
    for v in shifted:
        if tuple(v) not in index:
            index[tuple(v)] = len(merged)
            merged.append(v)
        names.append(index[tuple(v)])
    faces = faces + [[names[v] for v in face] for face in faces]
    shared = frozenset(names[k] for k in range(8) if names[k] < 8)
    return (np.array(merged), faces), {"edges": {shared}}


def two_boxes_at_a_vertex():
    verts, faces = shapes.box(2)
    corner = int(np.argmax(verts.sum(axis=1)))
    other = [[corner if np.allclose(verts[v], -verts[corner]) else v + len(verts) for v in face] for face in faces]
    merged = np.concatenate([verts, verts + 2.0])
    used = sorted({v for face in faces + other for v in face})
    rename = {v: k for k, v in enumerate(used)}
    return (merged[used], [[rename[v] for v in face] for face in faces + other]), {"verts": {rename[corner]}}


def one_flipped_face():
    verts, faces = shapes.box(3)
    faces[4] = faces[4][::-1]
    ring = {frozenset((faces[4][k], faces[4][(k + 1) % 4])) for k in range(4)}
    return (verts, faces), {"edges": ring}


def inside_out():
    verts, faces = shapes.box(2)
    return (verts, [face[::-1] for face in faces]), {"faces": set(range(len(faces)))}


def a_triangle_pair():
    verts, faces = shapes.box(3)
    a, b, c, d = faces.pop(0)
    faces += [[a, b, c], [a, c, d]]
    return (verts, faces), {"faces": {len(faces) - 2, len(faces) - 1}}


def an_ngon():
    """Two neighbouring faces joined into one of six corners."""
    verts, faces = shapes.box(3)
    first = faces[0]
    second = next(face for face in faces[1:] if len(set(face) & set(first)) == 2)
    # Start each face behind the shared edge: first runs ... p q, second q p ...
    p = next(v for v, after in zip(first, first[1:] + first[:1], strict=True) if {v, after} <= set(second))
    at = first.index(p)
    ring = first[at + 1 :] + first[: at + 1]
    at = second.index(p)
    ring += (second[at + 1 :] + second[:at])[:2]
    return (verts, [face for face in faces if face not in (first, second)] + [ring]), {"faces": {len(faces) - 2}}


def a_fold():
    """A vertex pulled through the opposite side."""
    verts, faces = shapes.box(4)
    top = int(np.argmin(np.abs(verts - (0.0, 0.0, 1.0)).sum(axis=1)))
    verts[top] = (0.0, 0.0, -1.5)
    pulled = {k for k, face in enumerate(faces) if top in face}
    bottom = int(np.argmin(np.abs(verts - (0.0, 0.0, -1.0)).sum(axis=1)))
    return (verts, faces), {"faces": pulled | {k for k, face in enumerate(faces) if bottom in face}}


def a_box_in_a_box():
    """The inner one faces outwards as well, so it bounds no void."""
    verts, faces = shapes.box(2)
    inner = [[v + len(verts) for v in face] for face in faces]
    shape = np.concatenate([verts, 0.4 * verts]), faces + inner
    return shape, {"faces": set(range(len(faces), 2 * len(faces)))}


CASES = [
    open_box,
    four_faces_at_an_edge,
    two_boxes_at_a_vertex,
    one_flipped_face,
    inside_out,
    a_triangle_pair,
    an_ngon,
    a_fold,
    a_box_in_a_box,
]


def selected(mesh: bpy.types.Mesh) -> dict[str, set]:
    return {
        "verts": {v.index for v in mesh.vertices if v.select},
        "edges": {frozenset(e.vertices) for e in mesh.edges if e.select},
        "faces": {f.index for f in mesh.polygons if f.select},
    }


@pytest.mark.parametrize("as_operand", ["A", "B"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_refuses_and_selects(case, as_operand):
    shape, expected = case()
    bad = shapes.add("Bad", shape)
    good = shapes.add("Good", shapes.ball(8), offset=(1.0, 0.1, 0.2))
    assert [len(p.vertices) for p in bad.data.polygons] == [len(f) for f in shape[1]]
    shapes.choose(*((bad, good) if as_operand == "A" else (good, bad)))
    before = [shapes.fingerprint(obj) for obj in (bad, good)]
    text = refused(bpy.ops.quadloom.boolean)
    assert "“Bad”" in text
    assert "“Good”" not in text
    assert bpy.context.view_layer.objects.active is bad
    found = selected(bad.data)
    for kind, elements in expected.items():
        assert found[kind] == elements
    mode = dict(zip(("verts", "edges", "faces"), bpy.context.tool_settings.mesh_select_mode, strict=True))
    assert [kind for kind, on in mode.items() if on] == list(expected)
    assert [shapes.fingerprint(obj) for obj in (bad, good)] == before


def test_the_sentences_differ():
    good = shapes.add("Good", shapes.ball(8), offset=(1.0, 0.1, 0.2))
    sentences = set()
    for case in CASES:
        bad = shapes.add("Bad", case()[0])
        shapes.choose(bad, good)
        sentences.add("".join(c for c in refused(bpy.ops.quadloom.boolean).split("(")[0] if not c.isdigit()))
        bpy.data.objects.remove(bad)
    assert len(sentences) >= len(CASES) - 2, "triangles and n-gons may share one, and parts that face the wrong way"


def test_a_region_that_cannot_be_filled_is_selected_on_the_object_it_lies_on():
    """Rings take annuli only. What sticks out of the small ball is remade from its rim to its pole: a disk."""
    big = shapes.add("Big", shapes.box(8))
    small = shapes.add("Small", shapes.ball(2), offset=(1.01, 0.03, 0.02), size=0.3)
    shapes.choose(big, small)
    text = refused(bpy.ops.quadloom.boolean, filler="rings")
    assert "selected on “Small”" in text
    assert "“Big”" not in text.rsplit("(", 1)[1]
    found = selected(small.data)["faces"]
    verts, faces = shapes.arrays(small)
    assert found == {k for k, face in enumerate(faces) if verts[list(face), 0].max() > 1.0}


def test_refuses_and_selects_in_edit_mode():
    shape, expected = open_box()
    bad = shapes.add("Bad", shape)
    shapes.choose(bad, shapes.add("Good", shapes.ball(8), offset=(1.0, 0.1, 0.2)))
    bpy.ops.object.mode_set(mode="EDIT")
    refused(bpy.ops.quadloom.boolean)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert selected(bad.data)["edges"] == expected["edges"]


def test_a_position_that_is_no_number_is_refused():
    verts, faces = shapes.box(3)
    bad = shapes.add("Bad", (verts, faces))
    bad.data.vertices[5].co = (float("nan"), 0.0, 0.0)
    shapes.choose(bad, shapes.add("Good", shapes.ball(8), offset=(1.0, 0.1, 0.2)))
    assert "“Bad”" in refused(bpy.ops.quadloom.boolean)
    assert selected(bad.data)["verts"] == {5}


def test_topology_changed_by_a_modifier_is_said_instead_of_selected():
    shape, _ = open_box()
    bad = shapes.add("Bad", shape)
    bad.modifiers.new("split", "SUBSURF").levels = 1
    shapes.choose(bad, shapes.add("Good", shapes.ball(8), offset=(1.0, 0.1, 0.2)))
    assert "modifiers" in refused(bpy.ops.quadloom.boolean)
