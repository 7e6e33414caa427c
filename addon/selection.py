"""What the tools would work on, and why they cannot start. Cheap: panels ask at every redraw."""

from __future__ import annotations

import bpy
from bpy.app.translations import pgettext_rpt as translated

from . import native


def operands(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A (the active object) and B (the other selected mesh)."""
    active = context.active_object
    return active, next(obj for obj in _selected_meshes(context) if obj != active)


def why_not(context: bpy.types.Context) -> str | None:
    """Why the boolean cannot start, or None. Cheap: it is asked at every redraw."""
    if native.problem is not None:
        return native.problem
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        return translated("Only in Object Mode and Edit Mode")
    active = context.active_object
    if active is None or active.type != "MESH":
        return translated("The active object is not a mesh")
    others = [obj for obj in _selected_meshes(context) if obj != active]
    if len(others) != 1:
        text = translated("Select exactly one other mesh beside the active one; now selected: {count}")
        return text.format(count=len(others))
    for obj in (active, others[0]):
        if len(obj.data.polygons) == 0 and not obj.modifiers and obj.mode != "EDIT":
            return translated("“{name}” has no faces").format(name=obj.name)
    return None


def why_no_outline(context: bpy.types.Context) -> str | None:
    """Why the active object cannot be tiled, or None."""
    if native.problem is not None:
        return native.problem
    if context.mode not in {"OBJECT", "EDIT_CURVE", "EDIT_MESH"}:
        return translated("Only in Object Mode and Edit Mode")
    active = context.active_object
    if active is None or active.type not in {"CURVE", "MESH"}:
        return translated("The active object is neither a curve nor a mesh")
    parts = active.data.splines if active.type == "CURVE" else active.data.edges
    if len(parts) == 0 and not active.modifiers and active.mode != "EDIT":
        return translated("“{name}” is empty").format(name=active.name)
    return None


def why_no_surface(context: bpy.types.Context) -> str | None:
    """Why the active object cannot be retopologized, or None."""
    if native.problem is not None:
        return native.problem
    if context.mode not in {"OBJECT", "EDIT_MESH"}:
        return translated("Only in Object Mode and Edit Mode")
    active = context.active_object
    if active is None or active.type != "MESH":
        return translated("The active object is not a mesh")
    if len(active.data.polygons) == 0 and not active.modifiers and active.mode != "EDIT":
        return translated("“{name}” has no faces").format(name=active.name)
    return None


def _selected_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in context.selected_objects if obj.type == "MESH"]
