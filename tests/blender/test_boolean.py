"""`quadloom.boolean`: what it makes, what it leaves alone, and when it says no."""

import bpy
import numpy as np
import pytest
import quadloom
import shapes
from conftest import refused

OPERATIONS = ["union", "difference", "intersection"]
SIGNS = {"union": "A \N{UNION} B", "difference": "A \N{MINUS SIGN} B", "intersection": "A \N{INTERSECTION} B"}


def mesh_of(obj: bpy.types.Object) -> quadloom.Mesh:
    verts, faces = shapes.arrays(obj)
    return quadloom.Mesh.from_polygons(verts.astype(float), faces)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_succeeds_with_a_closed_mesh_of_quads(balls, operation):
    assert bpy.ops.quadloom.boolean(operation=operation) == {"FINISHED"}
    made = bpy.context.active_object
    verts, faces = shapes.arrays(made)
    assert made.name == SIGNS[operation]
    assert {len(face) for face in faces} == {4}
    assert shapes.is_closed(faces)
    assert len(verts) - 2 * len(faces) + len(faces) == 2, "Euler characteristic of a sphere"
    assert not made.data.validate(), "Blender found something to correct"


@pytest.mark.parametrize("operation", OPERATIONS)
def test_the_volume_is_that_of_the_exact_boolean(balls, operation):
    a, b = balls
    exact = a.copy()
    exact.data = a.data.copy()
    bpy.context.scene.collection.objects.link(exact)
    modifier = exact.modifiers.new("exact", "BOOLEAN")
    modifier.operation = {"union": "UNION", "difference": "DIFFERENCE", "intersection": "INTERSECT"}[operation]
    modifier.object = b
    modifier.solver = "EXACT"
    evaluated = exact.evaluated_get(bpy.context.evaluated_depsgraph_get())
    expected = shapes.volume(*shapes.arrays(evaluated))
    shapes.choose(a, b)
    bpy.ops.quadloom.boolean(operation=operation)
    assert shapes.volume(*shapes.arrays(bpy.context.active_object)) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_the_result_is_the_api_result(balls, operation):
    expected = quadloom.boolean(*map(mesh_of, balls), operation=operation).mesh
    bpy.ops.quadloom.boolean(operation=operation)
    verts, faces = shapes.arrays(bpy.context.active_object)
    assert np.array_equal(verts, expected.positions.astype(np.float32))
    assert np.array_equal(np.ravel(faces), expected.corner_verts)


def test_kept_quads_are_bit_identical(balls):
    api = quadloom.boolean(*map(mesh_of, balls), operation="union")
    sources = [shapes.arrays(obj) for obj in balls]
    bpy.ops.quadloom.boolean()
    verts, faces = shapes.arrays(bpy.context.active_object)
    kept = 0
    for face, (operand, index) in zip(faces, api.face_source, strict=True):
        if index >= 0:
            source_verts, source_faces = sources[operand]
            assert verts[list(face)].tobytes() == source_verts[list(source_faces[index])].tobytes()
            kept += 1
    assert kept == api.report["faces_kept"] > 400


def test_the_result_is_selected_and_the_inputs_hidden_and_unaltered(balls):
    before = [shapes.fingerprint(obj) for obj in balls]
    bpy.ops.quadloom.boolean()
    made = bpy.context.active_object
    assert list(bpy.context.selected_objects) == [made]
    assert made.name in bpy.context.collection.objects
    assert [shapes.fingerprint(obj) for obj in balls] == before
    assert all(obj.hide_get() and obj.hide_render for obj in balls)
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (3, 3), "no leftovers"


def test_the_inputs_stay_visible_when_asked(balls):
    bpy.ops.quadloom.boolean(hide_inputs=False)
    assert not any(obj.hide_get() or obj.hide_render for obj in balls)


def test_the_curve_is_marked_sharp_and_selected(balls):
    bpy.ops.quadloom.boolean()
    mesh = bpy.context.active_object.data
    sharp = {edge.index for edge in mesh.edges if edge.use_edge_sharp}
    assert sharp
    assert sharp == {edge.index for edge in mesh.edges if edge.select}


