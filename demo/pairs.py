"""The pairs of the demo: shipped meshes and shapes made here, each with its placement and the side to look from."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, radians, sin
from pathlib import Path

import bpy
from mathutils import Euler, Matrix, Vector

MESHES = Path(__file__).resolve().parent.parent / "blend_fixtures" / "meshes"
# The shipped meshes have y up.
UPRIGHT = Matrix.Rotation(pi / 2, 4, "X")


@dataclass(frozen=True)
class Pair:
    """Two objects, the operations shown, and how."""

    build: Callable[[], tuple[bpy.types.Object, bpy.types.Object]]
    operations: tuple[str, ...]
    view: tuple[float, float, float]
    """Where the camera stands: a direction from the object."""
    frame_b: bool = False
    """Frame the pictures to the second object, when it is small beside the first."""


def load(name: str, file: str, *, at=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), size: float = 1.0) -> bpy.types.Object:
    """A shipped mesh; `at` in scene units, `turn` in degrees, both after it stands upright."""
    before = set(bpy.data.objects)
    bpy.ops.wm.obj_import(filepath=str(MESHES / file), forward_axis="Y", up_axis="Z")
    (obj,) = set(bpy.data.objects) - before
    rotation = Euler([radians(angle) for angle in turn]).to_matrix().to_4x4()
    obj.name = name
    obj.matrix_world = Matrix.Translation(at) @ rotation @ UPRIGHT @ Matrix.Scale(size, 4)
    return obj


def box(name: str, counts: tuple[int, int, int], size: tuple[float, float, float]) -> bpy.types.Object:
    """A box of quads centred at the origin, with so many quads along x, y and z."""
    index: dict[tuple[int, ...], int] = {}
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, counts[axis]):
            for i in range(counts[u]):
                for j in range(counts[v]):
                    face = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        corner = [0, 0, 0]
                        corner[axis], corner[u], corner[v] = side, i + di, j + dj
                        face.append(index.setdefault(tuple(corner), len(index)))
                    faces.append(face if side else face[::-1])
    verts = [tuple(size[k] * (c[k] / counts[k] - 0.5) for k in range(3)) for c in index]
    return add(name, verts, faces)


def cylinder(name: str, around: int, along: int, across: int, radius: float, length: float) -> bpy.types.Object:
    """A cylinder of quads along z whose caps are square grids pressed into the circle. `around` must be 4 x `across`."""
    assert around == 4 * across
    shape = box(name, (across, across, along), (2.0, 2.0, length))
    for vertex in shape.data.vertices:
        x, y, _ = vertex.co
        ring = max(abs(x), abs(y))
        if ring > 0:
            # Concentric squares to concentric circles, arc length for arc length.
            angle = pi / 4 * (y / x if abs(x) >= abs(y) else 2 - x / y)
            sign = (1 if x > 0 else -1) if abs(x) >= abs(y) else (1 if y > 0 else -1)
            vertex.co.x, vertex.co.y = radius * ring * sign * cos(angle), radius * ring * sign * sin(angle)
    shape.data.update()
    return shape


def add(name: str, verts: list, faces: list) -> bpy.types.Object:
    """A mesh object in the active collection."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(verts, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def spot_and_blub() -> tuple[bpy.types.Object, bpy.types.Object]:
    """A fish through a cow."""
    spot = load("Spot", "spot_quad.obj")
    blub = load("Blub", "blub_quad.obj", at=(0.12, 0.1, 0.03), turn=(0, 0, 78), size=0.6)
    return spot, blub


def body_and_eye() -> tuple[bpy.types.Object, bpy.types.Object]:
    """The MakeHuman body with an eye of its own as an amulet on the chest, or the socket for one."""
    body = load("Body", "makehuman_body.obj", size=0.25)
    # The eye's centre is not its origin.
    size = 1.1
    centre = Matrix.Scale(size, 4) @ Vector((0.308, -1.245, 7.284))
    eye = load("Eye", "makehuman_left_eye.obj", at=Vector((0.0, -0.33, 1.18)) - centre, size=size)
    return body, eye


def bracket() -> tuple[bpy.types.Object, bpy.types.Object]:
    """A block and a pin across it, as in a machine part."""
    block = box("Block", (24, 16, 10), (2.4, 1.6, 1.0))
    pin = cylinder("Pin", 32, 20, 8, 0.45, 2.0)
    pin.matrix_world = Matrix.Translation((0.35, 0.1, 0.25)) @ Euler((radians(18), radians(12), 0)).to_matrix().to_4x4()
    return block, pin


PAIRS = {
    "spot and blub": Pair(spot_and_blub, ("union", "difference", "intersection"), (1.1, 0.9, 0.5)),
    "body and eye": Pair(body_and_eye, ("union", "difference"), (0.8, -1.0, 0.25), frame_b=True),
    "block and pin": Pair(bracket, ("union", "difference", "intersection"), (0.9, -1.0, 0.9)),
}
