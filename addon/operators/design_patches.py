"""The partition of a surface by hand (Algorithm 1, user-guided): `quadloom.design_patches` begins, `quadloom.divide_part`
divides a part by one of its ranked partitions, `quadloom.change_division` takes another one or none in place of the last.

The object of the patches carries the choices made so far; Tile Surface, with it active, makes the panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import IntProperty, StringProperty

from .. import bridge, messages, native, patch_graphs, selection, tiling_objects, tilings
from ..attributes import Array, Snapshot
from ..jobs import JobOperator
from ..tiling_options import SURFACE_OPTIONS, TileSurfaceOptions, tile_surface_uses

# Partitions described in the redo panel, from the one chosen on.
LISTED = 6
# Points of a curve and of the side made of it differ by less than this part of the size of the patches.
SAME = 1e-6


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    source: str
    patches: str
    mesh: Snapshot
    """The source's own, for errors."""
    place: Array
    surface: tilings.Surface
    settings: dict[str, Any]
    choices: tuple[tilings.Choice, ...]
    """Made before."""
    divides: bool
    """Whether a part is divided."""
    part: int = -1
    """Which one; -1 for the one with the greatest defect, of those whose sides are selected if any are."""
    choice: int = 0
    """Which partition; past the last it begins anew."""
    selected: Array | None = None
    """(S,) which sides of the patches are selected."""

    def run(self, progress: native.Progress | None) -> Outcome:
        """The parts, and how the last was made. Touches no bpy."""
        design = tilings.design(self.surface, self.choices, progress)
        if not self.divides:
            return _outcome(design, self.choices, [], -1)
        part = self._chosen_part(design)
        found = native.partitions(design, part, progress=progress)
        if not found:
            return _outcome(design, self.choices, [], part)
        choices = (*self.choices, (part, self.choice % len(found)))
        return _outcome(tilings.design(self.surface, choices, progress), choices, found, part)

    def _chosen_part(self, design: Any) -> int:
        defects = np.abs(design.defects)
        if 0 <= self.part < len(defects):
            return self.part
        graph = design.patch_graph
        if self.selected is not None and graph is not None and len(self.selected) == len(graph.side_nodes):
            parts = np.repeat(np.arange(len(defects)), np.diff(graph.patch_offsets))
            share = np.bincount(parts, self.selected[graph.corner_sides], len(defects)) / np.diff(graph.patch_offsets)
            if share[defects > 0].max(initial=0) > 0:
                return int(np.argmax(np.where(defects > 0, share, -1)))
        return int(np.argmax(defects))


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    patches: Snapshot | None
    """None where corners of a part fall together."""
    new: Array
    """(N,2) the edges of the curves that were drawn last."""
    choices: tuple[tilings.Choice, ...]
    defects: list[int]
    part: int
    """The part that was to be divided, -1 for none."""
    ranked: list[tuple[float, list[int]]]
    """Score and defects of all its partitions."""


def _outcome(design: Any, choices: tuple[tilings.Choice, ...], found: Sequence[Any], part: int) -> Outcome:
    graph = design.patch_graph
    patches = None if graph is None else patch_graphs.snapshot(graph)
    new = np.empty((0, 2), np.int32)
    if found and patches is not None:
        points = np.concatenate(found[choices[-1][1]].curves)
        near = SAME * np.ptp(patches.positions, axis=0).max()
        middles = patches.positions[patches.edges]
        apart = np.abs(middles[:, :, None, :] - points).max(axis=-1).min(axis=-1)
        new = patches.edges[(apart < near).all(axis=1)]
    ranked = [(partition.score, partition.defects.tolist()) for partition in found]
    return Outcome(patches, new, choices, design.defects.tolist(), part, ranked)


