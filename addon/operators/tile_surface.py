"""`quadloom.tile_surface`: the active object's surface as a new object of panels, triangles and squares of one size."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import StringProperty

from .. import bridge, messages, native, patch_graphs, selection, tiling_objects, tilings
from ..attributes import Array, Snapshot
from ..jobs import JobOperator
from ..tiling_options import SURFACE_OPTIONS, TILE_SURFACE_OPTIONS, TileSurfaceOptions, tile_surface_uses


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    source: str
    patches: str
    """The object of the patches, or none."""
    panels: str
    """The panels whose source is tiled again, or none."""
    mesh: Snapshot
    """The source's own, for errors."""
    place: Array
    recipe: tilings.Recipe
    drawn: patch_graphs.Drawn | None
    """The patches as they are drawn, if they are taken so."""
    stored: dict[str, Any]

    def run(self, progress: native.Progress | None) -> Outcome:
        """The panels, measured in the world. Touches no bpy."""
        result = tilings.tile(self.recipe, progress)
        graph = result.patch_graph
        return Outcome(result, graph and patch_graphs.snapshot(graph), len(self.recipe.surface.edges()))


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    result: Any
    patches: Snapshot | None
    """Borders of the patches as chains of edges, if there are patches."""
    marked: int
    """Edges that were followed because they are marked."""


class QUADLOOM_OT_tile_surface(TileSurfaceOptions, JobOperator, bpy.types.Operator):
    """Cover the active object's surface with panels of one size, triangles and squares, measured and sorted into types.
    Modifiers are included; the object itself is not altered. With panels active, their source is tiled again; with patches
    active, it is tiled with these"""

    bl_idname = "quadloom.tile_surface"
    bl_label = "Tile Surface"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_tiling)

    summary: StringProperty(name="Summary", description="What the last run made", options={"HIDDEN", "SKIP_SAVE"}, default="")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        layout = self.layout
        layout.use_property_split = True
        for line in self.summary.splitlines():
            layout.label(text=line)
        for name in TILE_SURFACE_OPTIONS:
            if name in {"panel_count", "panel_size"} and not tile_surface_uses(self, name):
                continue
            row = layout.row()
            row.enabled = tile_surface_uses(self, name)
            if name == "patch_graph":
                row.prop_search(self, name, context.scene, "objects")
            else:
                row.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Puts the panels into the scene."""
        task = self._task
        source = bpy.data.objects.get(task.source)
        if source is None:
            self.report({"ERROR"}, translated("The object was removed while it was tiled"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        report = outcome.result.report
        lines = tiling_objects.summary(report)
        self.summary = "\n".join(lines)
        patches = self._show_patches(context, source, outcome)
        stored = {**task.stored, "report": {"marked_edges": outcome.marked}}
        made = tiling_objects.show_panels(context, source, None, outcome.result, task.place, stored, patches)
        hidden = [source, bpy.data.objects.get(task.panels)] if self.hide_input else []
        bridge.present(context, made, [obj for obj in hidden if obj is not None])
        for warning in report["warnings"]:
            self.report({"WARNING"}, translated(warning))
        self.report({"INFO"}, "; ".join(lines))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it, on surface or patches. What is not the wheel's error is a bug and is raised."""
        if not isinstance(error, native.NativeError):
            raise error
        task = self._task
        patches = bpy.data.objects.get(task.patches)
        if patches is not None and task.drawn is not None and any(len(index) for index in error.graph.values()):
            self.report({"ERROR"}, messages.shown_on_graph(context, error, patches, task.drawn))
        else:
            self.report({"ERROR"}, messages.shown(context, error, task.source, task.mesh))
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the objects into a task; reports and returns False when they cannot be worked on."""
        subject = tiling_objects.subject(context.active_object, again=self.again)
        patches = subject.patches
        if self.patch_graph:
            patches = context.scene.objects.get(self.patch_graph)
            if patches is None or patches.type != "MESH" or patches == subject.source:
                text = translated("“{name}” is no mesh of patches: choose another object with edges, or none")
                self.report({"ERROR"}, text.format(name=self.patch_graph))
                return False
            tiling_objects.link_drawing(patches, subject.source)
        options = tiling_objects.settings(self)
        try:
            choices = self._chosen(patches, options)
            surface, mesh, place = tiling_objects.surface(context, subject.source, options)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return False
        drawn = tiling_objects.drawn(context, patches, place) if patches is not None and choices is None else None
        partition = self.partition if patches is None else "design" if choices is not None else "drawn"
        recipe = tilings.Recipe(
            surface, partition, tiling_objects.panel_options(options), choices or (), drawn and drawn.arrays()
        )
        stored = {"settings": options, "partition": partition, "choices": recipe.choices}
        stored["graph"] = patch_graphs.to_text(recipe.graph)
        names = [obj.name if obj is not None else "" for obj in (patches, subject.panels)]
        self._task = Task(subject.source.name, *names, mesh, place, recipe, drawn, stored)
        return True

    def _chosen(self, patches: bpy.types.Object | None, options: dict[str, Any]) -> tuple[tilings.Choice, ...] | None:
        """The choices that made these patches, where they still say what the patches are."""
        design = tiling_objects.state(patches).get("design") if patches is not None else None
        if design is None or not tiling_objects.is_untouched(patches):
            return None
        if any(design["defects"]):
            # Only the design itself can go on dividing, and its parts are those of its own size.
            options.update(design["settings"])
        elif tiling_objects.settings(self, SURFACE_OPTIONS) != design["settings"]:
            return None
        return tuple((part, choice) for part, choice in design["choices"])

    def _show_patches(self, context: bpy.types.Context, source: bpy.types.Object, outcome: Outcome) -> bpy.types.Object | None:
        """The patches as they lie on the surface: those of a surface with their object, others with a new one if asked for."""
        patches = bpy.data.objects.get(self._task.patches)
        own = patches if tiling_objects.is_patches(patches) else None
        if outcome.patches is None or (own is None and not self.show_patches):
            return own
        stored = tiling_objects.state(own) if own is not None else {}
        design = stored.get("design")
        if design is not None and self._task.recipe.partition == "design" and not any(design["defects"]):
            return own
        stored.pop("design", None)
        return tiling_objects.show_patches(context, source, own, outcome.patches, self._task.place, stored)


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_tile_surface)


def unregister() -> None:
    """Removes the operator and what was kept."""
    tilings.forget()
    bpy.utils.unregister_class(QUADLOOM_OT_tile_surface)
