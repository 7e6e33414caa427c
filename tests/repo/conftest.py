"""The files of the repository, as git knows them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from repository import ROOT


@pytest.fixture(scope="session")
def tracked() -> list[Path]:
    """Every tracked file, and every new one that git does not ignore."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return [ROOT / name for name in sorted(set(listed.stdout.splitlines())) if (ROOT / name).is_file()]
