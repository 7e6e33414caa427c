"""Patches chosen by hand, drawn and edited: `design_patches`, `divide_part`, `change_division`, `mark_corners`, `zigzag`, and
`tile_surface` with patches."""

import json
import math

import bpy
import numpy as np
import pytest
import shapes
from conftest import refused

SIZE = {"panel_count": 300}


def cap(n: int = 12, angle: float = math.pi / 3) -> bpy.types.Object:
    """A piece of the unit sphere as wide as the angle both ways; too curved to be one patch."""
    line = np.linspace(0, angle, n + 1)
    verts = np.array([[math.sin(a), math.cos(a) * math.sin(b), math.cos(a) * math.cos(b)] for a in line for b in line])
    return _grid("Cap", verts, n)


def flat(n: int = 8) -> bpy.types.Object:
    """A square of side 2 in the plane."""
    line = np.linspace(0, 2, n + 1)
    return _grid("Floor", np.array([[x, y, 0.0] for x in line for y in line]), n)


def _grid(name: str, verts: np.ndarray, n: int) -> bpy.types.Object:
    at = lambda i, j: i * (n + 1) + j  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(n)]
    obj = shapes.add(name, (verts, faces))
    shapes.choose(obj)
    return obj


def drawing(points, edges, name: str = "Drawing") -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([list(map(float, p)) for p in points], edges, [])
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def state(obj: bpy.types.Object) -> dict:
    return json.loads(obj["quadloom_tiling"])


def report(obj: bpy.types.Object) -> dict:
    return json.loads(obj["quadloom_report"])


def begun(**options) -> bpy.types.Object:
    assert bpy.ops.quadloom.design_patches(**{**SIZE, **options}) == {"FINISHED"}
    return bpy.context.active_object


def check_surface(panels: bpy.types.Object) -> None:
    """A disk of triangles and quads without a gap."""
    _, faces = shapes.arrays(panels)
    directed = [(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))]
    assert {len(face) for face in faces} <= {3, 4}
    assert len(set(directed)) == len(directed)
    edges = {frozenset(edge) for edge in directed}
    assert len({v for f in faces for v in f}) - len(edges) + len(faces) == 1
    assert not panels.data.validate()


def test_a_design_is_divided_until_all_parts_are_flat_and_then_tiled():
    source = cap()
    patches = begun()
    assert patches.name == "Cap Patches"
    assert any(state(patches)["design"]["defects"])
    for _ in range(30):
        if not any(state(patches)["design"]["defects"]):
            break
        before = np.abs(state(patches)["design"]["defects"]).max()
        refusal = ""
        try:
            bpy.ops.quadloom.divide_part()
        except RuntimeError as error:  # A dead end: what an artist would do is written there.
            refusal = str(error)
        if refusal:
            assert "take another division before" in refusal
            bpy.ops.quadloom.change_division(step=1)
            continue
        assert np.abs(state(patches)["design"]["defects"]).max() <= before
        assert any(edge.select for edge in patches.data.edges), "the curves drawn are selected"
    assert not any(state(patches)["design"]["defects"])
    assert "All parts are flat" in refused(bpy.ops.quadloom.divide_part)
    count = len(state(patches)["design"]["defects"])
    assert bpy.ops.quadloom.tile_surface(**SIZE) == {"FINISHED"}
    panels = bpy.context.active_object
    assert panels.name == "Cap Panels"
    assert report(panels)["patches"] == count
    check_surface(panels)
    assert source.hide_get()


