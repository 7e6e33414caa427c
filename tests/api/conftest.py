"""Fixtures for the tests of the wheel."""

from __future__ import annotations

import pytest
import quadloom
from meshes import CUBE_FACES, cube_positions


@pytest.fixture
def cube() -> quadloom.Mesh:
    return quadloom.Mesh.from_polygons(cube_positions(), CUBE_FACES)