def test_the_curve_is_not_marked_when_asked(balls):
    bpy.ops.quadloom.boolean(mark_curve=False)
    assert not any(edge.use_edge_sharp for edge in bpy.context.active_object.data.edges)


def test_edits_in_edit_mode_count(balls):
    a, b = balls
    # Only A: Blender would take every selected object to Edit Mode.
    shapes.choose(a)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(0.5, 0.5, 0.5))
    b.select_set(True)
    assert bpy.ops.quadloom.boolean(operation="difference") == {"FINISHED"}
    assert bpy.context.mode == "OBJECT"
    verts, _ = shapes.arrays(bpy.context.active_object)
    assert np.abs(verts).max() <= 0.5001


def test_modifiers_count(balls):
    a, _ = balls
    scale = a.modifiers.new("half", "CAST")
    scale.cast_type, scale.factor, scale.use_radius_as_size, scale.size, scale.radius = "SPHERE", 1.0, False, 0.5, 0.0
    bpy.ops.quadloom.boolean(operation="intersection")
    verts, _ = shapes.arrays(bpy.context.active_object)
    assert np.linalg.norm(verts, axis=1).max() < 0.51


def test_options_reach_the_library(balls):
    expected = quadloom.boolean(*map(mesh_of, balls), retraction_distance=2.0, filler="matching", layout="separatrices")
    bpy.ops.quadloom.boolean(retraction_distance=2.0, filler="matching", layout="separatrices")
    verts, _ = shapes.arrays(bpy.context.active_object)
    assert np.array_equal(verts, expected.mesh.positions.astype(np.float32))


def test_running_twice_gives_the_same_mesh(balls):
    bpy.ops.quadloom.boolean(hide_inputs=False)
    first = shapes.arrays(bpy.context.active_object)
    shapes.choose(*balls)
    bpy.ops.quadloom.boolean(hide_inputs=False)
    second = shapes.arrays(bpy.context.active_object)
    assert np.array_equal(first[0], second[0])
    assert first[1] == second[1]


def test_refuses_an_empty_intersection(balls):
    balls[1].location.x = 10
    text = refused(bpy.ops.quadloom.boolean, operation="intersection")
    assert text
    assert not balls[0].hide_get()


def test_an_error_names_both_objects():
    inner, outer = shapes.add("Inner", shapes.ball(6), size=0.3), shapes.add("Outer", shapes.ball(6))
    shapes.choose(inner, outer)
    assert "“Inner” lies wholly inside “Outer”" in refused(bpy.ops.quadloom.boolean, operation="difference")


def test_refuses_one_object_and_says_so(balls):
    shapes.choose(balls[0])
    assert not bpy.ops.quadloom.boolean.poll()
    assert "exactly one other mesh" in refused(bpy.ops.quadloom.boolean)


def test_refuses_three_objects_and_says_so(balls):
    shapes.choose(*balls, shapes.add("C", shapes.box(2)))
    assert "now selected: 2" in refused(bpy.ops.quadloom.boolean)


def test_refuses_an_active_object_that_is_no_mesh(balls):
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    shapes.choose(empty, balls[0])
    assert "not a mesh" in refused(bpy.ops.quadloom.boolean)


def test_refuses_a_mesh_without_faces(balls):
    shapes.choose(balls[0], shapes.add("Nothing", (np.zeros((0, 3)), [])))
    assert "“Nothing” has no faces" in refused(bpy.ops.quadloom.boolean)


def test_undo_is_one_step(balls):
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.quadloom.boolean("EXEC_DEFAULT", True) == {"FINISHED"}
    assert len(bpy.data.objects) == 3
    bpy.ops.ed.undo()
    assert sorted(obj.name for obj in bpy.data.objects) == ["A", "B"]
    assert not any(obj.hide_get() or obj.hide_render for obj in bpy.data.objects)
    bpy.ops.ed.redo()
    assert len(bpy.data.objects) == 3
