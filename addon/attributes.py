"""Meshes as numpy arrays, and where the attributes of a result come from. Touches no bpy: runs on a job's thread.

A face of the result that was kept takes every value of its source face, corner for corner, unchanged. A new corner takes the
source face's values weighted by `corner_source`; whole numbers and switches come from the nearest corner. Edges take the
values of the source edge they are, or run along.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

# A new edge runs along a source edge when its ends and its middle are this near to it, as a fraction of its own length.
ALONG_TOLERANCE = 0.05
INTERPOLATED = {"FLOAT", "FLOAT2", "FLOAT_VECTOR", "FLOAT_COLOR", "BYTE_COLOR", "QUATERNION", "FLOAT4X4"}
SEAM = "use_seam"
FREESTYLE = "freestyle_edge"
MATERIAL = "material_index"
FEATURE_ATTRIBUTES = ("sharp_edge", SEAM, "crease_edge")


@dataclass(frozen=True)
class Attribute:
    """One attribute layer: `values` has shape (elements of the domain, components)."""

    domain: str
    data_type: str
    values: Array


@dataclass(frozen=True)
class Snapshot:
    """A mesh and its attributes, in Blender's own layout."""

    positions: Array
    """(V,3) float64."""
    edges: Array
    """(E,2) int32 vertex pairs."""
    face_offsets: Array
    """(F+1,) int32."""
    corner_verts: Array
    """(C,) int32."""
    attributes: dict[str, Attribute] = field(default_factory=dict)
    groups: dict[str, Array] = field(default_factory=dict)
    """Vertex group -> (V,) float32 weights, -1 where a vertex is not in the group."""
    materials: list[Any] = field(default_factory=list)
    """One material, or None, a slot."""
    corner_normals: Array | None = None
    """(C,3) float32 when the mesh has custom normals."""
    selected_edges: Array | None = None
    """(E,) bool: selected in Edit Mode; None for not known."""
    active_uv: str | None = None
    """Name of the active UV map."""

    @property
    def face_count(self) -> int:
        """Number of faces."""
        return len(self.face_offsets) - 1

    def feature_edges(self) -> Array:
        """(N,2) int32: the edges marked sharp, seam or creased."""
        marked = np.zeros(len(self.edges), bool)
        for name in FEATURE_ATTRIBUTES:
            layer = self.attributes.get(name)
            if layer is not None and layer.domain == "EDGE":
                marked |= layer.values[:, 0] > 0
        return np.ascontiguousarray(self.edges[marked])

    def with_sharp_edges(self, edges: Array) -> Snapshot:
        """The mesh with these edges (indices) marked sharp as well."""
        layer = self.attributes.get("sharp_edge")
        values = np.zeros((len(self.edges), 1), bool) if layer is None else layer.values.copy()
        values[edges] = True
        return replace(self, attributes={**self.attributes, "sharp_edge": Attribute("EDGE", "BOOLEAN", values)})

    def transformed(self, matrix: Array) -> Snapshot:
        """The mesh moved by a (4,4) float64 matrix; one that mirrors turns the faces, so that outside stays outside."""
        if np.array_equal(matrix, np.eye(4)):
            return self
        linear = matrix[:3, :3]
        moved = replace(self, positions=self.positions @ linear.T + matrix[:3, 3])
        if self.corner_normals is not None:
            normals = self.corner_normals @ np.linalg.inv(linear)
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            moved = replace(moved, corner_normals=(normals / np.maximum(length, 1e-30)).astype(np.float32))
        return moved._turned() if np.linalg.det(linear) < 0 else moved

    def _turned(self) -> Snapshot:
        """The same faces run the other way round, from the same first corner."""
        start = np.repeat(self.face_offsets[:-1], np.diff(self.face_offsets))
        size = np.repeat(np.diff(self.face_offsets), np.diff(self.face_offsets))
        step = np.arange(len(self.corner_verts)) - start
        order = start + (size - step) % size
        attributes = {
            name: replace(layer, values=layer.values[order]) if layer.domain == "CORNER" else layer
            for name, layer in self.attributes.items()
        }
        normals = None if self.corner_normals is None else self.corner_normals[order]
        return replace(self, corner_verts=self.corner_verts[order], attributes=attributes, corner_normals=normals)


def mix(a: Snapshot, b: Snapshot, result: Any, *, b_is_turned: bool) -> tuple[Snapshot, list[str]]:
    """The result of a native boolean as a snapshot with the operands' attributes, and the names that could not be carried.

    `result` has `mesh`, `face_source` and `corner_source` as the wheel gives them; `b_is_turned` says that B's faces bound
    the result from their other side, as in a difference. Costs O(corners) an attribute.
    """
    a, b, materials = _merge_materials(a, b)
    return _carried([a, b], _origin_of_boolean(a, b, result), result.mesh, materials, b_is_turned)


