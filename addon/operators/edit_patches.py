"""`quadloom.zigzag`: other panels for the patches beside a side whose edges are made to run in zigzag (section 4.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty

from .. import bridge, messages, native, patch_graphs, selection, tiling_objects, tilings
from ..attributes import Array, Snapshot
from ..jobs import JobOperator


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    source: str
    patches: str
    panels: str
    mesh: Snapshot
    """The source's own, for errors."""
    drawn: patch_graphs.Drawn
    place: Array
    recipe: tilings.Recipe
    """As the panels are now."""
    where: str
    selected: Array
    """(S,) bool: sides of the patches."""
    options: dict[str, Any]
    stored: dict[str, Any]

    def run(self, progress: native.Progress | None) -> Outcome:
        """The panels with further zigzags. Touches no bpy."""
        graph = tilings.tile(self.recipe, progress).patch_graph
        if graph is None or len(graph.side_nodes) != len(self.selected):
            raise LookupError
        edits = list(self.recipe.edits)
        if self.where == "patch":
            edits.append({"patch": _patch(graph, self.selected), **self.options})
        else:
            edits.extend({"side": side, **self.options} for side in np.flatnonzero(self.selected).tolist())
        recipe = tilings.Recipe(**{**vars(self.recipe), "edits": tuple(edits)})
        return Outcome(tilings.tile(recipe, progress), tuple(edits))


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    result: Any
    edits: tuple[dict[str, Any], ...]


class QUADLOOM_OT_zigzag(JobOperator, bpy.types.Operator):
    """Let the selected sides of the patches run in zigzag, edges that turn 30 degrees off: the patches beside get other
    panels, more fractured ones, and no vertex becomes irregular. Select sides on the object of the patches"""

    bl_idname = "quadloom.zigzag"
    bl_label = "Zigzag"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(lambda context: selection.why_no_patches(context) or _why_no_panels(context))

    where: EnumProperty(
        name="On",
        description="Which sides get zigzags",
        items=[
            ("sides", "Selected Sides", "Each side with all of its edges selected"),
            ("patch", "Selected Patch", "All sides of a three-sided patch, or two opposite ones of a four-sided patch: the one "
             "with most of its border selected"),
        ],
        default="sides",
    )  # fmt: skip
    edges: IntProperty(
        name="Edges",
        description="How many edges turn off, to the left as the side runs; to the right when negative",
        default=1,
        min=-100,
        max=100,
        soft_min=-8,
        soft_max=8,
    )
    pair: BoolProperty(
        name="Pair",
        description="As many edges turn off to the other side after them, so that the side runs on in its direction and fewer "
        "other sides change",
        default=True,
    )
    spread: BoolProperty(
        name="Spread",
        description="The edges lie apart along the side instead of one after the other: a more fractured pattern",
        default=False,
    )
    position: FloatProperty(
        name="Position",
        description="Where along the side their middle is wished for, as a part of its length. It lies elsewhere where only "
        "that has panels",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        self.layout.use_property_split = True
        for name in type(self).__annotations__:
            if name in {"where", "edges", "pair", "spread", "position"}:
                self.layout.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Gives the panels their new mesh."""
        task = self._task
        source, patches, panels = (bpy.data.objects.get(name) for name in (task.source, task.patches, task.panels))
        if source is None or patches is None or panels is None:
            self.report({"ERROR"}, translated("The panels or their surface were removed meanwhile"))
            return {"CANCELLED"}
        stored = {**task.stored, "edits": outcome.edits}
        tiling_objects.show_panels(context, source, panels, outcome.result, task.place, stored, patches)
        for warning in outcome.result.report["warnings"]:
            self.report({"WARNING"}, translated(warning))
        report = outcome.result.report
        text = translated("{sides} sides changed and {patches} patches have other panels")
        counts = {"sides": len(report["edited_sides"]), "patches": len(report["edited_patches"])}
        self.report({"INFO"}, "; ".join([text.format(**counts), *tiling_objects.summary(report)[:1]]))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it. What is not the wheel's error is a bug and is raised."""
        task = self._task
        if isinstance(error, LookupError):
            self.report({"ERROR"}, translated("The surface or its patches changed since it was tiled: tile it again first"))
            return {"CANCELLED"}
        if not isinstance(error, native.NativeError):
            raise error
        patches = bpy.data.objects.get(task.patches)
        if patches is not None and len(error.graph.get("sides", [])):
            self.report({"ERROR"}, messages.shown_on_graph(context, error, patches, task.drawn))
        else:
            self.report({"ERROR"}, messages.shown(context, error, task.source, task.mesh))
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the objects into a task; reports and returns False when they cannot be worked on."""
        patches = context.active_object
        panels = tiling_objects.panels_of(patches)
        stored = tiling_objects.state(panels)
        if self.edges == 0:
            self.report({"ERROR"}, translated("No edge is asked for: set Edges to 1 or -1"))
            return False
        if not tiling_objects.is_untouched(patches):
            self.report({"ERROR"}, translated("The patches were edited: tile the surface with them first"))
            return False
        snapshot = bridge.read_base(patches)
        drawn = patch_graphs.drawn(snapshot)
        chosen = np.zeros(len(snapshot.edges), bool) if snapshot.selected_edges is None else snapshot.selected_edges
        share = np.bincount(drawn.side_of_edge, chosen) / np.bincount(drawn.side_of_edge)
        selected = share == 1
        if not selected.any():
            self.report({"ERROR"}, translated("No side is selected: select all edges of one on the patches, in Edit Mode"))
            return False
        source = tiling_objects.subject(patches).source
        try:
            surface, mesh, place = tiling_objects.surface(context, source, stored["settings"])
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return False
        recipe = tilings.Recipe(
            surface,
            stored["partition"],
            tiling_objects.panel_options(stored["settings"]),
            choices=tuple((part, choice) for part, choice in stored["choices"]),
            graph=patch_graphs.from_text(stored.get("graph")),
            edits=tuple(stored.get("edits", ())),
        )
        options = {"edges": self.edges, "pair": self.pair, "spread": self.spread, "position": self.position}
        names = (source.name, patches.name, panels.name)
        self._task = Task(*names, mesh, drawn, place, recipe, self.where, selected, options, stored)
        return True


def _patch(graph: Any, selected: Array) -> int:
    """The patch most of whose sides are selected."""
    sizes = np.diff(graph.patch_offsets)
    share = np.bincount(np.repeat(np.arange(len(sizes)), sizes), selected[graph.corner_sides], len(sizes)) / sizes
    return int(np.argmax(share))


def _why_no_panels(context: bpy.types.Context) -> str | None:
    panels = tiling_objects.panels_of(context.active_object)
    if panels is None:
        return translated("“{name}” has no panels yet: tile the surface with it").format(name=context.active_object.name)
    return None


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_zigzag)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_zigzag)
