"""Which edges of a mesh are features: the artist's marks, and borders between UV islands and materials. Touches no bpy: runs
on a job's thread."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .attributes import FREESTYLE, MATERIAL, SEAM, Array, Snapshot, edge_indices

MARKS = {
    "sharp": "sharp_edge",
    "seam": SEAM,
    "crease": "crease_edge",
    "bevel": "bevel_weight_edge",
    "freestyle": FREESTYLE,
}
"""Source of features -> the edge attribute that is above zero there."""
SOURCES = (*MARKS, "selected", "uv_borders", "material_borders")
# UV maps are stored in single precision: what differs by less is one point.
SAME_UV = 1e-5


def feature_edges(mesh: Snapshot, sources: Iterable[str]) -> Array:
    """(N,2) vertex pairs of the edges that are features by any of the sources. Edges without a face are none."""
    marked = np.zeros(len(mesh.edges), bool)
    for source in sources:
        marked |= marked_by(mesh, source)
    return np.ascontiguousarray(mesh.edges[marked & (_faces_at_edges(mesh) > 0)])


def marked_by(mesh: Snapshot, source: str) -> Array:
    """(E,) bool: the edges that are features by one of `SOURCES`."""
    if source == "selected":
        return np.zeros(len(mesh.edges), bool) if mesh.selected_edges is None else mesh.selected_edges
    if source == "uv_borders":
        layer = mesh.attributes.get(mesh.active_uv or "")
        return _borders(mesh, None if layer is None else layer.values, at_ends=True)
    if source == "material_borders":
        layer = mesh.attributes.get(MATERIAL)
        return _borders(mesh, None if layer is None else np.repeat(layer.values, np.diff(mesh.face_offsets), axis=0))
    layer = mesh.attributes.get(MARKS[source])
    if layer is None or layer.domain != "EDGE":
        return np.zeros(len(mesh.edges), bool)
    return layer.values[:, 0] > 0


def density(mesh: Snapshot, group: str, factor: float) -> Array | None:
    """(V,) how much denser edges are: `factor` where a vertex group's weight is 1, its powers between; None without group."""
    weights = mesh.groups.get(group)
    return None if weights is None else factor ** np.clip(weights.astype(np.float64), 0, 1)


def _corner_edges(mesh: Snapshot) -> tuple[Array, Array]:
    """For each corner the corner after it in its face, and the edge between the two."""
    following = np.arange(len(mesh.corner_verts)) + 1
    following[mesh.face_offsets[1:] - 1] = mesh.face_offsets[:-1]
    pairs = np.stack([mesh.corner_verts, mesh.corner_verts[following]], axis=1)
    return following, edge_indices(mesh.edges, pairs)


def _faces_at_edges(mesh: Snapshot) -> Array:
    return np.bincount(_corner_edges(mesh)[1], minlength=len(mesh.edges))


def _borders(mesh: Snapshot, values: Array | None, *, at_ends: bool = False) -> Array:
    """(E,) bool: edges of two faces that disagree in the values (C,k) at their corners; `at_ends` compares the values at
    either end of the edge, otherwise any corner of a face stands for it."""
    found = np.zeros(len(mesh.edges), bool)
    if values is None:
        return found
    following, edge = _corner_edges(mesh)
    order = np.argsort(edge, kind="stable")
    pairs = np.flatnonzero((np.bincount(edge, minlength=len(mesh.edges)) == 2)[edge[order]])
    first, second = order[pairs].reshape(-1, 2).T
    # Neighbours run along their edge in opposite directions; where they do not, the mesh is refused anyway.
    compared = [(first, following[second]), (following[first], second)] if at_ends else [(first, second)]
    differs = [np.abs(values[a].astype(np.float64) - values[b]).max(axis=1) > SAME_UV for a, b in compared]
    found[edge[first]] = np.logical_or.reduce(differs)
    return found
