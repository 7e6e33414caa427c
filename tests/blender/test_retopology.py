"""`quadloom.retopologize`: what it makes, which marks survive, what is carried, and when it says no."""

import json
import math

import bpy
import numpy as np
import pytest
import quadloom
import shapes
from conftest import refused
from mathutils import Matrix

FACES = 700
MARKS = ["sharp", "seam", "crease", "bevel", "freestyle"]
NO_SOURCES = dict.fromkeys([*MARKS, "selected", "uv_borders", "material_borders", "detect"], False)


def retopologize(obj: bpy.types.Object, **options) -> bpy.types.Object:
    shapes.choose(obj)
    assert bpy.ops.quadloom.retopologize(**{"target_faces": FACES, **options}) == {"FINISHED"}
    return bpy.context.active_object


def report(made: bpy.types.Object) -> dict:
    return json.loads(made["quadloom_report"])


def pairs(faces) -> list[tuple[int, int]]:
    return [(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))]


def euler(verts, faces) -> int:
    return len(verts) - len({frozenset(pair) for pair in pairs(faces)}) + len(faces)


def length(mesh: bpy.types.Mesh, chosen) -> float:
    return sum((mesh.vertices[a].co - mesh.vertices[b].co).length for a, b in (mesh.edges[k].vertices for k in chosen))


def ring(obj: bpy.types.Object, axis: int = 2, at: float = 0.0) -> list[int]:
    """The edges in a plane."""
    verts, _ = shapes.arrays(obj)
    return [e.index for e in obj.data.edges if np.abs(verts[list(e.vertices), axis] - at).max() < 1e-6]


def mark(mesh: bpy.types.Mesh, kind: str, edges) -> None:
    if kind in {"sharp", "seam"}:
        for k in edges:
            setattr(mesh.edges[k], {"sharp": "use_edge_sharp", "seam": "use_seam"}[kind], True)
    elif kind == "freestyle":
        if hasattr(mesh.edges[0], "use_freestyle_mark"):
            for k in edges:
                mesh.edges[k].use_freestyle_mark = True
        else:
            layer = mesh.attributes.new("freestyle_edge", "BOOLEAN", "EDGE")
            for k in edges:
                layer.data[k].value = True
    else:
        layer = mesh.attributes.new({"crease": "crease_edge", "bevel": "bevel_weight_edge"}[kind], "FLOAT", "EDGE")
        for k in edges:
            layer.data[k].value = 0.75


def marked(mesh: bpy.types.Mesh, kind: str) -> list[int]:
    if kind in {"sharp", "seam"}:
        return [e.index for e in mesh.edges if getattr(e, {"sharp": "use_edge_sharp", "seam": "use_seam"}[kind])]
    if kind == "freestyle" and hasattr(mesh.edges[0], "use_freestyle_mark"):
        return [e.index for e in mesh.edges if e.use_freestyle_mark]
    name = {"crease": "crease_edge", "bevel": "bevel_weight_edge", "freestyle": "freestyle_edge"}[kind]
    layer = mesh.attributes.get(name)
    values = [] if layer is None else [item.value for item in layer.data]
    if kind != "freestyle":
        assert {round(value, 5) for value in values} <= {0.0, 0.75}, "values are not mixed"
    return [k for k, value in enumerate(values) if value]


@pytest.fixture
def ball() -> bpy.types.Object:
    return shapes.add("Ball", shapes.ball(8))


@pytest.fixture
def cube() -> bpy.types.Object:
    return shapes.add("Cube", shapes.box(4))


def test_succeeds_with_a_closed_mesh_of_quads(ball):
    made = retopologize(ball)
    verts, faces = shapes.arrays(made)
    assert made.name == "Ball Quads"
    assert {len(face) for face in faces} == {4}
    assert shapes.is_closed(faces)
    assert euler(verts, faces) == 2
    assert len(faces) == pytest.approx(FACES, rel=0.05)
    assert shapes.volume(verts, faces) == pytest.approx(shapes.volume(*shapes.arrays(ball)), rel=0.02)
    assert not made.data.validate(), "Blender found something to correct"


def test_the_result_is_the_api_result(cube):
    verts, faces = shapes.arrays(cube)
    mesh = quadloom.Mesh.from_polygons(verts.astype(float), faces)
    expected = quadloom.retopologize(mesh, target_faces=FACES, detect=True).mesh
    verts, faces = shapes.arrays(retopologize(cube))
    assert np.array_equal(verts, expected.positions.astype(np.float32))
    assert np.array_equal(np.ravel(faces), expected.corner_verts)


