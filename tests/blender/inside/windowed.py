"""Runs inside a Blender with a window: modal runs, Esc, undo, and the panel.

A timer steps through the tests, because modal operators only run between Blender's own events. Argument: the folder to write
counts.json into. With a second argument, pictures of the panel go into that folder.
"""

import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Generator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import addon_utils
import bpy
import shapes

EXTENSION = "bl_ext.user_default.quadloom"
TICK = 0.05
MOST_SECONDS = 60.0


def view() -> dict:
    """The context of the first 3D viewport's sidebar."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    region = next(region for region in area.regions if region.type == "WINDOW")
    return {"window": window, "area": area, "region": region}


def start(resolution: int, **options) -> None:
    """Two overlapping spheres, and the operator started on them as a click would."""
    for block in (*bpy.data.objects, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    a = shapes.add("A", shapes.ball(resolution))
    b = shapes.add("B", shapes.ball(resolution), offset=(0.9, 0.3, 0.2))
    shapes.choose(a, b)
    bpy.ops.ed.undo_push(message="two spheres")
    with bpy.context.temp_override(**view()):
        assert bpy.ops.quadloom.boolean("INVOKE_DEFAULT", True, **options) == {"RUNNING_MODAL"}


def jobs():
    """The extension's jobs module."""
    return sys.modules[f"{EXTENSION}.jobs"]


def until_done() -> Generator[None, None, None]:
    """Waits for the job without blocking Blender."""
    deadline = time.monotonic() + MOST_SECONDS
    while jobs().running is not None:
        assert time.monotonic() < deadline, "the job did not end"
        yield


def test_a_modal_run_makes_the_result_in_one_undo_step() -> Generator[None, None, None]:
    start(12, operation="difference")
    assert jobs().running is not None
    yield from until_done()
    assert "A \N{MINUS SIGN} B" in bpy.data.objects
    assert {len(face.vertices) for face in bpy.data.objects["A \N{MINUS SIGN} B"].data.polygons} == {4}
    with bpy.context.temp_override(**view()):
        bpy.ops.ed.undo()
    yield
    assert sorted(obj.name for obj in bpy.data.objects) == ["A", "B"]
    assert not any(obj.hide_get() for obj in bpy.data.objects)


def test_esc_cancels_and_leaves_nothing() -> Generator[None, None, None]:
    start(60, operation="union")
    job = jobs().running
    yield
    # What the modal handler does on Esc; key events cannot be simulated before Blender 5.
    begin = time.monotonic()
    job.cancel()
    while not job.finished and time.monotonic() < begin + MOST_SECONDS:
        time.sleep(0.005)
    assert time.monotonic() - begin < 0.2
    yield from until_done()
    assert sorted(obj.name for obj in bpy.data.objects) == ["A", "B"]
    assert len(bpy.data.meshes) == 2
    assert not any(obj.hide_get() for obj in bpy.data.objects)