def retopologized(source: Snapshot, result: Any) -> Snapshot:
    """The result of a native retopology as a snapshot with the source's attributes, its feature edges marked as they were.

    `result` has `mesh`, `corner_source`, `feature_edges` and `feature_source` as the wheel gives them. Costs O(corners) an
    attribute.
    """
    made, _ = _carried([source], _origin_of_retopology(source, result), result.mesh, source.materials, False)
    if source.selected_edges is not None:
        under = edge_indices(source.edges, result.feature_source)
        chosen = edge_indices(made.edges, result.feature_edges)[source.selected_edges[under]]
        selected = np.zeros(len(made.edges), bool)
        selected[chosen] = True
        made = replace(made, selected_edges=selected)
    return made


def _carried(
    operands: list[Snapshot], origin: _Origin, mesh: Any, materials: list[Any], last_is_turned: bool
) -> tuple[Snapshot, list[str]]:
    """The mesh with the operands' attributes, and the names of those that could not be carried."""
    attributes, left_out = {}, []
    for name in dict.fromkeys(name for s in operands for name in s.attributes):
        layers = [s.attributes.get(name) for s in operands]
        kind = next(layer for layer in layers if layer is not None)
        unlike = [layer is not None and (layer.domain, layer.data_type) != (kind.domain, kind.data_type) for layer in layers]
        if any(unlike):
            left_out.append(name)
        values = [_values(None if skip else layer, kind, s) for layer, skip, s in zip(layers, unlike, operands, strict=True)]
        mixed = origin.carry(kind.domain, np.concatenate(values), kind.data_type in INTERPOLATED)
        attributes[name] = replace(kind, values=mixed)
    groups = {}
    for name in dict.fromkeys(name for s in operands for name in s.groups):
        weights = np.concatenate([s.groups.get(name, np.full(len(s.positions), -1, np.float32)) for s in operands])
        inside = origin.carry("POINT", (weights >= 0).astype(np.float32)[:, None], True)[:, 0]
        mixed = origin.carry("POINT", np.maximum(weights, 0)[:, None], True)[:, 0]
        groups[name] = np.where(inside > 0, mixed, -1).astype(np.float32)
    normals = None
    if any(s.corner_normals is not None for s in operands):
        # Zero stands for "no custom normal here".
        each = [np.zeros((len(s.corner_verts), 3)) if s.corner_normals is None else s.corner_normals for s in operands]
        if last_is_turned:
            each[-1] = -each[-1]
        normals = origin.carry("CORNER", np.concatenate(each), True)
    made = Snapshot(mesh.positions, origin.edges, mesh.face_offsets, mesh.corner_verts, attributes, groups, materials, normals)
    return made, left_out


def edge_indices(edges: Array, pairs: Array) -> Array:
    """Index into `edges` (E,2) of each vertex pair of `pairs` (N,2), -1 where there is no such edge."""
    if len(edges) == 0 or len(pairs) == 0:
        return np.full(len(pairs), -1)
    keys, wanted = _edge_keys(edges), _edge_keys(pairs)
    order = np.argsort(keys)
    at = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][at] == wanted, order[at], -1)


@dataclass
class _Origin:
    """Where each element of a result comes from, as indices into the operands' elements, one operand's after another's."""

    corner_verts: Array
    """The result's."""
    edges: Array
    """The result's."""
    blend_corners: Array
    """(C,k) source corners that each corner of the result mixes."""
    blend_verts: Array
    """(C,k) the vertices at those."""
    weights: Array
    """(C,k) their weights."""
    corner: Array
    """(C,) the source corner that each corner of the result is, -1 for new ones; so for the other elements."""
    vert: Array
    face: Array
    edge: Array

    @property
    def nearest(self) -> Array:
        """(C,) the source corner with the greatest weight."""
        return self.blend_corners[np.arange(len(self.weights)), self.weights.argmax(axis=1)]

    @property
    def nearest_vert(self) -> Array:
        """(C,) the vertex there."""
        return self.blend_verts[np.arange(len(self.weights)), self.weights.argmax(axis=1)]

    def carry(self, domain: str, values: Array, interpolate: bool) -> Array:
        """Values of the result's elements from the values (N,k) of A's and B's."""
        if domain == "FACE":
            return _taken(values, self.face)
        if domain == "EDGE":
            return _taken(values, self.edge)
        exact, spread = (self.corner, self.blend_corners) if domain == "CORNER" else (self.vert, self.blend_verts)
        if interpolate:
            new = np.einsum("ck,ckw->cw", self.weights, values[spread].astype(np.float64))
        else:
            new = values[self.nearest if domain == "CORNER" else self.nearest_vert]
        if domain == "POINT":
            new = self._gather(new, interpolate)
        out = _taken(values, exact)
        out[exact < 0] = new[exact < 0].astype(values.dtype)
        return out

    def _gather(self, values: Array, interpolate: bool) -> Array:
        """One value a vertex from one a corner: the mean of its corners, or the first."""
        out = np.zeros((len(self.vert), values.shape[1]), values.dtype)
        if interpolate:
            count = np.maximum(np.bincount(self.corner_verts, minlength=len(out)), 1)
            for k in range(values.shape[1]):
                out[:, k] = np.bincount(self.corner_verts, values[:, k], len(out)) / count
        else:
            out[self.corner_verts[::-1]] = values[::-1]
        return out