def test_triangles_and_ngons_succeed():
    """A prism of twelve sides: its ends are n-gons, its sides triangles and quads."""
    turn = [(math.cos(k * math.pi / 6), math.sin(k * math.pi / 6)) for k in range(12)]
    verts = np.array([(x, y, z) for z in (-1, 1) for x, y in turn])
    faces = [list(range(11, -1, -1)), list(range(12, 24))]
    for k in range(12):
        a, b = k, (k + 1) % 12
        faces += [[a, b, b + 12, a + 12]] if k % 2 else [[a, b, b + 12], [a, b + 12, a + 12]]
    prism = shapes.add("Prism", (verts, faces))
    made = retopologize(prism)
    verts, faces = shapes.arrays(made)
    assert {len(face) for face in faces} == {4}
    assert euler(verts, faces) == 2
    sharp = marked(made.data, "sharp")
    # The rims turn by 90 degrees; from them the curves go on along the sides, which turn by 30.
    rims = 2 * 12 * 2 * math.sin(math.pi / 12)
    assert length(made.data, sharp) == pytest.approx(rims + 12 * 2, rel=1e-3)


@pytest.mark.parametrize("kind", MARKS)
def test_marks_become_edges_and_stay_marked(ball, kind):
    equator = ring(ball)
    mark(ball.data, kind, equator)
    made = retopologize(ball, **{**NO_SOURCES, kind: True})
    found = marked(made.data, kind)
    verts, _ = shapes.arrays(made)
    used = sorted({v for k in found for v in made.data.edges[k].vertices})
    assert np.abs(verts[used, 2]).max() < 1e-6
    assert length(made.data, found) == pytest.approx(length(ball.data, equator), rel=0.02)
    ends = np.bincount([v for k in found for v in made.data.edges[k].vertices])
    assert set(ends[ends > 0]) == {2}, "one closed loop"
    assert report(made)["chains"] == 1


@pytest.mark.parametrize("kind", MARKS)
def test_marks_that_are_not_chosen_do_nothing(ball, kind):
    mark(ball.data, kind, ring(ball))
    made = retopologize(ball, **NO_SOURCES)
    assert report(made)["chains"] == 0
    assert not marked(made.data, kind)


def test_a_feature_of_one_source_keeps_its_other_marks(ball):
    equator = ring(ball)
    mark(ball.data, "seam", equator)
    mark(ball.data, "crease", equator)
    made = retopologize(ball, **{**NO_SOURCES, "seam": True})
    assert marked(made.data, "seam") == marked(made.data, "crease") != []


def test_selected_edges_become_edges_in_edit_mode(ball):
    shapes.choose(ball)
    equator = set(ring(ball))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.context.tool_settings.mesh_select_mode = (False, True, False)
    bpy.ops.object.mode_set(mode="OBJECT")
    for edge in ball.data.edges:
        edge.select = edge.index in equator
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.quadloom.retopologize(target_faces=FACES, **{**NO_SOURCES, "selected": True}) == {"FINISHED"}
    assert bpy.context.mode == "OBJECT"
    mesh = bpy.context.active_object.data
    chosen = [edge.index for edge in mesh.edges if edge.select]
    assert length(mesh, chosen) == pytest.approx(length(ball.data, equator), rel=0.02)


def test_edits_in_edit_mode_count(ball):
    shapes.choose(ball)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(0.5, 0.5, 0.5))
    bpy.ops.quadloom.retopologize(target_faces=FACES)
    verts, _ = shapes.arrays(bpy.context.active_object)
    assert np.linalg.norm(verts, axis=1).max() < 0.51


def test_modifiers_count(cube):
    cube.modifiers.new("array", "ARRAY").relative_offset_displace = (1.5, 0, 0)
    verts, _ = shapes.arrays(retopologize(cube))
    assert verts[:, 0].max() == pytest.approx(4.0, abs=1e-5)


def test_material_borders_become_edges_and_materials_stay_on_their_side(ball):
    red, blue = bpy.data.materials.new("Red"), bpy.data.materials.new("Blue")
    ball.data.materials.append(red)
    ball.data.materials.append(blue)
    for face in ball.data.polygons:
        face.material_index = int(face.center.z > 0)
    made = retopologize(ball, **{**NO_SOURCES, "material_borders": True})
    assert [slot.material for slot in made.material_slots] == [red, blue]
    for face in made.data.polygons:
        assert face.material_index == int(face.center.z > 0)


