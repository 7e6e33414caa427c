"""Runs the Blender suite: installs the built zip into each runtime and runs pytest inside it.

    run.py --extension out/quadloom-0.1.0.zip [--runtime bpy-4.2 ...] [-k EXPRESSION]

Each runtime gets a HOME of its own, empty at the start: the zip is installed in one fresh process, enabled and tested in the
next. The `blender` runtime also opens its window on a virtual display for what needs one: modal runs, Esc, undo.
Prints a line a runtime, and closes on one line: N passed, N failed, N skipped. Exit code 0 when none failed.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tools"))

import blenders  # noqa: E402  (found through the line above)

INSTALL_SECONDS = 120
SUITE_SECONDS = 900


def main() -> int:
    """Runs every runtime asked for and sums up."""
    parser = argparse.ArgumentParser(description="Run the Blender test suite with a built extension zip.")
    parser.add_argument("--extension", type=Path, required=True, metavar="ZIP")
    parser.add_argument("--runtime", nargs="*", default=blenders.NAMES, choices=blenders.NAMES, metavar="NAME")
    parser.add_argument("-k", default="", metavar="EXPRESSION", help="only tests that match, as in pytest")
    given = parser.parse_args()
    totals = dict.fromkeys(("passed", "failed", "skipped"), 0)
    for name in given.runtime:
        counts = run_suite(name, given.extension.resolve(), given.k)
        for key in totals:
            totals[key] += counts[key]
    print(f"\n{totals['passed']} passed, {totals['failed']} failed, {totals['skipped']} skipped", flush=True)
    return int(totals["failed"] > 0 or totals["passed"] == 0)


def run_suite(name: str, extension: Path, expression: str) -> dict[str, int]:
    """Counts of one runtime. A runtime that cannot be had, hangs or crashes counts as one failure more."""
    print(f"\n{name}", flush=True)
    start = time.monotonic()
    counts = {"passed": 0, "failed": 0, "skipped": 0}
    try:
        runtime = blenders.ensure(name)
    except blenders.RuntimeUnavailable as error:
        print(error, flush=True)
        return {**counts, "failed": 1}
    with tempfile.TemporaryDirectory(prefix="quadloom-home-") as folder:
        home = Path(folder)

        def run(script: str, seconds: float, *arguments: str, background: bool = True) -> None:
            code = runtime.run(
                HERE / "inside" / script, arguments, timeout=seconds, home=home, mounts=[extension.parent],
                background=background,
            ).returncode  # fmt: skip
            written = home / "counts.json"
            if written.exists():
                for key, count in json.loads(written.read_text()).items():
                    counts[key] += count
                written.unlink()
            elif code == 0 and script != "install.py":
                code = 1
            if code != 0 and counts["failed"] == 0:
                print(f"{name}: {script} ended with exit code {code}", flush=True)
                counts["failed"] += 1

        run("install.py", INSTALL_SECONDS, str(extension))
        if not counts["failed"]:
            run("suite.py", SUITE_SECONDS, str(home), expression)
            if not runtime.is_module and not expression:
                run("windowed.py", SUITE_SECONDS, str(home), background=False)
    seconds = time.monotonic() - start
    print(f"{name}: " + ", ".join(f"{count} {key}" for key, count in counts.items()) + f" in {seconds:.0f} s", flush=True)
    return counts


if __name__ == "__main__":
    sys.exit(main())
