"""Imports go one way: between the Rust crates, and inside the add-on."""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest
from repository import ROOT

# Crate -> the crates it may use. testkit is for tests only: a dev-dependency, so it is in no list but its own.
MAY_USE = {
    "quadloom-mesh": set(),
    "quadloom-solve": set(),
    "quadloom-surface": {"quadloom-mesh", "quadloom-solve"},
    "quadloom-quadrangulate": {"quadloom-mesh", "quadloom-solve", "quadloom-surface"},
    "quadloom-boolean": {"quadloom-mesh", "quadloom-solve", "quadloom-surface", "quadloom-quadrangulate"},
    "quadloom-retopology": {"quadloom-mesh", "quadloom-solve", "quadloom-surface", "quadloom-quadrangulate"},
    "quadloom-tiling": {"quadloom-mesh", "quadloom-solve", "quadloom-surface"},
    "quadloom-python": {"quadloom-mesh", "quadloom-boolean", "quadloom-retopology", "quadloom-tiling"},
    "quadloom-testkit": {"quadloom-mesh"},
}

# Licences that may be combined with GPL-3.0-or-later.
LICENCES = {
    "MIT", "MIT-0", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0", "ISC",
    "Unicode-3.0", "Unlicense", "Zlib", "0BSD", "MPL-2.0", "GPL-3.0-or-later",
}  # fmt: skip


@pytest.fixture(scope="module")
def packages() -> list[dict]:
    """What cargo knows of the workspace and of everything it depends on."""
    cargo = shutil.which("cargo") or str(Path.home() / ".cargo" / "bin" / "cargo")
    command = [cargo, "metadata", "--format-version", "1", "--locked"]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True, env=os.environ)
    return json.loads(done.stdout)["packages"]


def test_crates_depend_downwards_only(packages):
    own = {package["name"]: package for package in packages if package["source"] is None}
    assert set(own) == set(MAY_USE)
    for name, package in own.items():
        used = {d["name"] for d in package["dependencies"] if d["kind"] is None and d["name"] in own}
        assert used <= MAY_USE[name], f"{name} may not use {sorted(used - MAY_USE[name])}"


def test_the_testkit_is_a_dev_dependency_only(packages):
    for package in packages:
        for dependency in package["dependencies"]:
            if dependency["name"] == "quadloom-testkit":
                assert dependency["kind"] == "dev", package["name"]


def test_only_the_binding_knows_python(packages):
    for package in packages:
        used = {dependency["name"] for dependency in package["dependencies"]}
        if package["source"] is None and used & {"pyo3", "numpy"}:
            assert package["name"] == "quadloom-python"


def test_unsafe_code_is_forbidden_outside_the_binding():
    for manifest in (ROOT / "native").glob("*/Cargo.toml"):
        if manifest.parent.name != "python":
            assert "[lints]\nworkspace = true" in manifest.read_text(), manifest
    assert 'unsafe_code = "forbid"' in (ROOT / "Cargo.toml").read_text()


def test_every_dependency_may_be_shipped_under_the_gpl(packages):
    for package in packages:
        # An SPDX expression: one of the alternatives must be allowed in all its parts ("/" is the old spelling of OR).
        alternatives = (package["license"] or "").replace("/", " OR ").replace("(", "").replace(")", "").split(" OR ")
        allowed = any(all(part.strip() in LICENCES for part in choice.split(" AND ")) for choice in alternatives)
        assert allowed, f"{package['name']}: {package['license']}"


ADDON = ROOT / "addon"
ADDON_FILES = sorted(ADDON.rglob("*.py"))


def imports(path: Path) -> set[str]:
    """Modules a file of the add-on imports; those of the add-on itself begin with a dot, counted from its root."""
    found = set()
    inside = path.relative_to(ADDON).parent.parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom):
            base = inside[: len(inside) - (node.level - 1)]
            target = [*base, *(node.module or "").split(".")] if node.module else [*base]
            if node.module and target:
                found.add("." + target[0])
            else:
                found |= {"." + "/".join([*base, alias.name]).split("/")[0] for alias in node.names}
    return found


def test_exactly_one_module_of_the_addon_imports_the_wheel():
    importers = [path.relative_to(ADDON).as_posix() for path in ADDON_FILES if "quadloom" in imports(path)]
    assert importers == ["native.py"]


def test_no_module_of_the_addon_reaches_back_to_operators_or_panels():
    for path in ADDON_FILES:
        if path.name == "__init__.py" and path.parent == ADDON:
            continue
        where = path.relative_to(ADDON).parts[0]
        upper = {".operators", ".panels"} - {f".{where}"}
        assert not imports(path) & upper, f"{path.relative_to(ROOT)} imports {sorted(imports(path) & upper)}"


def test_what_runs_off_the_main_thread_and_the_wheel_know_no_blender():
    for name in ("native.py", "attributes.py"):
        assert not imports(ADDON / name) & {"bpy", "bmesh", "mathutils"}, name