def test_uv_islands_stay_apart(ball):
    """The halves of the ball lie far from one another in the map: a corner that took the wrong side would be seen."""
    layer = ball.data.uv_layers.new(name="Halves")
    for face in ball.data.polygons:
        for corner in face.loop_indices:
            at = ball.data.vertices[ball.data.loops[corner].vertex_index].co
            layer.data[corner].uv = (at.x + (10 if face.center.z > 0 else 0), at.y)
    made = retopologize(ball, **{**NO_SOURCES, "uv_borders": True})
    layer = made.data.uv_layers["Halves"]
    assert made.data.uv_layers.active.name == "Halves"
    for face in made.data.polygons:
        for corner in face.loop_indices:
            at = made.data.vertices[made.data.loops[corner].vertex_index].co
            u, v = layer.data[corner].uv
            assert u - (10 if face.center.z > 0 else 0) == pytest.approx(at.x, abs=0.03)
            assert v == pytest.approx(at.y, abs=0.03)


def test_groups_and_colors_are_interpolated(cube):
    group = cube.vertex_groups.new(name="Height")
    for vertex in cube.data.vertices:
        group.add([vertex.index], (vertex.co.z + 1) / 2, "REPLACE")
    layer = cube.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    for corner, loop in enumerate(cube.data.loops):
        layer.data[corner].color = (*((np.array(cube.data.vertices[loop.vertex_index].co) + 1) / 2), 1.0)
    made = retopologize(cube)
    for vertex in made.data.vertices:
        weight = vertex.groups[0].weight if len(vertex.groups) else 0.0
        assert weight == pytest.approx((vertex.co.z + 1) / 2, abs=1e-4), "linear on flat faces"
    for corner, loop in enumerate(made.data.loops):
        at = (np.array(made.data.vertices[loop.vertex_index].co) + 1) / 2
        assert np.abs(np.array(made.data.color_attributes["Paint"].data[corner].color)[:3] - at).max() < 1e-4


def test_sharp_edges_are_found_and_marked(cube):
    made = retopologize(cube)
    sharp = marked(made.data, "sharp")
    assert length(made.data, sharp) == pytest.approx(24.0, rel=1e-5), "the twelve edges of the cube"
    verts, _ = shapes.arrays(made)
    for corner in np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).T.reshape(-1, 3):
        assert (verts == corner.astype(np.float32)).all(axis=1).any(), "corners stay where they are"
    unmarked = retopologize(cube, mark_detected=False)
    assert not marked(unmarked.data, "sharp")
    assert report(unmarked)["chains"] == 12
    assert report(retopologize(cube, detect=False))["chains"] == 0


def test_edges_without_a_face_are_no_features(cube):
    loose = shapes.add("Loose", shapes.box(2))
    mesh = loose.data
    first = len(mesh.vertices)
    mesh.vertices.add(2)
    mesh.vertices[first + 1].co = (3, 3, 3)
    mesh.edges.add(1)
    mesh.edges[len(mesh.edges) - 1].vertices = (first, first + 1)
    mesh.edges[len(mesh.edges) - 1].use_edge_sharp = True
    assert report(retopologize(loose, detect=False))["chains"] == 0


def test_the_edge_length_is_one_of_the_world(cube):
    cube.scale = (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    made = retopologize(cube, size_by="edge_length", edge_length=0.5)
    verts, faces = shapes.arrays(made, world=True)
    lengths = [np.linalg.norm(verts[a] - verts[b]) for a, b in pairs(faces)]
    assert np.mean(lengths) == pytest.approx(0.5, rel=0.1)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 5.0), (-1.0, 1.0, 5.0), (-2.0, -2.0, -2.0)])
def test_quads_are_even_in_the_world_under_any_transform(cube, scale):
    cube.matrix_world = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.5, 4, "Y") @ Matrix.Diagonal((*scale, 1.0))
    bpy.context.view_layer.update()
    made = retopologize(cube)
    assert made.matrix_world == cube.matrix_world, "bit for bit"
    verts, faces = shapes.arrays(made)
    assert shapes.volume(verts, faces) == pytest.approx(8.0, rel=1e-4), "outside stays outside"
    world, _ = shapes.arrays(made, world=True)
    lengths = np.array([np.linalg.norm(world[a] - world[b]) for a, b in pairs(faces)])
    assert np.quantile(lengths, 0.95) / np.quantile(lengths, 0.05) < 4.0


