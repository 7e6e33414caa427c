"""The panel of Tile Curve in the tab "Quadloom": its options, how many patterns there are, and why its button is grey."""

from __future__ import annotations

import json

import bpy
from bpy.app.translations import pgettext_iface as translated

from .. import jobs, selection
from ..tiling_options import TILE_CURVE_OPTIONS, tile_curve_uses
from . import layouts


class QUADLOOM_PT_tile_curve(bpy.types.Panel):
    """Tile Curve."""

    bl_idname = "QUADLOOM_PT_tile_curve"
    bl_label = "Tile Curve"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """Reads properties only: it runs at every redraw."""
        layout = self.layout
        settings = context.scene.quadloom.tile_curve
        layout.enabled = jobs.running is None
        made = context.active_object and context.active_object.get("quadloom_report")
        report = json.loads(made) if isinstance(made, str) else {}
        if "patterns" in report:
            box = layout.box().column(align=True)
            for line in report["summary"]:
                box.label(text=line)
        reason = selection.why_no_outline(context)
        if reason is None:
            text = translated("Fills “{name}”").format(name=context.active_object.name)
            layouts.sentences(context, layout, [text], icon="MESH_GRID")
        else:
            layouts.sentences(context, layout, [reason])
        layouts.button(layout, "quadloom.tile_curve", settings, TILE_CURVE_OPTIONS, icon="MESH_GRID")
        column = layout.column()
        column.use_property_split = True
        for name in TILE_CURVE_OPTIONS:
            shown = column.row()
            shown.enabled = tile_curve_uses(settings, name)
            shown.prop(settings, name)


def register() -> None:
    """Adds the panel."""
    bpy.utils.register_class(QUADLOOM_PT_tile_curve)


def unregister() -> None:
    """Removes the panel."""
    bpy.utils.unregister_class(QUADLOOM_PT_tile_curve)
