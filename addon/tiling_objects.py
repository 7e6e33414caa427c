"""The objects of a tiled surface, and how they hang together: the source, its patches, its panels. Main thread only.

Panels and patches point to the source that they were made from, and carry what is needed to make them again as a JSON text.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from mathutils import Matrix

from . import bridge, features, materials, patch_graphs, tilings
from .attributes import MATERIAL, Array, Attribute, Snapshot
from .tiling_options import TILE_SURFACE_OPTIONS

SOURCE, GRAPH, STATE, REPORT = "quadloom_source", "quadloom_graph", "quadloom_tiling", "quadloom_report"
ROUNDING = 6
PANEL_OPTIONS = (
    "pattern", "seed", "patch_panels", "shaping_rounds", "flattening_rounds", "closeness", "planarity", "fairness",
    "uniformity", "borders", "features", "mirror",
)  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """What a tool for surfaces works on."""

    source: bpy.types.Object
    patches: bpy.types.Object | None
    panels: bpy.types.Object | None


def subject(obj: bpy.types.Object, *, again: bool = True) -> Subject:
    """The surface that the object is, or that it was made from."""
    source = obj.get(SOURCE)
    role = state(obj).get("role")
    if not again or not isinstance(source, bpy.types.Object) or bpy.context.view_layer.objects.get(source.name) is None:
        return Subject(obj, None, None)
    if role in {"patches", "drawing"}:
        return Subject(source, obj, None)
    return Subject(source, None, obj)


def is_patches(obj: bpy.types.Object | None) -> bool:
    """Whether the object shows the patches of a surface."""
    return obj is not None and state(obj).get("role") == "patches"


def link_drawing(drawing: bpy.types.Object, source: bpy.types.Object) -> None:
    """Lets an object that was drawn by hand say which surface it divides: with it active, that is tiled."""
    if not is_patches(drawing):
        drawing[SOURCE], drawing[STATE] = source, json.dumps({"role": "drawing"})


def panels_of(patches: bpy.types.Object) -> bpy.types.Object | None:
    """The newest panels that were made with these patches."""
    found = [obj for obj in bpy.data.objects if obj.get(GRAPH) == patches and state(obj).get("role") == "panels"]
    return max(found, key=lambda obj: state(obj).get("order", 0), default=None)


def state(obj: bpy.types.Object) -> dict[str, Any]:
    """What is stored on an object."""
    text = obj.get(STATE)
    return json.loads(text) if isinstance(text, str) else {}


def settings(options: Any, names: Iterable[str] = TILE_SURFACE_OPTIONS) -> dict[str, Any]:
    """Options by name, as they are stored. Floats are those of Blender, whose properties have single precision."""
    return {name: getattr(options, name) for name in names}


def surface(
    context: bpy.types.Context, source: bpy.types.Object, options: Mapping[str, Any]
) -> tuple[tilings.Surface, Snapshot, Array]:
    """The surface of an object as the world sees it; the object's own mesh, for errors; and the (4,4) rigid place of what is
    made. Raises ValueError with a sentence for objects that cannot be worked on."""
    depsgraph = context.evaluated_depsgraph_get()
    to_world = bridge.world_matrix(source, depsgraph)
    if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-30:
        raise ValueError(translated("“{name}” has a scale of zero: scale it up first").format(name=source.name))
    mesh = bridge.read(source, depsgraph)
    shape, place = shape_and_place(to_world)
    chosen = [name for name in features.SOURCES if options[name]]
    if tilings.KIND in mesh.attributes and "material_borders" in chosen:
        # Materials of panels show what they are like; nobody marked anything with them.
        chosen.remove("material_borders")
    wheel: dict[str, Any] = {
        "feature_angle": options["detect_angle"] if options["detect"] else math.pi,
        "corner_angle": options["corner_angle"],
    }
    if options["size_by"] == "count":
        wheel["target_panels"] = options["panel_count"]
    else:
        wheel["edge_length"] = options["panel_size"]
    made = tilings.Surface(mesh.transformed(shape), tuple(chosen), options["corners"], wheel)
    return made, mesh, place


def drawn(context: bpy.types.Context, patches: bpy.types.Object, place: Array) -> patch_graphs.Drawn:
    """The edges of an object as a patch graph, in the space of a surface with this place."""
    depsgraph = context.evaluated_depsgraph_get()
    to_surface = np.linalg.inv(place) @ bridge.world_matrix(patches, depsgraph)
    return patch_graphs.drawn(bridge.read(patches, depsgraph).transformed(to_surface))


def is_untouched(patches: bpy.types.Object) -> bool:
    """Whether the patches are as they were made: no node was moved, no edge changed, and they lie where they lay."""
    return state(patches).get("fingerprint") == _fingerprint(patches)


def show_patches(
    context: bpy.types.Context,
    source: bpy.types.Object,
    patches: bpy.types.Object | None,
    graph: Snapshot,
    place: Array,
    stored: Mapping[str, Any],
) -> bpy.types.Object:
    """The patches of a surface as an object: the one given, with another mesh, or a new one."""
    if patches is None:
        patches = add_wire(context, source, graph, place)
        patches[SOURCE] = source
    else:
        _replace_mesh(patches, bridge.write(patches.data.name, graph))
    patches.matrix_world = Matrix(place.tolist())
    context.view_layer.update()
    if patches.mode == "OBJECT":
        bridge.select(context, patches, {})
    patches[STATE] = json.dumps({**stored, "role": "patches", "fingerprint": _fingerprint(patches)})
    return patches


def show_panels(
    context: bpy.types.Context,
    source: bpy.types.Object,
    panels: bpy.types.Object | None,
    result: Any,
    place: Array,
    stored: Mapping[str, Any],
    patches: bpy.types.Object | None,
) -> bpy.types.Object:
    """The panels of a surface as an object: the one given, with another mesh, or a new one."""
    color_by, report = stored["settings"]["color_by"], {**result.report, **stored.get("report", {})}
    if panels is None:
        panels = add_panels(context, source, result, place, color_by, report)
        panels[SOURCE] = source
    else:
        _replace_mesh(panels, bridge.write(panels.data.name, _colored(tilings.snapshot(result), result.panels, color_by)))
        panels[REPORT] = json.dumps({**report, "summary": summary(report)})
    if patches is not None:
        panels[GRAPH] = patches
    order = 1 + max((state(obj).get("order", 0) for obj in bpy.data.objects), default=0)
    panels[STATE] = json.dumps({**stored, "role": "panels", "order": order})
    return panels


def add_panels(
    context: bpy.types.Context, source: bpy.types.Object, result: Any, place: Array, color_by: str, report: Mapping[str, Any]
) -> bpy.types.Object:
    """Panels made from an object as a new one, which knows nothing of it."""
    name = translated("{name} Panels").format(name=source.name)
    mesh = _colored(tilings.snapshot(result), result.panels, color_by)
    panels = bpy.data.objects.new(name, bridge.write(name, mesh))
    panels.matrix_world = Matrix(place.tolist())
    panels[REPORT] = json.dumps({**report, "summary": summary(report)})
    context.collection.objects.link(panels)
    return panels


def add_wire(context: bpy.types.Context, source: bpy.types.Object, graph: Snapshot, place: Array) -> bpy.types.Object:
    """Patches as a new object in front of the panels."""
    name = translated("{name} Patches").format(name=source.name)
    patches = bpy.data.objects.new(name, bridge.write(name, graph))
    patches.matrix_world = Matrix(place.tolist())
    # A wire on a surface is hard to see and to pick.
    patches.show_in_front, patches.hide_render = True, True
    context.collection.objects.link(patches)
    return patches


def summary(report: Mapping[str, Any]) -> list[str]:
    """What was made, in short lines."""
    counts = translated("{triangles:,} triangles, {quads:,} quads of {types:,} types").format(**report)
    text = translated("Edges {edge_length_mean:.4g} long, varying by {edge_length_spread:.1%}; planarity {planarity_mean:.2%}")
    return [counts, text.format(**report)]


def describe(defects: Sequence[int]) -> list[str]:
    """The parts of a design, in a sentence."""
    bent = [f"{part + 1} ({degrees(defect)})" for part, defect in enumerate(defects) if defect]
    if not bent:
        return [translated("All {count} parts are flat: tile the surface").format(count=len(defects))]
    text = translated("{flat} of {count} parts are flat; curvature is left in part {bent}")
    return [text.format(flat=len(defects) - len(bent), count=len(defects), bent=", ".join(bent))]


def degrees(defect: int) -> str:
    """A total interior defect, given in units of 30 degrees."""
    return f"{30 * defect}°"


def panel_options(options: dict[str, Any]) -> dict[str, Any]:
    """The wheel's keywords for pattern, shape and types."""
    return {**{name: options[name] for name in PANEL_OPTIONS}, "type_tolerance": options["type_tolerance"] or None}


