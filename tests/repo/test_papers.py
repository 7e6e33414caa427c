"""docs/papers.md maps each section of a paper to the files and tests that exist, and the files name their sections."""

from __future__ import annotations

import re

from repository import ROOT

ROWS = [
    [cell.strip() for cell in line.strip().strip("|").split("|")]
    for line in (ROOT / "docs" / "papers.md").read_text().splitlines()
    if line.startswith("|") and not re.match(r"^\|\s*(-|Section)", line)
]


def test_every_row_names_files_and_tests_that_exist():
    assert ROWS
    for section, _, files, tests, deviation in ROWS:
        assert section
        assert deviation, f"{section}: say how it deviates, or 'none'"
        for cell in (files, tests):
            paths = re.findall(r"`([^`]+)`", cell)
            assert paths, f"{section}: name a file"
            for path in paths:
                name, _, item = path.partition("::")
                assert (ROOT / name).is_file(), f"{section}: {name} does not exist"
                assert not item or re.search(rf"\b(fn|def) {item}\b", (ROOT / name).read_text()), f"{section}: no test {path}"


def test_every_stage_is_on_the_map():
    named = {path for row in ROWS for path in re.findall(r"`(native/[^`:]+)", row[2])}
    for path in sorted((ROOT / "native").glob("*/src/**/*.rs")):
        head = "".join(line for line in path.read_text().splitlines(keepends=True)[:25] if line.startswith("//!"))
        if re.search(r"\bsections? \d|\(\d\.\d|\bappendix\b", head, flags=re.IGNORECASE):
            relative = path.relative_to(ROOT).as_posix()
            assert relative in named, f"{relative} names a section of a paper, but docs/papers.md does not list it"
