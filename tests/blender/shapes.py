"""Test shapes and oracles, in plain numpy: nothing here comes from the code under test."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

MESHES = Path(__file__).resolve().parents[2] / "blend_fixtures" / "meshes"


def box(n: int) -> tuple[np.ndarray, list[list[int]]]:
    """The surface of the cube [-1, 1]^3 in n x n quads a side: vertices (V,3) and faces, outward."""
    index: dict[tuple[int, ...], int] = {}
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        at = [0, 0, 0]
                        at[axis], at[u], at[v] = side, i + di, j + dj
                        corners.append(index.setdefault(tuple(at), len(index)))
                    faces.append(corners if side else corners[::-1])
    return 2.0 * np.array(list(index), float) / n - 1.0, faces


def ball(n: int) -> tuple[np.ndarray, list[list[int]]]:
    """The unit sphere as an inflated `box`."""
    verts, faces = box(n)
    verts = np.tan(verts * np.pi / 4)  # evens out the quads
    return verts / np.linalg.norm(verts, axis=1, keepdims=True), faces


def load(name: str) -> tuple[np.ndarray, list[list[int]]]:
    """A shipped OBJ mesh."""
    verts, faces = [], []
    for line in (MESHES / name).read_text().splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            verts.append([float(x) for x in rest.split()[:3]])
        elif word == "f":
            faces.append([int(corner.split("/")[0]) - 1 for corner in rest.split()])
    return np.array(verts), faces


def add(name: str, shape: tuple[np.ndarray, list[list[int]]], offset=(0.0, 0.0, 0.0), size: float = 1.0) -> bpy.types.Object:
    """A mesh object in the scene; `offset` and `size` are baked into its vertices."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata((shape[0] * size + np.asarray(offset)).tolist(), [], shape[1])
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def choose(active: bpy.types.Object, *others: bpy.types.Object) -> None:
    """Selects these objects and no other, the first of them active."""
    # The list of the view layer's objects is brought up to date by nothing else.
    bpy.context.view_layer.update()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in (active, *others))
    bpy.context.view_layer.objects.active = active


def arrays(obj: bpy.types.Object, *, world: bool = False) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Vertices (V,3), in the object's space or the world's, and faces."""
    verts = np.empty(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", verts)
    verts = verts.reshape(-1, 3)
    if world:
        matrix = np.array(obj.matrix_world, float)
        verts = verts.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    return verts, [tuple(face.vertices) for face in obj.data.polygons]


def fingerprint(obj: bpy.types.Object) -> tuple:
    """Everything of an object that an operator on it could alter by mistake."""
    verts, faces = arrays(obj)
    return verts.tobytes(), faces, tuple(map(tuple, obj.matrix_world)), sorted(a.name for a in obj.data.attributes)


def is_closed(faces: list[tuple[int, ...]]) -> bool:
    """Every edge runs once in each direction."""
    directed = [(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))]
    return len(set(directed)) == len(directed) and all((b, a) in set(directed) for a, b in set(directed))


def volume(verts: np.ndarray, faces: list[tuple[int, ...]]) -> float:
    """Signed volume inside a closed mesh."""
    total = 0.0
    for face in faces:
        p = verts[list(face)].astype(float)
        for k in range(1, len(face) - 1):
            total += p[0] @ np.cross(p[k], p[k + 1])
    return total / 6


def face_points(verts: np.ndarray, faces: list[tuple[int, ...]]) -> dict[bytes, int]:
    """Each face as its corner coordinates, bit for bit and in order from the first -> its index."""
    return {verts[list(face)].tobytes(): k for k, face in enumerate(faces)}
