"""`quadloom.tile_polyhedron` and `quadloom.fold_panels`: free forms of regular panels (section 5.1), from a polyhedron's faces,
or from a sheet of panels whose borders are glued."""

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
from ..tiling_options import ColorOptions, TypeOptions

# Types of a shape that is regular but for rounding are told apart by more than rounding.
REGULAR = 1e-6


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    name: str
    own: Snapshot
    """The object's mesh in its own space, for errors."""
    mesh: Snapshot
    """In the shape that the world sees."""
    place: Array
    options: dict[str, Any]
    folds: bool

    def run(self, progress: native.Progress | None) -> Outcome:
        """The panels. Touches no bpy."""
        make = native.fold_tiling if self.folds else native.tile_polyhedron
        result = make(self.mesh, progress=progress, **self.options)
        graph = None if self.folds else patch_graphs.snapshot(result.patch_graph)
        return Outcome(result, graph, tilings.measured(result))


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    result: Any
    patches: Snapshot | None
    report: dict[str, Any]


class _FormOperator(JobOperator):
    """What both share: results, errors and the place."""

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Puts the panels into the scene."""
        task = self._task
        source = bpy.data.objects.get(task.name)
        if source is None:
            self.report({"ERROR"}, translated("The object was removed meanwhile"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        made = tiling_objects.add_panels(context, source, outcome.result, task.place, self.color_by, outcome.report)
        if outcome.patches is not None and self.show_patches:
            tiling_objects.add_wire(context, source, outcome.patches, task.place)
        bridge.present(context, made, [source] if self.hide_input else [])
        irregularity = outcome.result.irregularity
        if irregularity < REGULAR:
            text = translated("all panels are regular")
        else:
            text = translated("the farthest from regular is off by {part:.1%} of an edge").format(part=irregularity)
        self.report({"INFO"}, "; ".join([*tiling_objects.summary(outcome.report)[:1], text]))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it. What is not the wheel's error is a bug and is raised."""
        if not isinstance(error, native.NativeError):
            raise error
        self.report({"ERROR"}, messages.shown(context, error, self._task.name, self._task.own))
        return {"CANCELLED"}

    def _read(self, context: bpy.types.Context, options: dict[str, Any], *, folds: bool) -> bool:
        obj = context.active_object
        depsgraph = context.evaluated_depsgraph_get()
        to_world = bridge.world_matrix(obj, depsgraph)
        if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-30:
            self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
            return False
        mesh = bridge.read(obj, depsgraph)
        shape, place = tiling_objects.shape_and_place(to_world)
        options = {**options, "type_tolerance": self.type_tolerance or None, "mirror": self.mirror, "rounds": self.rounds}
        self._task = Task(obj.name, mesh, mesh.transformed(shape), place, options, folds)
        return True


ROUNDS = IntProperty(
    name="Regularity",
    description="Most rounds that make the panels equilateral triangles and squares. They end earlier when all are",
    default=400,
    min=0,
    max=10_000,
    soft_max=1000,
)
HIDE = BoolProperty(
    name="Hide Input",
    description="Hide the object in the viewport and in renders. It is never altered",
    default=True,
)


