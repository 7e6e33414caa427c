"""The demo: installs the packed extension into Blender, joins shipped meshes with it, and shows the results.

Runs inside the bpy module (`python3 dev.py demo` does it). For each pair and operation it calls `bpy.ops.quadloom.boolean`,
runs Blender's own EXACT boolean on the same pair, renders before, after and a close-up of the seam, and prints a table.
Everything ends up in OUT/demo.blend, one collection a pair.

    demo.py -- --extension quadloom-0.1.0.zip --out OUT [--only PAIR ...]
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import pairs  # noqa: E402  (found through the line above)
import pictures  # noqa: E402

EXTENSION = "bl_ext.user_default.quadloom"
EXACT = {"union": "UNION", "difference": "DIFFERENCE", "intersection": "INTERSECT"}


def main() -> int:
    """Runs every pair; returns 1 when an operation did not give a result."""
    parser = argparse.ArgumentParser(prog="demo.py")
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=list(pairs.PAIRS), choices=list(pairs.PAIRS), metavar="PAIR")
    given = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    given.out.mkdir(parents=True, exist_ok=True)

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(
        filepath=str(given.extension.resolve()), repo="user_default", enable_on_install=True, overwrite=True
    )
    studio = pictures.Studio()
    rows, failed = [], 0
    for column, name in enumerate(given.only):
        place = np.array([column * 8.0, 0.0, 0.0])
        for row, operation in enumerate(pairs.PAIRS[name].operations):
            try:
                rows.append(run(name, operation, studio, given.out, place + np.array([0.0, row * 6.0, 0.0])))
            except RuntimeError as error:  # what the operator reports as an error
                print(f"{name}, {operation}: {error}", file=sys.stderr)
                failed += 1
    studio.close()
    bpy.ops.wm.save_as_mainfile(filepath=str(given.out.resolve() / "demo.blend"), compress=True)
    print_tables(rows)
    return int(failed > 0)


def run(name: str, operation: str, studio: pictures.Studio, out: Path, place: np.ndarray) -> dict:
    """One operation of one pair: result, pictures, and a row of the table."""
    pair = pairs.PAIRS[name]
    collection = bpy.data.collections.new(f"{name} {operation}")
    bpy.context.scene.collection.children.link(collection)
    bpy.context.view_layer.active_layer_collection = bpy.context.view_layer.layer_collection.children[collection.name]
    a, b = pair.build()
    materials = pictures.materials()
    for obj, material in ((a, materials["a"]), (b, materials["b"])):
        obj.data.materials.clear()
        obj.data.materials.append(material)
        obj.matrix_world.translation += pictures.vector(place)
    bpy.context.view_layer.update()

    exact = exact_boolean(a, b, operation)
    for obj in bpy.context.selected_objects:
        obj.select_set(False)
    a.select_set(True)
    b.select_set(True)
    bpy.context.view_layer.objects.active = a
    start = time.perf_counter()
    bpy.ops.quadloom.boolean(operation=operation, hide_inputs=False)
    seconds = time.perf_counter() - start
    made = bpy.context.view_layer.objects.active
    report = json.loads(made["quadloom_report"])
    pictures.color_new_faces(made, (a, b), materials)

    stem = out / f"{name}-{operation}".replace(" ", "-")
    frame = [b] if pair.frame_b else [a, b]
    before = out / f"{name}-before.png".replace(" ", "-")
    if operation == pair.operations[0]:
        studio.shoot([a, b], pair.view, str(before), frame)
    studio.shoot([made], pair.view, f"{stem}-after.png", frame)
    studio.shoot_seam(made, pair.view, f"{stem}-seam.png")
    for obj in (a, b):
        obj.hide_set(True)
        obj.hide_render = True
    print(f"{name}, {operation}: {seconds:.2f} s, pictures {before.name}, {stem.name}-after.png and -seam.png", flush=True)
    return {"name": f"{name}, {operation}", "seconds": seconds, "report": report, "exact": exact}


def exact_boolean(a: bpy.types.Object, b: bpy.types.Object, operation: str) -> dict:
    """Faces by size and seconds of Blender's EXACT solver on the same pair."""
    modifier = a.modifiers.new("exact", "BOOLEAN")
    modifier.operation, modifier.object, modifier.solver = EXACT[operation], b, "EXACT"
    start = time.perf_counter()
    evaluated = a.evaluated_get(bpy.context.evaluated_depsgraph_get())
    seconds = time.perf_counter() - start
    sizes = np.empty(len(evaluated.data.polygons), np.int32)
    evaluated.data.polygons.foreach_get("loop_total", sizes)
    a.modifiers.remove(modifier)
    bpy.context.view_layer.update()
    counts = {"triangles": int((sizes == 3).sum()), "quads": int((sizes == 4).sum()), "n-gons": int((sizes > 4).sum())}
    return {**counts, "seconds": seconds}


def print_tables(rows: list[dict]) -> None:
    """What came out beside Blender's EXACT, then where the seconds went."""
    print("\nIrregular vertices and scaled Jacobians are those of the new quads.\n")
    head = ["pair, operation", "kept", "new", "irregular", "worst SJ", "mean SJ", "seconds"]
    lines = [[*head, "EXACT: tris", "quads", "n-gons", "seconds"]]
    for row in rows:
        report, exact = row["report"], row["exact"]
        lines.append(
            [
                row["name"],
                f"{report['faces_kept']:,}",
                f"{report['faces_new']:,}",
                f"{report['irregular_vertices']:,}",
                f"{report['scaled_jacobian_min']:.3f}",
                f"{report['scaled_jacobian_mean']:.3f}",
                f"{row['seconds']:.2f}",
                f"{exact['triangles']:,}",
                f"{exact['quads']:,}",
                f"{exact['n-gons']:,}",
                f"{exact['seconds']:.2f}",
            ]
        )
    print_aligned(lines)
    stages = list(dict.fromkeys(stage for row in rows for stage in row["report"]["seconds"]))
    print("\nSeconds in each stage of the library.\n")
    lines = [["pair, operation", *stages]]
    for row in rows:
        lines.append([row["name"], *(f"{row['report']['seconds'].get(stage, 0.0):.3f}" for stage in stages)])
    print_aligned(lines)
    for row in rows:
        for warning in row["report"]["warnings"]:
            print(f"{row['name']}: {warning}")


def print_aligned(lines: list[list[str]]) -> None:
    """Columns under their heads: words to the left, numbers to the right."""
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    for line in lines:
        numbers = (cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True))
        print(line[0].ljust(widths[0]), *numbers, sep="  ")


code = main()
sys.stdout.flush()
sys.stderr.flush()
# Not exit(): bpy can hang or crash at interpreter exit while an extension is registered.
os._exit(code)