def test_a_modal_tiling_makes_the_panels_in_one_undo_step() -> Generator[None, None, None]:
    for block in (*bpy.data.objects, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    with bpy.context.temp_override(**view()):
        bpy.ops.curve.primitive_bezier_circle_add(radius=2.0)
    source = bpy.context.active_object.name
    bpy.ops.ed.undo_push(message="a circle")
    with bpy.context.temp_override(**view()):
        assert bpy.ops.quadloom.tile_curve("INVOKE_DEFAULT", True, panel_size=0.3) == {"RUNNING_MODAL"}
    yield from until_done()
    assert {len(face.vertices) for face in bpy.data.objects[f"{source} Panels"].data.polygons} == {3, 4}
    with bpy.context.temp_override(**view()):
        bpy.ops.ed.undo()
    yield
    assert [obj.name for obj in bpy.data.objects] == [source]


def test_a_modal_retopology_keeps_its_layout_for_the_next() -> Generator[None, None, None]:
    for block in (*bpy.data.objects, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    ball = shapes.add("Ball", shapes.ball(16))
    options = {"target_faces": 800, "base_vertices": 200, "hide_input": False, "keep_layout": True}
    for edges in ([0, 1, 2], [0, 1, 2, 40, 41]):
        for index in edges:
            ball.data.edges[index].use_edge_sharp = True
        shapes.choose(ball)
        bpy.ops.ed.undo_push(message="marked")
        with bpy.context.temp_override(**view()):
            assert bpy.ops.quadloom.retopologize("INVOKE_DEFAULT", True, **options) == {"RUNNING_MODAL"}
        yield from until_done()
        made = bpy.context.view_layer.objects.active
        assert {len(face.vertices) for face in made.data.polygons} == {4}
        edited = json.loads(made["quadloom_report"])["base_triangles_edited"]
    assert edited is not None
    with bpy.context.temp_override(**view()):
        bpy.ops.ed.undo()
    yield
    assert sorted(obj.name for obj in bpy.data.objects) == ["Ball", "Ball Quads"]


def test_panels_are_exported_from_the_file_browser(folder: Path) -> Generator[None, None, None]:
    for block in (*bpy.data.objects, *bpy.data.meshes):
        bpy.data.batch_remove([block])
    shapes.choose(shapes.add("Wall", shapes.ball(8)))
    windows = bpy.context.window_manager.windows
    with bpy.context.temp_override(**view()):
        assert bpy.ops.quadloom.export_panels("INVOKE_DEFAULT", True) == {"RUNNING_MODAL"}
    deadline = time.monotonic() + MOST_SECONDS
    browsers = []
    while not browsers:
        assert time.monotonic() < deadline, "the file browser did not open"
        yield
        browsers = [(w, a) for w in windows for a in w.screen.areas if a.type == "FILE_BROWSER"]
    (window, area), *_ = browsers
    while area.spaces.active.params is None:
        assert time.monotonic() < deadline, "the file browser has nothing to show"
        yield
    space = area.spaces.active
    assert type(space.active_operator).__name__ == "QUADLOOM_OT_export_panels"
    # What a user does there: another format at the side, which gives the name its ending, a folder, a name, the button.
    space.active_operator.format = "json"
    space.params.directory = str(folder).encode()
    space.params.filename = "wall.json"
    yield
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        assert bpy.ops.file.execute() == {"FINISHED"}
    path = folder / "wall.json"
    while not path.exists() or jobs().running is not None:
        assert time.monotonic() < deadline, "no file was written"
        yield
    assert len(json.loads(path.read_text(encoding="utf-8"))["panels"]) == len(bpy.data.objects["Wall"].data.polygons)


def test_the_panel_draws(folder: Path | None) -> Generator[None, None, None]:
    start(12, operation="union", hide_inputs=False)
    yield from until_done()
    bpy.data.objects["A \N{UNION} B"].hide_set(True)
    shapes.choose(bpy.data.objects["A"], bpy.data.objects["B"])
    place = view()
    place["area"].spaces.active.show_region_ui = True
    yield
    sidebar = next(region for region in place["area"].regions if region.type == "UI")
    sidebar.active_panel_category = "Quadloom"
    sidebar.tag_redraw()
    for _ in range(20):
        yield
    assert sidebar.active_panel_category == "Quadloom"
    photograph(folder, "panel-ready.png")
    shapes.choose(bpy.data.objects["A"])
    sidebar.tag_redraw()
    for _ in range(20):
        yield
    photograph(folder, "panel-grey.png")
    # Each of the other tools on what it is for, with the panel that redoes it.
    for name, primitive, options in (
        ("tile_curve", bpy.ops.curve.primitive_bezier_circle_add, {"panel_size": 0.3}),
        ("retopologize", bpy.ops.mesh.primitive_torus_add, {"target_faces": 800, "symmetry": "x", "preview": True}),
        (
            "tile_surface",
            bpy.ops.mesh.primitive_uv_sphere_add,
            {"panel_count": 400, "color_by": "type", "type_tolerance": 0.02},
        ),
    ):
        for other in bpy.data.objects:
            other.hide_set(True)
        if name == "tile_surface":
            # The sidebar has no room for all: those above make place.
            for above in ("tile_curve", "retopologize", "main"):
                sys.modules[f"{EXTENSION}.panels.{above}"].unregister()
        with bpy.context.temp_override(**view()):
            primitive()
            assert getattr(bpy.ops.quadloom, name)("EXEC_DEFAULT", True, **options) == {"FINISHED"}
        sidebar.tag_redraw()
        for _ in range(20):
            yield
        redo = next(region for region in place["area"].regions if region.type == "HUD")
        assert redo.height > 1, f"{name} has no panel to redo it"
        photograph(folder, f"panel-{name.replace('_', '-')}.png")


def photograph(folder: Path | None, name: str) -> None:
    """The whole screen, when pictures were asked for (Blender's own screenshots are black here)."""
    if folder is not None:
        subprocess.run(["import", "-window", "root", str(folder / name)], check=True, timeout=30)


def run(folder: Path, pictures: Path | None) -> Generator[None, None, None]:
    """Every test in turn; writes the counts and ends Blender."""
    counts = {"passed": 0, "failed": 0, "skipped": 0}
    tests = [
        test_a_modal_run_makes_the_result_in_one_undo_step(),
        test_esc_cancels_and_leaves_nothing(),
        test_a_modal_tiling_makes_the_panels_in_one_undo_step(),
        test_a_modal_retopology_keeps_its_layout_for_the_next(),
        test_panels_are_exported_from_the_file_browser(folder),
        test_the_panel_draws(pictures),
    ]
    for test in tests:
        try:
            yield from test
            counts["passed"] += 1
        except Exception:
            traceback.print_exc()
            counts["failed"] += 1
            yield from until_done()
    (folder / "counts.json").write_text(json.dumps(counts))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(int(counts["failed"] > 0))


def main() -> None:
    """Enables the extension and lets a timer drive `run`."""
    folder, *pictures = map(Path, sys.argv[sys.argv.index("--") + 1 :])
    bpy.context.preferences.view.show_splash = False
    addon_utils.enable(EXTENSION, default_set=True, persistent=True)
    steps = run(folder, pictures[0] if pictures else None)
    bpy.app.timers.register(lambda: next(steps, None) or TICK, first_interval=1.0)


main()