class QUADLOOM_OT_tile_polyhedron(ColorOptions, TypeOptions, _FormOperator, bpy.types.Operator):
    """Turn the faces of the active mesh into patches of triangles and squares, shaped to be as regular as can be: a free
    form, not a cover of the faces. Faces may have any number of corners"""

    bl_idname = "quadloom.tile_polyhedron"
    bl_label = "Tile Polyhedron"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    panel_size: FloatProperty(
        name="Edge Length",
        description="Length of the panels' edges, in the world. 0 takes the mean length of the object's edges",
        default=0.0,
        min=0.0,
        soft_max=10.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    cones: BoolProperty(
        name="Points Inside Faces",
        description="Faces whose angles leave 30 or 60 degrees, such as pentagons and decagons, keep that at a point inside",
        default=True,
    )
    seed: IntProperty(name="Seed", description="Another seed takes other tilings of the faces", default=0, min=0)
    rounds: ROUNDS
    show_patches: BoolProperty(name="Show Faces", description="Add the borders of the faces as another object", default=False)
    hide_input: HIDE

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the object into a task; reports and returns False when it cannot be worked on."""
        options = {"edge_length": self.panel_size or None, "cones": self.cones, "seed": self.seed}
        return self._read(context, options, folds=False)


class QUADLOOM_OT_fold_panels(ColorOptions, TypeOptions, _FormOperator, bpy.types.Operator):
    """Glue borders of a sheet of triangles and squares and let it find its shape in space, all panels regular. Delete faces,
    then select border edges in Edit Mode: two runs are glued to one another, a single one is zipped up from its middle"""

    bl_idname = "quadloom.fold_panels"
    bl_label = "Fold Panels"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    glue: EnumProperty(
        name="Glue",
        description="How the selected runs of border edges are glued",
        items=[
            ("auto", "Automatic", "Two runs of as many edges to one another, others each about its middle"),
            ("together", "Two by Two", "The first run to the second, the third to the fourth"),
            ("middle", "About the Middle", "Each run is zipped up from its middle: its two halves are glued"),
        ],
        default="auto",
    )
    rounds: ROUNDS
    hide_input: HIDE

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the object into a task; reports and returns False when it cannot be worked on."""
        if not self._read(context, {}, folds=True):
            return False
        runs = selected_runs(self._task.mesh)
        lengths = [len(run) - 1 for run in runs]
        if not runs:
            self.report({"ERROR"}, translated("No border edge is selected: select the runs to glue, in Edit Mode"))
            return False
        together = self.glue == "together" or (self.glue == "auto" and len(runs) == 2 and lengths[0] == lengths[1])
        if together and (len(runs) % 2 or lengths[::2] != lengths[1::2]):
            text = translated("Runs of {lengths} edges cannot be glued two by two: select as many edges in both")
            self.report({"ERROR"}, text.format(lengths=", ".join(map(str, lengths))))
            return False
        if not together and any(length % 2 for length in lengths):
            text = translated("Runs of {lengths} edges have no middle vertex: select an even number of edges")
            self.report({"ERROR"}, text.format(lengths=", ".join(map(str, lengths))))
            return False
        if together:
            # Along the border both have their faces on the left; glued, one runs against the other.
            pairs = [(a, b[::-1]) for a, b in zip(runs[::2], runs[1::2], strict=True)]
            self._task.options["glue"] = pairs
        else:
            self._task.options["zips"] = [(run[len(run) // 2], len(run) // 2) for run in runs]
        return True


def selected_runs(mesh: Snapshot) -> list[list[int]]:
    """Vertices along each run of selected border edges, with the faces on the left, in the order of their first vertices."""
    following = np.arange(len(mesh.corner_verts)) + 1
    following[mesh.face_offsets[1:] - 1] = mesh.face_offsets[:-1]
    sides = set(zip(mesh.corner_verts.tolist(), mesh.corner_verts[following].tolist(), strict=True))
    if mesh.selected_edges is None:
        return []
    chosen = {frozenset(edge) for edge in mesh.edges[mesh.selected_edges].tolist()}
    after = {a: b for a, b in sorted(sides) if (b, a) not in sides and frozenset((a, b)) in chosen}
    runs = []
    # Loops have no beginning: they start at their lowest vertex.
    for start in [*sorted(set(after) - set(after.values())), *sorted(after)]:
        run = [start]
        while run[-1] in after:
            run.append(after.pop(run[-1]))
        if len(run) > 1:
            runs.append(run)
    return runs


classes = (QUADLOOM_OT_tile_polyhedron, QUADLOOM_OT_fold_panels)


def register() -> None:
    """Adds the operators."""
    for cls in classes:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Removes the operators."""
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
