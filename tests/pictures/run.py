"""Draws what a person should look at before a release: the panel, ready and grey, and the demo's results.

    run.py --extension out/quadloom-0.1.0.zip --out out/pictures

The panel is photographed in a real Blender on a virtual display; the results are drawn by demo/demo.py and
demo/retopology.py and demo/surfaces.py. Nothing is compared pixel by pixel: a picture differs between drivers
and versions. It fails when Blender does, or when a picture is missing.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import blenders  # noqa: E402  (found through the line above)

PANEL = tuple(
    f"panel-{name}.png" for name in ("ready", "grey", "tile-curve", "retopologize", "tile-surface")
)  # fmt: skip
SHEETS = tuple(f"surfaces-{look}.png" for look in ("input", "regular", "random", "patches", "type", "planarity", "area"))
SECONDS = 3600


def main() -> int:
    """Returns 1 when something could not be drawn."""
    parser = argparse.ArgumentParser(description="Draw the interface and the demo's results.")
    parser.add_argument("--extension", type=Path, required=True, metavar="ZIP")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    given = parser.parse_args()
    extension, out = given.extension.resolve(), given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    inside = ROOT / "tests" / "blender" / "inside"
    blender = blenders.ensure("blender")
    with tempfile.TemporaryDirectory(prefix="quadloom-home-") as home:
        places = {"home": Path(home), "mounts": [extension.parent, out], "timeout": SECONDS}
        codes = [blender.run(inside / "install.py", [str(extension)], **places).returncode]
        codes.append(blender.run(inside / "windowed.py", [home, str(out)], background=False, **places).returncode)
    demo = ["--extension", str(extension), "--out", str(out)]
    for script in ("demo.py", "retopology.py", "surfaces.py"):
        codes.append(blenders.ensure("bpy-5.0").run(ROOT / "demo" / script, demo, timeout=SECONDS).returncode)
    missing = [name for name in (*PANEL, *SHEETS) if not (out / name).exists()]
    if missing:
        print(f"not drawn: {', '.join(missing)}")
    return int(any(codes) or bool(missing))


if __name__ == "__main__":
    sys.exit(main())
