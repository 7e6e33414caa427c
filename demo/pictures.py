"""Pictures of meshes with their wireframe, by Workbench: quick, and it needs no display.

Workbench draws no overlay wires in a render, so each picture has a copy of the mesh with a Wireframe modifier in it.
"""

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

SIZE = (1280, 960)
COLORS = {
    "a": (0.90, 0.62, 0.36, 1.0),
    "b": (0.40, 0.60, 0.85, 1.0),
    "new": (0.86, 0.88, 0.72, 1.0),
    "wire": (0.08, 0.09, 0.10, 1.0),
}
# Width of the wire, as a fraction of the picture's width, and most of the object's diagonal that a close-up shows.
WIRE = 0.0011
CLOSE_UP = 0.22


def vector(values: Sequence[float]) -> Vector:
    """A Blender vector of three numbers."""
    return Vector([float(value) for value in values])


def materials() -> dict[str, bpy.types.Material]:
    """The materials of the pictures: the two inputs, new faces, wire."""
    return {name: material(name, color) for name, color in COLORS.items()}


def material(name: str, color: Sequence[float]) -> bpy.types.Material:
    """The demo's material of a name, of one color."""
    made = bpy.data.materials.get(f"demo {name}") or bpy.data.materials.new(f"demo {name}")
    made.diffuse_color = color
    return made


def color_new_faces(made: bpy.types.Object, inputs: Sequence[bpy.types.Object], used: dict) -> None:
    """Gives faces that are no input's, coordinate for coordinate, the material "new". The result is in A's space."""
    known = set()
    to_a = [np.eye(4), np.linalg.solve(np.array(made.matrix_world, float), np.array(inputs[1].matrix_world, float))]
    for obj, matrix in zip(inputs, to_a, strict=True):
        verts = positions(obj.data).astype(float)
        verts = np.float32(verts if np.array_equal(matrix, np.eye(4)) else verts @ matrix[:3, :3].T + matrix[:3, 3])
        known |= {frozenset(verts[v].tobytes() for v in face.vertices) for face in obj.data.polygons}
    verts = positions(made.data)
    made.data.materials.append(used["new"])
    slot = len(made.data.materials) - 1
    for face in made.data.polygons:
        if frozenset(verts[v].tobytes() for v in face.vertices) not in known:
            face.material_index = slot


