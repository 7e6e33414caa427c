"""The extension as a whole: registration, the one module that imports the wheel, icons, the command line."""

import ast
import importlib
from pathlib import Path

import bpy
import pytest
import shapes
from conftest import PACKAGE

FOLDER = Path(importlib.import_module(PACKAGE).__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))


def imports(path: Path) -> set[str]:
    """Top-level names that a file imports absolutely."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add(node.module.partition(".")[0])
    return found


def test_registers_twice():
    package = importlib.import_module(PACKAGE)
    for _ in range(2):
        package.unregister()
        assert not hasattr(bpy.types.Scene, "quadloom")
        assert not hasattr(bpy.types, "QUADLOOM_OT_boolean")
        package.register()
        assert hasattr(bpy.types, "QUADLOOM_OT_boolean")


def test_only_native_imports_the_wheel():
    assert [path.name for path in FILES if "quadloom" in imports(path)] == ["native.py"]


def test_what_runs_on_the_worker_thread_knows_no_bpy():
    for name in ("attributes.py", "features.py", "outline.py", "patterns.py", "symmetry.py", "native.py"):
        assert not imports(FOLDER / name) & {"bpy", "bmesh", "mathutils"}


def test_every_icon_exists():
    icons = set(bpy.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items.keys())
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg == "icon" and isinstance(node.value, ast.Constant):
                assert node.value.value in icons, f"{path.name}: {node.value.value}"
    panel = importlib.import_module(f"{PACKAGE}.panels.main")
    assert set(panel.ICONS.values()) <= icons


def test_every_option_has_a_tooltip():
    operators = [name for name in dir(bpy.ops.quadloom) if not name.startswith("_")]
    assert len(operators) > 6
    for operator in operators:
        rna = getattr(bpy.ops.quadloom, operator).get_rna_type()
        assert rna.description
        for prop in rna.properties:
            assert prop.identifier == "rna_type" or prop.description, prop.identifier


@pytest.mark.parametrize(("operation", "bound", "expected"), [("union", max, (1.1, 1, 1)), ("difference", min, (-1, -1, -1))])
def test_the_command_writes_an_obj(tmp_path, module, operation, bound, expected):
    b_verts, b_faces = shapes.box(6)
    for name, (verts, faces) in (("a", shapes.ball(8)), ("b", (b_verts * 0.3 + (0.8, 0.2, 0.1), b_faces))):
        lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in verts]
        lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
        (tmp_path / f"{name}.obj").write_text("\n".join(lines) + "\n")
    inputs = [str(tmp_path / name) for name in ("a.obj", "b.obj")]
    target = tmp_path / "out.obj"
    assert module("command").main(["boolean", "--operation", operation, *inputs, "-o", str(target)]) == 0
    lines = target.read_text().splitlines()
    faces = [line for line in lines if line.startswith("f ")]
    assert {len(line.split()) for line in faces} == {5}
    verts = [[float(word) for word in line.split()[1:4]] for line in lines if line.startswith("v ")]
    for k in range(3):
        assert bound(v[k] for v in verts) == pytest.approx(expected[k], abs=1e-4), "axes as they came"


def test_the_command_reads_blend_files(tmp_path, module):
    source = shapes.MESHES.parent / "spot_and_blub.blend"
    target = tmp_path / "out.blend"
    arguments = ["boolean", "--operation", "difference", f"{source}:Spot", f"{source}:Blub", "-o", str(target)]
    assert module("command").main(arguments) == 0
    made = bpy.data.objects["Spot \N{MINUS SIGN} Blub"]
    assert {len(face.vertices) for face in made.data.polygons} == {4}
    assert [slot.material.name for slot in made.material_slots] == ["Hide", "Scales"]
    assert [group.name for group in made.vertex_groups] == ["Height"]
    assert [layer.name for layer in made.data.uv_layers] == ["Planar"]
    assert target.exists()


def test_the_command_tiles_an_outline(tmp_path, module):
    source, target = tmp_path / "l.obj", tmp_path / "out.obj"
    corners = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
    source.write_text("".join(f"v {x} {y} 0\n" for x, y in corners) + "f 1 2 3 4 5 6\n")
    arguments = ["tile-curve", str(source), "--panel-size", "0.5", "--rotation", "0", "-o", str(target)]
    assert module("command").main(arguments) == 0
    faces = [line for line in target.read_text().splitlines() if line.startswith("f ")]
    assert len(faces) == 12 / 0.25
    assert {len(line.split()) for line in faces} == {5}


def test_the_command_says_why_an_outline_cannot_be_tiled(tmp_path, module, capsys):
    source = tmp_path / "box.obj"
    verts, faces = shapes.box(1)
    lines = [f"v {x} {y} {z}" for x, y, z in verts] + ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    source.write_text("\n".join(lines) + "\n")
    assert module("command").main(["tile-curve", str(source), "-o", str(tmp_path / "out.obj")]) == 1
    assert "closed all round" in capsys.readouterr().err


def test_the_command_says_what_is_missing(tmp_path, module, capsys):
    target = str(tmp_path / "out.obj")
    assert module("command").main(["boolean", str(tmp_path / "none.obj"), "b.obj", "-o", target]) == 1
    assert "no such file" in capsys.readouterr().err
