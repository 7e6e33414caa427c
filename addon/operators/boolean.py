"""`quadloom.boolean`: the boolean of the active object and the other selected one, as a new object of quads."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated

from .. import attributes, bridge, messages, native, selection
from ..attributes import Snapshot
from ..jobs import JobOperator
from ..properties import OPERATION_SIGNS, BooleanOptions

WHEEL_OPTIONS = ("operation", "retraction_distance", "alpha", "layout", "filler", "sharp_angle")


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts. Both meshes are in A's own space."""

    names: tuple[str, str]
    operands: tuple[Snapshot, Snapshot]
    options: dict[str, Any]

    def run(self, progress: native.Progress | None) -> tuple[Any, Snapshot, list[str]]:
        """The native result, the result with its attributes, and the attributes left out. Touches no bpy."""
        a, b = self.operands
        result = native.boolean(a, b, progress=progress, **self.options)
        return result, *attributes.mix(a, b, result, b_is_turned=self.options["operation"] == "difference")


class QUADLOOM_OT_boolean(BooleanOptions, JobOperator, bpy.types.Operator):
    """Combine the active object with the other selected one into a new mesh of quads, keeping every quad away from the seam.
    Modifiers are included; the objects themselves are not altered"""

    bl_idname = "quadloom.boolean"
    bl_label = "Quad Boolean"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_boolean)

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        layout = self.layout
        layout.use_property_split = True
        for name in BooleanOptions.__annotations__:
            layout.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: tuple[Any, Snapshot, list[str]]) -> set[str]:
        """Puts the result into the scene."""
        result, snapshot, left_out = outcome
        inputs = [bpy.data.objects.get(name) for name in self._task.names]
        if None in inputs:
            self.report({"ERROR"}, translated("One of the objects was removed while the boolean ran"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        made = self._add_result(context, inputs, snapshot, result)
        bridge.present(context, made, inputs if self.hide_inputs else [])
        for warning in result.report["warnings"]:
            self.report({"WARNING"}, translated(warning))
        if left_out:
            text = translated("Attributes of unlike types were taken from “{name}” only: {layers}")
            self.report({"WARNING"}, text.format(name=inputs[0].name, layers=", ".join(left_out)))
        counts = result.report["faces_kept"], result.report["faces_new"]
        self.report({"INFO"}, translated("{kept:,} quads kept, {new:,} new").format(kept=counts[0], new=counts[1]))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it. What is not the wheel's error is a bug and is raised."""
        if not isinstance(error, native.NativeError):
            raise error
        text = messages.sentence(error, self._task.names)
        objects = [bpy.data.objects.get(name) for name in self._task.names]
        if None not in objects:
            where = messages.select_elements(context, error, objects, self._task.operands)
            text += f" ({where})" if where else ""
        self.report({"ERROR"}, text)
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads both objects into a task; reports and returns False when they cannot be combined."""
        active, other = selection.operands(context)
        depsgraph = context.evaluated_depsgraph_get()
        to_world = [bridge.world_matrix(obj, depsgraph) for obj in (active, other)]
        for obj, matrix in zip((active, other), to_world, strict=True):
            if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
                self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
                return False
        # All happens in A's own space, so that A's kept vertices come back unchanged, and B's too when they share it.
        same = np.array_equal(to_world[0], to_world[1])
        b_to_a = np.eye(4) if same else np.linalg.solve(to_world[0], to_world[1])
        options = {name: getattr(self, name) for name in WHEEL_OPTIONS}
        options["blend_radius"] = self.blend_radius / abs(np.linalg.det(to_world[0][:3, :3])) ** (1 / 3)
        meshes = bridge.read(active, depsgraph), bridge.read(other, depsgraph).transformed(b_to_a)
        self._task = Task((active.name, other.name), meshes, options)
        return True

    def _add_result(
        self, context: bpy.types.Context, inputs: list[bpy.types.Object], snapshot: Snapshot, result: Any
    ) -> bpy.types.Object:
        name = f"{inputs[0].name} {OPERATION_SIGNS[self.operation]} {inputs[1].name}"
        on_curve = attributes.edge_indices(snapshot.edges, result.intersection_edges)
        if self.mark_curve and self.blend_radius == 0:
            snapshot = snapshot.with_sharp_edges(on_curve)
        mesh = bridge.write(name, snapshot)
        for source in reversed(inputs):
            bridge.copy_active_layers(source.data, mesh)
        made = bpy.data.objects.new(name, mesh)
        bridge.assign_groups(made, snapshot)
        made["quadloom_report"] = json.dumps(result.report)
        bridge.copy_transform(inputs[0], made)
        context.collection.objects.link(made)
        # The seam is what an artist works on next: it is selected when Edit Mode opens.
        bridge.select(context, made, {"edges": result.intersection_edges})
        return made


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_boolean)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_boolean)
