"""`quadloom.tile_surface` and `quadloom.export_panels`: panels, what is measured of them, files, and when they say no."""

import csv
import json
import math
import time

import bpy
import numpy as np
import pytest
import shapes
from conftest import refused
from mathutils import Euler, Matrix

FEW = {"panel_count": 200}


def sheet(n: int = 10, height: float = 0.5, name: str = "Roof") -> bpy.types.Object:
    """An open, domed square from -2 to 2."""
    line = np.linspace(-2, 2, n + 1)
    verts = np.array([[x, y, height * math.cos(x * math.pi / 4) * math.cos(y * math.pi / 4)] for x in line for y in line])
    at = lambda i, j: i * (n + 1) + j  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(n)]
    obj = shapes.add(name, (verts, faces))
    shapes.choose(obj)
    return obj


def tile(**options) -> bpy.types.Object:
    assert bpy.ops.quadloom.tile_surface(**{**FEW, **options}) == {"FINISHED"}
    return bpy.context.active_object


def report(made: bpy.types.Object) -> dict:
    return json.loads(made["quadloom_report"])


def values(made: bpy.types.Object, name: str) -> np.ndarray:
    layer = made.data.attributes[name]
    assert layer.domain == "FACE"
    return np.array([item.value for item in layer.data])


def euler(faces) -> int:
    edges = {frozenset((f[k], f[(k + 1) % len(f)])) for f in faces for k in range(len(f))}
    return len({v for f in faces for v in f}) - len(edges) + len(faces)


def check_panels(made: bpy.types.Object, expected_euler: int) -> None:
    _, faces = shapes.arrays(made)
    assert {len(face) for face in faces} == {3, 4}
    directed = [(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))]
    assert len(set(directed)) == len(directed)
    assert euler(faces) == expected_euler
    assert not made.data.validate()


def mean_edge(made: bpy.types.Object) -> float:
    verts, _ = shapes.arrays(made, world=True)
    return float(np.mean([np.linalg.norm(np.subtract(*verts[list(edge.vertices)])) for edge in made.data.edges]))


@pytest.mark.parametrize("pattern", ["regular", "random"])
def test_a_roof_becomes_panels_whose_border_is_the_roofs(pattern):
    source = sheet()
    before = shapes.fingerprint(source)
    made = tile(pattern=pattern)
    check_panels(made, 1)
    assert made.name == "Roof Panels"
    assert len(made.data.polygons) == pytest.approx(200, rel=0.25)
    verts, _ = shapes.arrays(made)
    for axis in (0, 1):
        assert (verts[:, axis].min(), verts[:, axis].max()) == pytest.approx((-2, 2), abs=1e-5)
    assert shapes.fingerprint(source) == before
    assert source.hide_get()
    assert list(bpy.context.selected_objects) == [made]
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (2, 2), "no leftovers"


def test_patches_come_as_a_second_object():
    source = sheet()
    made = tile(partition="patches", show_patches=True)
    _, faces = shapes.arrays(made)
    # A patch may be all triangles or all squares.
    assert {len(face) for face in faces} <= {3, 4}
    assert euler(faces) == 1
    assert report(made)["patches"] >= 1
    graph = bpy.data.objects[f"{source.name} Patches"]
    assert len(graph.data.polygons) == 0
    # The curvature of a disk.
    assert sum(item.value for item in graph.data.attributes["angle_defect"].data) == 12
    uses = np.bincount(np.array([edge.vertices for edge in graph.data.edges]).ravel(), minlength=len(graph.data.vertices))
    assert uses.min() >= 2, "a side ends in the open"
    assert bpy.context.active_object == made


def test_a_ball_becomes_closed_panels():
    shapes.choose(shapes.add("Ball", shapes.ball(8)))
    made = tile(hide_input=False)
    check_panels(made, 2)
    assert shapes.is_closed(shapes.arrays(made)[1])
    assert not bpy.data.objects["Ball"].hide_get()
    assert shapes.volume(*shapes.arrays(made)) == pytest.approx(4 / 3 * math.pi, rel=0.1)


