"""Pure-quad booleans of polygon meshes. Meshes are in Blender's own layout, lengths in scene units."""

from collections.abc import Callable, Iterable
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
__all__: list[str]

type _Indices = NDArray[np.int32]
type _Floats = NDArray[np.float64]
type _Progress = Callable[[str, float], bool | None]

class QuadloomError(Exception):
    """Base of every error of this module."""

    code: str
    """A stable identifier, such as "open"."""
    mesh: int | None
    """0 or 1, the input the elements belong to; None when there is one input, or when both are concerned."""
    elements: dict[str, _Indices]
    """Index arrays by kind: "verts", "faces" and "corners" (N,), "edges" (N, 2) vertex pairs. When both inputs are
    concerned the kinds begin with "a_" or "b_"."""

class InvalidMeshError(QuadloomError):
    """An input mesh is not what the operation needs."""

class InfeasibleError(QuadloomError):
    """The operation has no valid result on these inputs."""

class Cancelled(QuadloomError):
    """The caller's `progress` asked to stop."""

class InternalError(QuadloomError):
    """A bug of this library; the sentence names the stage."""

@final
class Mesh:
    """A polygon mesh: face f has the corners corner_verts[face_offsets[f]:face_offsets[f + 1]], counter-clockwise seen
    from outside. Immutable."""

    def __new__(cls, positions: ArrayLike, face_offsets: ArrayLike, corner_verts: ArrayLike) -> Mesh:
        """positions: (V, 3) floats. face_offsets: (F + 1,) integers from 0 to C. corner_verts: (C,) integers."""
    @staticmethod
    def from_polygons(positions: ArrayLike, polygons: Iterable[ArrayLike]) -> Mesh:
        """A mesh from (V, 3) positions and one list of vertex indices a face."""
    @property
    def positions(self) -> _Floats:
        """(V, 3) float64, scene units, read-only."""
    @property
    def face_offsets(self) -> _Indices:
        """(F + 1,) int32, read-only."""
    @property
    def corner_verts(self) -> _Indices:
        """(C,) int32, read-only."""

@final
class Defects:
    """Every defect of a mesh; true when there is any. Borders, triangles and n-gons are listed but are no defects."""

    @property
    def nonfinite_verts(self) -> _Indices: ...
    @property
    def isolated_verts(self) -> _Indices: ...
    @property
    def duplicate_verts(self) -> _Indices: ...
    @property
    def degenerate_faces(self) -> _Indices: ...
    @property
    def zero_area_faces(self) -> _Indices: ...
    @property
    def duplicate_faces(self) -> _Indices: ...
    @property
    def nonmanifold_edges(self) -> _Indices: ...
    @property
    def misoriented_edges(self) -> _Indices: ...
    @property
    def border_edges(self) -> _Indices: ...
    @property
    def nonmanifold_verts(self) -> _Indices: ...
    @property
    def self_intersecting_faces(self) -> _Indices: ...
    @property
    def inside_out_components(self) -> list[_Indices]: ...
    @property
    def triangles(self) -> _Indices: ...
    @property
    def ngons(self) -> _Indices: ...
    @property
    def components(self) -> int: ...
    @property
    def euler(self) -> int: ...
    @property
    def closed(self) -> bool: ...
    @property
    def manifold(self) -> bool: ...
    @property
    def pure_quad(self) -> bool: ...
    @property
    def is_valid(self) -> bool: ...
    @property
    def summary(self) -> str: ...
    def __bool__(self) -> bool: ...

def check(mesh: Mesh, *, progress: _Progress | None = None) -> Defects:
    """Every defect of a mesh, with indices."""
