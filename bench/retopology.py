"""Retopology beside QuadriFlow (with sharp edges) and Instant Meshes: the same meshes, the same run, one judge.

    python dev.py bench retopology [--faces 4000] [--data FOLDER] [--quads FOLDER] [NAME...]

A row for each triangle mesh with NAME.obj, its features in NAME.edges40, and each method: seconds of the call alone, then what
tests/judge/meshcheck.py measures. Seconds of QuadriFlow are those of its operator in Blender. --quads takes our results
from OBJ files in place of the wheel. Instant Meshes comes from PyPI (bench/requirements.txt, a virtual environment of its own).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tests" / "judge")]

import blenders  # noqa: E402  (found through the line above)
import meshcheck  # noqa: E402

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
    vertex_count=int(sys.argv[1]), rosy=4, posy=4, creaseAngle=40.0, align_to_boundaries=True, smooth_iter=2,
    deterministic=True,
)
print(time.perf_counter() - start)
np.savez(sys.argv[3], positions=positions, quads=quads)
"""


def write_obj(path: Path, positions: Any, faces: Any) -> None:
    lines = ["v {:.17g} {:.17g} {:.17g}".format(*p) for p in positions]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def ours(files: list[Path], faces: int, out: Path) -> dict[str, float | None]:
    """Results of the wheel, and the seconds of each."""
    import quadloom

    seconds: dict[str, float | None] = {}
    for file in files:
        positions, polygons = meshcheck.read_obj(str(file))
        features = features_of(file)
        mesh = quadloom.Mesh.from_polygons(positions, polygons)
        start = time.perf_counter()
        try:
            result = quadloom.retopologize(mesh, feature_edges=features if len(features) else None, target_faces=faces)
        except quadloom.QuadloomError as error:
            print(f"{file.stem}: {error.code}: {error}")
            seconds[file.stem] = None
            continue
        seconds[file.stem] = time.perf_counter() - start
        write_obj(out / file.name, result.mesh.positions, result.mesh.corner_verts.reshape(-1, 4))
    return seconds


def quadriflow(files: list[Path], faces: int, out: Path) -> dict[str, float | None]:
    arguments = [str(out), str(faces), *map(str, files)]
    folders = sorted({file.parent for file in files} | {out})
    blenders.ensure("bpy-5.0").run(ROOT / "bench" / "quadriflow.py", arguments, mounts=folders, timeout=3600)
    seconds: dict[str, float | None] = json.loads((out / "seconds.json").read_text())
    return seconds


def instant_meshes(files: list[Path], faces: int, out: Path) -> dict[str, float | None]:
    """Each file in a process of its own: the library ends the process when it fails."""
    environment = blenders.cache_folder() / "bench"
    python = environment / "bin" / "python"
    with blenders.install(environment, gigabytes=0.2) as needed:
        if needed:
            subprocess.run([sys.executable, "-m", "venv", "--clear", str(environment)], check=True)
            requirements = str(ROOT / "bench" / "requirements.txt")
            subprocess.run([str(python), "-m", "pip", "install", "--quiet", "--requirement", requirements], check=True)
    seconds: dict[str, float | None] = {}
    for file in files:
        positions, polygons = meshcheck.read_obj(str(file))
        given, made = out / "given.npz", out / "made.npz"
        np.savez(given, positions=positions, triangles=np.array(polygons))
        command = [str(python), "-c", INSTANT_MESHES, str(faces), str(given), str(made)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        seconds[file.stem] = None
        if done.returncode != 0:
            print(f"{file.stem}: Instant Meshes: {done.stderr.strip().splitlines()[-1:]}")
            continue
        result = np.load(made)
        # Triangles among the quads repeat a corner.
        quads = [list(dict.fromkeys(map(int, quad))) for quad in result["quads"]]
        write_obj(out / file.name, result["positions"], quads)
        seconds[file.stem] = float(done.stdout.split()[-1])
    return seconds


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


def row(name: str, method: str, seconds: float | None, report: dict[str, Any]) -> str:
    features = [report.get(f"feature_reproduced_{k}") for k in (1, 5)]
    shown = " ".join("     -" if share is None else f"{100 * share:6.1f}" for share in features)
    return (
        f"{name:18} {method:14} {'' if seconds is None else format(seconds, '.2f'):>7} {report['faces']:6} "
        f"{report['irregular_vertices']:6} {report['patches'] or '':>7} {report['scaled_jacobian_min']:6.2f} "
        f"{report['scaled_jacobian_p01']:6.2f} {report['scaled_jacobian_mean']:6.2f} {report['inverted_quads']:5} "
        f"{report['angle_deviation_mean']:6.1f} {100 * report['distance_max']:6.2f}% {shown} "
        f"{'yes' if report['valid'] else 'no'}"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--faces", type=int, default=4000)
    parser.add_argument("--data", type=Path, default=DATA, help="where the meshes are")
    parser.add_argument("--quads", type=Path, help="our results as OBJ files, in place of the wheel")
    parser.add_argument("names", nargs="*", help="only these meshes")
    given = parser.parse_args()
    files = sorted(file.resolve() for file in given.data.glob("*.obj") if not given.names or file.stem in given.names)
    with tempfile.TemporaryDirectory(prefix="quadloom-bench-") as folder:
        methods: dict[str, tuple[Path, dict[str, float | None]]] = {}
        for name, method in (("ours", ours), ("QuadriFlow", quadriflow), ("Instant Meshes", instant_meshes)):
            out = Path(folder) / name.replace(" ", "-")
            out.mkdir()
            if method is ours and given.quads:
                methods[name] = (given.quads, {})
            else:
                methods[name] = (out, method(files, given.faces, out))
        print(
            f"{'mesh':18} {'method':14} {'seconds':>7} {'faces':>6} {'irreg.':>6} {'patches':>7} {'SJ min':>6} {'1%':>6} "
            f"{'mean':>6} {'inv.':>5} {'angle':>6} {'distance':>7} {'1%':>6} {'5%':>6} valid"
        )
        failed = False
        for file in files:
            for name, (out, seconds) in methods.items():
                result = out / file.name
                if result.exists():
                    report = judge(file, result)
                    print(row(file.stem, name, seconds.get(file.stem), report), flush=True)
                    failed |= name == "ours" and not report["valid"]
                else:
                    print(f"{file.stem:18} {name:14} failed")
                    failed |= name == "ours"
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
