"""The native library: the only module that imports the wheel `quadloom`."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from .attributes import Array, Snapshot

try:
    import quadloom

    problem = None
except ImportError as error:  # e.g. the zip of another platform: the buttons are grey and say so
    quadloom = None
    problem = f"Quadloom's native library cannot be loaded: {error}"

Progress = Callable[[str, float], bool]
"""Called with the stage and the fraction done; returning False cancels."""


class NativeError(Exception):
    """What the wheel's errors say, in terms the add-on can use without importing the wheel."""

    def __init__(self, error: Any) -> None:
        super().__init__(str(error))
        self.code: str = error.code
        self.elements: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
        """For A and for B, or for the only mesh and nothing: kind of element ("verts", "edges", "faces") -> index array."""
        self.graph: dict[str, Any] = {k: index for k, index in error.elements.items() if k in ("nodes", "sides", "patches")}
        """Nodes, sides and patches of a patch graph."""
        if error.mesh is not None:
            self.elements[error.mesh].update(error.elements)
            return
        # There is one mesh, or both operands are concerned: then the kinds say which is whose.
        self.elements[0].update({kind: index for kind, index in error.elements.items() if kind in ("verts", "edges", "faces")})
        for operand, own in zip(("a_", "b_"), self.elements, strict=True):
            own.update({kind[2:]: index for kind, index in error.elements.items() if kind.startswith(operand)})


class Cancelled(Exception):
    """The call was cancelled by its progress callback."""