class _DesignOperator(JobOperator):
    """What steps of a design share: the patches shown, and the errors."""

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Shows the parts and stores the choices with them."""
        task = self._task
        source = bpy.data.objects.get(task.source)
        if source is None:
            self.report({"ERROR"}, translated("The object was removed while it was divided"))
            return {"CANCELLED"}
        if task.divides and not outcome.ranked:
            text = translated("Part {part} cannot be divided: take another division before, or smaller panels")
            self.report({"ERROR"}, text.format(part=outcome.part + 1))
            return {"CANCELLED"}
        if outcome.patches is None:
            self.report({"ERROR"}, translated("Corners fall together there: take another partition, or smaller panels"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        design = {"settings": task.settings, "choices": outcome.choices, "defects": outcome.defects}
        if outcome.ranked:
            design["last"] = {"count": len(outcome.ranked), "score": outcome.ranked[outcome.choices[-1][1]][0]}
        patches = tiling_objects.show_patches(
            context, source, bpy.data.objects.get(task.patches), outcome.patches, task.place, {"design": design}
        )
        bridge.present(context, patches)
        bridge.select(context, patches, {"edges": outcome.new})
        self._tell(outcome)
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong with the surface and selects it. What is not the wheel's error is a bug and is raised."""
        if isinstance(error, IndexError):
            text = translated("The surface changed since the design was begun, and the choices do not fit it: begin anew")
            self.report({"ERROR"}, text)
            return {"CANCELLED"}
        if not isinstance(error, native.NativeError):
            raise error
        self.report({"ERROR"}, messages.shown(context, error, self._task.source, self._task.mesh))
        return {"CANCELLED"}

    def _tell(self, outcome: Outcome) -> None:
        lines = tiling_objects.describe(outcome.defects)
        if outcome.ranked:
            taken = outcome.choices[-1][1]
            text = translated("Part {part}, partition {choice} of {count}").format(
                part=outcome.part + 1, choice=taken + 1, count=len(outcome.ranked)
            )
            lines.insert(0, text)
            for k in range(taken, min(taken + LISTED, len(outcome.ranked))):
                score, defects = outcome.ranked[k]
                text = translated("{mark}{number}: {parts} parts, {curvature}; score {score:.2f}")
                curvature = ", ".join(tiling_objects.degrees(defect) for defect in defects)
                numbers = {"number": k + 1, "parts": len(defects), "score": score}
                lines.append(text.format(mark="→ " if k == taken else "", curvature=curvature, **numbers))
        self.summary = "\n".join(lines)
        self.report({"INFO"}, "; ".join(lines[: 2 if outcome.ranked else 1]))

    def _design_task(self, context: bpy.types.Context, patches: bpy.types.Object, **more: Any) -> Task | None:
        """The task that goes on with a design; reports and returns None when it cannot."""
        design = tiling_objects.state(patches)["design"]
        if not tiling_objects.is_untouched(patches):
            self.report({"ERROR"}, translated("The patches were edited by hand: tile with them as they are, or undo the edit"))
            return None
        source = tiling_objects.subject(patches).source
        try:
            surface, mesh, place = tiling_objects.surface(context, source, design["settings"])
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return None
        choices = tuple((part, choice) for part, choice in more.pop("choices", design["choices"]))
        return Task(source.name, patches.name, mesh, place, surface, design["settings"], choices, **more)


class QUADLOOM_OT_design_patches(TileSurfaceOptions, _DesignOperator, bpy.types.Operator):
    """Begin to divide the active object's surface into patches by hand: cut it into disks and show their sides as a second
    object. Divide Part goes on from there until no part has curvature left"""

    bl_idname = "quadloom.design_patches"
    bl_label = "Design Patches"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    summary: StringProperty(name="Summary", description="The parts", options={"HIDDEN", "SKIP_SAVE"}, default="")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel: what is divided."""
        layout = self.layout
        layout.use_property_split = True
        for line in self.summary.splitlines():
            layout.label(text=line)
        for name in SURFACE_OPTIONS:
            if name == "corners" or tile_surface_uses(self, name):
                layout.prop(self, name)

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the object into a task; reports and returns False when it cannot be worked on."""
        source = tiling_objects.subject(context.active_object, again=self.again).source
        settings = tiling_objects.settings(self, SURFACE_OPTIONS)
        try:
            surface, mesh, place = tiling_objects.surface(context, source, settings)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return False
        self._task = Task(source.name, "", mesh, place, surface, settings, (), divides=False)
        return True


