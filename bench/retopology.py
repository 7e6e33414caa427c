"""Retopology beside QuadriFlow (with sharp edges) and Instant Meshes: the same meshes, the same run, one judge.

    python dev.py bench retopology [--faces 4000] [--data FOLDER] [--limit SECONDS] [--only NAME...] [--no-growth]

A row for each mesh that has its features beside it (NAME.obj, NAME.edges40) and each method: seconds of the call alone, then
what tests/judge/meshcheck.py measures: irregular vertices, patches of the base complex, scaled Jacobian, inverted quads, mean
deviation of angles, Hausdorff distance, length of features within 1% and 5% of the mean edge. Seconds of QuadriFlow are those
of its operator in Blender. After each mesh comes the ratio of irregular vertices, ours to QuadriFlow's. A method that fails, or
takes longer than the limit, is shown as such; only our own failures fail the run. Then growth: tori of up to 160,000 vertices
with 70 curves. Instant Meshes comes from PyPI (bench/requirements.txt, a
virtual environment of its own).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests" / "judge")]

import blenders  # noqa: E402  (found through the line above)
import meshcheck  # noqa: E402

# The torus of the growth rows at its smallest, vertices the long way round and across; its curves in a grid of 10 by 7.
AROUND, ACROSS = 200, 100
GROWTH = (1, 2, 4, 8)
DATA = ROOT / "blend_fixtures" / "meshes" / "tri"
# Runs in the environment of Instant Meshes: FACES IN.npz OUT.npz, prints the seconds.
INSTANT_MESHES = """
import sys, time
import numpy as np
import pynanoinstantmeshes as instant
given = np.load(sys.argv[2])
start = time.perf_counter()
positions, quads = instant.remesh(
    np.asarray(given["positions"], np.float32), np.asarray(given["triangles"], np.uint32),
    # It subdivides at the end, which makes four quads of each.
    vertex_count=int(sys.argv[1]) // 4, rosy=4, posy=4, creaseAngle=40.0, align_to_boundaries=True, smooth_iter=2,
    deterministic=True,
)
print(time.perf_counter() - start)
np.savez(sys.argv[3], positions=positions, quads=quads)
"""


def write_obj(path: Path, positions: Any, faces: Any) -> None:
    lines = ["v {:.17g} {:.17g} {:.17g}".format(*p) for p in positions]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


@dataclass(frozen=True)
class Task:
    """What each method is given."""

    file: Path
    faces: int
    limit: float
    """Seconds that a method may take."""
    result: Path
    """Where the quads go, as an OBJ file."""


class Failed(Exception):
    """Why a method has no result."""


def ours(task: Task) -> float:
    """The wheel; returns the seconds of the call."""
    positions, polygons = meshcheck.read_obj(str(task.file))
    made, seconds = retopologized(positions, polygons, features_of(task.file), task.faces, task.limit)
    write_obj(task.result, made.mesh.positions, made.mesh.corner_verts.reshape(-1, 4))
    return seconds


def retopologized(positions: Any, polygons: Any, features: Any, faces: int, limit: float) -> tuple[Any, float]:
    import quadloom

    mesh = quadloom.Mesh.from_polygons(positions, polygons)
    start = time.perf_counter()

    def progress(stage: str, fraction: float) -> bool:
        return time.perf_counter() - start < limit

    try:
        result = quadloom.retopologize(mesh, features, target_faces=faces, progress=progress)
    except quadloom.Cancelled:
        raise Failed(f"no result in {limit:.0f} s") from None
    except quadloom.QuadloomError as error:
        raise Failed(f"{error.code}: {error}") from None
    return result, time.perf_counter() - start


def quadriflow(task: Task) -> float:
    """A Blender of its own for each mesh: it cannot be interrupted otherwise."""
    out = task.result.parent
    arguments = [str(out), str(task.faces), str(task.file)]
    folders = sorted({task.file.parent, out})
    script = ROOT / "bench" / "quadriflow.py"
    done = blenders.ensure("bpy-5.0").run(script, arguments, mounts=folders, timeout=task.limit, capture=True)
    if done.returncode != 0:
        raise Failed(ending(done.returncode, done.stderr, task.limit))
    seconds = json.loads((out / "seconds.json").read_text())
    if seconds is None:
        raise Failed("it gives up")
    return float(seconds)


def instant_meshes(task: Task) -> float:
    """A process of its own for each mesh: the library ends the process when it fails."""
    environment = blenders.cache_folder() / "bench"
    python = environment / "bin" / "python"
    with blenders.install(environment, gigabytes=0.2) as needed:
        if needed:
            subprocess.run([sys.executable, "-m", "venv", "--clear", str(environment)], check=True)
            requirements = str(ROOT / "bench" / "requirements.txt")
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", "--requirement", requirements], check=True)
    positions, polygons = meshcheck.read_obj(str(task.file))
    given, made = task.result.with_name("given.npz"), task.result.with_name("made.npz")
    np.savez(given, positions=positions, triangles=np.array(polygons))
    command = [str(python), "-c", INSTANT_MESHES, str(task.faces), str(given), str(made)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=task.limit)
    except subprocess.TimeoutExpired:
        raise Failed(f"no result in {task.limit:.0f} s") from None
    if done.returncode != 0:
        raise Failed(ending(done.returncode, done.stderr, task.limit))
    result = np.load(made)
    # Triangles among the quads repeat a corner.
    quads = [list(dict.fromkeys(map(int, quad))) for quad in result["quads"]]
    write_obj(task.result, result["positions"], quads)
    return float(done.stdout.split()[-1])


METHODS: dict[str, Callable[[Task], float]] = {
    "ours": ours, "QuadriFlow": quadriflow, "Instant Meshes": instant_meshes
}  # fmt: skip


def ending(code: int, errors: str | None, limit: float) -> str:
    """Why a process ended badly, in a few words."""
    if code == -9:
        return f"no result in {limit:.0f} s"
    last = (errors or "").strip().splitlines()[-1:]
    return f"ended with code {code}" + "".join(f": {line[:80]}" for line in last)


def features_of(file: Path) -> Any:
    edges = file.with_suffix(".edges40")
    return meshcheck.read_edges(str(edges)) if edges.exists() else np.empty((0, 2), np.int64)


def judge(file: Path, result: Path) -> dict[str, Any]:
    """What the judge says, without its slow exact self-intersections."""
    vertices, faces = meshcheck.read_obj(str(result))
    surface, polygons = meshcheck.read_obj(str(file))
    triangles, _ = meshcheck.triangulate(vertices, faces)
    surface_triangles, _ = meshcheck.triangulate(surface, polygons)
    diagonal = float(np.linalg.norm(np.ptp(surface, axis=0)))
    report = {**meshcheck.topology(vertices, faces), **meshcheck.quad_quality(vertices, faces)}
    report["patches"] = meshcheck.layout(faces) if report["pure_quad"] else 0
    rng = np.random.default_rng(1)
    report.update(meshcheck.two_way(vertices, triangles, surface, surface_triangles, diagonal, rng))
    features = features_of(file)
    if len(features):
        report.update(meshcheck.check_features(vertices, faces, surface, features, diagonal))
    same = report["euler"] == meshcheck.topology(surface, polygons)["euler"]
    report["valid"] = bool(same and report["pure_quad"] and report["nonmanifold_edges"] == 0)
    return report


def row(name: str, method: str, seconds: float, report: dict[str, Any]) -> str:
    features = [report.get(f"feature_reproduced_{k}") for k in (1, 5)]
    shown = " ".join("     -" if share is None else f"{100 * share:6.1f}" for share in features)
    return (
        f"{name:18} {method:14} {seconds:7.2f} {report['faces']:6} "
        f"{report['irregular_vertices']:6} {report['patches'] or '':>7} {report['scaled_jacobian_min']:6.2f} "
        f"{report['scaled_jacobian_p01']:6.2f} {report['scaled_jacobian_mean']:6.2f} {report['inverted_quads']:5} "
        f"{report['angle_deviation_mean']:6.1f} {100 * report['distance_max']:6.2f}% {shown} "
        f"{'yes' if report['valid'] else 'no'}"
    )


def growth(limit: float) -> bool:
    """Rows for the same torus with ever more vertices; the quads grow with it. Returns whether each had a result."""
    print(f"\n{'growth':18} {'vertices':>9} {'features':>8} {'quads':>7} {'seconds':>8} {'us a vertex':>11}")
    for size in GROWTH:
        positions, triangles, features = torus(size)
        name = f"torus x {size}"
        try:
            result, seconds = retopologized(positions, triangles, features, 4000 * size, limit)
        except Failed as why:
            print(f"{name:18} {len(positions):9} failed: {why}", flush=True)
            return False
        quads, each = len(result.mesh.face_offsets) - 1, 1e6 * seconds / len(positions)
        print(f"{name:18} {len(positions):9} {70:8} {quads:7} {seconds:8.2f} {each:11.1f}", flush=True)
    return True


def torus(size: int) -> tuple[Any, Any, Any]:
    """A torus with `size` times the vertices, and 70 curves on it that are each eight edges of the smallest long."""
    around, across = round(AROUND * size**0.5), round(ACROSS * size**0.5)
    u, v = np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(across) * 2 * np.pi / across, indexing="ij")
    ring = 2 + 0.8 * np.cos(v)
    positions = np.stack([ring * np.cos(u), ring * np.sin(u), 0.8 * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corner = [((i + a) % around * across + (j + b) % across).ravel() for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    triangles = np.concatenate([np.stack([corner[0], corner[k], corner[k + 1]], axis=1) for k in (1, 2)])
    length = round(8 * around / AROUND)
    features = []
    for k in range(70):
        start, row = round(k % 10 * around / 10), round((k // 10 + 0.2) * across / 7)
        line = (start + np.arange(length + 1)) % around * across + row % across
        features.append(np.stack([line[:-1], line[1:]], axis=1))
    return positions, triangles.tolist(), np.concatenate(features).astype(np.int32)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=int, default=4000)
    parser.add_argument("--data", type=Path, action="append", help="where the meshes are; may be given again")
    parser.add_argument("--limit", type=float, default=300, help="seconds that a method has for a mesh")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS), help="only these")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="only these meshes")
    parser.add_argument("--no-growth", action="store_true", help="leave the tori out")
    given = parser.parse_args()
    found = {file.stem: file.resolve() for data in given.data or [DATA] for file in data.rglob("*.edges40")}
    if missing := set(given.only) - set(found):
        parser.error(f"no mesh with features is named {', '.join(sorted(missing))}; there are: {', '.join(sorted(found))}")
    files = [found[name].with_suffix(".obj") for name in sorted(given.only or found)]
    print(
        f"{'mesh':18} {'method':14} {'seconds':>7} {'faces':>6} {'irreg.':>6} {'patches':>7} {'SJ min':>6} {'1%':>6} "
        f"{'mean':>6} {'inv.':>5} {'angle':>6} {'Hausd.':>7} {'f. 1%':>6} {'f. 5%':>6} valid",
        flush=True,
    )
    failed = False
    with tempfile.TemporaryDirectory(prefix="quadloom-bench-") as folder:
        for file in files:
            irregular: dict[str, int] = {}
            for name in given.methods:
                out = Path(folder) / name.replace(" ", "-")
                out.mkdir(exist_ok=True)
                task = Task(file, given.faces, given.limit, out / file.name)
                try:
                    seconds = METHODS[name](task)
                    report = judge(file, task.result)
                except Failed as why:
                    print(f"{file.stem:18} {name:14} failed: {why}", flush=True)
                    failed |= name == "ours"
                    continue
                print(row(file.stem, name, seconds, report), flush=True)
                failed |= name == "ours" and not report["valid"]
                irregular[name] = report["irregular_vertices"]
            own, theirs = irregular.get("ours"), irregular.get("QuadriFlow")
            if own is not None and theirs:
                print(f"{file.stem:18} irregular vertices, ours to QuadriFlow's: {own / theirs:.2f}", flush=True)
    if not given.no_growth:
        failed |= not growth(given.limit)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
