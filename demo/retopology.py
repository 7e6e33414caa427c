"""Pictures of Feature Retopology: for each mesh with features beside it (NAME.obj, NAME.edges40) the input with its features,
the base triangulation, and the result, side by side on one sheet.

Runs inside the bpy module; `python3 dev.py pictures` starts it:

    retopology.py -- --extension quadloom-0.1.0.zip --out OUT [--data FOLDER ...] [--only NAME ...] [--faces 2500]

Writes OUT/retopology-1.jpg and so on, a few meshes a sheet, and prints a row a mesh.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import pictures  # noqa: E402  (found through the line above)

DATA = HERE.parent / "blend_fixtures" / "meshes" / "tri"
ROWS_A_SHEET = 4
# Pictures are drawn larger and made smaller by this, for smooth lines.
FINER = 2
SIZE = (520, 400)
# Radius of the lines along features and along base edges, as a part of the object's diagonal.
FEATURE, BASE = 0.0022, 0.0011
COLORS = {"feature": (0.80, 0.10, 0.08, 1.0), "base": (0.06, 0.16, 0.42, 1.0)}


def main() -> int:
    """Draws every mesh; returns 1 when the operator refused one."""
    parser = argparse.ArgumentParser(prog="retopology.py")
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--data", type=Path, nargs="+", default=[DATA])
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME")
    parser.add_argument("--faces", type=int, default=2500)
    given = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    given.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(
        filepath=str(given.extension.resolve()), repo="user_default", enable_on_install=True, overwrite=True
    )
    studio = pictures.Studio((FINER * SIZE[0], FINER * SIZE[1]))
    files = sorted(file for data in given.data for file in data.glob("*.edges40") if not given.only or file.stem in given.only)
    rows, failed = [], 0
    for file in files:
        try:
            rows.append(draw(file.with_suffix(".obj"), studio, given.faces))
        except RuntimeError as error:  # what the operator reports as an error
            print(f"{file.stem}: {error}", file=sys.stderr)
            failed += 1
            continue
        sheet = (len(rows) - 1) // ROWS_A_SHEET
        save(np.concatenate(rows[sheet * ROWS_A_SHEET :]), given.out / f"retopology-{sheet + 1}.jpg")
    studio.close()
    return int(failed > 0)


def draw(file: Path, studio: pictures.Studio, faces: int) -> np.ndarray:
    """The three pictures of a mesh beside one another, (height, width, 3) from 0 to 1, the first row at the top."""
    source, features = load(file)
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    source.select_set(True)
    bpy.context.view_layer.objects.active = source
    bpy.ops.quadloom.retopologize(target_faces=faces, detect=False, preview=True, hide_input=False)
    made = bpy.context.active_object
    layout = bpy.data.objects[f"{source.name} Layout"]
    report = json.loads(made["quadloom_report"])
    print(
        f"{file.stem:18} {report['faces']:6} quads, {report['irregular_vertices']:4} irregular, "
        f"{report['inverted']:3} inverted, {report['base_triangles']:5} base triangles, "
        f"features {report['features_reproduced']:.1%}",
        flush=True,
    )
    used = {**pictures.materials(), **{name: pictures.material(name, color) for name, color in COLORS.items()}}
    size = float(np.linalg.norm(np.ptp(pictures.positions(source.data), axis=0)))
    for obj, name in ((source, "a"), (made, "new")):
        obj.data.materials.clear()
        obj.data.materials.append(used[name])
    of_input = lines("features", source, features, FEATURE * size, used["feature"])
    of_base = lines("base", layout, [e.index for e in layout.data.edges], BASE * size, used["base"])
    sharp = [edge.index for edge in made.data.edges if edge.use_edge_sharp]
    of_result = lines("kept", made, sharp, FEATURE * size, used["feature"])
    view = direction(pictures.positions(source.data))
    panels = []
    with tempfile.TemporaryDirectory(prefix="quadloom-pictures-") as folder:
        path = Path(folder) / "panel.png"
        for wired, bare in (([], [source, of_input]), ([], [source, of_base, of_input]), ([made], [of_result])):
            studio.shoot(wired, view, str(path), [source], bare)
            panels.append(read(path))
    for obj in (source, made, layout, of_input, of_base, of_result):
        bpy.data.objects.remove(obj)
    return np.concatenate(panels, axis=1)


def load(file: Path) -> tuple[bpy.types.Object, list[int]]:
    """A plain OBJ as an object with its features marked sharp, and the features' edges."""
    rows = [line.split() for line in file.read_text().splitlines()]
    points = np.array([row[1:4] for row in rows if row[:1] == ["v"]], float)
    polygons = [[int(word.split("/")[0]) - 1 for word in row[1:]] for row in rows if row[:1] == ["f"]]
    mesh = bpy.data.meshes.new(file.stem)
    mesh.from_pydata((points - points.mean(axis=0)).tolist(), [], polygons)
    pairs = [line.split() for line in file.with_suffix(".edges40").read_text().splitlines()]
    marked = {frozenset(map(int, pair)) for pair in pairs if len(pair) == 2}
    features = [edge.index for edge in mesh.edges if frozenset(edge.vertices) in marked]
    for index in features:
        mesh.edges[index].use_edge_sharp = True
    obj = bpy.data.objects.new(file.stem, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj, features


def lines(name: str, obj: bpy.types.Object, edges: list[int], radius: float, material: bpy.types.Material) -> bpy.types.Object:
    """Some edges of an object as round bars."""
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution = "3D", radius, 1
    curve.materials.append(material)
    for index in edges:
        spline = curve.splines.new("POLY")
        spline.points.add(1)
        for point, vertex in zip(spline.points, obj.data.edges[index].vertices, strict=True):
            point.co = (*obj.data.vertices[vertex].co, 1.0)
    made = bpy.data.objects.new(name, curve)
    bpy.context.scene.collection.objects.link(made)
    return made


def direction(points: np.ndarray) -> np.ndarray:
    """Where to look from: across the object's two longest directions, and from a little to the side."""
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    view = axes[2] + 0.45 * axes[1] + 0.35 * axes[0]
    return view if view[2] > 0 or abs(view[2]) < 0.1 else -view


def read(path: Path) -> np.ndarray:
    """A picture made smaller by `FINER`, the first row at the top."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    values = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    blocks = values.reshape(height // FINER, FINER, width // FINER, FINER, 4)
    return blocks.mean(axis=(1, 3))[::-1, :, :3]


def save(sheet: np.ndarray, path: Path) -> None:
    """Writes a sheet as JPEG."""
    height, width = sheet.shape[:2]
    image = bpy.data.images.new("sheet", width, height)
    image.pixels.foreach_set(np.concatenate([sheet[::-1], np.ones((height, width, 1))], axis=2).astype(np.float32).ravel())
    image.filepath_raw, image.file_format = str(path), "JPEG"
    image.save(quality=80)
    bpy.data.images.remove(image)


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    # Not exit(): bpy can hang at interpreter exit.
    os._exit(code)
