"""What the tools would work on, and why they cannot start. Cheap: panels ask at every redraw."""

from __future__ import annotations

from collections.abc import Callable

import bpy
from bpy.app.translations import pgettext_rpt as translated

from . import native, tiling_objects

WhyNot = Callable[[bpy.types.Context], str | None]
"""Why a tool cannot start, or None."""


def operands(context: bpy.types.Context) -> tuple[bpy.types.Object, bpy.types.Object]:
    """A (the active object) and B (the other selected mesh)."""
    active = context.active_object
    return active, next(obj for obj in _selected_meshes(context) if obj != active)


def why_no_boolean(context: bpy.types.Context) -> str | None:
    """Why the active and the other selected object cannot be combined, or None."""
    reason = _why_no_active(context, {"MESH"}, translated("The active object is not a mesh"))
    if reason is not None:
        return reason
    active = context.active_object
    others = [obj for obj in _selected_meshes(context) if obj != active]
    if len(others) != 1:
        text = translated("Select exactly one other mesh beside the active one; now selected: {count}")
        return text.format(count=len(others))
    return _why_no_faces(active) or _why_no_faces(others[0])


def why_no_outline(context: bpy.types.Context) -> str | None:
    """Why the active object has no outline to fill, or None."""
    reason = _why_no_active(context, {"CURVE", "MESH"}, translated("The active object is neither a curve nor a mesh"))
    if reason is not None:
        return reason
    active = context.active_object
    parts = active.data.splines if active.type == "CURVE" else active.data.edges
    if len(parts) == 0 and not active.modifiers and active.mode != "EDIT":
        return translated("“{name}” is empty").format(name=active.name)
    return None


def why_no_surface(context: bpy.types.Context) -> str | None:
    """Why the active object has no surface to work on, or None."""
    reason = _why_no_active(context, {"MESH"}, translated("The active object is not a mesh"))
    return reason or _why_no_faces(context.active_object)


def why_no_tiling(context: bpy.types.Context) -> str | None:
    """Why the active object has no surface to tile, or None. Patches have none of their own: their source has."""
    if context.active_object is not None and tiling_objects.subject(context.active_object).patches is not None:
        return _why_no_active(context, {"MESH"}, "")
    return why_no_surface(context)


def why_no_patches(context: bpy.types.Context) -> str | None:
    """Why the active object has no patches to work on, or None."""
    reason = _why_no_active(context, {"MESH"}, translated("The active object is not a mesh"))
    if reason is not None:
        return reason
    active = context.active_object
    if not tiling_objects.is_patches(active):
        return translated("“{name}” shows no patches: begin a design, or tile with Show Patch Graph").format(name=active.name)
    if tiling_objects.subject(active).patches is None:
        return translated("The surface of “{name}” is not in this scene").format(name=active.name)
    return None


def why_no_design(context: bpy.types.Context) -> str | None:
    """Why the active object has no design of patches that can be gone on with, or None."""
    reason = why_no_patches(context)
    if reason is not None:
        return reason
    active = context.active_object
    if "design" not in tiling_objects.state(active):
        return translated("“{name}” was not made by Design Patches: move its nodes and edges instead").format(name=active.name)
    return None


def _why_no_active(context: bpy.types.Context, types: set[str], otherwise: str) -> str | None:
    """What every tool asks first: the library, the mode, and the type of the active object."""
    if native.problem is not None:
        return native.problem
    if context.mode not in {"OBJECT", *(f"EDIT_{kind}" for kind in types)}:
        return translated("Only in Object Mode and Edit Mode")
    if context.active_object is None or context.active_object.type not in types:
        return otherwise
    return None


def _why_no_faces(obj: bpy.types.Object) -> str | None:
    # Modifiers and edits under way may add some: the operator will see.
    if len(obj.data.polygons) == 0 and not obj.modifiers and obj.mode != "EDIT":
        return translated("“{name}” has no faces").format(name=obj.name)
    return None


def _selected_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    return [obj for obj in context.selected_objects if obj.type == "MESH"]
