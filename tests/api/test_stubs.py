"""The type stubs and the docstrings say what the module has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import quadloom

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import dev  # noqa: E402  (found through the line above)


def test_the_stubs_agree_with_the_module():
    done = subprocess.run(dev.stub_check(), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_has_a_docstring():
    for name in quadloom.__all__:
        thing = getattr(quadloom, name)
        if name != "__version__":
            assert thing.__doc__, name
        for attribute, value in vars(thing).items() if isinstance(thing, type) else ():
            if not attribute.startswith("_"):
                assert value.__doc__, f"{name}.{attribute}"


def test_the_version_is_the_crates():
    manifest = (ROOT / "Cargo.toml").read_text()
    assert f'version = "{quadloom.__version__}"' in manifest
