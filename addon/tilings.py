"""From a surface to its panels, by way of patches that are found, chosen step by step, or drawn, and then edited. What the last
run made is kept, so that a further step costs that step only. Runs on a job's thread: touches no bpy.

A tiling is a recipe: surface, options, choices and edits give the same panels again. Operators store the recipe on the objects
they make, so that undo, copies and saved files keep working; what is kept here only saves time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import features, native
from .attributes import Array, Attribute, Snapshot

KIND, TYPE, PLANARITY, AREA, EDGE_CLASS = "tile_kind", "panel_type", "panel_planarity", "panel_area", "edge_class"
CORNER = "c_index_corner"
# More kept steps than this would be more memory than they save time.
MOST_KEPT = 16

Choice = tuple[int, int]
"""A part, and which of its partitions is taken, both from 0."""


@dataclass(frozen=True)
class Surface:
    """What is tiled, in the shape that the world sees."""

    mesh: Snapshot
    sources: tuple[str, ...]
    """Which marked edges are followed."""
    with_corners: bool
    """Whether vertices marked as corners have a say."""
    options: dict[str, Any]
    """Of `quadloom.PatchDesign`: size and angles."""

    def arguments(self) -> dict[str, Any]:
        """The keywords of the wheel."""
        found = dict(self.options)
        if self.with_corners:
            found["corners"] = corners(self.mesh)
        return found

    def edges(self) -> Array:
        """(E,2) the marked edges that are followed."""
        return features.feature_edges(self.mesh, self.sources)

    def key(self) -> str:
        """The same for the same surface and options."""
        digest = hashlib.sha256()
        for array in (self.mesh.positions, self.mesh.face_offsets, self.mesh.corner_verts, self.edges(), corners(self.mesh)):
            digest.update(np.ascontiguousarray(array).tobytes())
        digest.update(repr((self.with_corners, sorted(self.options.items()))).encode())
        return digest.hexdigest()


@dataclass(frozen=True)
class Recipe:
    """A tiling of a surface."""

    surface: Surface
    partition: str
    """One of "even", "patches" (found automatically), "design" (by `choices`) and "drawn" (by `graph`)."""
    panels: dict[str, Any]
    """Of `quadloom.PatchDesign.tile`: pattern, shape and types."""
    choices: tuple[Choice, ...] = ()
    graph: dict[str, Array] | None = None
    """What a `quadloom.PatchGraph` is made of."""
    edits: tuple[dict[str, Any], ...] = ()
    """Zigzags on sides of the patches: the keywords of `quadloom.SurfaceResult.zigzag` or `zigzag_patch`."""


@dataclass
class _Kept:
    """The steps of the last surface, or the last tiling."""

    key: str = ""
    steps: dict[Any, Any] = field(default_factory=dict)

    def of(self, key: str) -> dict[Any, Any]:
        if self.key != key:
            self.key, self.steps = key, {}
        while len(self.steps) > MOST_KEPT:
            del self.steps[next(iter(self.steps))]
        return self.steps


_designs, _results = _Kept(), _Kept()


def forget() -> None:
    """Frees what was kept."""
    for kept in (_designs, _results):
        kept.of("")


def corners(mesh: Snapshot) -> Array:
    """(N,2) vertices marked as corners, and their c-indices."""
    layer = mesh.attributes.get(CORNER)
    if layer is None or layer.domain != "POINT":
        return np.empty((0, 2), np.int32)
    values = layer.values[:, 0]
    verts = np.flatnonzero(values)
    return np.stack([verts, values[verts]], axis=1).astype(np.int32)


def design(surface: Surface, choices: Sequence[Choice], progress: native.Progress | None) -> Any:
    """The `quadloom.PatchDesign` after some choices; raises IndexError for one that there is not."""
    steps = _designs.of(surface.key())
    taken = tuple(choices)
    known = next(taken[:n] for n in range(len(taken), -1, -1) if n == 0 or taken[:n] in steps)
    if known not in steps:
        steps[()] = native.patch_design(surface.mesh, surface.edges(), progress=progress, **surface.arguments())
    made = steps[known]
    for n in range(len(known), len(taken)):
        part, choice = taken[n]
        made = native.divided(made, native.partitions(made, part, progress=progress)[choice])
        steps[taken[: n + 1]] = made
    return made


def tile(recipe: Recipe, progress: native.Progress | None) -> Any:
    """The `quadloom.SurfaceResult` of a recipe."""
    surface = recipe.surface
    drawn = recipe.graph
    digest = hashlib.sha256(surface.key().encode())
    for name in sorted(drawn or {}):
        digest.update(np.ascontiguousarray(drawn[name]).tobytes())
    digest.update(repr((recipe.partition, recipe.choices, sorted(recipe.panels.items()))).encode())
    steps = _results.of(digest.hexdigest())
    edits = tuple(tuple(sorted(edit.items())) for edit in recipe.edits)
    known = next(edits[:n] for n in range(len(edits), -1, -1) if n == 0 or edits[:n] in steps)
    if known not in steps:
        steps[()] = _tiled(recipe, drawn, progress)
    made = steps[known]
    for n in range(len(known), len(edits)):
        made = native.zigzag(made, progress=progress, **recipe.edits[n])
        steps[edits[: n + 1]] = made
    return made


def _tiled(recipe: Recipe, drawn: dict[str, Array] | None, progress: native.Progress | None) -> Any:
    surface = recipe.surface
    if recipe.partition == "design":
        return native.tile_design(design(surface, recipe.choices, progress), progress=progress, **recipe.panels)
    if recipe.partition == "drawn":
        made = native.patch_design(surface.mesh, surface.edges(), graph=drawn, progress=progress, **surface.arguments())
        return native.tile_design(made, progress=progress, **recipe.panels)
    options = {**surface.arguments(), **recipe.panels, "partition": recipe.partition}
    return native.tile_surface(surface.mesh, surface.edges(), progress=progress, **options)


def measured(result: Any) -> dict[str, Any]:
    """What the report of a surface says of its panels, of any result with `mesh` and `panels`."""
    schedule = result.panels
    corners = np.diff(result.mesh.face_offsets)
    mean = float(schedule.edge_lengths.mean())
    quads = schedule.planarity[corners == 4]
    return {
        "triangles": int((corners == 3).sum()),
        "quads": len(quads),
        "types": len(schedule.type_names),
        "edge_length_mean": mean,
        "edge_length_spread": float(schedule.edge_lengths.std() / mean),
        "planarity_mean": float(quads.mean()) if len(quads) else 0.0,
    }


def snapshot(result: Any) -> Snapshot:
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