def test_a_vertex_group_makes_quads_smaller(ball):
    group = ball.vertex_groups.new(name="Dense")
    for vertex in ball.data.vertices:
        group.add([vertex.index], float(vertex.co.z > 0), "REPLACE")
    made = retopologize(ball, detect=False, density_group="Dense", density_factor=3.0, target_faces=2000)
    areas = {side: [f.area for f in made.data.polygons if side * f.center.z > 0.4] for side in (-1, 1)}
    assert np.mean(areas[-1]) / np.mean(areas[1]) > 2.0


def test_the_layout_comes_as_a_second_object(ball):
    made = retopologize(ball, preview=True)
    wire = bpy.data.objects["Ball Layout"]
    assert len(wire.data.polygons) == 0
    assert len(wire.data.edges) > 0
    valence = np.bincount([v for edge in wire.data.edges for v in edge.vertices])
    assert valence.min() >= 2
    inner = (valence == 2).sum()
    assert len(valence) - inner <= report(made)["base_vertices"]
    assert np.linalg.norm(shapes.arrays(wire)[0], axis=1) == pytest.approx(1.0, abs=0.05), "on the surface"
    assert list(bpy.context.selected_objects) == [made]


def test_the_input_is_hidden_and_unaltered(ball):
    before = shapes.fingerprint(ball)
    made = retopologize(ball)
    assert shapes.fingerprint(ball) == before
    assert ball.hide_get()
    assert ball.hide_render
    assert list(bpy.context.selected_objects) == [made]
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (2, 2), "no leftovers"


def test_the_input_stays_visible_when_asked(ball):
    retopologize(ball, hide_input=False)
    assert not ball.hide_get()


def grouped(points: np.ndarray) -> set[tuple[float, ...]]:
    """Points to compare, with one zero only."""
    return {tuple(point) for point in (points + 0.0).tolist()}


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1.0, 2.0, 0.5)])
def test_the_result_is_exactly_symmetric_in_the_objects_space(ball, axis, scale):
    ball.matrix_world = Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.5, 4, "Y") @ Matrix.Diagonal((*scale, 1.0))
    bpy.context.view_layer.update()
    mark(ball.data, "sharp", ring(ball))
    made = retopologize(ball, symmetry=axis)
    verts, faces = shapes.arrays(made)
    assert shapes.is_closed(faces)
    assert euler(verts, faces) == 2
    sign = np.ones(3)
    sign["xyz".index(axis)] = -1
    if scale == (1.0, 1.0, 1.0):
        assert grouped(verts) == grouped(verts * sign), "bit for bit"
    away = np.linalg.norm(verts[:, None] - (verts * sign)[None], axis=2).min(axis=1)
    assert away.max() < 1e-6
    assert report(made)["symmetry_deviation"] < 1e-6
    found = marked(made.data, "sharp")
    assert length(made.data, found) == pytest.approx(length(ball.data, ring(ball)), rel=0.02)


def test_attributes_of_both_sides_survive_symmetry(ball):
    group = ball.vertex_groups.new(name="Left")
    for vertex in ball.data.vertices:
        group.add([vertex.index], float(vertex.co.x > 0), "REPLACE")
    made = retopologize(ball, symmetry="x", symmetry_flip=True)
    for vertex in made.data.vertices:
        weight = vertex.groups[0].weight if len(vertex.groups) else 0.0
        if abs(vertex.co.x) > 0.2:
            assert weight == float(vertex.co.x > 0)


def test_refuses_what_is_not_symmetric_and_selects_it(cube):
    far = [v.index for v in cube.data.vertices if v.co.x > 0.99]
    for index in far:
        cube.data.vertices[index].co.x += 0.5
    shapes.choose(cube)
    text = refused(bpy.ops.quadloom.retopologize, symmetry="x")
    assert "“Cube” is not symmetric about the plane" in text
    assert set(far) <= selected(cube.data)["verts"]
    made = retopologize(cube, symmetry="x", symmetry_tolerance=1.0)
    verts, _ = shapes.arrays(made)
    assert (verts[:, 0].min(), verts[:, 0].max()) == (-1.5, 1.5), "the positive side decides"
    verts, _ = shapes.arrays(retopologize(cube, symmetry="x", symmetry_tolerance=1.0, symmetry_flip=True))
    assert (verts[:, 0].min(), verts[:, 0].max()) == (-1.0, 1.0)


