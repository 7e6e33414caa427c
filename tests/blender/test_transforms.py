"""Object transforms: the world decides what overlaps, the result sits where A sits, and mirrors keep outside outside."""

import bpy
import numpy as np
import pytest
import shapes
from conftest import refused
from mathutils import Matrix

PLACES = {
    "moved": Matrix.Translation((0.3, -0.2, 0.1)),
    "turned": Matrix.Rotation(0.7, 4, "X") @ Matrix.Rotation(0.4, 4, "Z"),
    "stretched": Matrix.Diagonal((1.0, 1.4, 0.8, 1.0)),
    "mirrored": Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)),
    "all": Matrix.Translation((0.2, 0.1, 0)) @ Matrix.Rotation(0.5, 4, "Y") @ Matrix.Diagonal((1.2, -0.9, 1.1, 1.0)),
}


def world_volume_of_the_exact_boolean(a: bpy.types.Object, b: bpy.types.Object) -> float:
    """Volume of A minus B in the world by Blender's own solver, on copies with the transforms baked in."""
    baked = []
    for obj in (a, b):
        copy = bpy.data.objects.new("baked", obj.data.copy())
        copy.data.transform(obj.matrix_world)
        if obj.matrix_world.determinant() < 0:
            copy.data.flip_normals()
        bpy.context.scene.collection.objects.link(copy)
        baked.append(copy)
    modifier = baked[0].modifiers.new("exact", "BOOLEAN")
    modifier.operation, modifier.object, modifier.solver = "DIFFERENCE", baked[1], "EXACT"
    evaluated = baked[0].evaluated_get(bpy.context.evaluated_depsgraph_get())
    total = shapes.volume(*shapes.arrays(evaluated))
    for copy in baked:
        bpy.data.objects.remove(copy)
    return total


@pytest.mark.parametrize("place_b", PLACES)
@pytest.mark.parametrize("place_a", ["moved", "mirrored", "all"])
def test_difference_in_the_world(balls, place_a, place_b):
    a, b = balls
    a.matrix_world, b.matrix_world = PLACES[place_a], PLACES[place_b]
    bpy.context.view_layer.update()
    expected = world_volume_of_the_exact_boolean(a, b)
    shapes.choose(a, b)
    bpy.ops.quadloom.boolean(operation="difference")
    made = bpy.context.active_object
    verts, faces = shapes.arrays(made, world=True)
    # Blender shows the faces of a mirrored object turned, so its outward side has negative volume in the world.
    outward = np.sign(made.matrix_world.determinant())
    assert outward * shapes.volume(verts, faces) == pytest.approx(expected, rel=0.01)
    assert made.matrix_world == a.matrix_world, "bit for bit"


@pytest.mark.parametrize("operation", ["union", "difference"])
def test_a_shared_transform_changes_no_vertex(balls, operation):
    bpy.ops.quadloom.boolean(operation=operation, hide_inputs=False)
    expected = shapes.arrays(bpy.context.active_object)
    for obj in balls:
        obj.matrix_world = PLACES["all"]
    bpy.context.view_layer.update()
    shapes.choose(*balls)
    bpy.ops.quadloom.boolean(operation=operation)
    verts, faces = shapes.arrays(bpy.context.active_object)
    assert verts.tobytes() == expected[0].tobytes()
    assert faces == expected[1]


def test_kept_vertices_of_a_stay_under_any_transform(balls):
    a, b = balls
    a.matrix_world, b.matrix_world = PLACES["all"], PLACES["turned"]
    own = {v.tobytes() for v in shapes.arrays(a)[0]}
    bpy.ops.quadloom.boolean()
    made = {v.tobytes() for v in shapes.arrays(bpy.context.active_object)[0]}
    assert len(made & own) > 0.4 * len(own)


def test_a_parent_moves_its_child(balls):
    _, b = balls
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    b.parent, parent.location.x = parent, 10.0
    bpy.context.view_layer.update()
    assert refused(bpy.ops.quadloom.boolean, operation="intersection"), "they are apart"


def test_refuses_a_scale_of_zero(balls):
    balls[1].scale.z = 0.0
    bpy.context.view_layer.update()
    assert "“B” has a scale of zero" in refused(bpy.ops.quadloom.boolean)