class Studio:
    """A camera and Workbench's settings; `close` takes the camera away again."""

    def __init__(self, size: tuple[int, int] = SIZE) -> None:
        scene = bpy.context.scene
        scene.render.engine = "BLENDER_WORKBENCH"
        scene.render.resolution_x, scene.render.resolution_y = self.size = size
        scene.display.render_aa = "8"
        shading = scene.display.shading
        shading.light, shading.color_type, shading.show_cavity = "STUDIO", "MATERIAL", True
        scene.render.image_settings.color_mode = "RGB"
        scene.world = bpy.data.worlds.new("demo background")
        scene.world.color = (0.9, 0.9, 0.88)
        scene.view_settings.view_transform = "Standard"
        self.camera = bpy.data.objects.new("demo camera", bpy.data.cameras.new("demo camera"))
        self.camera.data.type = "ORTHO"
        scene.collection.objects.link(self.camera)
        scene.camera = self.camera

    def close(self) -> None:
        """Removes the camera."""
        data = self.camera.data
        bpy.data.objects.remove(self.camera)
        bpy.data.cameras.remove(data)

    def shoot(
        self,
        objects: Sequence[bpy.types.Object],
        view,
        path: str,
        frame: Sequence[bpy.types.Object],
        bare: Sequence[bpy.types.Object] = (),
    ) -> None:
        """A picture of the objects from the direction `view`, framed to `frame`; `bare` ones are drawn without their wire."""
        points = np.concatenate([_world_positions(obj) for obj in frame])
        axes = _camera_axes(view)
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width = max(high[0] - low[0], (high[1] - low[1]) * self.size[0] / self.size[1]) * 1.08
        self._render(objects, axes, axes.T @ ((low + high) / 2), width, path, bare)

    def shoot_seam(self, made: bpy.types.Object, view, path: str) -> None:
        """A close-up of the part of the seam (the selected edges) nearest to the camera."""
        axes = _camera_axes(view)
        on_seam = np.zeros(len(made.data.edges), bool)
        made.data.edges.foreach_get("select", on_seam)
        pairs = np.empty(2 * len(on_seam), np.int32)
        made.data.edges.foreach_get("vertices", pairs)
        points = _world_positions(made)
        seam = points[pairs.reshape(-1, 2)[on_seam].ravel()]
        # Not the very nearest point, which is at the silhouette of the seam: the middle of the nearest fifth.
        depth = seam @ axes[2]
        target = np.median(seam[depth >= np.quantile(depth, 0.8)], axis=0)
        width = min(CLOSE_UP * np.linalg.norm(np.ptp(points, axis=0)), 1.5 * np.linalg.norm(np.ptp(seam, axis=0)))
        self._render([made], axes, target, width, path)

    def _render(
        self,
        objects: Sequence[bpy.types.Object],
        axes: np.ndarray,
        target: np.ndarray,
        width: float,
        path: str,
        bare: Sequence[bpy.types.Object] = (),
    ) -> None:
        scene = bpy.context.scene
        was_hidden = {obj: obj.hide_render for obj in scene.objects}
        for obj in was_hidden:
            obj.hide_render = obj not in objects and obj not in bare
        wires = [_wire(obj, width) for obj in objects]
        distance = 100.0
        self.camera.data.ortho_scale, self.camera.data.clip_end = width, 2 * distance
        matrix = np.eye(4)
        matrix[:3, :3] = axes.T
        matrix[:3, 3] = target + distance * axes[2]
        self.camera.matrix_world = Matrix(matrix.tolist())
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        for obj in wires:
            data = obj.data
            bpy.data.objects.remove(obj)
            bpy.data.meshes.remove(data)
        for obj, hidden in was_hidden.items():
            obj.hide_render = hidden


def sheet(paths: Sequence[Path], path: Path, columns: int) -> None:
    """One picture of many of one size, each at half its size, in rows."""
    tiles = []
    for each in paths:
        image = bpy.data.images.load(str(each))
        width, height = image.size
        pixels = np.empty(4 * width * height, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        pixels = pixels.reshape(height, width, 4)[: height // 2 * 2, : width // 2 * 2]
        tiles.append(pixels.reshape(height // 2, 2, width // 2, 2, 4).mean(axis=(1, 3)))
    height, width = tiles[0].shape[:2]
    rows = -(-len(tiles) // columns)
    whole = np.ones((rows * height, columns * width, 4), np.float32)
    for k, tile in enumerate(tiles):
        # Rows of pixels run upwards.
        row, column = rows - 1 - k // columns, k % columns
        whole[row * height : (row + 1) * height, column * width : (column + 1) * width] = tile
    image = bpy.data.images.new("sheet", columns * width, rows * height)
    image.pixels.foreach_set(whole.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)


def _wire(obj: bpy.types.Object, width: float) -> bpy.types.Object:
    """The mesh's edges as thin dark bars, in the world."""
    mesh = obj.data.copy()
    mesh.transform(obj.matrix_world)
    mesh.materials.clear()
    mesh.materials.append(materials()["wire"])
    mesh.polygons.foreach_set("material_index", np.zeros(len(mesh.polygons), np.int32))
    wire = bpy.data.objects.new(f"{obj.name} wire", mesh)
    bpy.context.scene.collection.objects.link(wire)
    modifier = wire.modifiers.new("wire", "WIREFRAME")
    modifier.thickness, modifier.use_even_offset, modifier.offset = WIRE * width, False, 0.0
    return wire


def _camera_axes(view) -> np.ndarray:
    """Rows: right, up and towards the camera, for a camera that stands in the direction `view`."""
    back = np.array(view, float) / np.linalg.norm(view)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def positions(mesh: bpy.types.Mesh) -> np.ndarray:
    """(V,3) float32, in the object's own space."""
    values = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


def _world_positions(obj: bpy.types.Object) -> np.ndarray:
    matrix = np.array(obj.matrix_world, float)
    return positions(obj.data) @ matrix[:3, :3].T + matrix[:3, 3]