def test_faces_carry_kind_type_planarity_and_area():
    sheet()
    made = tile(flattening_rounds=0)
    verts, faces = shapes.arrays(made, world=True)
    kinds, types = values(made, "tile_kind"), values(made, "panel_type")
    assert kinds.tolist() == [len(face) - 3 for face in faces]
    for face, planarity, area in zip(faces, values(made, "panel_planarity"), values(made, "panel_area"), strict=True):
        p = verts[list(face)].astype(float)
        if len(face) == 3:
            assert planarity == 0
            assert area == pytest.approx(np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / 2, rel=1e-4)
            continue
        first, second = p[2] - p[0], p[3] - p[1]
        normal = np.cross(first, second)
        apart = abs(normal @ (p[1] - p[0])) / np.linalg.norm(normal)
        assert planarity == pytest.approx(2 * apart / (np.linalg.norm(first) + np.linalg.norm(second)), abs=1e-5)
        assert area == pytest.approx(np.linalg.norm(normal) / 2, rel=1e-4)
    assert report(made)["types"] == types.max() + 1 == len(set(types.tolist()))
    # A type has one number of corners.
    assert len({(kind, number) for kind, number in zip(types.tolist(), kinds.tolist(), strict=True)}) == types.max() + 1


@pytest.mark.parametrize(
    ("color_by", "names"), [("kind", "Panels"), ("type", "Panel Type"), ("planarity", "Planarity"), ("area", "Panel Area")]
)
def test_materials_show_what_was_asked_for(color_by, names):
    sheet()
    made = tile(color_by=color_by, type_tolerance=0.05)
    slots = [slot.material.name for slot in made.material_slots]
    assert all(names in name for name in slots)
    chosen = np.array([polygon.material_index for polygon in made.data.polygons])
    assert 0 <= chosen.min() <= chosen.max() < len(slots)
    measured = values(made, {"kind": "tile_kind", "type": "panel_type"}.get(color_by, f"panel_{color_by}"))
    if color_by in {"planarity", "area"}:
        # A greater number never has an earlier colour.
        order = np.argsort(measured)
        assert (np.diff(chosen[order]) >= 0).all()
        assert len(set(chosen.tolist())) > 1
    else:
        frequent = np.bincount(chosen) > 0
        assert all(len(set(measured[chosen == k].tolist())) == 1 for k in np.flatnonzero(frequent) if "Other" not in slots[k])
    assert len({tuple(slot.material.diffuse_color) for slot in made.material_slots}) == len(slots)


def test_materials_are_used_again():
    source = sheet()
    first = tile()
    first.data.materials[0].diffuse_color = (0, 1, 0, 1)
    source.hide_set(False)
    shapes.choose(source)
    second = tile()
    assert list(first.data.materials) == list(second.data.materials)
    assert second.data.materials[0].diffuse_color[1] == 1


