"""dev.py reads the closing lines of the test runners right: a wrong count would hide a failure."""

from __future__ import annotations

import subprocess
import sys

import pytest
from repository import ROOT

sys.path.insert(0, str(ROOT))

import dev


@pytest.mark.parametrize(
    ("lines", "code", "counts"),
    [
        (["     Summary [   0.213s] 12 tests run: 10 passed, 2 failed, 1 skipped"], 1, (10, 2, 1)),
        (["     Summary [   0.1s] 3 tests run: 3 passed (1 slow), 0 skipped"], 0, (3, 0, 0)),
        (["     Summary [   9.1s] 5 tests run: 3 passed, 1 failed, 1 timed out, 0 skipped"], 1, (3, 2, 0)),
        (
            ["test result: ok. 3 passed; 0 failed; 1 ignored", "test result: FAILED. 4 passed; 2 failed; 0 ignored"],
            1,
            (7, 2, 1),
        ),
        (["========= 2 failed, 62 passed, 1 error in 18.51s ========="], 1, (62, 3, 0)),
        (["63 passed in 9.39s"], 0, (63, 0, 0)),
        (["bpy-4.2: 9 passed, 0 failed, 0 skipped in 3 s", "20 passed, 1 failed, 2 skipped"], 1, (20, 1, 2)),
        (["63 passed in 9.39s"], 139, (63, 1, 0)),
        (["error: could not compile"], 101, (0, 1, 0)),
    ],
)
def test_reads_closing_lines(lines, code, counts):
    script = f"print({chr(10).join(lines)!r}); raise SystemExit({code})"
    assert dev.run_counted([sys.executable, "-c", script], {}) == counts


@pytest.mark.parametrize("verb", ["setup", "demo", "test", "check", "bench", "wheel", "extension", "pictures"])
def test_every_verb_has_help_and_works_from_any_folder(verb, tmp_path):
    done = subprocess.run([sys.executable, ROOT / "dev.py", verb, "-h"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0
    assert f"dev.py {verb}" in done.stdout