class QUADLOOM_OT_divide_part(_DesignOperator, bpy.types.Operator):
    """Divide a part of the patches by the best of its partitions, or by another one in the list: lower scores are better. The
    curves drawn are selected. Without a number, the part whose sides are selected is taken, or the one with most curvature"""

    bl_idname = "quadloom.divide_part"
    bl_label = "Divide Part"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(lambda context: selection.why_no_design(context) or _why_flat(context))

    part: IntProperty(
        name="Part",
        description="Number of the part to divide. 0 takes the part whose sides are selected, or the one with most curvature",
        default=0,
        min=0,
    )
    choice: IntProperty(
        name="Partition",
        description="Which of the ranked partitions to take: 1 is the best. After the last comes the first again",
        default=1,
        min=1,
    )
    summary: StringProperty(name="Summary", description="The partitions", options={"HIDDEN", "SKIP_SAVE"}, default="")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel: the arrows of Partition go through the list."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "part")
        layout.prop(self, "choice")
        for line in self.summary.splitlines():
            layout.label(text=line)

    def _prepare(self, context: bpy.types.Context) -> bool:
        patches = context.active_object
        snapshot = bridge.read_base(patches)
        sides = patch_graphs.drawn(snapshot).side_of_edge
        chosen = np.zeros(len(sides), bool) if snapshot.selected_edges is None else snapshot.selected_edges
        # Curves drawn last are selected; they say nothing unless the artist selects in Edit Mode.
        selected = np.bincount(sides, chosen) > 0 if patches.mode == "EDIT" and len(sides) else None
        task = self._design_task(context, patches, divides=True, part=self.part - 1, choice=self.choice - 1, selected=selected)
        if task is not None:
            self._task = task
        return task is not None


class QUADLOOM_OT_change_division(_DesignOperator, bpy.types.Operator):
    """Take the next or the previous of the ranked partitions in place of the one chosen last, or take that back"""

    bl_idname = "quadloom.change_division"
    bl_label = "Change Last Division"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(lambda context: selection.why_no_design(context) or _why_no_choice(context))

    step: IntProperty(
        name="Step",
        description="How many places further in the list: 1 takes the next one, -1 the previous, 0 takes the division back",
        default=1,
    )
    summary: StringProperty(name="Summary", description="The partitions", options={"HIDDEN", "SKIP_SAVE"}, default="")

    @classmethod
    def description(cls, context: bpy.types.Context, properties: Any) -> str:
        """What the button does."""
        if properties.step == 0:
            return translated("Take the last division back")
        if properties.step < 0:
            return translated("Take the previous of the ranked partitions in place of the one chosen last")
        return translated("Take the next of the ranked partitions in place of the one chosen last")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        for line in self.summary.splitlines():
            self.layout.label(text=line)

    def _prepare(self, context: bpy.types.Context) -> bool:
        patches = context.active_object
        choices = tiling_objects.state(patches)["design"]["choices"]
        part, choice = choices[-1]
        task = self._design_task(
            context, patches, choices=choices[:-1], divides=self.step != 0, part=part, choice=choice + self.step
        )
        if task is not None:
            self._task = task
        return task is not None


def _why_flat(context: bpy.types.Context) -> str | None:
    design = tiling_objects.state(context.active_object)["design"]
    return None if any(design["defects"]) else translated("All parts are flat: tile the surface")


def _why_no_choice(context: bpy.types.Context) -> str | None:
    design = tiling_objects.state(context.active_object)["design"]
    return None if design["choices"] else translated("No part was divided yet")


classes = (QUADLOOM_OT_design_patches, QUADLOOM_OT_divide_part, QUADLOOM_OT_change_division)


def register() -> None:
    """Adds the operators."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the operators."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
