"""The panel of Feature Retopology in the tab "Quadloom": what counts as a feature and how many edges that are, how large the
quads will be, and why the button is grey."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bpy.app.handlers import persistent
from bpy.app.translations import pgettext_iface as translated

from .. import bridge, features, jobs, selection
from ..properties import RETOPOLOGIZE_OPTIONS, retopologize_uses
from . import layouts

SIZES = (
    "size_by", "target_faces", "edge_length", "density_group", "density_factor",
    "symmetry", "symmetry_flip", "symmetry_tolerance",
)  # fmt: skip
DETECTION = ("detect_angle", "detect_length", "mark_detected")
# Counting reads the whole mesh: larger ones are counted when the operator runs.
MOST_EDGES = 500_000

_counted: tuple[int, dict[str, int]] | None = None
"""The mesh that was counted last, by its session number, and its marked edges by source; dropped when a mesh changes."""


class QUADLOOM_PT_retopologize(bpy.types.Panel):
    """Feature Retopology."""

    bl_idname = "QUADLOOM_PT_retopologize"
    bl_label = "Feature Retopology"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """Counts marks once after each change; otherwise reads properties only."""
        layout = self.layout
        settings = context.scene.quadloom.retopologize
        layout.enabled = jobs.running is None
        reason = selection.why_no_surface(context)
        layouts.sentences(context, layout, [reason] if reason is not None else what_happens(context))
        layouts.button(layout, "quadloom.retopologize", settings, RETOPOLOGIZE_OPTIONS, icon="MOD_REMESH")
        layout.label(text="Edge Loops Along")
        counts = {} if reason is not None else marked_edges(context)
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for source in features.SOURCES:
            label = translated(settings.bl_rna.properties[source].name)
            grid.prop(settings, source, text=f"{label} ({counts[source]:,})" if counts.get(source) else label)
        column = layout.column()
        column.use_property_split = True
        column.prop(settings, "detect")
        if settings.detect:
            for name in DETECTION:
                column.prop(settings, name)
        column.separator()
        for name in SIZES:
            if not retopologize_uses(settings, name):
                continue
            if name == "density_group" and reason is None:
                column.prop_search(settings, name, context.active_object, "vertex_groups")
            else:
                column.prop(settings, name)


class QUADLOOM_PT_retopologize_options(bpy.types.Panel):
    """Further options of Feature Retopology."""

    bl_idname = "QUADLOOM_PT_retopologize_options"
    bl_parent_id = "QUADLOOM_PT_retopologize"
    bl_label = "Options"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """One row an option."""
        self.layout.use_property_split = True
        shown = {*features.SOURCES, "detect", *DETECTION, *SIZES}
        settings = context.scene.quadloom.retopologize
        for name in RETOPOLOGIZE_OPTIONS:
            if name not in shown and retopologize_uses(settings, name):
                self.layout.prop(settings, name)


def what_happens(context: bpy.types.Context) -> list[str]:
    """What the button will do, in sentences."""
    settings = context.scene.quadloom.retopologize
    obj = context.active_object
    if settings.size_by == "faces":
        lines = [translated("“{name}” becomes about {count:,} quads").format(name=obj.name, count=settings.target_faces)]
    else:
        lines = [translated("“{name}” becomes quads of one size").format(name=obj.name)]
    counts = marked_edges(context)
    chosen = [source for source in features.SOURCES if getattr(settings, source)]
    if obj.mode == "EDIT":
        lines.append(translated("Marks are counted in Object Mode"))
    elif set(counts) >= set(chosen):
        # An edge may be marked more than once.
        total = sum(counts[source] for source in chosen)
        text = translated("{count:,} marked edges will be edge loops") if total else translated("No edge is marked")
        lines.append(text.format(count=total))
    if settings.detect:
        lines.append(translated("Sharp edges are found as well"))
    return lines


def marked_edges(context: bpy.types.Context) -> dict[str, int]:
    """Source -> number of edges marked by it on the active object's own mesh; those that are known."""
    global _counted
    obj = context.active_object
    mesh = obj.data
    if obj.mode == "EDIT":
        return {"selected": mesh.total_edge_sel}
    if len(mesh.edges) > MOST_EDGES:
        return {}
    if _counted is None or _counted[0] != mesh.session_uid:
        snapshot = bridge.read_base(obj)
        _counted = mesh.session_uid, {s: int(features.marked_by(snapshot, s).sum()) for s in features.SOURCES}
    return _counted[1]


@persistent
def _forget(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Drops the count when a mesh changes."""
    global _counted
    if _counted is not None and depsgraph.id_type_updated("MESH"):
        _counted = None


@persistent
def _forget_all(*_: object) -> None:
    """Drops the count when another file is opened, or a step is undone."""
    global _counted
    _counted = None


classes = (QUADLOOM_PT_retopologize, QUADLOOM_PT_retopologize_options)


def register() -> None:
    """Adds the panels and listens for changes of meshes."""
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.app.handlers.depsgraph_update_post.append(_forget)
    for handlers in (bpy.app.handlers.load_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.append(_forget_all)


def unregister() -> None:
    """Removes the panels."""
    for handlers in (bpy.app.handlers.load_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.remove(_forget_all)
    bpy.app.handlers.depsgraph_update_post.remove(_forget)
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