def test_the_edge_length_is_one_of_the_world():
    source = sheet()
    for scale in [(1, 1, 1), (3, 3, 3), (1, 2, 0.5), (-1, 1, 1)]:
        source.hide_set(False)
        source.scale = scale
        source.rotation_euler = (0.3, 0.2, 0.1)
        source.location = (5, 6, 7)
        shapes.choose(source)
        made = tile(size_by="edge_length", panel_size=0.4)
        assert mean_edge(made) == pytest.approx(0.4, rel=0.1), scale
        assert made.matrix_world.median_scale == pytest.approx(1, abs=1e-5)
        # It lies where the roof is, outside up.
        matrix = np.array(source.matrix_world, float)
        verts, faces = shapes.arrays(made, world=True)
        own = (verts - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
        assert (own[:, :2].min(), own[:, :2].max()) == pytest.approx((-2, 2), abs=1e-4)
        up = sum(np.cross(own[f[1]] - own[f[0]], own[f[2]] - own[f[0]])[2] for f in faces)
        assert up * np.linalg.det(matrix[:3, :3]) > 0
        bpy.data.objects.remove(made)


def test_marked_edges_become_lines_of_edges():
    def covered(**options) -> float:
        source = sheet(height=0.0)
        for edge in source.data.edges:
            a, b = (source.data.vertices[v].co for v in edge.vertices)
            edge.use_seam = abs(a.x) < 1e-6 and abs(b.x) < 1e-6
        made = tile(panel_count=300, **options)
        verts, _ = shapes.arrays(made)
        total = 0.0
        for edge in made.data.edges:
            a, b = verts[list(edge.vertices)]
            if abs(a[0]) < 1e-5 and abs(b[0]) < 1e-5:
                total += np.linalg.norm(a - b)
        return total

    assert covered() == pytest.approx(4, rel=1e-3)
    assert covered(seam=False) < 2


def test_sharp_edges_are_followed_unless_told_otherwise():
    def corners(detect: bool) -> int:
        box = shapes.add("Box", shapes.box(4))
        shapes.choose(box)
        verts, _ = shapes.arrays(tile(panel_count=400, detect=detect, flattening_rounds=0))
        return int((np.abs(np.abs(verts) - 1).max(axis=1) < 1e-4).sum())

    assert corners(True) == 8
    assert corners(False) < 8


def test_modifiers_and_edit_mode_are_included():
    source = sheet(4)
    source.modifiers.new("Mirror", "MIRROR").use_axis = (False, False, True)
    source.location.z = 1
    made = tile()
    verts, _ = shapes.arrays(made)
    assert verts[:, 2].min() < -0.4
    bpy.data.objects.remove(made)
    plain = sheet(4, name="Edited")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(2, 2, 2))
    made = tile()
    assert bpy.context.mode == "OBJECT"
    assert shapes.arrays(made)[0][:, 0].max() == pytest.approx(4, abs=1e-4)
    assert plain.hide_get()


def test_seeds_give_other_patterns_and_the_same_ones_again():
    source = sheet()

    def faces(seed: int) -> list:
        source.hide_set(False)
        shapes.choose(source)
        return shapes.arrays(tile(pattern="random", seed=seed))[1]

    assert faces(1) == faces(1) != faces(2)


def test_undo_is_one_step():
    sheet()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.quadloom.tile_surface("EXEC_DEFAULT", True, **FEW) == {"FINISHED"}
    assert len(bpy.data.objects) == 2
    bpy.ops.ed.undo()
    assert [obj.name for obj in bpy.data.objects] == ["Roof"]
    assert not bpy.data.objects["Roof"].hide_get()
    bpy.ops.ed.redo()
    assert len(bpy.data.objects) == 2


def test_a_cancelled_run_changes_nothing(module, monkeypatch):
    source = sheet()
    native = module("native")
    module("tilings").forget()

    def cancelled(*args, **options):
        raise native.Cancelled

    monkeypatch.setattr(native, "tile_surface", cancelled)
    assert bpy.ops.quadloom.tile_surface(**FEW) == {"CANCELLED"}
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (1, 1)
    assert not source.hide_get()


def test_cancels_the_library_in_time(module):
    bridge, jobs, native = module("bridge"), module("jobs"), module("native")
    source = sheet(60)
    mesh = bridge.read(source, bpy.context.evaluated_depsgraph_get())
    none = np.empty((0, 2), np.int32)
    job = jobs.Job(lambda progress: native.tile_surface(mesh, none, progress=progress, target_panels=40_000))
    time.sleep(1.0)
    assert not job.finished
    start = time.monotonic()
    job.cancel()
    while not job.finished:
        time.sleep(0.005)
    assert time.monotonic() - start < 0.3
    with pytest.raises(native.Cancelled):
        job.outcome()


