"""Random placements: two shipped quad meshes, one scaled to 0.4-0.9 of the other, turned at random, its centre on the
other's surface, joined by a random operation; each result judged by tests/judge, against the exact boolean.

    python dev.py bench placements --count 200 --seed 1
    python dev.py bench placements --only 17 --save out/placement    # one case, with its meshes as OBJ files

Prints the table of bars (must, goal, measured), every case that misses one with its cause, and writes a CSV. Each case
depends on its seed and number only, so that --only repeats it exactly.
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "judge"))
# The cases run side by side: one thread each.
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import meshcheck  # noqa: E402  (found through the lines above)
import numpy as np  # noqa: E402
import quadloom  # noqa: E402

MESHES = ROOT / "blend_fixtures" / "meshes"
NAMES = tuple(sorted((MESHES.parent / "placements.txt").read_text().split()))
Operation = Literal["union", "intersection", "difference"]
Filler = Literal["auto", "patches", "rings", "matching"]
OPERATIONS: tuple[Operation, ...] = get_args(Operation)
RETRACTION = 1.0

Polygons = tuple[Any, list[list[int]]]
"""Positions (V, 3) and one vertex list a face."""
Row = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """One placement, all of it determined by the seed and the number."""

    number: int
    seed: int
    filler: Filler
    time_limit: float
    save: Path | None


@dataclass(frozen=True)
class Placement:
    """The two meshes of a case in one frame, and what to do with them."""

    names: tuple[str, str]
    meshes: tuple[Polygons, Polygons]
    operation: Operation
    scale: float


def place(case: Case) -> Placement:
    """The placement of a case. Coordinates are rounded to float32, as Blender would have them."""
    rng = np.random.default_rng([case.seed, case.number])
    name_a, name_b = rng.choice(NAMES, 2)
    positions_a, faces_a = meshcheck.read_obj(MESHES / f"{name_a}.obj")
    positions_b, faces_b = meshcheck.read_obj(MESHES / f"{name_b}.obj")
    scale = float(rng.uniform(0.4, 0.9))
    operation = OPERATIONS[rng.integers(len(OPERATIONS))]
    anchor = meshcheck.sample(positions_a, meshcheck.triangulate(positions_a, faces_a)[0], 1, rng)[0]
    # A random rotation is a uniform unit quaternion: here the orthogonal factor of a normal matrix, made a rotation.
    rotation, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation *= np.sign(np.diag(upper))
    rotation[:, 0] *= np.sign(np.linalg.det(rotation))
    low, high = positions_b.min(axis=0), positions_b.max(axis=0)
    factor = scale * np.linalg.norm(np.ptp(positions_a, axis=0)) / np.linalg.norm(high - low)
    positions_b = factor * (positions_b - (low + high) / 2) @ rotation.T + anchor
    rounded = (positions_a.astype(np.float32).astype(float), positions_b.astype(np.float32).astype(float))
    return Placement((name_a, name_b), ((rounded[0], faces_a), (rounded[1], faces_b)), operation, scale)


def run(case: Case) -> Row:
    """Runs and judges one case; a failure is a row with its cause."""
    placement = place(case)
    row: Row = {
        "case": case.number,
        "a": placement.names[0],
        "b": placement.names[1],
        "operation": placement.operation,
        "scale": round(placement.scale, 3),
    }
    if case.save:
        save(case.save, placement.meshes, "ab")
    start = time.monotonic()
    try:
        a, b = (quadloom.Mesh.from_polygons(*mesh) for mesh in placement.meshes)
        result = quadloom.boolean(
            a,
            b,
            placement.operation,
            retraction_distance=RETRACTION,
            filler=case.filler,
            progress=lambda *_: time.monotonic() - start < case.time_limit,
        )
    except quadloom.QuadloomError as error:
        row |= {"seconds": time.monotonic() - start, "outcome": error.code, "cause": str(error)}
        if error.code == "empty" and meshcheck.exact_boolean(*placement.meshes, placement.operation)[1].size == 0:
            row["cause"] = ""
        return row
    row["seconds"] = time.monotonic() - start
    report = result.report
    wins = Counter((region["filler"], why(region)) for region in report["regions"])
    offsets = result.mesh.face_offsets
    faces = [list(map(int, face)) for face in np.split(result.mesh.corner_verts, offsets[1:-1])]
    positions = result.mesh.positions
    if case.save:
        save(case.save, [(positions, faces)], "r")
    judged = judge(placement, (positions, faces), curve_edge(result), case)
    row |= {
        "outcome": "made",
        "fillers": "; ".join(f"{name}, {reason}: {count}" for (name, reason), count in sorted(wins.items())),
        "retries": len(report["retries"]),
        **judged,
    }
    row["cause"] = ", ".join(name for name, test in {**SOUND, **CLEAN_MUST}.items() if not test(row))
    return row


def why(region: dict[str, Any]) -> str:
    """Why a region's filler won it."""
    rivals = set(region["scores"]) - {region["filler"]}
    declined = set(region["declined"]) - {region["filler"]}
    if rivals:
        return "lowest score of " + ", ".join(sorted(region["scores"]))
    return "good, no other tried" if not declined else "declined by " + ", ".join(sorted(declined))