def shape_and_place(to_world: Array) -> tuple[Array, Array]:
    """A (4,4) transform as what it does to shapes, mirroring and scale among it, and the rigid motion that follows.

    The polar decomposition: panels that are even in the world have to be made in the shape the world sees."""
    squared, axes = np.linalg.eigh(to_world[:3, :3].T @ to_world[:3, :3])
    shape, place = np.eye(4), to_world.copy()
    shape[:3, :3] = axes @ np.diag(np.sqrt(squared)) @ axes.T
    if np.linalg.det(to_world[:3, :3]) < 0:
        shape[0] *= -1
    place[:3, :3] = to_world[:3, :3] @ np.linalg.inv(shape[:3, :3])
    return shape, place


def _colored(mesh: Snapshot, schedule: Any, color_by: str) -> Snapshot:
    """The panels with materials."""
    if color_by == "type":
        palette, chosen = materials.by_type(schedule.types, schedule.type_names, schedule.type_counts)
    elif color_by == "planarity":
        palette, chosen = materials.by_planarity(schedule.planarity)
    elif color_by == "area":
        palette, chosen = materials.by_area(schedule.area)
    else:
        palette, chosen = list(materials.KINDS[:2]), mesh.attributes[tilings.KIND].values[:, 0]
    mesh.attributes[MATERIAL] = Attribute("FACE", "INT", chosen.astype(np.int32)[:, None])
    mesh.materials.extend(materials.named(*each) for each in palette)
    return mesh


def _replace_mesh(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> None:
    old = obj.data
    obj.data = mesh
    if old.users == 0:
        bpy.data.meshes.remove(old)


def _fingerprint(patches: bpy.types.Object) -> str:
    mesh = bridge.read_base(patches)
    digest = hashlib.sha256(np.round(np.array(patches.matrix_world, float), ROUNDING).tobytes())
    digest.update(mesh.positions.astype(np.float32).tobytes())
    digest.update(mesh.edges.tobytes())
    return digest.hexdigest()
