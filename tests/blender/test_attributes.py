"""Attributes: exact on kept faces, interpolated on new ones."""

import bpy
import numpy as np
import pytest
import quadloom
import shapes


@pytest.fixture
def source_faces(balls):
    """For each face of the union the (operand, face) it is, (-1, -1) when new, by the API on the same meshes."""
    meshes = []
    for obj in balls:
        verts, faces = shapes.arrays(obj)
        meshes.append(quadloom.Mesh.from_polygons(verts.astype(float), faces))
    return quadloom.boolean(*meshes, operation="union").face_source


def union() -> bpy.types.Object:
    assert bpy.ops.quadloom.boolean(operation="union") == {"FINISHED"}
    return bpy.context.active_object


def planar_uv(obj: bpy.types.Object, name: str) -> None:
    """UV = (x, y): linear, so that interpolation must reproduce it on flat faces and nearly on round ones."""
    layer = obj.data.uv_layers.new(name=name)
    for corner, loop in enumerate(obj.data.loops):
        layer.data[corner].uv = obj.data.vertices[loop.vertex_index].co.xy


def test_uvs_are_exact_on_kept_faces_and_follow_on_new_ones(balls, source_faces):
    for obj in balls:
        planar_uv(obj, "Planar")
    made = union()
    layer = made.data.uv_layers["Planar"]
    for face, (_, index) in zip(made.data.polygons, source_faces, strict=True):
        for corner in face.loop_indices:
            uv = np.array(layer.data[corner].uv)
            at = np.array(made.data.vertices[made.data.loops[corner].vertex_index].co.xy)
            if index >= 0:
                assert np.array_equal(uv, at)
            else:
                assert np.abs(uv - at).max() < 0.02


def test_every_uv_layer_is_carried_by_name(balls):
    planar_uv(balls[0], "OnlyA")
    planar_uv(balls[1], "OnlyB")
    assert {layer.name for layer in union().data.uv_layers} == {"OnlyA", "OnlyB"}


def test_materials_are_merged_without_duplicates(balls, source_faces):
    red, blue = bpy.data.materials.new("Red"), bpy.data.materials.new("Blue")
    for obj, slots in zip(balls, ([red], [blue, red]), strict=True):
        for material in slots:
            obj.data.materials.append(material)
    for face in balls[1].data.polygons:
        face.material_index = face.index % 2
    made = union()
    assert [slot.material for slot in made.material_slots] == [red, blue]
    for face, (operand, index) in zip(made.data.polygons, source_faces, strict=True):
        if operand == 0:
            assert face.material_index == 0
        elif operand == 1:
            assert made.material_slots[face.material_index].material == [blue, red][index % 2]


def test_an_operand_without_material_stays_without(balls, source_faces):
    balls[1].data.materials.append(bpy.data.materials.new("Red"))
    made = union()
    for face, (operand, _) in zip(made.data.polygons, source_faces, strict=True):
        if operand == 0:
            assert made.material_slots[face.material_index].material is None


def test_materials_linked_to_the_object_are_carried(balls):
    red = bpy.data.materials.new("Red")
    balls[0].data.materials.append(None)
    balls[0].material_slots[0].link = "OBJECT"
    balls[0].material_slots[0].material = red
    assert red in [slot.material for slot in union().material_slots]


def test_vertex_groups_are_carried_by_name(balls):
    a, b = balls
    group = a.vertex_groups.new(name="Shared")
    for vertex in a.data.vertices:
        group.add([vertex.index], (vertex.co.z + 1) / 2, "REPLACE")
    b.vertex_groups.new(name="OnlyB").add(range(len(b.data.vertices)), 0.25, "REPLACE")
    expected = {np.array(v.co).tobytes(): v.groups[0].weight for v in a.data.vertices}
    made = union()
    assert [g.name for g in made.vertex_groups] == ["Shared", "OnlyB"]
    exact = 0
    for vertex in made.data.vertices:
        weights = {made.vertex_groups[entry.group].name: entry.weight for entry in vertex.groups}
        key = np.array(vertex.co).tobytes()
        if key in expected:
            assert weights["Shared"] == expected[key]
            exact += 1
        elif set(weights) == {"Shared"}:
            assert weights["Shared"] == pytest.approx((vertex.co.z + 1) / 2, abs=0.03)
        elif set(weights) == {"OnlyB"}:
            assert weights["OnlyB"] == pytest.approx(0.25)
        else:
            assert set(weights) == {"Shared", "OnlyB"}, "a vertex of the curve"
    assert exact > 200


@pytest.mark.parametrize("domain", ["CORNER", "POINT"])
@pytest.mark.parametrize("data_type", ["FLOAT_COLOR", "BYTE_COLOR"])
def test_colors_are_carried(balls, domain, data_type):
    a, b = balls
    for obj, color in ((a, (0.2, 0.4, 0.6, 1.0)), (b, (0.8, 0.1, 0.3, 0.5))):
        layer = obj.data.color_attributes.new("Paint", data_type, domain)
        layer.data.foreach_set("color", np.tile(np.array(color, np.float32), len(layer.data)))
    given = {tuple(obj.data.color_attributes["Paint"].data[0].color) for obj in balls}
    made = union()
    layer = made.data.color_attributes["Paint"]
    assert (layer.domain, layer.data_type) == (domain, data_type)
    found = {tuple(item.color) for item in layer.data}
    assert given <= found
    if domain == "CORNER":
        assert all(min(np.abs(np.subtract(c, g)).max() for g in given) < 0.01 for c in found), "no mixing across the curve"
    assert made.data.color_attributes.active_color_name == "Paint"