def judge(placement: Placement, result: Polygons, edge: float, case: Case) -> Row:
    """What the judge, which shares no code with the library, says of a result."""
    positions, faces = result
    rng = np.random.default_rng([case.seed, case.number, 1])
    judged: Row = {**meshcheck.topology(positions, faces), **meshcheck.quad_quality(positions, faces)}
    judged["self_intersections"] = meshcheck.self_intersections(positions, meshcheck.triangulate(positions, faces)[0])
    try:
        judged |= meshcheck.check_boolean(result, *placement.meshes, placement.operation, rng, RETRACTION, edge)
    except ValueError as error:
        judged["cause"] = str(error)
    return judged


def curve_edge(result: quadloom.BooleanResult) -> float:
    """Mean edge length along the intersection curve of the result."""
    ends = result.mesh.positions[result.intersection_edges]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean()) if len(ends) else 0.0


def save(folder: Path, meshes: Sequence[Polygons], names: str) -> None:
    """Writes OBJ files with every digit of the coordinates."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, (positions, faces) in zip(names, meshes, strict=True):
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in positions.tolist()]
        lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")


Test = Callable[[Row], bool]

# Bar 2: must hold for all.
SOUND: dict[str, Test] = {
    "closed and manifold": lambda r: r["closed_manifold"],
    "pure quad": lambda r: r["pure_quad"],
    "Euler characteristic": lambda r: r["euler"] == r.get("reference_euler"),
    "components": lambda r: r["components"] == r.get("reference_components"),
}


def clean(limit: float) -> dict[str, Test]:
    """Bar 2, the second half: within `limit` of the exact boolean (of the diagonal; of the volume)."""
    return {
        "no inverted quad": lambda r: r["inverted_quads"] == 0,
        "no self-intersection": lambda r: r["self_intersections"] == 0,
        f"distance below {limit:.1%}": lambda r: r.get("distance_max", 1.0) < limit,
        f"volume within {limit:.1%}": lambda r: r.get("volume_error", 1.0) < limit,
    }


CLEAN_MUST, CLEAN_GOAL = clean(0.01), clean(0.005)


def table(rows: Sequence[Row]) -> list[tuple[str, str, str, str]]:
    """The bars: (what, must, goal, measured). An empty result counts as right when the exact boolean's is empty too."""
    made = [row for row in rows if row["outcome"] == "made"]
    empty = [row for row in rows if row["outcome"] == "empty" and not row["cause"]]
    total = len(rows)

    def share(tests: dict[str, Test]) -> str:
        return f"{sum(all(test(row) for test in tests.values()) for row in made) + len(empty)} of {total}"

    def ratio(part: str, whole: str) -> str:
        whole_sum = sum(row.get(whole, 0) for row in made)
        return f"{sum(row.get(part, 0) for row in made) / whole_sum:.1%}" if whole_sum else "none"

    worst = [row["new_scaled_jacobian_min"] for row in made if "new_scaled_jacobian_min" in row]
    means = [row["new_scaled_jacobian_mean"] for row in made if "new_scaled_jacobian_mean" in row]
    above = f"{np.mean(np.array(worst) > 0.05):.0%}, least {min(worst):.3f}" if worst else "none"
    mean = f"{np.mean(means):.3f}, least {min(means):.3f}" if means else "none"
    allowed = total * 190 // 200
    return [
        ("2 sound: closed, manifold, quad, topology", f"{total} of {total}", "", share(SOUND)),
        ("2 also clean and within 1%", f"{allowed} of {total}", "", share({**SOUND, **CLEAN_MUST})),
        ("2 also clean and within 0.5%", "", f"{total} of {total}", share({**SOUND, **CLEAN_GOAL})),
        ("3 kept, of the whole quads beyond retraction", "95%", "99%", ratio("beyond_preserved_quads", "beyond_quads")),
        ("3 kept, of all whole quads", "", "95%", ratio("preserved_quads", "preservable_quads")),
        ("4 placements with min scaled Jacobian > 0.05", "95%", "min > 0.2", above),
        ("4 mean scaled Jacobian of new quads", "0.85", "", mean),
        ("5 seconds, median and most", "", "", seconds(rows)),
    ]