def boolean(a: Snapshot, b: Snapshot, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.boolean` of two snapshots; raises NativeError or Cancelled."""
    return _call(
        lambda: quadloom.boolean(
            _mesh(a), _mesh(b), feature_edges=(a.feature_edges(), b.feature_edges()), progress=progress, **options
        )
    )


def retopology_session(mesh: Snapshot, feature_edges: Array, *, progress: Progress | None, **options: Any) -> Any:
    """A `quadloom.RetopologySession` of a snapshot; raises NativeError or Cancelled."""
    return _call(lambda: quadloom.RetopologySession(_mesh(mesh), feature_edges, progress=progress, **options))


def set_features(session: Any, feature_edges: Array, *, progress: Progress | None) -> dict[str, Any]:
    """Makes these the features of a session; says how many base triangles were made anew."""
    return _call(lambda: session.set_features(feature_edges, progress=progress))


def session_quads(session: Any, templates: Any, *, progress: Progress | None) -> Any:
    """The quads of a session: what `quadloom.retopologize` returns."""
    return _call(lambda: session.quads(templates=templates or [], progress=progress))


def harmonic_field(session: Any, feature_edges: Array) -> Array:
    """(V,) a value at every vertex of the session's mesh: 1 on the edges, 0 on all other features."""
    return _call(lambda: session.field(feature_edges))


def template_names(catalogue: str | None) -> list[str]:
    """The names of the built-in templates and of those in a catalogue, a JSON text."""
    names = [template["name"] for template in json.loads(quadloom.template_catalogue())["templates"]]
    own = json.loads(catalogue)["templates"] if catalogue else []
    return list(dict.fromkeys([*names, *(template["name"] for template in own)]))


def tile_surface(mesh: Snapshot, feature_edges: Array, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.tile_surface` of a snapshot; raises NativeError or Cancelled."""
    return _call(lambda: quadloom.tile_surface(_mesh(mesh), feature_edges=feature_edges, progress=progress, **options))


def patch_design(
    mesh: Snapshot, feature_edges: Array, *, graph: dict[str, Array] | None = None, progress: Progress | None, **options: Any
) -> Any:
    """A `quadloom.PatchDesign` of a snapshot, begun with a graph if one is given; raises NativeError or Cancelled."""

    def call() -> Any:
        drawn = graph and quadloom.PatchGraph(**graph)
        return quadloom.PatchDesign(_mesh(mesh), feature_edges=feature_edges, patch_graph=drawn, progress=progress, **options)

    return _call(call)


def partitions(design: Any, part: int, *, progress: Progress | None) -> list[Any]:
    """The admissible partitions of a part of a design, best first."""
    return list(_call(lambda: design.partitions(part, progress=progress)))


def divided(design: Any, partition: Any) -> Any:
    """The design with a part divided."""
    return _call(lambda: design.divided(partition))


def tile_design(design: Any, *, progress: Progress | None, **options: Any) -> Any:
    """The panels of a design; raises NativeError or Cancelled."""
    return _call(lambda: design.tile(progress=progress, **options))


def zigzag(result: Any, *, progress: Progress | None, **options: Any) -> Any:
    """The panels with a zigzag on a side, or on the sides of a patch; raises NativeError or Cancelled."""
    edit = result.zigzag_patch if "patch" in options else result.zigzag
    return _call(lambda: edit(progress=progress, **options))


def tile_polyhedron(mesh: Snapshot, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.tile_polyhedron` of a snapshot; raises NativeError or Cancelled."""
    return _call(lambda: quadloom.tile_polyhedron(_mesh(mesh), progress=progress, **options))


def fold_tiling(mesh: Snapshot, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.fold_tiling` of a snapshot; raises NativeError or Cancelled."""
    return _call(lambda: quadloom.fold_tiling(_mesh(mesh), progress=progress, **options))


def panel_schedule(mesh: Snapshot, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.panel_schedule` of a snapshot; raises NativeError or Cancelled."""
    return _call(lambda: quadloom.panel_schedule(_mesh(mesh), progress=progress, **options))


def unrolled(schedule: Any, kind: str, *, progress: Progress | None, **options: Any) -> str:
    """The panels of a schedule laid flat, as an "svg" or "dxf" drawing; raises NativeError or Cancelled."""
    return str(_call(lambda: schedule.unrolled(kind, progress=progress, **options)))


def check(mesh: Snapshot) -> Any:
    """`quadloom.check`: every defect of the mesh, with indices."""
    return _call(lambda: quadloom.check(_mesh(mesh)))


def fit_boundary(points: Array, edge_length: float, *, progress: Progress | None, **options: Any) -> Any:
    """`quadloom.fit_boundary`: an outline near a polygon that has patterns."""
    return _call(lambda: quadloom.fit_boundary(points, edge_length, progress=progress, **options))


def tilings(code: Array, *, memory: int, progress: Progress | None) -> Any:
    """`quadloom.tilings`: every pattern of an outline; NativeError "memory" when there are too many."""
    return _call(lambda: quadloom.tilings(code, memory=memory, progress=progress))


def find_tiling(code: Array, seed: int, *, rhombi: bool = False, memory: int, progress: Progress | None) -> Any:
    """`quadloom.find_tiling`: some pattern of an outline, or None; with the fewest rhombi if asked."""
    return _call(lambda: quadloom.find_tiling(code, seed, rhombi=rhombi, memory=memory, progress=progress))


def best_tiling(tilings: Any, objective: str, *, progress: Progress | None) -> Any:
    """The best of `tilings` and its cost."""
    return _call(lambda: tilings.best(objective, progress=progress))


def symmetric_tilings(tilings: Any, group: Any, *, progress: Progress | None) -> Any:
    """Those of `tilings` with the symmetries of the group."""
    return _call(lambda: tilings.symmetric(group, progress=progress))


def tiling_mesh(tiling: Any) -> tuple[Any, Array, Array]:
    """The panels of one pattern as a mesh with unit edges, their kinds and their orientations."""
    return _call(lambda: (tiling.mesh, tiling.kinds, tiling.orientations))


def _mesh(snapshot: Snapshot) -> Any:
    return quadloom.Mesh(snapshot.positions, snapshot.face_offsets, snapshot.corner_verts)


def _call(call: Callable[[], Any]) -> Any:
    try:
        return call()
    except quadloom.Cancelled as error:
        raise Cancelled from error
    except quadloom.QuadloomError as error:
        raise NativeError(error) from error
