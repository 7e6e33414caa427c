"""`quadloom.tile_surface`: the active object's surface as a new object of panels, triangles and squares of one size."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import StringProperty
from mathutils import Matrix

from .. import attributes, bridge, features, materials, messages, native, selection
from ..attributes import Array, Attribute, Snapshot
from ..jobs import JobOperator
from ..tiling_options import TILE_SURFACE_OPTIONS, TileSurfaceOptions, tile_surface_uses

KIND, TYPE, PLANARITY, AREA, EDGE_CLASS = "tile_kind", "panel_type", "panel_planarity", "panel_area", "edge_class"
DEFECT = "angle_defect"
WHEEL_OPTIONS = (
    "partition", "pattern", "seed", "patch_panels", "corner_angle", "shaping_rounds", "flattening_rounds", "closeness", "mirror"
)  # fmt: skip


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    name: str
    mesh: Snapshot
    """In the object's own space."""
    shape: Array
    """(4,4): what the object's transform does to its shape."""
    place: Array
    """(4,4): where it then puts it, without scale."""
    sources: tuple[str, ...]
    options: dict[str, Any]

    def run(self, progress: native.Progress | None) -> Outcome:
        """The panels, measured in the world. Touches no bpy."""
        edges = features.feature_edges(self.mesh, self.sources)
        result = native.tile_surface(self.mesh.transformed(self.shape), edges, progress=progress, **self.options)
        graph = result.patch_graph
        return Outcome(_snapshot(result), result.panels, graph and _patch_graph(graph), len(edges), result.report)


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    mesh: Snapshot
    schedule: Any
    patches: Snapshot | None
    """Borders of the patches as chains of edges, if there are patches."""
    marked: int
    """Edges that were followed because they are marked."""
    report: dict[str, Any]