def test_refuses_marks_on_one_side_and_selects_them(ball):
    edges = [k for k in ring(ball) if all(ball.data.vertices[v].co.x > 0.3 for v in ball.data.edges[k].vertices)]
    mark(ball.data, "seam", edges)
    shapes.choose(ball)
    text = refused(bpy.ops.quadloom.retopologize, symmetry="x", detect=False)
    assert "no like on the other side" in text
    assert selected(ball.data)["edges"] == {frozenset(ball.data.edges[k].vertices) for k in edges}


def test_the_layout_is_kept_where_no_mark_changed(ball):
    options = {**NO_SOURCES, "sharp": True, "seam": True, "hide_input": False, "base_vertices": 300}
    mark(ball.data, "sharp", ring(ball))
    first = retopologize(ball, **options, preview=True)
    assert report(first)["base_triangles_edited"] is None
    top = [e.index for e in ball.data.edges if all(ball.data.vertices[v].co.z > 0.85 for v in e.vertices)]
    mark(ball.data, "seam", top[:2])
    kept = retopologize(ball, **options, keep_layout=True)
    assert 0 < report(kept)["base_triangles_edited"] < report(kept)["base_triangles"]
    assert marked(kept.data, "seam")
    again = retopologize(ball, **options, keep_layout=True)
    assert np.array_equal(shapes.arrays(again)[0], shapes.arrays(kept)[0]), "the redo panel changes nothing"
    anew = retopologize(ball, **options)
    assert report(anew)["base_triangles_edited"] is None
    retopologize(shapes.add("Other", shapes.box(3)))
    assert np.array_equal(shapes.arrays(retopologize(ball, **options))[0], shapes.arrays(anew)[0])


def test_a_template_goes_where_the_cursor_is(ball, tmp_path):
    plain = retopologize(ball, hide_input=False)
    bpy.context.scene.cursor.location = (0, 0, 1)
    made = retopologize(ball, hide_input=False, template="knuckle")
    assert not np.array_equal(*[shapes.arrays(obj)[0][:50] for obj in (plain, made)])
    verts, faces = shapes.arrays(made)
    assert euler(verts, faces) == 2
    valence = np.bincount([v for face in faces for v in face])
    assert (np.linalg.norm(verts[valence != 4] - (0, 0, 1), axis=1) < 0.8).sum() >= 8
    own = {"name": "two", "sides": [[0, 1, 2], [2, 3], [3, 4, 5], [5, 0]], "quads": [[0, 1, 4, 5], [1, 2, 3, 4]]}
    file = tmp_path / "templates.json"
    file.write_text(json.dumps({"templates": [own]}))
    retopologize(ball, hide_input=False, template="two", template_file=str(file))
    assert "no template named" in refused(bpy.ops.quadloom.retopologize, template="three", template_file=str(file))
    missing = str(tmp_path / "none.json")
    assert "cannot be read" in refused(bpy.ops.quadloom.retopologize, template="two", template_file=missing)


def test_the_field_of_a_feature_can_be_shown(ball):
    mark(ball.data, "seam", ring(ball))
    made = retopologize(ball, **{**NO_SOURCES, "seam": True, "field": "seam", "preview": True})
    layer = made.data.attributes["quadloom_field"]
    assert (layer.domain, layer.data_type) == ("POINT", "FLOAT")
    values = np.array([item.value for item in layer.data])
    verts, _ = shapes.arrays(made)
    assert values[np.abs(verts[:, 2]) < 1e-6] == pytest.approx(1.0, abs=1e-3)
    assert values.min() > -1e-3
    assert values[np.abs(verts[:, 2]) > 0.7].mean() < 0.5
    wire = bpy.data.objects["Ball Layout"].data
    assert len(wire.attributes["quadloom_field"].data) == len(wire.vertices)
    assert "quadloom_field" not in ball.data.attributes


def test_undo_is_one_step(ball):
    shapes.choose(ball)
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.quadloom.retopologize("EXEC_DEFAULT", True, target_faces=FACES) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert [obj.name for obj in bpy.data.objects] == ["Ball"]
    assert not bpy.data.objects["Ball"].hide_get()
    bpy.ops.ed.redo()
    assert len(bpy.data.objects) == 2


def test_running_twice_gives_the_same_mesh(cube):
    first = shapes.arrays(retopologize(cube, hide_input=False))
    second = shapes.arrays(retopologize(cube, hide_input=False))
    assert np.array_equal(first[0], second[0])
    assert first[1] == second[1]


def selected(mesh: bpy.types.Mesh) -> dict[str, set]:
    return {
        "verts": {v.index for v in mesh.vertices if v.select},
        "edges": {frozenset(e.vertices) for e in mesh.edges if e.select},
        "faces": {f.index for f in mesh.polygons if f.select},
    }