def _origin_of_boolean(a: Snapshot, b: Snapshot, result: Any) -> _Origin:
    mesh = result.mesh
    sizes = np.diff(mesh.face_offsets)
    face_of_corner = np.repeat(np.arange(len(sizes)), sizes)
    source_corner_verts = np.concatenate([a.corner_verts, b.corner_verts + len(a.positions)])
    source_start = np.concatenate([a.face_offsets[:-1], b.face_offsets[:-1] + len(a.corner_verts)])
    source = result.corner_source
    face = _joined(source.mesh, source.face, a.face_count)
    blend_corners = source_start[face][:, None] + np.arange(4)
    kept_face = _joined(result.face_source[:, 0], result.face_source[:, 1], a.face_count)
    kept_corner = kept_face[face_of_corner] >= 0
    origin = _Origin(
        corner_verts=mesh.corner_verts,
        edges=_unique_edges(_sides(mesh)),
        blend_corners=blend_corners,
        blend_verts=source_corner_verts[blend_corners],
        weights=source.weights,
        corner=np.empty(0),
        vert=np.full(len(mesh.positions), -1),
        face=np.where(kept_face >= 0, kept_face, _most_frequent(face, mesh.face_offsets)),
        edge=np.empty(0),
    )
    # A kept corner has one weight, so it is its nearest source corner; in a difference B's faces come turned.
    origin.corner = np.where(kept_corner, origin.nearest, -1)
    origin.vert[mesh.corner_verts[kept_corner]] = source_corner_verts[origin.corner[kept_corner]]
    source_positions = np.concatenate([a.positions, b.positions])
    source_edges = np.concatenate([a.edges, b.edges + len(a.positions)])
    origin.edge = _edge_origin(origin, mesh.positions, source_positions, source_edges, _marked(a, b))
    return origin


def _origin_of_retopology(source: Snapshot, result: Any) -> _Origin:
    """Nothing is kept: every corner is a mixture, and only feature edges come from an edge."""
    mesh, points = result.mesh, result.corner_source
    edges = _unique_edges(_sides(mesh))
    edge = np.full(len(edges), -1)
    edge[edge_indices(edges, result.feature_edges)] = edge_indices(source.edges, result.feature_source)
    return _Origin(
        corner_verts=mesh.corner_verts,
        edges=edges,
        blend_corners=points.corners,
        blend_verts=source.corner_verts[points.corners],
        weights=points.weights,
        corner=np.full(len(mesh.corner_verts), -1),
        vert=np.full(len(mesh.positions), -1),
        face=_most_frequent(points.face, mesh.face_offsets),
        edge=edge,
    )


def _edge_origin(origin: _Origin, positions: Array, source_positions: Array, source_edges: Array, marked: Array) -> Array:
    """The source edge that each edge is (both its ends were kept) or runs along (marked ones only), or -1."""
    ends = origin.vert[origin.edges]
    found = np.where((ends >= 0).all(axis=1), edge_indices(source_edges, ends), -1)
    new = np.flatnonzero(found < 0)
    # Only marked edges that did not survive can have been replaced by new ones.
    lost = marked[~np.isin(marked, found)]
    if len(new) == 0 or len(lost) == 0:
        return found
    low, high = source_positions[source_edges[lost, 0]], source_positions[source_edges[lost, 1]]
    first, second = positions[origin.edges[new, 0]], positions[origin.edges[new, 1]]
    limit = ALONG_TOLERANCE * np.linalg.norm(second - first, axis=1)
    near = np.ones(len(new), bool)
    for points in (first, second, (first + second) / 2):
        distance, nearest = _nearest_segment(points, low, high)
        near &= distance <= limit
    found[new[near]] = lost[nearest[near]]
    return found


