"""Fixtures: an empty scene for each test, and the modules of the installed extension."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

import bpy
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent))

import shapes

PACKAGE = "bl_ext.user_default.quadloom"


@pytest.fixture(autouse=True)
def empty_scene():
    """No object, mesh or material is left of the test before, and the 3D cursor is in the middle."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for collection in (bpy.data.objects, bpy.data.meshes, bpy.data.materials):
        bpy.data.batch_remove(list(collection))
    bpy.context.scene.cursor.location = (0.0, 0.0, 0.0)


@pytest.fixture
def module():
    """A module of the extension by name: module("bridge")."""

    def load(name: str) -> ModuleType:
        return importlib.import_module(f"{PACKAGE}.{name}")

    return load


@pytest.fixture
def balls() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Two overlapping spheres, A active and B selected."""
    a = shapes.add("A", shapes.ball(12))
    b = shapes.add("B", shapes.ball(10), offset=(0.9, 0.3, 0.2), size=0.8)
    shapes.choose(a, b)
    return a, b


def refused(operator, **options) -> str:
    """Runs an operator that must not succeed; returns what it says. A script sees an error report as RuntimeError."""
    before = {obj.name for obj in bpy.data.objects}
    try:
        outcome = operator(**options)
    except RuntimeError as error:
        text = str(error)
    else:
        assert outcome == {"CANCELLED"}
        text = ""
    assert {obj.name for obj in bpy.data.objects} == before
    return text
