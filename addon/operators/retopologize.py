"""`quadloom.retopologize`: the active object's surface as a new object of quads whose edges follow the marked ones."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from mathutils.kdtree import KDTree

from .. import attributes, bridge, features, layouts, messages, native, selection
from ..attributes import Array, Attribute, Snapshot
from ..jobs import JobOperator
from ..properties import RETOPOLOGIZE_OPTIONS, RetopologizeOptions, retopologize_uses

WHEEL_OPTIONS = (
    "detect", "detect_angle", "detect_length", "corner_angle", "base_vertices", "coarseness", "pairing", "improve",
    "symmetry_tolerance",
)  # fmt: skip
FIELD = "quadloom_field"
# Detected curves go on over edges this much less sharp than where they begin: 25 of 40 degrees.
CONTINUE_PART = 0.625
DETECTED = 1
# Scales along the axes that differ by less count as one.
EVEN_SCALE = 1e-6


@dataclass(frozen=True)
class Task:
    """What one run works on, read from Blender before it starts."""

    name: str
    mesh: Snapshot
    """In the object's own space."""
    stretch: Array | None
    """(3,3) symmetric: what the object's transform does to shapes; None when it keeps them."""
    sources: tuple[str, ...]
    mark_detected: bool
    keep: bool
    """Whether the layout of the last run stays where nothing changed."""
    field: str
    """The source of features whose harmonic field is wanted, or "none"."""
    options: dict[str, Any]

    def run(self, progress: native.Progress | None) -> Outcome:
        """The result with its attributes. Touches no bpy."""
        mesh = self.mesh if self.stretch is None else self.mesh.transformed(_matrix(self.stretch))
        edges = features.feature_edges(mesh, self.sources)
        field_of = None if self.field == "none" else features.feature_edges(mesh, [self.field])
        result, field = layouts.retopologize(mesh, edges, keep=self.keep, field_of=field_of, progress=progress, **self.options)
        if field is not None:
            layer = Attribute("POINT", "FLOAT", field[:, None].astype(np.float32))
            mesh = replace(mesh, attributes={**mesh.attributes, FIELD: layer})
        made = attributes.retopologized(mesh, result)
        if self.mark_detected:
            detected = result.feature_edges[result.feature_kind == DETECTED]
            made = made.with_sharp_edges(attributes.edge_indices(made.edges, detected))
        back = np.eye(3)
        if self.stretch is not None:
            back = np.linalg.inv(self.stretch)
            made = made.transformed(_matrix(back))
        cut = self.mesh.active_uv is not None and _is_cut(mesh, edges)
        return Outcome(made, _layout(result, back), field, len(edges), cut, result.report)


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    mesh: Snapshot
    layout: Snapshot
    """The base triangulation's edges as a wire."""
    field: Array | None
    """(V,) the harmonic field at the vertices of the object, if one was asked for."""
    marked: int
    """Edges that were features by a mark."""
    uv_is_cut: bool
    """Whether the active UV map has borders that no feature follows."""
    report: dict[str, Any]