QUAD = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
BAD_MESHES = {
    "three faces at an edge": (
        [*QUAD, (0, 0, 1), (1, 0, 1)], [[0, 1, 2, 3], [1, 0, 4, 5], [0, 1, 4]], "more than two faces", {0, 1}
    ),
    "opposite faces": ([*QUAD, (0, -1, 0), (1, -1, 0)], [[0, 1, 2, 3], [0, 1, 5, 4]], "point opposite ways", {0, 1}),
    "no area": ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [[0, 1, 2]], "no area", {0, 1, 2}),
    "not a number": ([(0, 0, 0), (1, 0, 0), (0, float("nan"), 0)], [[0, 1, 2]], "not a number", {2}),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_MESHES)
def test_refuses_a_bad_mesh_and_selects(case):
    verts, faces, words, expected = BAD_MESHES[case]
    source = shapes.add("Roof", (np.array(verts, float), faces))
    shapes.choose(source)
    for vertex in source.data.vertices:
        vertex.select = False
    text = refused(bpy.ops.quadloom.tile_surface)
    assert words in text
    assert "“Roof”" in text
    assert {vertex.index for vertex in source.data.vertices if vertex.select} == expected


def test_refuses_too_many_panels_and_a_scale_of_zero():
    source = sheet()
    assert "panels; use more than" in refused(bpy.ops.quadloom.tile_surface, size_by="edge_length", panel_size=1e-5)
    source.scale.x = 0
    bpy.context.view_layer.update()
    assert "scale of zero" in refused(bpy.ops.quadloom.tile_surface)


def test_refuses_what_is_no_mesh_and_says_so():
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.scene.collection.objects.link(empty)
    shapes.choose(empty)
    for operator in (bpy.ops.quadloom.tile_surface, bpy.ops.quadloom.export_panels):
        assert not operator.poll()
        assert "not a mesh" in refused(operator)


def test_the_panel_says_what_happens(module):
    source = sheet()
    for edge in list(source.data.edges)[:3]:
        edge.use_edge_sharp = True
    settings = bpy.context.scene.quadloom.tile_surface
    lines = " ".join(module("panels.tile_surface").what_happens(bpy.context))
    assert "“Roof” becomes about 1,000 panels" in lines
    assert "3 marked edges" in lines
    settings.size_by = "edge_length"
    try:
        assert "panels of one size" in module("panels.tile_surface").what_happens(bpy.context)[0]
    finally:
        settings.property_unset("size_by")


# Files


def two_squares_and_a_triangle() -> bpy.types.Object:
    verts = [*QUAD, (2, 0, 0), (2, 1, 0), (3, 0, 0)]
    obj = shapes.add("Wall", (np.array(verts, float), [[0, 1, 2, 3], [1, 4, 5, 2], [4, 6, 5]]))
    shapes.choose(obj)
    return obj


def export(path, **options) -> None:
    assert bpy.ops.quadloom.export_panels(filepath=str(path), **options) == {"FINISHED"}


def test_csv_files_hold_panels_types_nodes_and_edges_in_world_units(tmp_path):
    wall = two_squares_and_a_triangle()
    wall.scale = (2, 2, 2)
    bpy.context.view_layer.update()
    export(tmp_path / "wall", format="csv")
    rows = {}
    for name in ("wall", "wall_types", "wall_nodes", "wall_edges"):
        with (tmp_path / f"{name}.csv").open(newline="") as file:
            rows[name] = list(csv.DictReader(file))
    assert [float(row["area"]) for row in rows["wall"]] == pytest.approx([4, 4, 2])
    assert [row["type"] for row in rows["wall"]] == ["Q1", "Q1", "T1"]
    assert {row["type"]: row["count"] for row in rows["wall_types"]} == {"T1": "1", "Q1": "2"}
    assert len(rows["wall_nodes"]) == 7
    assert len(rows["wall_edges"]) == 9
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "wall.csv",
        "wall_edges.csv",
        "wall_nodes.csv",
        "wall_types.csv",
    ]


