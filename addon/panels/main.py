"""The tab "Quadloom" in the sidebar: what the boolean will do, its options, and why its button is grey."""

from __future__ import annotations

from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as translated

from .. import jobs, selection
from ..properties import BOOLEAN_OPTIONS
from . import layouts

SENTENCES = {
    "union": "“{a}” plus “{b}”",
    "difference": "“{a}” minus “{b}”",
    "intersection": "What “{a}” and “{b}” share",
}
ICONS = {"union": "SELECT_EXTEND", "difference": "SELECT_SUBTRACT", "intersection": "SELECT_INTERSECT"}


class QUADLOOM_PT_main(bpy.types.Panel):
    """Quad Boolean."""

    bl_idname = "QUADLOOM_PT_main"
    bl_label = "Quad Boolean"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """Reads counts only: it runs at every redraw."""
        layout = self.layout
        settings = context.scene.quadloom
        if jobs.running is not None:
            layout.progress(factor=jobs.running.fraction, text=translated(jobs.running.stage))
            layout.label(text="Esc cancels", icon="CANCEL")
            return
        layout.column(align=True).prop(settings, "operation", expand=True)
        reason = selection.why_no_boolean(context)
        if reason is None:
            self._say_what_happens(context, layout.column(align=True), settings.operation)
        else:
            layouts.sentences(context, layout, [reason])
        layouts.button(layout, "quadloom.boolean", settings, BOOLEAN_OPTIONS, icon=ICONS[settings.operation])

    def _say_what_happens(self, context: bpy.types.Context, layout: bpy.types.UILayout, operation: str) -> None:
        a, b = selection.operands(context)
        layout.label(text=translated(SENTENCES[operation]).format(a=a.name, b=b.name), icon="MESH_DATA")
        counts = [_count(context, obj) for obj in (a, b)]
        layout.label(text=f"{counts[0]} + {counts[1]}", icon="BLANK1")


class QUADLOOM_PT_options(bpy.types.Panel):
    """Options of the boolean."""

    bl_idname = "QUADLOOM_PT_options"
    bl_parent_id = "QUADLOOM_PT_main"
    bl_label = "Options"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """One row an option."""
        self.layout.use_property_split = True
        for name in BOOLEAN_OPTIONS:
            if name != "operation":
                self.layout.prop(context.scene.quadloom, name)


class QUADLOOM_PT_defects(bpy.types.Panel):
    """Defects of the mesh in Edit Mode."""

    bl_idname = "QUADLOOM_PT_defects"
    bl_parent_id = "QUADLOOM_PT_main"
    bl_label = "Check"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context: bpy.types.Context) -> None:
        """The button; its tooltip says why it is grey."""
        self.layout.operator("quadloom.select_defects", icon="RESTRICT_SELECT_OFF")


def _count(context: bpy.types.Context, obj: bpy.types.Object) -> str:
    """Faces of the object as its modifiers leave it, without evaluating anything."""
    mesh = obj.evaluated_get(context.view_layer.depsgraph).data
    faces, corners = len(mesh.polygons), len(mesh.loops)
    # 4 corners a face on average: quads, unless triangles and n-gons cancel out.
    return translated("{count:,} quads" if corners == 4 * faces else "{count:,} faces, not all quads").format(count=faces)


classes = (QUADLOOM_PT_main, QUADLOOM_PT_options, QUADLOOM_PT_defects)


def register() -> None:
    """Adds the panels, parents first."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the panels."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
