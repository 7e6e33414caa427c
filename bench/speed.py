"""Speed beside Blender's EXACT boolean solver, both in this process on the same pairs of 7,000-face meshes; and irregular
vertices beside QuadriFlow on Blender's result at the same face count. Runs inside Blender: python dev.py bench speed.

Blender's time is the evaluation of the Boolean modifier; ours is one call of quadloom.boolean. Each is the least of
--repeats runs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

ROOT = Path(__file__).resolve().parent.parent
BLUB = ROOT / "blend_fixtures" / "meshes" / "blub_quad.obj"
OPERATIONS = {"union": "UNION", "intersection": "INTERSECT", "difference": "DIFFERENCE"}
# Where the second Blub stands: offset as a fraction of the diagonal, and turn about the vertical in degrees.
PLACEMENTS = {"beside": ((0.0, 0.0, 0.12), 90.0), "through": ((0.1, 0.05, 0.0), 45.0)}


def install(extension: Path) -> Any:
    """Installs the packed extension and returns the wheel it brings."""
    bpy.ops.extensions.package_install_files(filepath=str(extension), repo="user_default", enable_on_install=True)
    import quadloom

    return quadloom


def read_obj(path: Path) -> tuple[Any, list[list[int]]]:
    """Positions and polygons of a plain OBJ."""
    rows = [line.split() for line in path.read_text().splitlines()]
    positions = np.array([row[1:4] for row in rows if row[:1] == ["v"]], float)
    return positions, [[int(word.split("/")[0]) - 1 for word in row[1:]] for row in rows if row[:1] == ["f"]]


def turned(positions: Any, offset: tuple[float, float, float], degrees: float) -> Any:
    """Turned about the y axis through the centre, then moved by a fraction of the diagonal; rounded to float32."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    centre = positions.mean(axis=0)
    rotation = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    diagonal = np.linalg.norm(np.ptp(positions, axis=0))
    moved = (positions - centre) @ rotation.T + centre + np.array(offset) * diagonal
    return moved.astype(np.float32).astype(float)


def add_object(name: str, positions: Any, faces: list[list[int]]) -> Any:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(positions.tolist(), [], faces)
    made = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def exact(a: Any, b: Any, operation: str) -> Any:
    """A new object with what the EXACT solver makes of the pair."""
    modifier = a.modifiers.new("Boolean", "BOOLEAN")
    modifier.operation, modifier.object, modifier.solver = OPERATIONS[operation], b, "EXACT"
    a.update_tag()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    depsgraph.update()
    mesh = bpy.data.meshes.new_from_object(a.evaluated_get(depsgraph), depsgraph=depsgraph)
    a.modifiers.remove(modifier)
    made = bpy.data.objects.new("exact", mesh)
    bpy.context.scene.collection.objects.link(made)
    return made


def irregular_after_quadriflow(made: Any, faces: int) -> int | None:
    """Irregular vertices of QuadriFlow's remesh at that face count; None when QuadriFlow gives up."""
    bpy.context.view_layer.objects.active = made
    made.select_set(True)
    # QuadriFlow refuses a mesh with edges below 1e-4, which the cut leaves; their length means nothing to it otherwise.
    made.data.transform(Matrix.Scale(1000.0, 4))
    triangulate = made.modifiers.new("Triangulate", "TRIANGULATE")
    bpy.ops.object.modifier_apply(modifier=triangulate.name)
    try:
        done = bpy.ops.object.quadriflow_remesh(mode="FACES", target_faces=faces, use_preserve_sharp=True)
    except RuntimeError as error:
        print(f"  QuadriFlow: {error}")
        return None
    if done != {"FINISHED"}:
        return None
    valence = Counter(v for edge in made.data.edges for v in edge.vertices)
    return sum(count != 4 for count in valence.values())


def least(call: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """The least time of some calls, and what the last one returned."""
    times, value = [], None
    for _ in range(repeats):
        start = time.perf_counter()
        value = call()
        times.append(time.perf_counter() - start)
    return min(times), value


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--extension", type=Path, required=True, help="the packed extension; dev.py gives it")
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    quadloom = install(given.extension)
    positions, faces = read_obj(BLUB)
    ratios = []
    print(f"{'pair':22} {'ours':>7} {'EXACT':>7} {'ratio':>6} {'irregular':>9} {'QuadriFlow':>10}")
    for name, (offset, degrees) in PLACEMENTS.items():
        moved = turned(positions, offset, degrees)
        pair = [quadloom.Mesh.from_polygons(p, faces) for p in (positions.astype(np.float32), moved)]
        a, b = add_object("a", positions, faces), add_object("b", moved, faces)
        for operation in OPERATIONS:
            try:
                ours, result = least(partial(quadloom.boolean, *pair, operation), given.repeats)
            except quadloom.QuadloomError as error:
                print(f"{name} {operation}: {error.code}: {error}")
                return 1
            theirs, made = least(partial(exact, a, b, operation), given.repeats)
            flow = irregular_after_quadriflow(made, len(result.face_source))
            valence = np.bincount(unique_edges(result.mesh).ravel())
            ratios.append(ours / theirs)
            print(
                f"{name + ' ' + operation:22} {ours:6.2f}s {theirs:6.2f}s {ratios[-1]:6.2f} "
                f"{int(np.sum((valence != 4) & (valence > 0))):9} {'failed' if flow is None else flow:>10}"
            )
            stages = sorted(result.report["seconds"].items(), key=lambda item: -item[1])
            print("  " + ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in stages))
    print(f"\nbar 5: must at most 3, goal below 1: worst ratio {max(ratios):.2f}, mean {np.mean(ratios):.2f}")
    return 0 if max(ratios) <= 3 else 1


def unique_edges(mesh: Any) -> Any:
    """(E, 2) vertex pairs of a pure-quad mesh."""
    quads = mesh.corner_verts.reshape(-1, 4)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(sides, axis=1), axis=0)


if __name__ == "__main__":
    sys.exit(main())