def test_other_partitions_can_be_taken_and_a_division_taken_back():
    cap()
    patches = begun()
    start = [tuple(v.co) for v in patches.data.vertices]
    bpy.ops.quadloom.divide_part(choice=1)
    first = [tuple(v.co) for v in patches.data.vertices]
    bpy.ops.quadloom.change_division(step=1)
    assert state(patches)["design"]["choices"] == [[0, 1]]
    second = [tuple(v.co) for v in patches.data.vertices]
    assert second != first
    bpy.ops.quadloom.change_division(step=-1)
    assert [tuple(v.co) for v in patches.data.vertices] == first
    bpy.ops.quadloom.change_division(step=0)
    assert [tuple(v.co) for v in patches.data.vertices] == start
    assert "No part was divided" in refused(bpy.ops.quadloom.change_division, step=1)
    # The choice of the redo panel is the same as going through the list.
    bpy.ops.quadloom.divide_part(choice=2)
    assert [tuple(v.co) for v in patches.data.vertices] == second


def test_a_design_survives_a_new_session(module):
    cap()
    patches = begun()
    bpy.ops.quadloom.divide_part()
    module("tilings").forget()
    bpy.ops.quadloom.divide_part()
    again = [tuple(v.co) for v in patches.data.vertices]
    bpy.ops.quadloom.change_division(step=0)
    bpy.ops.quadloom.divide_part()
    assert [tuple(v.co) for v in patches.data.vertices] == again


def test_a_step_of_a_design_is_one_undo_step():
    cap()
    begun()
    bpy.ops.ed.undo_push(message="begun")
    bpy.ops.quadloom.divide_part("EXEC_DEFAULT", True)
    assert len(state(bpy.data.objects["Cap Patches"])["design"]["choices"]) == 1
    bpy.ops.ed.undo()
    assert state(bpy.data.objects["Cap Patches"])["design"]["choices"] == []


def test_an_unfinished_design_is_finished_by_tiling():
    cap()
    patches = begun()
    bpy.ops.quadloom.divide_part()
    bpy.ops.quadloom.tile_surface(**SIZE)
    panels = bpy.context.active_object
    check_surface(panels)
    assert report(panels)["patches"] >= 2
    assert "design" not in state(patches), "the patches shown are those of the panels"


def test_edges_drawn_by_hand_are_the_patches():
    flat()
    # A cross: four patches, its ends a little beside the floor.
    graph = drawing([(1, 0, 0.02), (1, 2, 0), (0, 1, 0), (2, 1, 0), (1, 1, 0.05)], [(0, 4), (4, 1), (2, 4), (4, 3)])
    bpy.ops.quadloom.tile_surface(patch_graph=graph.name, show_patches=True, **SIZE)
    panels = bpy.context.active_object
    check_surface(panels)
    assert report(panels)["patches"] == 4
    # Four squares: all panels are squares, and the cross is a chain of edges.
    verts, faces = shapes.arrays(panels)
    assert {len(face) for face in faces} == {4}
    total = 0.0
    for edge in panels.data.edges:
        a, b = verts[list(edge.vertices)]
        if max(abs(a[0] - 1), abs(b[0] - 1)) < 1e-3 or max(abs(a[1] - 1), abs(b[1] - 1)) < 1e-3:
            total += np.linalg.norm(a - b)
    assert total == pytest.approx(4, rel=1e-3)
    assert len(graph.data.vertices) == 5, "the drawing stays"
    assert bpy.data.objects["Floor Patches"].data.edges


def test_a_graph_that_was_shown_can_be_moved_and_used_again():
    cap()
    bpy.ops.quadloom.tile_surface(partition="patches", show_patches=True, **SIZE)
    first = bpy.context.active_object
    patches = bpy.data.objects["Cap Patches"]
    count = report(first)["patches"]
    nodes = [v for v in patches.data.vertices if patches.data.attributes["patch_node"].data[v.index].value]
    degree = np.bincount(np.array([edge.vertices for edge in patches.data.edges]).ravel())
    inner = next(v for v in nodes if degree[v.index] >= 3 and min(v.co) > 0.1)
    inner.co.x += 0.05
    where = inner.index
    shapes.choose(patches)
    bpy.ops.quadloom.tile_surface(**SIZE)
    again = bpy.context.active_object
    assert again != first
    check_surface(again)
    assert report(again)["patches"] == count
    # The node lies on the sphere again, where it was moved to.
    at = np.array(patches.data.vertices[where].co)
    assert np.linalg.norm(at) == pytest.approx(1, abs=0.02)