def test_json_holds_all_of_it(tmp_path):
    sheet()
    made = tile(type_tolerance=0.02)
    export(tmp_path / "roof.json", format="json", type_tolerance=0.02)
    data = json.loads((tmp_path / "roof.json").read_text())
    assert len(data["panels"]) == len(made.data.polygons)
    assert [panel["nodes"] for panel in data["panels"]] == [list(polygon.vertices) for polygon in made.data.polygons]
    assert [panel["area"] for panel in data["panels"]] == pytest.approx(values(made, "panel_area").tolist(), rel=1e-4)
    verts, _ = shapes.arrays(made, world=True)
    assert np.allclose(data["nodes"], verts, atol=1e-5)


@pytest.mark.parametrize("kind", ["svg", "dxf"])
def test_drawings_are_in_millimetres(tmp_path, kind):
    two_squares_and_a_triangle()
    export(tmp_path / "wall", format=kind, gap=0.1)
    text = (tmp_path / f"wall.{kind}").read_text()
    assert text.count("<polygon" if kind == "svg" else "LWPOLYLINE") == (3 if kind == "svg" else 4)
    bpy.context.scene.unit_settings.scale_length = 0.001
    try:
        export(tmp_path / "small", format=kind, gap=0.1)
    finally:
        bpy.context.scene.unit_settings.scale_length = 1.0
    small = (tmp_path / f"small.{kind}").read_text()
    assert small != text
    if kind == "svg":
        width = [float(t.split('width="')[1].split("mm")[0]) for t in (text, small)]
        assert width[0] == pytest.approx(1000 * width[1], rel=1e-3)


def test_sheets_too_small_and_faces_with_many_corners_are_refused_and_selected(tmp_path):
    wall = two_squares_and_a_triangle()
    path = str(tmp_path / "wall.svg")
    text = refused(bpy.ops.quadloom.export_panels, filepath=path, format="svg", sheet=(0.5, 0.5))
    assert "do not fit" in text
    assert [face.select for face in wall.data.polygons] == [True, True, True]
    pentagon = shapes.add("Pentagon", (np.array([*QUAD, (-0.5, 0.5, 0)], float), [[0, 1, 2, 3, 4]]))
    shapes.choose(pentagon)
    assert "more than four corners" in refused(bpy.ops.quadloom.export_panels, filepath=path, format="svg")
    assert pentagon.data.polygons[0].select
    assert not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_is_said(tmp_path):
    two_squares_and_a_triangle()
    text = refused(bpy.ops.quadloom.export_panels, filepath=str(tmp_path / "none" / "wall.csv"), format="csv")
    assert "Cannot write" in text


def test_the_command_tiles_and_exports(tmp_path, module):
    verts, faces = shapes.ball(4)
    lines = [f"v {x} {y} {z}" for x, y, z in verts] + ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    (tmp_path / "ball.obj").write_text("\n".join(lines) + "\n")
    target = tmp_path / "panels.obj"
    main = module("command").main
    assert main(["tile-surface", str(tmp_path / "ball.obj"), "--panel-count", "150", "-o", str(target)]) == 0
    made = [line for line in target.read_text().splitlines() if line.startswith("f ")]
    assert {len(line.split()) for line in made} == {4, 5}
    for suffix in ("csv", "json", "svg", "dxf"):
        assert main(["export-panels", str(target), "-o", str(tmp_path / f"list.{suffix}")]) == 0
    assert len((tmp_path / "list.csv").read_text().splitlines()) == 1 + len(made)
    assert main(["export-panels", str(target), "-o", str(tmp_path / "list.pdf")]) == 1


def test_the_place_of_a_result_is_rigid(module):
    shape_and_place = module("tiling_objects").shape_and_place
    for scale in [(1, 1, 1), (2, 3, 4), (-1, 2, 2), (-1, -1, -1)]:
        matrix = np.array(Matrix.LocRotScale((1, 2, 3), Euler((0.5, 0.6, 0.7)), scale), float)
        shape, place = shape_and_place(matrix)
        assert np.allclose(place @ shape, matrix)
        assert np.allclose(place[:3, :3] @ place[:3, :3].T, np.eye(3))
        assert np.linalg.det(place[:3, :3]) > 0