class QUADLOOM_OT_retopologize(RetopologizeOptions, JobOperator, bpy.types.Operator):
    """Lay quads over the active object's surface so that its marked and sharp edges become edge loops. Modifiers are
    included; the object itself is not altered"""

    bl_idname = "quadloom.retopologize"
    bl_label = "Feature Retopology"
    bl_options: ClassVar = {"REGISTER", "UNDO"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    def draw(self, context: bpy.types.Context) -> None:
        """The redo panel."""
        layout = self.layout
        layout.use_property_split = True
        for name in RETOPOLOGIZE_OPTIONS:
            if name not in {"target_faces", "edge_length"} or retopologize_uses(self, name):
                row = layout.row()
                row.enabled = retopologize_uses(self, name)
                row.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Puts the result into the scene."""
        source = bpy.data.objects.get(self._task.name)
        if source is None:
            self.report({"ERROR"}, translated("The object was removed while it was retopologized"))
            return {"CANCELLED"}
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        made = self._add_result(context, source, outcome)
        if self.preview:
            self._add_layout(context, made, source, outcome)
        bridge.present(context, made, [source] if self.hide_input else [])
        for warning in outcome.report["warnings"]:
            self.report({"WARNING"}, translated(warning))
        if outcome.uv_is_cut:
            text = translated("The UV map “{name}” is cut where no edge loop runs: tick UV Islands, or unwrap the result")
            self.report({"WARNING"}, text.format(name=self._task.mesh.active_uv))
        text = translated("{faces:,} quads, {irregular:,} irregular vertices, {features:.1%} of the features are edges")
        report = outcome.report
        if report["base_triangles_edited"] is not None:
            text += translated("; the layout is new only near what changed")
        counts = {"faces": report["faces"], "irregular": report["irregular_vertices"]}
        self.report({"INFO"}, text.format(features=report["features_reproduced"], **counts))
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
        to_world = bridge.world_matrix(obj, depsgraph)[:3, :3]
        if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world)) < 1e-30:
            self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
            return False
        mesh = bridge.read(obj, depsgraph)
        if self.density_group and self.density_group not in mesh.groups:
            text = translated("“{name}” has no vertex group “{group}”: choose another one for the density, or none")
            self.report({"ERROR"}, text.format(name=obj.name, group=self.density_group))
            return False
        scale, stretch = _stretch(to_world)
        options = {name: getattr(self, name) for name in WHEEL_OPTIONS}
        if self.symmetry != "none" and not self._add_symmetry(options, stretch):
            return False
        if self.template and not self._add_template(options, context, obj, depsgraph, stretch):
            return False
        options["detect_continue_angle"] = CONTINUE_PART * self.detect_angle
        options["density"] = features.density(mesh, self.density_group, self.density_factor)
        if self.size_by == "faces":
            options["target_faces"] = self.target_faces
        else:
            options["edge_length"] = self.edge_length / scale
        sources = tuple(source for source in features.SOURCES if getattr(self, source))
        self._task = Task(obj.name, mesh, stretch, sources, self.mark_detected, self.keep_layout, self.field, options)
        return True

    def _add_symmetry(self, options: dict[str, Any], stretch: Array | None) -> bool:
        """The plane in the object's own space; reports and returns False when the object's scale turns it."""
        normal = np.eye(3)["xyz".index(self.symmetry)]
        if stretch is not None and np.abs(np.cross(stretch @ normal, normal)).max() > EVEN_SCALE * np.abs(stretch).max():
            self.report({"ERROR"}, translated("The object is sheared: apply its scale and rotation to make it symmetric"))
            return False
        options["symmetry"] = ((0.0, 0.0, 0.0), tuple((-normal if self.symmetry_flip else normal).tolist()))
        return True

    def _add_template(
        self,
        options: dict[str, Any],
        context: bpy.types.Context,
        obj: bpy.types.Object,
        depsgraph: bpy.types.Depsgraph,
        stretch: Array | None,
    ) -> bool:
        """The template at the 3D cursor; reports and returns False when its file cannot be read."""
        if self.template_file:
            try:
                options["catalogue"] = Path(bpy.path.abspath(self.template_file)).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                text = translated("The template file cannot be read: {reason}")
                self.report({"ERROR"}, text.format(reason=error))
                return False
        place = np.linalg.solve(bridge.world_matrix(obj, depsgraph), np.append(context.scene.cursor.location, 1.0))[:3]
        if stretch is not None:
            place = stretch @ place
        options["templates"] = [(tuple(place.tolist()), self.template, self.template_turn)]
        return True

    def _add_result(self, context: bpy.types.Context, source: bpy.types.Object, outcome: Outcome) -> bpy.types.Object:
        name = translated("{name} Quads").format(name=source.name)
        mesh = bridge.write(name, outcome.mesh)
        bridge.copy_active_layers(source.data, mesh)
        made = bpy.data.objects.new(name, mesh)
        bridge.assign_groups(made, outcome.mesh)
        made["quadloom_report"] = json.dumps(outcome.report)
        bridge.copy_transform(source, made)
        context.collection.objects.link(made)
        if outcome.mesh.selected_edges is not None:
            bridge.select(context, made, {"edges": outcome.mesh.edges[outcome.mesh.selected_edges]})
        return made

    def _add_layout(
        self, context: bpy.types.Context, made: bpy.types.Object, source: bpy.types.Object, outcome: Outcome
    ) -> None:
        name = translated("{name} Layout").format(name=source.name)
        layout = outcome.layout
        if outcome.field is not None:
            values = outcome.field[_nearest(self._task.mesh.positions, layout.positions), None]
            layer = Attribute("POINT", "FLOAT", values.astype(np.float32))
            layout = replace(layout, attributes={**layout.attributes, FIELD: layer})
        wire = bpy.data.objects.new(name, bridge.write(name, layout))
        bridge.copy_transform(made, wire)
        wire.show_in_front, wire.hide_render = True, True
        context.collection.objects.link(wire)


def _stretch(to_world: Array) -> tuple[float, Array | None]:
    """The mean scale of a (3,3) transform, and what remains of it without rotation, mirroring and, where that is all, scale.

    The polar decomposition: quads that are square in the world have to be made in the shape the world sees."""
    squared, axes = np.linalg.eigh(to_world.T @ to_world)
    scales = np.sqrt(squared)
    if scales.max() - scales.min() <= EVEN_SCALE * scales.max():
        return float(scales.mean()), None
    return 1.0, axes @ np.diag(scales) @ axes.T


def _nearest(points: Array, at: Array) -> Array:
    """For each of some places the nearest of the points."""
    tree = KDTree(len(points))
    for index, point in enumerate(points.tolist()):
        tree.insert(point, index)
    tree.balance()
    return np.array([tree.find(place)[1] for place in at.tolist()])


def _matrix(linear: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    return matrix


def _is_cut(mesh: Snapshot, edges: Array) -> bool:
    """Whether the active UV map has a border between faces that is none of these edges."""
    borders = mesh.edges[features.marked_by(mesh, "uv_borders")]
    return bool((attributes.edge_indices(edges, borders) < 0).any())


def _layout(result: Any, back: Array) -> Snapshot:
    """The base triangulation's edges, as they lie on the surface, as a wire; those on features are marked sharp."""
    count = len(result.base.positions)
    points, edges, sharp = [result.base.positions], [], []
    for ends, path, chain in zip(result.base_edges, result.base_paths, result.base_chain, strict=True):
        inner = np.arange(count, count + len(path) - 2)
        line = np.concatenate([ends[:1], inner, ends[1:]])
        points.append(path[1:-1])
        edges.append(np.stack([line[:-1], line[1:]], axis=1))
        sharp.append(np.full(len(line) - 1, chain >= 0))
        count += len(inner)
    wire = Snapshot(
        positions=np.concatenate(points) @ back.T,
        edges=np.concatenate(edges).astype(np.int32),
        face_offsets=np.zeros(1, np.int32),
        corner_verts=np.empty(0, np.int32),
    )
    return wire.with_sharp_edges(np.concatenate(sharp))


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_retopologize)


def unregister() -> None:
    """Removes the operator and what was kept."""
    layouts.forget()
    bpy.utils.unregister_class(QUADLOOM_OT_retopologize)