def test_a_missing_color_is_white(balls, source_faces):
    layer = balls[0].data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    layer.data.foreach_set("color", np.zeros(4 * len(layer.data), np.float32))
    made = union()
    for face, (operand, _) in zip(made.data.polygons, source_faces, strict=True):
        if operand >= 0:
            color = tuple(made.data.color_attributes["Paint"].data[face.loop_start].color)
            assert color == ((0, 0, 0, 0) if operand == 0 else (1, 1, 1, 1))


def test_attributes_of_unlike_types_keep_the_first(balls):
    balls[0].data.attributes.new("Value", "FLOAT", "POINT")
    balls[1].data.attributes.new("Value", "INT", "FACE")
    layer = union().data.attributes["Value"]
    assert (layer.data_type, layer.domain) == ("FLOAT", "POINT")


@pytest.mark.parametrize("mark", ["use_seam", "use_edge_sharp", "crease_edge", "bevel_weight_edge"])
def test_edge_marks_are_carried_on_kept_edges(balls, mark):
    def read(mesh: bpy.types.Mesh) -> dict[frozenset, float]:
        if mark.startswith("use"):
            values = [float(getattr(edge, mark)) for edge in mesh.edges]
        else:
            values = [item.value for item in mesh.attributes[mark].data]
        ends = [frozenset(np.array(mesh.vertices[v].co).tobytes() for v in edge.vertices) for edge in mesh.edges]
        return dict(zip(ends, values, strict=True))

    a, _ = balls
    if not mark.startswith("use"):
        a.data.attributes.new(mark, "FLOAT", "EDGE")
    for edge in a.data.edges:
        # The meridian x = 0: away from the cut in part, through it in part.
        if all(abs(a.data.vertices[v].co.x) < 1e-5 for v in edge.vertices):
            if mark.startswith("use"):
                setattr(edge, mark, True)
            else:
                a.data.attributes[mark].data[edge.index].value = 0.75
    before = read(a.data)
    bpy.ops.quadloom.boolean(mark_curve=False)
    after = read(bpy.context.active_object.data)
    common = before.keys() & after.keys()
    assert len(common) > 500
    assert all(before[edge] == after[edge] for edge in common)
    assert sum(after[edge] > 0 for edge in common) > 10


def test_a_marked_line_goes_on_through_the_new_faces():
    a = shapes.add("A", shapes.box(8))
    b = shapes.add("B", shapes.box(4), offset=(0.3, 0.2, 1.0), size=0.45)
    for edge in a.data.edges:
        p, q = (a.data.vertices[v].co for v in edge.vertices)
        edge.use_edge_sharp = sum(abs(abs(p[k]) - 1) < 1e-6 and abs(abs(q[k]) - 1) < 1e-6 for k in range(3)) >= 2
    shapes.choose(a, b)
    bpy.ops.quadloom.boolean(operation="union", mark_curve=False)
    mesh = bpy.context.active_object.data
    sharp = [[mesh.vertices[v].co for v in edge.vertices] for edge in mesh.edges if edge.use_edge_sharp]
    length = sum((p - q).length for p, q in sharp)
    assert length == pytest.approx(24.0, rel=0.001), "the twelve edges of the cube"


def test_smooth_shading_is_carried_by_face(balls, source_faces):
    for face in balls[0].data.polygons:
        face.use_smooth = True
    for face in balls[1].data.polygons:
        face.use_smooth = False
    made = union()
    for face, (operand, _) in zip(made.data.polygons, source_faces, strict=True):
        if operand >= 0:
            assert face.use_smooth == (operand == 0)


def test_custom_normals_are_carried(balls, source_faces):
    a, _ = balls
    for face in a.data.polygons:
        face.use_smooth = True
    rng = np.random.default_rng(1)
    tilt = shapes.arrays(a)[0] + 0.3 * rng.standard_normal((len(a.data.vertices), 3))
    tilt /= np.linalg.norm(tilt, axis=1, keepdims=True)
    a.data.normals_split_custom_set([tilt[loop.vertex_index] for loop in a.data.loops])
    given = {np.array(v.co).tobytes(): tilt[v.index] for v in a.data.vertices}
    made = union()
    assert made.data.has_custom_normals
    for face, (operand, _) in zip(made.data.polygons, source_faces, strict=True):
        if operand == 0:
            for corner in face.loop_indices:
                at = np.array(made.data.vertices[made.data.loops[corner].vertex_index].co).tobytes()
                assert np.dot(made.data.corner_normals[corner].vector, given[at]) > 0.999, "Blender keeps 16 bits"
