"""Blender meshes to numpy snapshots and back, and the selection of elements. Main thread only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bmesh
import bpy
import numpy as np

from .attributes import FREESTYLE, SEAM, Array, Attribute, Snapshot, edge_indices

# Attribute type -> the property of its items, numbers a value, and the array they are read through. BYTE_COLOR goes through
# its sRGB bytes, which come back unchanged.
ATTRIBUTE_TYPES: dict[str, tuple[str, int, type]] = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color_srgb", 4, np.float32),
    "INT16_2D": ("value", 2, np.int32),
    "INT32_2D": ("value", 2, np.int32),
    "QUATERNION": ("value", 4, np.float32),
    "FLOAT4X4": ("value", 16, np.float32),
}
# Carried by other means: positions, custom normals, and seams (whose attribute changed its name in 4.3).
OTHERWISE_CARRIED = {"position", "custom_normal", "uv_seam"}
TRANSFORM_CHANNELS = (
    "rotation_mode", "location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale",
    "delta_location", "delta_rotation_euler", "delta_rotation_quaternion", "delta_scale",
)  # fmt: skip


def read(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Snapshot:
    """The object's mesh as its modifiers leave it, in its own space. Edits still in Edit Mode are included."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
        obj.data.update_tag()
        depsgraph.update()
    evaluated = obj.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    try:
        return _snapshot(mesh, evaluated)
    finally:
        evaluated.to_mesh_clear()


