"""`quadloom.select_defects` in Edit Mode."""

import bpy
import shapes
from conftest import refused
from test_bad_input import a_triangle_pair, an_ngon, inside_out, open_box, selected, two_boxes_at_a_vertex


def edit(shape) -> bpy.types.Object:
    obj = shapes.add("Mesh", shape)
    shapes.choose(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    return obj


def leave(obj: bpy.types.Object) -> dict[str, set]:
    bpy.ops.object.mode_set(mode="OBJECT")
    return selected(obj.data)


def test_selects_open_borders():
    shape, expected = open_box()
    obj = edit(shape)
    assert bpy.ops.quadloom.select_defects() == {"FINISHED"}
    assert leave(obj)["edges"] == expected["edges"]


def test_selects_vertices_where_surfaces_touch():
    shape, expected = two_boxes_at_a_vertex()
    obj = edit(shape)
    bpy.ops.quadloom.select_defects(kinds={"nonmanifold_verts"})
    assert leave(obj)["verts"] == expected["verts"]


def test_selects_faces_that_are_not_quads():
    for case in (a_triangle_pair, an_ngon):
        shape, expected = case()
        obj = edit(shape)
        bpy.ops.quadloom.select_defects(kinds={"triangles", "ngons"})
        assert leave(obj)["faces"] == expected["faces"]


def test_selects_parts_that_are_inside_out():
    shape, expected = inside_out()
    obj = edit(shape)
    bpy.ops.quadloom.select_defects()
    assert leave(obj)["faces"] == expected["faces"]


def test_selects_only_the_kinds_asked_for():
    obj = edit(open_box()[0])
    bpy.ops.quadloom.select_defects(kinds={"triangles"})
    assert not any(leave(obj).values())


def test_selects_nothing_on_a_sound_mesh():
    obj = edit(shapes.ball(6))
    assert bpy.ops.quadloom.select_defects() == {"FINISHED"}
    assert not any(leave(obj).values())


def test_extends_the_selection_when_asked():
    shape, expected = open_box()
    obj = edit(shape)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.quadloom.select_defects(extend=True)
    assert len(leave(obj)["edges"]) > len(expected["edges"])


def test_refuses_object_mode():
    shapes.choose(shapes.add("Mesh", shapes.box(1)))
    assert "Edit Mode" in refused(bpy.ops.quadloom.select_defects)