def test_graphs_that_do_not_close_are_selected_and_said():
    flat()
    open_end = drawing([(0, 1, 0), (0.7, 1, 0)], [(0, 1)])
    text = refused(bpy.ops.quadloom.tile_surface, patch_graph="Drawing", **SIZE)
    assert "end in the open" in text
    assert open_end.data.edges[0].select
    away = drawing([(0, 1, 9), (2, 1, 9)], [(0, 1)], "Away")
    text = refused(bpy.ops.quadloom.tile_surface, patch_graph="Away", **SIZE)
    assert "far from the surface" in text
    assert all(v.select for v in away.data.vertices)
    # A ring inside: the patch around it is no disk.
    ring = drawing([(0.5, 0.5, 0), (1.5, 0.5, 0), (1.5, 1.5, 0), (0.5, 1.5, 0)], [(0, 1), (1, 2), (2, 3), (3, 0)], "Ring")
    text = refused(bpy.ops.quadloom.tile_surface, patch_graph="Ring", **SIZE)
    assert "no disks" in text
    assert all(edge.select for edge in ring.data.edges)
    assert "no mesh of patches" in refused(bpy.ops.quadloom.tile_surface, patch_graph="None such", **SIZE)


def test_marked_corners_set_angles():
    source = flat()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")

    def mark(corners, angle: str) -> None:
        source.hide_set(False)
        shapes.choose(source)
        for vertex in source.data.vertices:
            vertex.select = (
                tuple(round(x) for x in vertex.co[:2]) in corners and vertex.co.x in (0, 2) and vertex.co.y in (0, 2)
            )
        bpy.ops.object.mode_set(mode="EDIT")
        assert bpy.ops.quadloom.mark_corners(angle=angle) == {"FINISHED"}
        bpy.ops.object.mode_set(mode="OBJECT")

    def kinds() -> set[int]:
        source.hide_set(False)
        shapes.choose(source)
        bpy.ops.quadloom.tile_surface(partition="patches", panel_size=0.25, size_by="edge_length")
        return {len(face) for face in shapes.arrays(bpy.context.active_object)[1]}

    assert kinds() == {4}
    mark({(0, 0), (2, 2)}, "2")
    mark({(2, 0), (0, 2)}, "4")
    assert kinds() == {3}
    mark({(0, 0), (2, 2), (2, 0), (0, 2)}, "0")
    assert kinds() == {4}


def test_panels_are_not_tiled_themselves():
    source = flat()
    bpy.ops.quadloom.tile_surface(**SIZE)
    first = bpy.context.active_object
    bpy.ops.quadloom.tile_surface(panel_count=60)
    second = bpy.context.active_object
    assert second["quadloom_source"] == source
    assert len(second.data.polygons) < len(first.data.polygons)
    assert first.hide_get()
    # As many as of the source itself.
    source.hide_set(False)
    shapes.choose(source)
    bpy.ops.quadloom.tile_surface(panel_count=60)
    assert len(bpy.context.active_object.data.polygons) == len(second.data.polygons)
    # Panels whose source is gone, or on request, are a surface like any other; their colours are no marks.
    shapes.choose(second)
    bpy.ops.quadloom.tile_surface(panel_count=60, again=False)
    assert bpy.context.active_object["quadloom_source"] == second
    assert report(bpy.context.active_object)["marked_edges"] == 0


