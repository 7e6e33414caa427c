"""The files themselves: their size, what they must not hold, and the licences of what ships."""

from __future__ import annotations

import re
import warnings

from repository import ROOT

SPLIT_LINES, LONG_LINES = 600, 300
# Hosts of package registries, and folders of one machine. Spelled in parts, so that this file passes its own test.
FORBIDDEN = re.compile(r"(pypi\.|crates\.|static\.crates\.|registry\.npmjs\.|deb\.debian\.)(org|io)|/(work|root|home/\w+)/\w")
TEXT = {".rs", ".py", ".pyi", ".toml", ".md", ".txt", ".sh", ".yml", ""}


def test_no_source_file_is_past_600_lines(tracked):
    lengths = {path: len(path.read_text().splitlines()) for path in tracked if path.suffix in (".rs", ".py")}
    long = [f"{path.relative_to(ROOT)} ({length})" for path, length in lengths.items() if length > LONG_LINES]
    if long:
        warnings.warn(f"files past {LONG_LINES} lines: {', '.join(long)}", stacklevel=1)
    assert not [str(path) for path, length in lengths.items() if length > SPLIT_LINES]


def test_no_registry_host_and_no_path_of_one_machine(tracked):
    found = []
    for path in tracked:
        # Lock files name the registry by their format.
        if path.suffix in TEXT and path.name != "LICENSE":
            for number, line in enumerate(path.read_text().splitlines(), 1):
                if FORBIDDEN.search(line):
                    found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()}")
    assert not found


def test_nothing_is_left_unfinished(tracked):
    marks = re.compile(r"\b(TO" + r"DO|FIX" + r"ME)\b|todo" + r"!\(|unimplemented" + r"!\(")
    found = [path for path in tracked if path.suffix in (".rs", ".py") and marks.search(path.read_text())]
    assert not found


def test_every_shipped_mesh_has_a_source_and_a_licence(tracked):
    folder = ROOT / "blend_fixtures" / "meshes"
    table = (folder / "LICENSES.md").read_text()
    # The table names each mesh by its file name in the folder it came from.
    rows = {line.split("|")[1].strip(): line for line in table.splitlines() if ".obj |" in line}
    names = {name.rsplit("/", 1)[-1]: row for name, row in rows.items()}
    meshes = [path for path in tracked if path.suffix == ".obj"]
    assert meshes
    for mesh in meshes:
        assert mesh.is_relative_to(folder), f"{mesh}: meshes ship in blend_fixtures/meshes"
        assert mesh.name in names, f"{mesh.name} has no row in LICENSES.md"
        assert re.search(r"CC0|CC BY|MIT|Apache|public domain", names[mesh.name]), mesh.name


def test_the_licence_is_the_gpl():
    assert "GNU GENERAL PUBLIC LICENSE\n                       Version 3" in (ROOT / "LICENSE").read_text()
    assert 'license = "GPL-3.0-or-later"' in (ROOT / "Cargo.toml").read_text()


def test_ci_runs_the_test_command_of_the_readme():
    assert "python3 dev.py test" in (ROOT / ".ci" / "run").read_text()
    assert "python3 dev.py test" in (ROOT / "README.md").read_text()
