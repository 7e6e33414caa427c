"""QuadriFlow on a triangle mesh, inside Blender; bench/retopology.py starts it: quadriflow.py -- OUT FACES FILE.obj

Features beside the file (FILE.edges40) are marked sharp and kept. Writes OUT/FILE.obj, and its seconds to OUT/seconds.json:
null for a mesh that QuadriFlow gives up on.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np

# QuadriFlow refuses a mesh with edges below 1e-4; their length means nothing to it otherwise.
SIZE = 1000.0


def read_obj(path: Path) -> tuple[Any, list[list[int]]]:
    """Positions and polygons of a plain OBJ."""
    rows = [line.split() for line in path.read_text().splitlines()]
    positions = np.array([row[1:4] for row in rows if row[:1] == ["v"]], float)
    return positions, [[int(word.split("/")[0]) - 1 for word in row[1:]] for row in rows if row[:1] == ["f"]]


def read_edges(path: Path) -> set[tuple[int, int]]:
    """Vertex pairs, smaller first; a first line with one number is a count."""
    rows = [line.split() for line in path.read_text().splitlines()] if path.exists() else []
    return {(min(a, b), max(a, b)) for a, b in (map(int, row) for row in rows if len(row) == 2)}


def remesh(path: Path, out: Path, faces: int) -> float | None:
    """Writes the remeshed file; returns the seconds of the remeshing alone, None when QuadriFlow gave up."""
    positions, polygons = read_obj(path)
    low, diagonal = positions.min(axis=0), np.linalg.norm(np.ptp(positions, axis=0))
    mesh = bpy.data.meshes.new(path.stem)
    mesh.from_pydata(((positions - low) * (SIZE / diagonal)).tolist(), [], polygons)
    features = read_edges(path.with_suffix(".edges40"))
    for edge in mesh.edges:
        a, b = edge.vertices
        edge.use_edge_sharp = (min(a, b), max(a, b)) in features
    made = bpy.data.objects.new(path.stem, mesh)
    bpy.context.scene.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    made.select_set(True)
    start = time.perf_counter()
    try:
        done = bpy.ops.object.quadriflow_remesh(
            mode="FACES", target_faces=faces, use_preserve_sharp=True, use_preserve_boundary=True
        )
    except RuntimeError as error:
        print(f"{path.stem}: {error}")
        done = {"CANCELLED"}
    seconds = time.perf_counter() - start
    if done == {"FINISHED"}:
        points = np.empty(3 * len(made.data.vertices))
        made.data.vertices.foreach_get("co", points)
        points = points.reshape(-1, 3) * (diagonal / SIZE) + low
        lines = ["v {:.17g} {:.17g} {:.17g}".format(*p) for p in points]
        lines += ["f " + " ".join(str(v + 1) for v in polygon.vertices) for polygon in made.data.polygons]
        (out / f"{path.stem}.obj").write_text("\n".join(lines) + "\n")
    bpy.data.objects.remove(made)
    return seconds if done == {"FINISHED"} else None


def main() -> None:
    out, faces, file = sys.argv[sys.argv.index("--") + 1 :]
    seconds = remesh(Path(file), Path(out), int(faces))
    (Path(out) / "seconds.json").write_text(json.dumps(seconds))


main()
sys.stdout.flush()
# Not exit(): bpy can hang at interpreter exit.
os._exit(0)
