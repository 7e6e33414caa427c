"""`quadloom.tile_curve`: a closed plane curve, or a plane mesh's outline, becomes a mesh of triangles and squares."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import StringProperty
from mathutils import Matrix

from .. import attributes, bridge, materials, messages, native, outline, patterns, selection
from ..attributes import Array, Attribute, Snapshot
from ..jobs import JobOperator
from ..outline import OutlineError, Plane
from ..patterns import Layout, Request
from ..tiling_options import TILE_CURVE_OPTIONS, TileCurveOptions, tile_curve_uses

KIND, ORIENTATION = "tile_kind", "tile_orientation"


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    name: str
    plane: Plane
    request: Request

    def run(self, progress: native.Progress | None) -> Layout:
        """The panels. Touches no bpy."""
        return patterns.lay(self.request, progress)


class QUADLOOM_OT_tile_curve(TileCurveOptions, JobOperator, bpy.types.Operator):
    """Fill the active closed curve, or the outline of the active flat mesh, with panels of one size: triangles and squares.
    The object itself is not altered"""

    bl_idname = "quadloom.tile_curve"
    bl_label = "Tile Curve"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_outline)

    summary: StringProperty(name="Summary", description="What the last run made", options={"HIDDEN", "SKIP_SAVE"}, default="")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        layout = self.layout
        layout.use_property_split = True
        for line in self.summary.splitlines():
            layout.label(text=line)
        for name in TILE_CURVE_OPTIONS:
            row = layout.row()
            row.enabled = tile_curve_uses(self, name)
            row.prop(self, name)

    def finish(self, context: bpy.types.Context, layout: Layout) -> set[str]:
        """Puts the panels into the scene."""
        source = bpy.data.objects.get(self._task.name)
        if source is None:
            self.report({"ERROR"}, translated("The outline was removed while it was tiled"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        lines = _summary(layout)
        self.summary = "\n".join(lines)
        self._add_result(context, source, layout)
        for sentence, values in layout.notes:
            self.report({"WARNING"}, translated(sentence).format(**values))
        self.report({"INFO"}, "; ".join(lines))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and how to mend it. What is neither the outline's fault nor the wheel's error is a bug, and
        raised."""
        if isinstance(error, OutlineError):
            text = translated(error.sentence).format(name=self._task.name, **error.values)
        elif isinstance(error, native.NativeError):
            text = messages.sentence(error, (self._task.name, self._task.name))
        else:
            raise error
        self.report({"ERROR"}, text)
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the outline into a task; reports, selects what is wrong and returns False when it cannot be tiled."""
        obj = context.active_object
        wire = bridge.read_outline(context, obj)
        try:
            to_world = bridge.world_matrix(obj, context.evaluated_depsgraph_get())
            if not np.isfinite(to_world).all() or (np.linalg.norm(to_world[:3, :3], axis=0) < 1e-12).any():
                raise OutlineError("“{name}” has a scale of zero: scale it up first")
            loop = outline.closed_loop(wire.positions, wire.edges, wire.face_offsets, wire.corner_verts)
            positions = wire.positions[loop] @ to_world[:3, :3].T + to_world[:3, 3]
            different = outline.merged(positions)
            loop = loop[different]
            plane, points = outline.flatten(positions[different], to_world, loop)
            outline.check_simple(points, loop)
        except OutlineError as error:
            text = translated(error.sentence).format(name=obj.name, **error.values)
            where = _select(context, obj, wire, error.verts)
            self.report({"ERROR"}, text + (f" ({where})" if where else ""))
            return False
        request = Request(
            points=points,
            panel_size=self.panel_size,
            straight=self.straight,
            rotation=self.rotation if self.fix_rotation else None,
            pattern=self.pattern,
            number=self.number,
            seed=self.seed,
            memory=self.memory,
        )
        self._task = Task(obj.name, plane, request)
        return True

    def _add_result(self, context: bpy.types.Context, source: bpy.types.Object, layout: Layout) -> None:
        name = translated("{name} Panels").format(name=source.name)
        mesh = bridge.write(name, _snapshot(layout))
        made = bpy.data.objects.new(name, mesh)
        made.matrix_world = Matrix(self._task.plane.matrix.tolist())
        made["quadloom_report"] = json.dumps(_report(self._task.request, layout))
        context.collection.objects.link(made)
        bridge.present(context, made)


def _snapshot(layout: Layout) -> Snapshot:
    """The panels as a mesh with attributes and materials."""
    following = np.arange(len(layout.corner_verts)) + 1
    following[layout.face_offsets[1:] - 1] = layout.face_offsets[:-1]
    sides = np.stack([layout.corner_verts, layout.corner_verts[following]], axis=1)
    edges = np.unique(np.sort(sides, axis=1), axis=0).astype(np.int32)
    kinds = layout.kinds.astype(np.int32)[:, None]
    # Rhombi are rare: an object without has no material for them.
    panels = materials.KINDS[: max(patterns.SQUARE, int(layout.kinds.max())) + 1]
    return Snapshot(
        positions=np.column_stack([layout.positions, np.zeros(len(layout.positions))]),
        edges=edges,
        face_offsets=layout.face_offsets,
        corner_verts=layout.corner_verts,
        attributes={
            KIND: Attribute("FACE", "INT", kinds),
            ORIENTATION: Attribute("FACE", "INT", layout.orientations.astype(np.int32)[:, None]),
            attributes.MATERIAL: Attribute("FACE", "INT", kinds),
        },
        materials=[materials.named(*each) for each in panels],
    )


def _counts(layout: Layout) -> dict[str, int]:
    """How many panels there are of each kind."""
    return dict(zip(("triangles", "squares", "rhombi"), np.bincount(layout.kinds, minlength=3).tolist(), strict=True))


def _summary(layout: Layout) -> list[str]:
    counts = _counts(layout)
    if counts["rhombi"]:
        lines = [translated("{triangles:,} triangles, {squares:,} squares, {rhombi:,} thin rhombi").format(**counts)]
        if layout.rhombi_at_least == counts["rhombi"]:
            lines.append(translated("As few rhombi as can be"))
        else:
            lines.append(translated("At least {count:,} rhombi are needed").format(count=layout.rhombi_at_least))
        return lines
    lines = [translated("{triangles:,} triangles, {squares:,} squares").format(**counts)]
    if layout.count is None:
        lines.append(translated("More patterns than can be counted"))
    else:
        text = translated("1 pattern" if layout.count == 1 else "{count} patterns")
        lines.append(text.format(count=patterns.count_text(layout.count)))
    return lines


def _report(request: Request, layout: Layout) -> dict[str, Any]:
    """What is kept with the result. The count is text: it may pass any number type."""
    return {
        **_counts(layout),
        "panel_size": request.panel_size,
        "rotation": layout.rotation,
        "pattern": request.pattern,
        "number": request.number,
        "seed": request.seed,
        "patterns": None if layout.count is None else str(layout.count),
        "distance": layout.distance,
        "summary": _summary(layout),
    }


def _select(context: bpy.types.Context, obj: bpy.types.Object, wire: Snapshot, verts: Array) -> str:
    """Selects what these vertices of the wire are on the object; says what was selected."""
    if len(verts) == 0:
        return ""
    if obj.type == "CURVE":
        count = bridge.select_points(obj.data, verts, len(wire.positions))
        text = translated("1 control point selected" if count == 1 else "{count:,} control points selected")
        return text.format(count=count)
    if not bridge.can_select(obj, wire):
        return translated("apply the modifiers to see where")
    counts = bridge.select(context, obj, {"verts": verts})
    return translated("selected: {counts}").format(counts=messages.count_text(counts))


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_tile_curve)


def unregister() -> None:
    """Removes the operator and frees what it kept."""
    bpy.utils.unregister_class(QUADLOOM_OT_tile_curve)
    patterns.forget()
