"""Runs inside a runtime: enables the installed extension and runs pytest over tests/blender.

Arguments: the folder to write counts.json into, and pytest's -k expression.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, os.environ["QUADLOOM_TEST_PACKAGES"])

import bpy  # noqa: F401  (puts addon_utils on sys.path)
import pytest

# After bpy, which makes it known.
import addon_utils  # isort: skip

EXTENSION = "bl_ext.user_default.quadloom"
TESTS = Path(__file__).resolve().parent.parent


class Counter:
    """Counts outcomes as pytest reports them; an error in a fixture is a failure."""

    def __init__(self) -> None:
        self.counts = {"passed": 0, "failed": 0, "skipped": 0}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Called by pytest for each phase of each test."""
        if report.when == "call" or not report.passed:
            self.counts[report.outcome] += 1

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """A test file that cannot be imported."""
        if report.failed:
            self.counts["failed"] += 1


def main(folder: str, expression: str) -> int:
    """Returns pytest's exit code."""
    if addon_utils.enable(EXTENSION, default_set=True, persistent=True) is None:
        print("the extension could not be enabled")
        return 1
    counter = Counter()
    arguments = ["-q", "-p", "no:cacheprovider", "--rootdir", str(TESTS), "-k", expression, str(TESTS)]
    code = pytest.main(arguments, plugins=[counter])
    (Path(folder) / "counts.json").write_text(json.dumps(counter.counts))
    return int(code)


code = main(*sys.argv[sys.argv.index("--") + 1 :])
sys.stdout.flush()
sys.stderr.flush()
# Not exit(): bpy 4.5 can hang at interpreter exit.
os._exit(code)