def seconds(rows: Sequence[Row]) -> str:
    spent = [row["seconds"] for row in rows]
    return f"{np.median(spent):.2f}, {max(spent):.1f}"


def show(rows: Sequence[Row]) -> None:
    """Prints the bars, who filled the regions, and every case that misses a must."""
    lines = [("bar", "must", "goal", "measured"), *table(rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(4)]
    print()
    for line in lines:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
    wins: Counter[str] = Counter()
    for row in rows:
        for entry in filter(None, row.get("fillers", "").split("; ")):
            name, count = entry.split(": ")
            wins[name] += int(count)
    print("\nregions won, and why:")
    for name, count in wins.most_common():
        print(f"{count:6} {name}")
    missed = [row for row in rows if row["cause"]]
    print(f"\ncases that miss a must: {len(missed)}")
    for row in missed:
        where = f"{row['case']:4} {row['operation']:12} {row['a']} + {row['b']} at {row['scale']}"
        print(f"{where}: {row['outcome']}: {row['cause'][:160]}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, help="number of placements")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, action="append", metavar="CASE", help="run this case; may be repeated")
    parser.add_argument("--filler", default="auto", choices=get_args(Filler))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--time-limit", type=float, default=120, help="seconds until a case is cancelled")
    parser.add_argument("--csv", type=Path, default=ROOT / "out" / "placements.csv")
    parser.add_argument("--save", type=Path, help="folder for the meshes of each case: a.obj, b.obj, r.obj")
    given = parser.parse_args()
    numbers = given.only if given.only else range(given.count)
    cases = [Case(n, given.seed, given.filler, given.time_limit, given.save and given.save / str(n)) for n in numbers]
    rows: list[Row] = []
    start = time.monotonic()
    # Fresh processes: a crash of the judge's C++ must not take the others along, nor may threads be forked.
    with multiprocessing.get_context("spawn").Pool(given.processes, maxtasksperchild=20) as pool:
        for row in pool.imap_unordered(run, cases):
            rows.append(row)
            note = row["cause"] or "ok"
            print(
                f"[{len(rows)}/{len(cases)}] {row['case']}: {row['outcome']}, {row['seconds']:.1f} s: {note[:120]}", flush=True
            )
    rows.sort(key=lambda row: row["case"])
    given.csv.parent.mkdir(parents=True, exist_ok=True)
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with open(given.csv, "w", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)
    show(rows)
    print(f"\n{given.csv}: {len(rows)} cases in {time.monotonic() - start:.0f} s")
    sound = all((row["outcome"] == "made" and all(test(row) for test in SOUND.values())) or not row["cause"] for row in rows)
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