def select_side(patches: bpy.types.Object, module) -> int:
    """Selects all edges of a side with patches on both of its sides; returns its number."""
    graphs, bridge = module("patch_graphs"), module("bridge")
    sides = graphs.drawn(bridge.read_base(patches)).side_of_edge
    both = np.array([[patches.data.attributes[n].data[e].value for n in (graphs.BEGIN, graphs.END)] for e in range(len(sides))])
    begins = {side for side, (a, _) in zip(sides.tolist(), both.tolist(), strict=True) if a}
    ends = {side for side, (_, b) in zip(sides.tolist(), both.tolist(), strict=True) if b}
    side = min(begins & ends)
    chosen = [list(edge.vertices) for edge in patches.data.edges if sides[edge.index] == side]
    bridge.select(bpy.context, patches, {"edges": np.array(chosen)})
    return side


def test_zigzags_change_the_panels_beside_a_side(module):
    flat()
    graph = drawing([(1, 0, 0), (1, 2, 0), (0, 1, 0), (2, 1, 0), (1, 1, 0)], [(0, 4), (4, 1), (2, 4), (4, 3)])
    bpy.ops.quadloom.tile_surface(patch_graph=graph.name, show_patches=True, panel_count=250)
    panels = bpy.context.active_object
    assert {len(face) for face in shapes.arrays(panels)[1]} == {4}
    patches = bpy.data.objects["Floor Patches"]
    shapes.choose(patches)
    assert "No side is selected" in refused(bpy.ops.quadloom.zigzag)
    side = select_side(patches, module)
    assert bpy.ops.quadloom.zigzag(pair=True) == {"FINISHED"}
    check_surface(panels)
    assert {len(face) for face in shapes.arrays(panels)[1]} == {3, 4}
    assert [edit["side"] for edit in state(panels)["edits"]] == [side]
    once = shapes.arrays(panels)[1]
    # What was kept only saves time.
    module("tilings").forget()
    bpy.ops.quadloom.zigzag(pair=True, position=0.2)
    twice = shapes.arrays(panels)[1]
    assert len(state(panels)["edits"]) == 2
    assert twice != once


def test_zigzags_on_all_sides_of_a_patch_and_what_was_edited_since(module):
    flat()
    graph = drawing([(1, 0, 0), (1, 2, 0)], [(0, 1)])
    bpy.ops.quadloom.tile_surface(patch_graph=graph.name, show_patches=True, panel_count=250)
    panels = bpy.context.active_object
    patches = bpy.data.objects["Floor Patches"]
    shapes.choose(patches)
    left = [list(e.vertices) for e in patches.data.edges if sum(patches.data.vertices[v].co.x for v in e.vertices) < 2.002]
    module("bridge").select(bpy.context, patches, {"edges": np.array(left)})
    bpy.ops.quadloom.zigzag(where="patch", pair=True)
    check_surface(panels)
    assert {len(face) for face in shapes.arrays(panels)[1]} == {3, 4}
    patches.data.vertices[0].co.x += 0.3
    assert "were edited" in refused(bpy.ops.quadloom.zigzag)


def test_a_polyhedron_becomes_regular_panels():
    shapes.choose(shapes.add("Cube", shapes.box(1)))
    assert bpy.ops.quadloom.tile_polyhedron(panel_size=0.5, show_patches=True) == {"FINISHED"}
    panels = bpy.context.active_object
    verts, faces = shapes.arrays(panels, world=True)
    lengths = [np.linalg.norm(verts[f[k]] - verts[f[(k + 1) % len(f)]]) for f in faces for k in range(len(f))]
    assert lengths == pytest.approx([lengths[0]] * len(lengths), rel=1e-4)
    assert {len(face) for face in faces} == {4}
    assert shapes.is_closed(faces)
    assert len(bpy.data.objects["Cube Patches"].data.edges) >= 12


