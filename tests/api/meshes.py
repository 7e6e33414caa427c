"""Meshes for the tests of the wheel, and the judge's way to see them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import quadloom

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "judge"))

import meshcheck  # noqa: E402  (found through the line above)

CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def cube_positions() -> np.ndarray:
    """The corners of the unit cube, x slowest."""
    return np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def shipped(name: str, move: tuple[float, float, float] = (0, 0, 0), scale: float = 1.0) -> quadloom.Mesh:
    """A mesh of blend_fixtures/meshes, centred, `scale` long across the diagonal, then moved. Float32, as in Blender."""
    positions, faces = meshcheck.read_obj(ROOT / "blend_fixtures" / "meshes" / f"{name}.obj")
    low, high = positions.min(axis=0), positions.max(axis=0)
    positions = (positions - (low + high) / 2) * scale / np.linalg.norm(high - low) + move
    return quadloom.Mesh.from_polygons(positions.astype(np.float32), faces)


def polygons(mesh: quadloom.Mesh) -> tuple[np.ndarray, list[list[int]]]:
    """The mesh as the judge takes it."""
    faces = np.split(mesh.corner_verts, mesh.face_offsets[1:-1])
    return mesh.positions, [face.tolist() for face in faces]
