"""Pictures of tiled surfaces: generated ones and all that ship, each as it is and by kind, random, in patches with the patch
graph, by type, planarity and area; and a sheet of all surfaces for each of these.

Runs inside the bpy module, as demo.py does; tests/pictures calls it. Each surface is tiled by `bpy.ops.quadloom.tile_surface`
from a scene of its own object, and its panels are exported beside the pictures.

    surfaces.py -- --extension quadloom-0.1.0.zip --out OUT [--count PANELS] [--obj FILE ...] [--only WORD]
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
import numpy as np  # noqa: E402
import pictures  # noqa: E402  (found through the line above)

VIEW = (0.7, -1.0, 0.8)
SHIPPED = HERE.parent / "blend_fixtures" / "meshes" / "arch"
# Name of the picture -> options of the operator; none for the surface itself.
LOOKS = {
    "input": None,
    "regular": {},
    "random": {"pattern": "random"},
    "patches": {"partition": "patches"},
    "type": {"color_by": "type"},
    "planarity": {"color_by": "planarity"},
    "area": {"color_by": "area"},
}
SIZE = (960, 720)
COLUMNS = 5
# Radius of the tubes that show the sides of patches, as a part of the surface's size.
TUBE = 0.004


def main() -> int:
    """Tiles and draws every surface; returns 1 when one could not be tiled."""
    parser = argparse.ArgumentParser(prog="surfaces.py")
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=800, help="panels of each")
    parser.add_argument("--obj", type=Path, nargs="*", default=[], help="further surfaces")
    parser.add_argument("--only", default="", metavar="WORD", help="only surfaces whose name has this word")
    given = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    given.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(
        filepath=str(given.extension.resolve()), repo="user_default", enable_on_install=True, overwrite=True
    )
    studio = pictures.Studio(SIZE)
    failed = 0
    drawn = {look: [] for look in LOOKS}
    generated = [lambda name=name, shape=shape: grid(name, *shape) for name, shape in SHAPES.items()]
    files = [lambda path=path: load(path) for path in (*sorted(SHIPPED.glob("*.obj")), *given.obj)]
    names = [*SHAPES, *(path.stem for path in (*sorted(SHIPPED.glob("*.obj")), *given.obj))]
    for name, make in zip(names, [*generated, *files], strict=True):
        if given.only.lower() not in name.lower():
            continue
        for look, options in LOOKS.items():
            try:
                drawn[look].append(draw(make(), given.count, look, options, studio, given.out))
            except RuntimeError as error:  # what the operator reports as an error
                print(f"{name}, {look}: {error}", file=sys.stderr)
                failed += 1
            for block in (*bpy.data.objects, *bpy.data.meshes, *bpy.data.curves):
                if block not in (studio.camera, studio.camera.data):
                    bpy.data.batch_remove([block])
    for look, paths in drawn.items():
        if paths:
            pictures.sheet(paths, given.out / f"surfaces-{look}.png", COLUMNS)
    studio.close()
    return int(failed > 0)


def draw(source: bpy.types.Object, count: int, look: str, options: dict | None, studio: pictures.Studio, out: Path) -> Path:
    """One surface in one way; the picture's file."""
    bpy.context.view_layer.update()
    path = out / f"surface-{source.name}-{look}.png".lower()
    if options is None:
        studio.shoot([source], VIEW, str(path), [source])
        return path
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    source.select_set(True)
    bpy.context.view_layer.objects.active = source
    start = time.perf_counter()
    bpy.ops.quadloom.tile_surface(panel_count=count, show_patches=True, type_tolerance=0.02, **options)
    seconds = time.perf_counter() - start
    made = bpy.context.view_layer.objects.active
    report = json.loads(made["quadloom_report"])
    patches = f"; {report['patches']} patches" if report["patches"] else ""
    print(f"{source.name}, {look}: {'; '.join(report['summary'])}{patches}; {seconds:.2f} s", flush=True)
    for warning in report["warnings"]:
        print(f"    {warning}", flush=True)
    graph = [tubes(obj) for obj in bpy.data.objects if obj.name.startswith(f"{source.name} Patches")]
    studio.shoot([made], VIEW, str(path), [made], bare=graph)
    if look == "regular":
        bpy.ops.quadloom.export_panels(filepath=str(path.with_suffix(".svg")), format="svg")
    return path


def tubes(patches: bpy.types.Object) -> bpy.types.Object:
    """The edges of the object as tubes that a render shows."""
    points = pictures.positions(patches.data)
    data = bpy.data.curves.new("sides", "CURVE")
    data.dimensions = "3D"
    data.bevel_depth = TUBE * float(np.linalg.norm(np.ptp(points, axis=0)))
    for edge in patches.data.edges:
        spline = data.splines.new("POLY")
        spline.points.add(1)
        spline.points.foreach_set("co", np.append(points[list(edge.vertices)], [[1.0], [1.0]], axis=1).ravel())
    data.materials.append(pictures.material("sides", (0.75, 0.05, 0.10, 1.0)))
    made = linked(bpy.data.objects.new("sides", data))
    made.matrix_world = patches.matrix_world
    return made


def grid(name: str, place, n: int, m: int, around: bool) -> bpy.types.Object:
    """n by m quads at place(u, v), u and v from 0 to 1; `around` joins the end of u to its beginning.
    Points that fall together are one."""
    columns = n if around else n + 1
    places: dict[tuple, int] = {}
    index = {}
    for i in range(columns):
        for j in range(m + 1):
            index[i, j] = places.setdefault(tuple(round(x, 9) + 0.0 for x in place(i / n, j / m)), len(places))
    points = list(places)
    corners = [[(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(n) for j in range(m)]
    faces = [list(dict.fromkeys(index[i % columns, j] for i, j in face)) for face in corners]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], faces)
    return linked(bpy.data.objects.new(name, mesh))


def load(path: Path) -> bpy.types.Object:
    """The mesh of an OBJ file, z upwards, its largest side 4 long."""
    bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z")
    obj = bpy.context.selected_objects[0]
    obj.name = path.stem
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


def sphere(u: float, v: float) -> tuple[float, float, float]:
    """By longitude and latitude."""
    latitude = math.pi * (v - 0.5)
    return (math.cos(latitude) * math.cos(math.tau * u), math.cos(latitude) * math.sin(math.tau * u), math.sin(latitude))


def slice_of(part: int, fraction: float):
    """A slice of the sphere between two meridians: the paper's figure 10 has six."""

    def place(u: float, v: float) -> tuple[float, float, float]:
        return sphere((part + u) * fraction, v)

    return place


def saddle(u: float, v: float) -> tuple[float, float, float]:
    """A hyperbolic paraboloid."""
    x, y = 4 * u - 2, 4 * v - 2
    return (x, y, 0.2 * (x * x - y * y))


def torus(u: float, v: float) -> tuple[float, float, float]:
    """Closed both ways."""
    radius = 2 + 0.7 * math.cos(math.tau * v)
    return (radius * math.cos(math.tau * u), radius * math.sin(math.tau * u), 0.7 * math.sin(math.tau * v))


SHAPES = {
    "Sphere": (sphere, 48, 24, True),
    "Slice": (slice_of(0, 1 / 6), 16, 48, False),
    "Quarter": (slice_of(0, 1 / 4), 16, 48, False),
    "Saddle": (saddle, 32, 32, False),
    "Torus": (torus, 64, 32, True),
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