def test_a_sheet_is_folded_about_the_middle_of_a_run(module):
    # A square without a quarter, zipped up from the inner corner: three squares meet there, as in a cube's corner.
    n = 4
    verts = np.array([[x, y, 0.0] for x in range(n + 1) for y in range(n + 1)])
    at = lambda i, j: i * (n + 1) + j  # noqa: E731
    whole = [(i, j) for i in range(n) for j in range(n) if i < n // 2 or j < n // 2]
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i, j in whole]
    used = sorted({v for face in faces for v in face})
    faces = [[used.index(v) for v in face] for face in faces]
    sheet = shapes.add("Sheet", (verts[used], faces))
    shapes.choose(sheet)
    runs = []
    for edge in sheet.data.edges:
        a, b = (sheet.data.vertices[v].co for v in edge.vertices)
        if (a.x == b.x == n / 2 and min(a.y, b.y) >= n / 2) or (a.y == b.y == n / 2 and min(a.x, b.x) >= n / 2):
            runs.append(list(edge.vertices))
    module("bridge").select(bpy.context, sheet, {"edges": np.array(runs)})
    assert bpy.ops.quadloom.fold_panels() == {"FINISHED"}
    made = bpy.context.active_object
    verts, faces = shapes.arrays(made, world=True)
    assert len(faces) == len(whole)
    uses = np.bincount(np.concatenate([list(face) for face in faces]))
    edges = {frozenset((f[k], f[(k + 1) % 4])) for f in faces for k in range(4)}
    assert len(uses) - len(edges) + len(faces) == 1
    assert np.ptp(verts, axis=0).min() > 1, "it stands up"
    lengths = [np.linalg.norm(np.subtract(*verts[list(edge)])) for edge in edges]
    assert lengths == pytest.approx([1] * len(lengths), rel=1e-3)
    sheet.hide_set(False)
    shapes.choose(sheet)
    module("bridge").select(bpy.context, sheet, {})
    assert "No border edge" in refused(bpy.ops.quadloom.fold_panels)


class Layout:
    """Stands for a layout where there is no window: what is drawn must exist."""

    def __init__(self) -> None:
        self.drawn: list[str] = []

    def row(self, **_) -> "Layout":
        return self

    column = box = grid_flow = row

    def label(self, *, text: str = "", **_) -> None:
        self.drawn.append(text)

    def prop(self, data, name: str, **_) -> None:
        assert name in data.bl_rna.properties, name
        self.drawn.append(name)

    def prop_search(self, data, name: str, where, collection: str) -> None:
        assert name in data.bl_rna.properties
        assert hasattr(where, collection)
        self.drawn.append(name)

    def operator(self, name: str, **_):
        made = bpy.ops
        for part in name.split("."):
            made = getattr(made, part)
        properties = {prop.identifier for prop in made.get_rna_type().properties}
        self.drawn.append(name)

        class Options:
            def __setattr__(self, key: str, value) -> None:
                assert key in properties, f"{name} has no {key}"

        return Options()


def test_the_panel_of_patches_offers_what_can_be_done(module):
    panels = module("panels.tile_surface")

    def drawn(panel) -> list[str]:
        layout = Layout()
        methods = {name: value for name, value in vars(panel).items() if callable(value)}
        shown = type("Shown", (), {**methods, "layout": layout})()
        context = type("Context", (), {"region": type("Region", (), {"width": 300})})()
        for name in ("scene", "mode", "active_object", "view_layer", "selected_objects", "window_manager"):
            setattr(context, name, getattr(bpy.context, name))
        panel.draw(shown, context)
        return layout.drawn

    source = cap()
    assert "quadloom.design_patches" in drawn(panels.QUADLOOM_PT_patches)
    assert "quadloom.tile_surface" in drawn(panels.QUADLOOM_PT_tile_surface)
    patches = begun()
    assert "quadloom.divide_part" in drawn(panels.QUADLOOM_PT_patches)
    bpy.ops.quadloom.divide_part()
    text = " ".join(drawn(panels.QUADLOOM_PT_patches))
    assert f"1 of {state(patches)['design']['last']['count']}" in text
    assert "quadloom.zigzag" in text
    assert any("Its patches are those" in line for line in panels.what_happens(bpy.context))
    shapes.choose(source)
    bpy.ops.object.mode_set(mode="EDIT")
    assert "quadloom.mark_corners" in drawn(panels.QUADLOOM_PT_patches)