def test_refuses_flipped_faces_and_selects_their_edges():
    verts, faces = shapes.box(3)
    faces[4] = faces[4][::-1]
    bad = shapes.add("Bad", (verts, faces))
    shapes.choose(bad)
    text = refused(bpy.ops.quadloom.retopologize)
    assert "“Bad” has 4 edges where neighbouring faces point opposite ways" in text
    assert "selected on “Bad”: 4 edges" in text
    assert selected(bad.data)["edges"] == {frozenset(pair) for pair in pairs([faces[4]])}


def test_refuses_a_fin_and_selects_its_edge_in_edit_mode():
    verts, faces = shapes.box(3)
    a, b = faces[0][:2]
    fin = np.concatenate([verts, 2 * verts[[a, b]]])
    bad = shapes.add("Bad", (fin, [*faces, [a, b, len(verts) + 1, len(verts)]]))
    shapes.choose(bad)
    bpy.ops.object.mode_set(mode="EDIT")
    assert "more than two faces" in refused(bpy.ops.quadloom.retopologize)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert selected(bad.data)["edges"] == {frozenset((a, b))}


def test_refuses_a_position_that_is_no_number(cube):
    cube.data.vertices[5].co = (float("nan"), 0.0, 0.0)
    shapes.choose(cube)
    assert "“Cube”" in refused(bpy.ops.quadloom.retopologize)
    assert selected(cube.data)["verts"] == {5}


def test_refuses_a_scale_of_zero(cube):
    cube.scale.z = 0.0
    shapes.choose(cube)
    assert "scale of zero" in refused(bpy.ops.quadloom.retopologize)


def test_refuses_a_vertex_group_that_is_not_there(cube):
    shapes.choose(cube)
    assert "no vertex group “Nose”" in refused(bpy.ops.quadloom.retopologize, density_group="Nose")


def test_refuses_what_is_no_mesh_and_says_so(cube):
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    shapes.choose(empty)
    assert not bpy.ops.quadloom.retopologize.poll()
    assert "not a mesh" in refused(bpy.ops.quadloom.retopologize)


def test_refuses_a_mesh_without_faces_and_says_so():
    shapes.choose(shapes.add("Nothing", (np.zeros((0, 3)), [])))
    assert "“Nothing” has no faces" in refused(bpy.ops.quadloom.retopologize)


def test_an_unfollowed_uv_border_is_said(ball, capfd):
    layer = ball.data.uv_layers.new(name="Cut")
    for face in ball.data.polygons:
        for corner in face.loop_indices:
            layer.data[corner].uv = (face.index, corner % 2)
    retopologize(ball, **NO_SOURCES)
    assert "“Cut” is cut where no edge loop runs" in capfd.readouterr().out


def test_the_panel_counts_marks_and_says_what_happens(ball, module):
    panel = module("panels.retopologize")
    mark(ball.data, "seam", ring(ball))
    shapes.choose(ball)
    bpy.context.scene.quadloom.retopologize.property_unset("size_by")
    assert panel.marked_edges(bpy.context)["seam"] == len(ring(ball))
    lines = " ".join(panel.what_happens(bpy.context))
    assert f"{len(ring(ball))} marked edges will be edge loops" in lines
    assert "“Ball” becomes about 4,000 quads" in lines
    mark(ball.data, "sharp", ring(ball, 0))
    ball.data.update_tag()
    bpy.context.view_layer.update()
    assert panel.marked_edges(bpy.context)["sharp"] == len(ring(ball, 0)), "counted anew after a change"


def test_the_command_writes_an_obj(tmp_path, module):
    verts, faces = shapes.box(2)
    lines = [f"v {x} {y} {z}" for x, y, z in verts] + ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    target = tmp_path / "out.obj"
    arguments = ["retopologize", str(tmp_path / "box.obj"), "--target-faces", "600", "-o", str(target)]
    assert module("command").main(arguments) == 0
    made = [line for line in target.read_text().splitlines() if line.startswith("f ")]
    assert {len(line.split()) for line in made} == {5}
    assert len(made) == pytest.approx(600, rel=0.05)


def test_the_command_names_the_sources_of_features(tmp_path, module, capsys):
    with pytest.raises(SystemExit):
        module("command").main(["retopologize", "x.obj", "--features", "sharp,edges", "-o", str(tmp_path / "out.obj")])
    assert "edges: choose from sharp, seam" in capsys.readouterr().err
