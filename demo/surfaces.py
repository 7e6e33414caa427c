"""Pictures of tiled surfaces: generated roofs, a dome, a tower and closed ones, each by kind, type, planarity and area.

Runs inside the bpy module, as demo.py does; tests/pictures calls it. Each surface is tiled by `bpy.ops.quadloom.tile_surface`
from a scene of its own object, and its panels are exported beside the pictures.

    surfaces.py -- --extension quadloom-0.1.0.zip --out OUT [--count PANELS] [--obj FILE ...]
"""

import argparse
import json
import math
import os
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bpy  # noqa: E402
import pictures  # noqa: E402  (found through the line above)

VIEW = (0.7, -1.0, 0.8)


def main() -> int:
    """Tiles and draws every surface; returns 1 when one could not be tiled."""
    parser = argparse.ArgumentParser(prog="surfaces.py")
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=800, help="panels of each")
    parser.add_argument("--obj", type=Path, nargs="*", default=[], help="further surfaces")
    given = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    given.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(
        filepath=str(given.extension.resolve()), repo="user_default", enable_on_install=True, overwrite=True
    )
    studio = pictures.Studio()
    failed = 0
    for obj in [*(grid(name, *shape) for name, shape in SHAPES.items()), *map(load, given.obj)]:
        try:
            draw(obj, given.count, studio, given.out)
        except RuntimeError as error:  # what the operator reports as an error
            print(f"{obj.name}: {error}", file=sys.stderr)
            failed += 1
    studio.close()
    return int(failed > 0)


def draw(source: bpy.types.Object, count: int, studio: pictures.Studio, out: Path) -> None:
    """One surface by kind, random, and by each measure."""
    for color_by, pattern in (
        ("kind", "regular"),
        ("kind", "random"),
        ("type", "regular"),
        ("planarity", "regular"),
        ("area", "regular"),
    ):
        for obj in bpy.context.selected_objects:
            obj.select_set(False)
        source.select_set(True)
        bpy.context.view_layer.objects.active = source
        start = time.perf_counter()
        bpy.ops.quadloom.tile_surface(
            panel_count=count, color_by=color_by, pattern=pattern, hide_input=False, type_tolerance=0.02
        )
        seconds = time.perf_counter() - start
        made = bpy.context.view_layer.objects.active
        stem = out / f"surface-{source.name}-{pattern if color_by == 'kind' else color_by}".lower()
        studio.shoot([made], VIEW, f"{stem}.png", [made])
        if (color_by, pattern) == ("kind", "regular"):
            print(f"{source.name}: {'; '.join(json.loads(made['quadloom_report'])['summary'])}; {seconds:.2f} s", flush=True)
            bpy.ops.quadloom.export_panels(filepath=f"{stem}.svg", format="svg")
        bpy.data.objects.remove(made)


def grid(name: str, place, n: int, m: int, around: bool) -> bpy.types.Object:
    """n by m quads at place(u, v), u and v from 0 to 1; `around` joins the end of u to its beginning."""
    columns = n if around else n + 1
    points = [place(i / n, j / m) for i in range(columns) for j in range(m + 1)]
    corners = [[(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(n) for j in range(m)]
    faces = [[(i % columns) * (m + 1) + j for i, j in face] for face in corners]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    return linked(bpy.data.objects.new(name, mesh))


def load(path: Path) -> bpy.types.Object:
    """The mesh of an OBJ file, z upwards, its largest side 4 long."""
    bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z")
    obj = bpy.context.selected_objects[0]
    obj.scale = [4 / max(obj.dimensions)] * 3
    bpy.context.view_layer.update()
    return obj


def linked(obj: bpy.types.Object) -> bpy.types.Object:
    """The object, in the scene."""
    bpy.context.scene.collection.objects.link(obj)
    return obj


def roof(u: float, v: float) -> tuple[float, float, float]:
    """Undulating, longer than wide."""
    return (6 * u, 3 * v, 0.35 * math.sin(math.tau * u) + 0.25 * math.cos(1.5 * math.tau * v))


def dome(u: float, v: float) -> tuple[float, float, float]:
    """A cap over a square."""
    x, y = 4 * u - 2, 4 * v - 2
    return (x, y, math.sqrt(9 - 0.5 * (x * x + y * y)) - 2.2)


def tower(u: float, v: float) -> tuple[float, float, float]:
    """A twisted tower of three lobes."""
    angle = math.tau * u
    radius = (1 + 0.15 * math.cos(3 * angle)) * (1 - 0.35 * v + 0.2 * v * v)
    return (radius * math.cos(angle + v), radius * math.sin(angle + v), 4 * v)


def vase(u: float, v: float) -> tuple[float, float, float]:
    """Round, with a waist."""
    radius = 1 + 0.45 * math.sin(1.7 * math.pi * v)
    return (radius * math.cos(math.tau * u), radius * math.sin(math.tau * u), 3 * v)


def barrel(u: float, v: float) -> tuple[float, float, float]:
    """Half of a cylinder."""
    return (4 * v, 1.5 * math.cos(math.pi * (1 - u)), 1.5 * math.sin(math.pi * u))


SHAPES = {
    "Roof": (roof, 48, 24, False),
    "Dome": (dome, 32, 32, False),
    "Tower": (tower, 72, 40, True),
    "Vase": (vase, 60, 32, True),
    "Barrel": (barrel, 40, 30, False),
}

if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    # Not exit(): bpy 4.5 can hang at interpreter exit.
    os._exit(code)