class QUADLOOM_OT_tile_surface(TileSurfaceOptions, JobOperator, bpy.types.Operator):
    """Cover the active object's surface with panels of one size, triangles and squares, measured and sorted into types.
    Modifiers are included; the object itself is not altered"""

    bl_idname = "quadloom.tile_surface"
    bl_label = "Tile Surface"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    summary: StringProperty(name="Summary", description="What the last run made", options={"HIDDEN", "SKIP_SAVE"}, default="")

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        layout = self.layout
        layout.use_property_split = True
        for line in self.summary.splitlines():
            layout.label(text=line)
        for name in TILE_SURFACE_OPTIONS:
            if name not in {"panel_count", "panel_size"} or tile_surface_uses(self, name):
                row = layout.row()
                row.enabled = tile_surface_uses(self, name)
                row.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Puts the panels into the scene."""
        source = bpy.data.objects.get(self._task.name)
        if source is None:
            self.report({"ERROR"}, translated("The object was removed while it was tiled"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        lines = summary(outcome.report)
        self.summary = "\n".join(lines)
        self._add_result(context, source, outcome)
        for warning in outcome.report["warnings"]:
            self.report({"WARNING"}, translated(warning))
        self.report({"INFO"}, "; ".join(lines))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it. What is not the wheel's error is a bug and is raised."""
        if not isinstance(error, native.NativeError):
            raise error
        self.report({"ERROR"}, messages.shown(context, error, self._task.name, self._task.mesh))
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the object into a task; reports and returns False when it cannot be worked on."""
        obj = context.active_object
        depsgraph = context.evaluated_depsgraph_get()
        to_world = bridge.world_matrix(obj, depsgraph)
        if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-30:
            self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
            return False
        options = {name: getattr(self, name) for name in WHEEL_OPTIONS}
        options["feature_angle"] = self.detect_angle if self.detect else math.pi
        options["type_tolerance"] = self.type_tolerance or None
        if self.size_by == "count":
            options["target_panels"] = self.panel_count
        else:
            options["edge_length"] = self.panel_size
        shape, place = _shape_and_place(to_world)
        sources = tuple(source for source in features.SOURCES if getattr(self, source))
        self._task = Task(obj.name, bridge.read(obj, depsgraph), shape, place, sources, options)
        return True

    def _add_result(self, context: bpy.types.Context, source: bpy.types.Object, outcome: Outcome) -> None:
        name = translated("{name} Panels").format(name=source.name)
        mesh = bridge.write(name, _colored(outcome, self.color_by))
        made = bpy.data.objects.new(name, mesh)
        made.matrix_world = Matrix(self._task.place.tolist())
        report = {**outcome.report, "marked_edges": outcome.marked, "summary": summary(outcome.report)}
        made["quadloom_report"] = json.dumps(report)
        context.collection.objects.link(made)
        if self.show_patches and outcome.patches is not None:
            name = translated("{name} Patches").format(name=source.name)
            graph = bpy.data.objects.new(name, bridge.write(name, outcome.patches))
            graph.matrix_world = made.matrix_world
            context.collection.objects.link(graph)
        bridge.present(context, made, [source] if self.hide_input else [])


def summary(report: dict[str, Any]) -> list[str]:
    """What was made, in short lines."""
    counts = translated("{triangles:,} triangles, {quads:,} quads of {types:,} types").format(**report)
    text = translated("Edges {edge_length_mean:.4g} long, varying by {edge_length_spread:.1%}; planarity {planarity_mean:.2%}")
    return [counts, text.format(**report)]


def _snapshot(result: Any) -> Snapshot:
    """The panels as a mesh with what was measured as attributes."""
    schedule, mesh = result.panels, result.mesh

    def column(values: Array, dtype: type) -> Array:
        return values.astype(dtype)[:, None]

    return Snapshot(
        positions=mesh.positions,
        edges=schedule.edges,
        face_offsets=mesh.face_offsets,
        corner_verts=mesh.corner_verts,
        attributes={
            KIND: Attribute("FACE", "INT", column(np.diff(mesh.face_offsets) - 3, np.int32)),
            TYPE: Attribute("FACE", "INT", column(schedule.types, np.int32)),
            PLANARITY: Attribute("FACE", "FLOAT", column(schedule.planarity, np.float32)),
            AREA: Attribute("FACE", "FLOAT", column(schedule.area, np.float32)),
            EDGE_CLASS: Attribute("EDGE", "INT", column(schedule.edge_classes, np.int32)),
        },
    )


def _patch_graph(graph: Any) -> Snapshot:
    """The sides of the patches as chains of edges; each node knows its curvature."""
    offsets, ends = graph.side_offsets, graph.side_nodes
    node_count, sizes = len(graph.nodes), np.diff(graph.side_offsets)
    # Nodes come first; of each side only the points between its ends are vertices of their own.
    is_end = np.zeros(len(graph.side_points), bool)
    is_end[offsets[:-1]] = is_end[offsets[1:] - 1] = True
    index = np.empty(len(is_end), np.int32)
    index[~is_end] = node_count + np.arange(np.count_nonzero(~is_end))
    index[offsets[:-1]], index[offsets[1:] - 1] = ends[:, 0], ends[:, 1]
    begins = np.ones(len(index), bool)
    begins[np.cumsum(sizes) - 1] = False
    begins = np.flatnonzero(begins)
    positions = np.concatenate([graph.nodes, graph.side_points[~is_end]])
    defects = np.zeros(len(positions), np.int32)
    defects[:node_count] = graph.defects
    return Snapshot(
        positions=positions,
        edges=np.stack([index[begins], index[begins + 1]], axis=1).astype(np.int32),
        face_offsets=np.zeros(1, np.int32),
        corner_verts=np.zeros(0, np.int32),
        attributes={DEFECT: Attribute("POINT", "INT", defects[:, None])},
    )


def _colored(outcome: Outcome, color_by: str) -> Snapshot:
    """The panels with materials."""
    mesh, schedule = outcome.mesh, outcome.schedule
    if color_by == "type":
        palette, chosen = materials.by_type(schedule.types, schedule.type_names, schedule.type_counts)
    elif color_by == "planarity":
        palette, chosen = materials.by_planarity(schedule.planarity)
    elif color_by == "area":
        palette, chosen = materials.by_area(schedule.area)
    else:
        palette, chosen = list(materials.KINDS[:2]), mesh.attributes[KIND].values[:, 0]
    mesh.attributes[attributes.MATERIAL] = Attribute("FACE", "INT", chosen.astype(np.int32)[:, None])
    mesh.materials.extend(materials.named(*each) for each in palette)
    return mesh


def _shape_and_place(to_world: Array) -> tuple[Array, Array]:
    """A (4,4) transform as what it does to shapes, mirroring and scale among it, and the rigid motion that follows.

    The polar decomposition: panels that are even in the world have to be made in the shape the world sees."""
    squared, axes = np.linalg.eigh(to_world[:3, :3].T @ to_world[:3, :3])
    shape, place = np.eye(4), to_world.copy()
    shape[:3, :3] = axes @ np.diag(np.sqrt(squared)) @ axes.T
    if np.linalg.det(to_world[:3, :3]) < 0:
        shape[0] *= -1
    place[:3, :3] = to_world[:3, :3] @ np.linalg.inv(shape[:3, :3])
    return shape, place


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_tile_surface)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_tile_surface)
