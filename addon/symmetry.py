"""Symmetries of outlines and patterns. Runs on a job's thread: touches no bpy."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np

from .attributes import Array

# Centres of panels lie farther apart than this, in edges; the same centre computed twice much less.
CELL = 0.1
SAME = 1e-6


def outline_order(code: Array) -> int:
    """How many rotations and reflections leave a boundary code as it is."""
    turned = np.stack([np.roll(code, k) for k in range(len(code))])
    return int((turned == code).all(axis=1).sum() + (turned == code[::-1]).all(axis=1).sum())


def groups(symmetries: list[Any]) -> list[list[Any]]:
    """The groups within an outline's symmetries, greatest first, without that of the identity alone."""
    turns = [s for s in symmetries if not s.reflection]
    mirrors = [s for s in symmetries if s.reflection]
    found: dict[tuple[int, ...], list[Any]] = {}

    def add(group: list[Any]) -> None:
        found.setdefault(tuple(symmetries.index(s) for s in group), group)

    for n in (n for n in range(len(turns), 0, -1) if len(turns) % n == 0):
        rotations = [s for s in turns if _is_multiple(s.angle, 360 / n)]
        add(rotations)
        for mirror in mirrors:
            # Axes of an n-fold group lie 180 / n degrees apart.
            add(rotations + [s for s in mirrors if _is_multiple(s.angle - mirror.angle, 180 / n)])
    return sorted((group for group in found.values() if len(group) > 1), key=len, reverse=True)


def is_symmetric(mesh: Any) -> bool:
    """Whether some rotation or reflection other than the identity leaves a pattern as it is. `mesh` has unit edges, one of
    them along x."""
    sizes = np.diff(mesh.face_offsets)
    sums = np.add.reduceat(mesh.positions[mesh.corner_verts], mesh.face_offsets[:-1], axis=0)
    x, y = (sums / sizes[:, None])[:, :2].T
    # A symmetry leaves the mean of the centres in place.
    panels = list(zip((x - x.mean() + 1j * (y - y.mean())).tolist(), sizes.tolist(), strict=True))
    cells = {_cell(centre): (centre, size) for centre, size in panels}

    def is_panel(centre: complex, size: int) -> bool:
        column, row = _cell(centre)
        near = (cells.get((column + i, row + j)) for i in (-1, 0, 1) for j in (-1, 0, 1))
        return any(panel is not None and panel[1] == size and abs(panel[0] - centre) < SAME for panel in near)

    # The lattice has symmetries at multiples of 30 degrees, and mirror axes at multiples of 15.
    for k in range(12):
        turn = cmath.rect(1, k * math.pi / 6)
        if k > 0 and all(is_panel(turn * centre, size) for centre, size in panels):
            return True
        if all(is_panel(turn * centre.conjugate(), size) for centre, size in panels):
            return True
    return False


def _cell(centre: complex) -> tuple[int, int]:
    return math.floor(centre.real / CELL), math.floor(centre.imag / CELL)


def _is_multiple(angle: float, of: float) -> bool:
    return abs(angle / of - round(angle / of)) < 1e-6