def read_base(obj: bpy.types.Object) -> Snapshot:
    """The object's own mesh, without modifiers. Edits still in Edit Mode are included."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    return _snapshot(obj.data, obj)


def read_outline(context: bpy.types.Context, obj: bpy.types.Object) -> Snapshot:
    """A mesh as its modifiers leave it; a curve as a wire, without thickness and fill."""
    if obj.type == "MESH":
        return read(obj, context.evaluated_depsgraph_get())
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    # Blender evaluates only curves that are in a scene, and a thick or filled one to its surface.
    wire = obj.copy()
    wire.data = obj.data.copy()
    wire.data.dimensions = "3D"
    wire.data.extrude = wire.data.bevel_depth = wire.data.offset = 0.0
    wire.data.bevel_object = None
    context.scene.collection.objects.link(wire)
    try:
        return read(wire, context.evaluated_depsgraph_get())
    finally:
        data = wire.data
        bpy.data.objects.remove(wire)
        bpy.data.curves.remove(data)


def select_points(curve: bpy.types.Curve, verts: Array, total: int) -> int:
    """Selects the control points nearest to these of the `total` vertices of the curve's wire, and no other; how many."""
    points = [point for spline in curve.splines for point in spline.bezier_points or spline.points]
    chosen = {int(vert) * len(points) // total for vert in verts} if total else set()
    for index, point in enumerate(points):
        selected = index in chosen
        if isinstance(point, bpy.types.BezierSplinePoint):
            point.select_control_point = point.select_left_handle = point.select_right_handle = selected
        else:
            point.select = selected
    return len(chosen)


def world_matrix(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> Array:
    """(4,4) float64: the object's space to the world, constraints and parents included."""
    return np.array(obj.evaluated_get(depsgraph).matrix_world, np.float64)


def write(name: str, snapshot: Snapshot) -> bpy.types.Mesh:
    """A new mesh of the snapshot; vertex groups belong to objects: see `assign_groups`."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(snapshot.positions))
    mesh.edges.add(len(snapshot.edges))
    mesh.loops.add(len(snapshot.corner_verts))
    mesh.polygons.add(snapshot.face_count)
    _set(mesh.vertices, "co", snapshot.positions.astype(np.float32))
    _set(mesh.edges, "vertices", snapshot.edges)
    _set(mesh.polygons, "loop_start", snapshot.face_offsets[:-1])
    _set(mesh.loops, "vertex_index", snapshot.corner_verts)
    _set(mesh.loops, "edge_index", _corner_edges(snapshot))
    for material in snapshot.materials:
        mesh.materials.append(material)
    properties = {SEAM: SEAM, **dict(_freestyle_property())}
    for attribute_name, layer in snapshot.attributes.items():
        if attribute_name in properties:
            _set(mesh.edges, properties[attribute_name], layer.values)
            continue
        made = mesh.attributes.new(attribute_name, layer.data_type, layer.domain)
        _set(made.data, ATTRIBUTE_TYPES[layer.data_type][0], layer.values)
    mesh.update()
    if snapshot.corner_normals is not None:
        mesh.normals_split_custom_set(snapshot.corner_normals)
    return mesh


def present(context: bpy.types.Context, made: bpy.types.Object, hidden: Sequence[bpy.types.Object] = ()) -> None:
    """Selects a result alone and makes it active; hides its inputs, in renders too where they may be changed."""
    for obj in context.selected_objects:
        obj.select_set(False)
    made.select_set(True)
    context.view_layer.objects.active = made
    for obj in hidden:
        obj.hide_set(True)
        if obj.is_editable:
            obj.hide_render = True


def assign_groups(obj: bpy.types.Object, snapshot: Snapshot) -> None:
    """Gives the object the snapshot's vertex groups. Vertices of equal weight go in one call."""
    for name, weights in snapshot.groups.items():
        group = obj.vertex_groups.new(name=name)
        members = np.flatnonzero(weights >= 0)
        order = members[np.argsort(weights[members], kind="stable")]
        values, starts = np.unique(weights[order], return_index=True)
        for value, verts in zip(values, np.split(order, starts[1:]), strict=True):
            group.add(verts.tolist(), float(value), "REPLACE")


def copy_active_layers(source: bpy.types.Mesh, target: bpy.types.Mesh) -> None:
    """Makes the layers that are active (and rendered) in `source` active in `target`."""
    for layer in source.uv_layers:
        mine = target.uv_layers.get(layer.name)
        if mine is not None:
            mine.active = mine.active or layer.active
            mine.active_render = mine.active_render or layer.active_render
    colors = source.color_attributes
    if colors.active_color_name in target.color_attributes:
        target.color_attributes.active_color_name = colors.active_color_name
    if colors.default_color_name in target.color_attributes:
        target.color_attributes.default_color_name = colors.default_color_name


def copy_transform(source: bpy.types.Object, target: bpy.types.Object) -> None:
    """Puts `target`, which has no parent, where `source` is: channel by channel where that is enough, so that no digit is lost.

    A matrix would have to be taken apart into location, rotation and scale, which rounds."""
    if source.parent is not None or len(source.constraints) > 0:
        target.matrix_world = source.matrix_world
        return
    for channel in TRANSFORM_CHANNELS:
        setattr(target, channel, getattr(source, channel))


def can_select(obj: bpy.types.Object, snapshot: Snapshot) -> bool:
    """Whether indices into the snapshot are indices into the object's own mesh (no modifier changed its topology)."""
    mesh = obj.data
    if len(mesh.vertices) != len(snapshot.positions) or len(mesh.loops) != len(snapshot.corner_verts):
        return False
    same = np.array_equal(np.sort(_get(mesh.loops, "vertex_index", 1, np.int32)[:, 0]), np.sort(snapshot.corner_verts))
    return same and len(mesh.polygons) == snapshot.face_count


def select(
    context: bpy.types.Context, obj: bpy.types.Object, elements: dict[str, Array], *, extend: bool = False
) -> dict[str, int]:
    """Selects these elements of the object's mesh, and unless `extend` nothing else of it; returns how many of each kind.

    `elements`: "verts" and "faces" are indices, "edges" vertex pairs (N,2). The select mode becomes that of the smallest kind
    given, so that none of them is lost."""
    mesh = obj.data
    edit = bmesh.from_edit_mesh(mesh) if obj.mode == "EDIT" else None
    edges = _edge_pairs(mesh, edit)
    chosen = {
        "verts": np.unique(elements.get("verts", [])).astype(int),
        "edges": edge_indices(edges, np.asarray(elements.get("edges", np.empty((0, 2))), np.int64).reshape(-1, 2)),
        "faces": np.unique(elements.get("faces", [])).astype(int),
    }
    chosen["edges"] = np.unique(chosen["edges"][chosen["edges"] >= 0])
    if edit is None:
        _select_in_object_mode(mesh, edges, chosen, extend)
    else:
        _select_in_edit_mode(edit, chosen, extend)
    if any(len(index) for index in chosen.values()):
        smallest = next(kind for kind in ("verts", "edges", "faces") if len(chosen[kind]))
        context.tool_settings.mesh_select_mode = [kind == smallest for kind in ("verts", "edges", "faces")]
    if edit is not None:
        edit.select_mode = {"VERT", "EDGE", "FACE"}
        bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
    return {kind: len(index) for kind, index in chosen.items()}


def _select_in_object_mode(mesh: bpy.types.Mesh, edges: Array, chosen: dict[str, Array], extend: bool) -> None:
    # Blender 5.0 gives edges that it computed itself a selection of the wrong type, and crashes when it is written to.
    edge_selection = mesh.attributes.get(".select_edge")
    if edge_selection is not None and edge_selection.data_type != "BOOLEAN":
        mesh.attributes.remove(edge_selection)
    sequences = {"verts": mesh.vertices, "edges": mesh.edges, "faces": mesh.polygons}
    flags = {kind: _get(sequence, "select", 1, bool)[:, 0] & extend for kind, sequence in sequences.items()}
    for kind, index in chosen.items():
        flags[kind][index] = True
    # A selected face has its edges and vertices selected, a selected edge its vertices.
    sizes = _get(mesh.polygons, "loop_total", 1, np.int32)[:, 0]
    on_face = np.repeat(flags["faces"], sizes)
    flags["edges"][_get(mesh.loops, "edge_index", 1, np.int32)[on_face, 0]] = True
    flags["verts"][edges[flags["edges"]]] = True
    for kind, sequence in sequences.items():
        _set(sequence, "select", flags[kind])
    mesh.update()


def _select_in_edit_mode(edit: bmesh.types.BMesh, chosen: dict[str, Array], extend: bool) -> None:
    if not extend:
        for sequence in (edit.faces, edit.edges, edit.verts):
            for element in sequence:
                element.select = False
    for kind, sequence in (("verts", edit.verts), ("edges", edit.edges), ("faces", edit.faces)):
        sequence.ensure_lookup_table()
        for index in chosen[kind]:
            sequence[index].hide = False
            sequence[index].select_set(True)


def _edge_pairs(mesh: bpy.types.Mesh, edit: bmesh.types.BMesh | None) -> Array:
    if edit is not None:
        edit.verts.index_update()
        return np.array([[v.index for v in edge.verts] for edge in edit.edges], np.int32).reshape(-1, 2)
    return _get(mesh.edges, "vertices", 2, np.int32)


def _snapshot(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> Snapshot:
    corners = len(mesh.loops)
    offsets = np.append(_get(mesh.polygons, "loop_start", 1, np.int32)[:, 0], np.int32(corners))
    attributes = {}
    for layer in mesh.attributes:
        if layer.name.startswith(".") or layer.name in OTHERWISE_CARRIED or layer.data_type not in ATTRIBUTE_TYPES:
            continue
        prop, width, dtype = ATTRIBUTE_TYPES[layer.data_type]
        attributes[layer.name] = Attribute(layer.domain, layer.data_type, _get(layer.data, prop, width, dtype))
    for name, prop in [(SEAM, SEAM), *_freestyle_property()]:
        marks = _get(mesh.edges, prop, 1, bool)
        if marks.any():
            attributes[name] = Attribute("EDGE", "BOOLEAN", marks)
    materials = [slot.material and slot.material.original for slot in obj.material_slots]
    normals = _get(mesh.corner_normals, "vector", 3, np.float32) if mesh.has_custom_normals else None
    return Snapshot(
        positions=_get(mesh.vertices, "co", 3, np.float32).astype(np.float64),
        edges=_get(mesh.edges, "vertices", 2, np.int32),
        face_offsets=offsets,
        corner_verts=_get(mesh.loops, "vertex_index", 1, np.int32)[:, 0],
        attributes=attributes,
        groups=_groups(mesh, obj),
        materials=materials,
        corner_normals=normals,
        selected_edges=_get(mesh.edges, "select", 1, bool)[:, 0],
        active_uv=mesh.uv_layers.active.name if mesh.uv_layers.active is not None else None,
    )


def _freestyle_property() -> list[tuple[str, str]]:
    """The attribute of Freestyle's edge marks and the property it was before Blender 5.0."""
    return [(FREESTYLE, "use_freestyle_mark")] if "use_freestyle_mark" in bpy.types.MeshEdge.bl_rna.properties else []


def _groups(mesh: bpy.types.Mesh, obj: bpy.types.Object) -> dict[str, Array]:
    """Vertex group weights; Blender offers no faster way than a loop over the vertices."""
    names = [group.name for group in obj.vertex_groups]
    weights = np.full((len(names), len(mesh.vertices)), -1, np.float32)
    if names:
        for vertex in mesh.vertices:
            for entry in vertex.groups:
                weights[entry.group, vertex.index] = entry.weight
    return dict(zip(names, weights, strict=True))


def _corner_edges(snapshot: Snapshot) -> Array:
    """(C,) int32: the edge from each corner to the next of its face."""
    following = np.arange(len(snapshot.corner_verts)) + 1
    following[snapshot.face_offsets[1:] - 1] = snapshot.face_offsets[:-1]
    pairs = np.stack([snapshot.corner_verts, snapshot.corner_verts[following]], axis=1)
    return edge_indices(snapshot.edges, pairs).astype(np.int32)


def _get(sequence: Any, prop: str, width: int, dtype: type) -> Array:
    values = np.empty(len(sequence) * width, dtype)
    sequence.foreach_get(prop, values)
    return values.reshape(-1, width)


def _set(sequence: Any, prop: str, values: Array) -> None:
    sequence.foreach_set(prop, np.ascontiguousarray(values).ravel())
