"""The panel of Tile Surface in the tab "Quadloom": how large the panels will be, what they follow, what was made, and why the
button is grey."""

from __future__ import annotations

import json
from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as translated

from .. import features, jobs, selection
from ..tiling_options import TILE_SURFACE_OPTIONS, tile_surface_uses
from . import layouts
from .retopologize import marked_edges

MAIN_OPTIONS = ("size_by", "panel_count", "panel_size", "partition", "show_patches", "pattern", "seed", "color_by")


class QUADLOOM_PT_tile_surface(bpy.types.Panel):
    """Tile Surface."""

    bl_idname = "QUADLOOM_PT_tile_surface"
    bl_label = "Tile Surface"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """Counts marks once after each change; otherwise reads properties only."""
        layout = self.layout
        settings = context.scene.quadloom.tile_surface
        layout.enabled = jobs.running is None
        made = context.active_object and context.active_object.get("quadloom_report")
        report = json.loads(made) if isinstance(made, str) else {}
        if "planarity_mean" in report:
            layouts.sentences(context, layout.box(), report["summary"])
        reason = selection.why_no_surface(context)
        if reason is None:
            layouts.sentences(context, layout, what_happens(context), icon="MOD_LATTICE")
        else:
            layouts.sentences(context, layout, [reason])
        layouts.button(layout, "quadloom.tile_surface", settings, TILE_SURFACE_OPTIONS, icon="MOD_LATTICE")
        column = layout.column()
        column.use_property_split = True
        for name in MAIN_OPTIONS:
            if tile_surface_uses(settings, name):
                column.prop(settings, name)
        layout.operator("quadloom.export_panels", icon="EXPORT")


class QUADLOOM_PT_tile_surface_options(bpy.types.Panel):
    """What the panels follow, how they are shaped, and what counts as one type."""

    bl_idname = "QUADLOOM_PT_tile_surface_options"
    bl_parent_id = "QUADLOOM_PT_tile_surface"
    bl_label = "Options"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Switches of what is followed, then one row an option."""
        layout = self.layout
        settings = context.scene.quadloom.tile_surface
        layout.label(text="Panel Edges Along")
        grid = layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        for source in features.SOURCES:
            grid.prop(settings, source)
        column = layout.column()
        column.use_property_split = True
        for name in TILE_SURFACE_OPTIONS:
            if name not in features.SOURCES and name not in MAIN_OPTIONS:
                row = column.row()
                row.enabled = tile_surface_uses(settings, name)
                row.prop(settings, name)


def what_happens(context: bpy.types.Context) -> list[str]:
    """What the button will do, in sentences."""
    settings = context.scene.quadloom.tile_surface
    name = context.active_object.name
    if settings.size_by == "count":
        lines = [translated("“{name}” becomes about {count:,} panels").format(name=name, count=settings.panel_count)]
    else:
        lines = [translated("“{name}” becomes panels of one size").format(name=name)]
    counts = marked_edges(context)
    # An edge may be marked more than once.
    total = sum(counts.get(source, 0) for source in features.SOURCES if getattr(settings, source))
    if total:
        lines.append(translated("Their edges follow {count:,} marked edges").format(count=total))
    if settings.detect:
        lines.append(translated("Sharp edges are followed as well") if total else translated("Sharp edges are followed"))
    return lines


classes = (QUADLOOM_PT_tile_surface, QUADLOOM_PT_tile_surface_options)


def register() -> None:
    """Adds the panels."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the panels."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
