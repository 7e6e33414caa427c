"""The panel of Tile Surface in the tab "Quadloom": how large the panels will be, what they follow, what was made, the patches
that are chosen or drawn, and why a button is grey."""

from __future__ import annotations

import json
from typing import ClassVar

import bpy
from bpy.app.translations import pgettext_iface as translated

from .. import features, jobs, selection, tiling_objects
from ..tiling_options import TILE_SURFACE_OPTIONS, tile_surface_uses
from . import layouts
from .retopologize import marked_edges

MAIN_OPTIONS = ("size_by", "panel_count", "panel_size", "partition", "pattern", "seed", "color_by")
PATCH_OPTIONS = ("patch_graph", "corners", "show_patches")


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
        reason = selection.why_no_tiling(context)
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
        row = layout.row(align=True)
        row.operator_context = "INVOKE_DEFAULT"
        row.operator("quadloom.tile_polyhedron", icon="MESH_ICOSPHERE")
        row.operator("quadloom.fold_panels", icon="MOD_SIMPLEDEFORM")


class QUADLOOM_PT_patches(bpy.types.Panel):
    """Patches chosen by hand, drawn, and edited."""

    bl_idname = "QUADLOOM_PT_patches"
    bl_parent_id = "QUADLOOM_PT_tile_surface"
    bl_label = "Patches"
    bl_category = "Quadloom"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """What can be done with the active object: surface or patches."""
        layout = self.layout
        settings = context.scene.quadloom.tile_surface
        active = context.active_object
        if context.mode == "EDIT_MESH":
            row = layout.row(align=True)
            row.label(text="Mark Corners")
            for angle in ("2", "3", "4", "0"):
                text = f"{30 * int(angle)}°" if angle != "0" else "Clear"
                row.operator("quadloom.mark_corners", text=text).angle = angle
        if tiling_objects.is_patches(active):
            self._draw_design(context, active)
        else:
            layouts.button(layout, "quadloom.design_patches", settings, TILE_SURFACE_OPTIONS, icon="MESH_GRID")
            column = layout.column()
            column.use_property_split = True
            column.prop_search(settings, "patch_graph", context.scene, "objects")
            for name in PATCH_OPTIONS[1:]:
                row = column.row()
                row.enabled = tile_surface_uses(settings, name)
                row.prop(settings, name)

    def _draw_design(self, context: bpy.types.Context, patches: bpy.types.Object) -> None:
        layout = self.layout
        layout.operator_context = "INVOKE_DEFAULT"
        design = tiling_objects.state(patches).get("design")
        if design is None:
            lines = [translated("Move nodes and edges, then Tile Surface with the patches active")]
        else:
            lines = tiling_objects.describe(design["defects"])
        layouts.sentences(context, layout, lines)
        if design is not None:
            layout.operator("quadloom.divide_part", icon="MOD_EDGESPLIT")
            row = layout.row(align=True)
            last = design.get("last")
            if last is not None:
                place = translated("{choice} of {count}").format(choice=design["choices"][-1][1] + 1, count=last["count"])
                row.label(text=place)
            row.operator("quadloom.change_division", text="", icon="TRIA_LEFT").step = -1
            row.operator("quadloom.change_division", text="", icon="TRIA_RIGHT").step = 1
            row.operator("quadloom.change_division", text="", icon="LOOP_BACK").step = 0
        layout.operator("quadloom.zigzag", icon="MOD_SIMPLIFY")


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
            if name not in {*features.SOURCES, *MAIN_OPTIONS, *PATCH_OPTIONS}:
                row = column.row()
                row.enabled = tile_surface_uses(settings, name)
                row.prop(settings, name)


def what_happens(context: bpy.types.Context) -> list[str]:
    """What the button will do, in sentences."""
    settings = context.scene.quadloom.tile_surface
    subject = tiling_objects.subject(context.active_object, again=settings.again)
    name = subject.source.name
    if settings.size_by == "count":
        lines = [translated("“{name}” becomes about {count:,} panels").format(name=name, count=settings.panel_count)]
    else:
        lines = [translated("“{name}” becomes panels of one size").format(name=name)]
    if subject.patches is not None:
        return [*lines, translated("Its patches are those of “{name}”").format(name=subject.patches.name)]
    if subject.panels is not None:
        return [*lines, translated("It is the surface that “{name}” was made from").format(name=subject.panels.name)]
    if settings.patch_graph:
        lines.append(translated("Its patches are those of “{name}”").format(name=settings.patch_graph))
    counts = marked_edges(context)
    # An edge may be marked more than once.
    total = sum(counts.get(source, 0) for source in features.SOURCES if getattr(settings, source))
    if total:
        lines.append(translated("Their edges follow {count:,} marked edges").format(count=total))
    if settings.detect:
        lines.append(translated("Sharp edges are followed as well") if total else translated("Sharp edges are followed"))
    return lines


classes = (QUADLOOM_PT_tile_surface, QUADLOOM_PT_patches, QUADLOOM_PT_tile_surface_options)


def register() -> None:
    """Adds the panels."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the panels."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