def _joined(mesh: Array, face: Array, first_count: int) -> Array:
    """Indices into A's faces followed by B's, from pairs of operand and face; -1 where there is none."""
    return np.where(face >= 0, face + np.where(mesh == 1, first_count, 0), -1).astype(np.int64)


def _values(layer: Attribute | None, kind: Attribute, owner: Snapshot) -> Array:
    """The layer's values, or the defaults where the mesh lacks it: white for colours, zero for the rest."""
    if layer is not None:
        return layer.values
    count = {
        "POINT": len(owner.positions),
        "EDGE": len(owner.edges),
        "FACE": owner.face_count,
        "CORNER": len(owner.corner_verts),
    }[kind.domain]
    fill = 1 if kind.data_type in {"FLOAT_COLOR", "BYTE_COLOR"} else 0
    return np.full((count, kind.values.shape[1]), fill, kind.values.dtype)


def _merge_materials(a: Snapshot, b: Snapshot) -> tuple[Snapshot, Snapshot, list[Any]]:
    """Both operands with their material indices pointing into one list of slots without duplicates."""
    if not a.materials and not b.materials:
        return a, b, []
    slots: list[Any] = []
    mapped = []
    for operand in (a, b):
        own = operand.materials or [None]
        for material in own:
            if material not in slots:
                slots.append(material)
        layer = operand.attributes.get(MATERIAL)
        index = np.zeros((operand.face_count, 1), np.int32) if layer is None else layer.values
        to_slot = np.array([slots.index(material) for material in own], np.int32)
        # Blender itself draws an index past the last slot with the last slot.
        values = to_slot[np.clip(index, 0, len(own) - 1)]
        attributes = {**operand.attributes, MATERIAL: Attribute("FACE", "INT", values)}
        mapped.append(replace(operand, attributes=attributes))
    return mapped[0], mapped[1], slots


def _marked(a: Snapshot, b: Snapshot) -> Array:
    """Indices (A's edges, then B's) of the edges with any edge attribute that is not zero."""
    parts = []
    for operand in (a, b):
        marked = np.zeros(len(operand.edges), bool)
        for layer in operand.attributes.values():
            if layer.domain == "EDGE":
                marked |= (layer.values != 0).any(axis=1)
        parts.append(marked)
    return np.flatnonzero(np.concatenate(parts))


def _taken(values: Array, index: Array) -> Array:
    """values[index] with zeros where the index is -1."""
    out = np.zeros((len(index), values.shape[1]), values.dtype)
    has = index >= 0
    out[has] = values[index[has]]
    return out


def _most_frequent(values: Array, offsets: Array) -> Array:
    """For each run of `values` between offsets, the value met most often; the lowest on a tie."""
    run = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    pairs, count = np.unique(np.stack([run, values], axis=1), axis=0, return_counts=True)
    order = np.lexsort((pairs[:, 1], -count, pairs[:, 0]))
    first = np.searchsorted(pairs[order, 0], np.arange(len(offsets) - 1))
    return pairs[order[first], 1]


def _sides(mesh: Any) -> Array:
    """(C,2): the vertices of each corner and of the next of its face."""
    following = np.arange(len(mesh.corner_verts)) + 1
    following[mesh.face_offsets[1:] - 1] = mesh.face_offsets[:-1]
    return np.stack([mesh.corner_verts, mesh.corner_verts[following]], axis=1)


def _edge_keys(pairs: Array) -> Array:
    pairs = np.sort(np.asarray(pairs, np.int64), axis=1)
    return pairs[:, 0] << 32 | pairs[:, 1]


def _unique_edges(pairs: Array) -> Array:
    keys = np.unique(_edge_keys(pairs))
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)


def _nearest_segment(points: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Distance from each point to the nearest segment low-high, and which it is. Costs points x segments."""
    along = high - low
    squared = np.maximum((along**2).sum(axis=1), 1e-300)
    distance, nearest = np.empty(len(points)), np.empty(len(points), np.int64)
    for begin in range(0, len(points), 1024):
        offset = points[begin : begin + 1024, None, :] - low[None]
        t = np.clip((offset * along).sum(axis=2) / squared, 0, 1)
        apart = ((offset - t[..., None] * along) ** 2).sum(axis=2)
        pick = apart.argmin(axis=1)
        nearest[begin : begin + 1024] = pick
        distance[begin : begin + 1024] = np.sqrt(apart[np.arange(len(pick)), pick])
    return distance, nearest
