"""Pure-quad booleans of polygon meshes, retopology along marked edges, and triangle-quad tilings of outlines. Meshes are in
Blender's own layout, lengths in scene units."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "BaseTriangulation",
    "BooleanResult",
    "Boundary",
    "Cancelled",
    "CornerPoints",
    "CornerSources",
    "Defects",
    "Fit",
    "FoldResult",
    "InfeasibleError",
    "InternalError",
    "InvalidMeshError",
    "Mesh",
    "PatchDesign",
    "PatchGraph",
    "PatchPartition",
    "PolyhedronResult",
    "QuadloomError",
    "RetopologyResult",
    "RetopologySession",
    "Schedule",
    "SurfaceResult",
    "Symmetry",
    "Tiling",
    "TilingIterator",
    "Tilings",
    "__version__",
    "boolean",
    "check",
    "count_tilings",
    "explain_boundary",
    "find_tiling",
    "fit_boundary",
    "fold_tiling",
    "panel_schedule",
    "repair_boundary",
    "retopologize",
    "template_catalogue",
    "tile_polyhedron",
    "tile_surface",
    "tilings",
]

__version__: str

_Indices: TypeAlias = NDArray[np.int32]
_Floats: TypeAlias = NDArray[np.float64]
_Progress: TypeAlias = Callable[[str, float], bool | None]
_Place: TypeAlias = int | Sequence[float]
_Template: TypeAlias = tuple[_Place, str] | tuple[_Place, str, int]

class QuadloomError(Exception):
    """Base of every error of this module."""

    code: str
    """A stable identifier, such as "open"."""
    mesh: int | None
    """0 or 1, the input the elements belong to; None when there is one input, or when both are concerned."""
    elements: dict[str, _Indices]
    """Index arrays by kind: "verts", "faces" and "corners" (N,), "edges" (N, 2) vertex pairs; "sides" and "patches" are those
    of a patch graph; "features" and "feature_verts" are positions in what was given under those names. When both inputs are concerned the kinds begin
    with "a_" or "b_"."""

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

@final
class CornerSources:
    """Where each of the C corners of a result takes its attributes from: a point of an input's face."""

    @property
    def mesh(self) -> _Indices:
        """(C,) input mesh, 0 or 1."""
    @property
    def face(self) -> _Indices:
        """(C,) face of that mesh."""
    @property
    def weights(self) -> _Floats:
        """(C, 4) weights of that face's four corners, in their order; each row sums to 1."""

@final
class BooleanResult:
    """What `boolean` returns."""

    @property
    def mesh(self) -> Mesh:
        """The result, every face a quad."""
    @property
    def face_source(self) -> _Indices:
        """(F, 2) the input mesh (0 or 1) and the face of it that each face is; (-1, -1) when new."""
    @property
    def corner_source(self) -> CornerSources: ...
    @property
    def intersection_edges(self) -> _Indices:
        """(E, 2) edges of `mesh` on the intersection curve, as vertex pairs."""
    @property
    def report(self) -> dict[str, Any]:
        """What was done: counts, seconds a stage, warnings."""

def boolean(
    a: Mesh,
    b: Mesh,
    operation: Literal["union", "intersection", "difference"] = "union",
    *,
    retraction_distance: float = 1.0,
    alpha: float = 0.5,
    blend_radius: float = 0.0,
    layout: Literal["motorcycle", "separatrices"] = "motorcycle",
    regroup: Literal["rows", "rectangles"] = "rows",
    filler: Literal["auto", "patches", "rings", "matching"] = "auto",
    sharp_angle: float = ...,
    feature_edges: tuple[ArrayLike, ArrayLike] | None = None,
    progress: _Progress | None = None,
) -> BooleanResult:
    """Union, intersection or difference (A without B) of two closed, manifold, pure-quad meshes, as a pure-quad mesh
    that keeps every quad the cut does not come near, vertex for vertex.

    retraction_distance: quads nearer to the intersection curve than this are remade; edge lengths, 0 to 10.
    alpha: even edge lengths (towards 0) or regular patches (towards 1); between 0 and 1, both excluded.
    blend_radius: smooth the surface within this distance of the curve; scene units, 0 keeps the curve sharp.
    sharp_angle: edges bent by more than this become edge loops of the band; radians, 0 to pi, by default 35 degrees.
    feature_edges: for A and for B, (E, 2) vertex pairs that become edge loops of the band whatever their angle.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises InvalidMeshError, InfeasibleError, Cancelled, or QuadloomError when an option is out of range."""

@final
class CornerPoints:
    """Where each of the C corners of a result takes its attributes from: a point of a face of the input, on the corner's
    own side of every feature."""

    @property
    def face(self) -> _Indices:
        """(C,) face of the input."""
    @property
    def corners(self) -> _Indices:
        """(C, 3) three corners of that face, as indices into the input's `corner_verts`."""
    @property
    def weights(self) -> _Floats:
        """(C, 3) weights of the three; none negative, each row sums to 1."""

@final
class RetopologyResult:
    """What `retopologize` returns."""

    @property
    def mesh(self) -> Mesh:
        """The result, every face a quad."""
    @property
    def base(self) -> Mesh:
        """The base triangulation, with straight edges."""
    @property
    def base_edges(self) -> _Indices:
        """(B, 2) the edges of `base`, as vertex pairs."""
    @property
    def base_paths(self) -> list[_Floats]:
        """Those edges as they lie on the surface: (N, 3) points each, from first to second vertex."""
    @property
    def base_chain(self) -> _Indices:
        """(B,) the feature chain that each of `base_paths` lies on, -1 for none."""
    @property
    def mirror(self) -> _Indices | None:
        """(V,) the mirror image of each vertex of `mesh`, itself on the plane; None when no symmetry was asked for."""
    @property
    def feature_edges(self) -> _Indices:
        """(E, 2) edges of `mesh` that lie on features, open borders among them, as vertex pairs."""
    @property
    def feature_chain(self) -> _Indices:
        """(E,) the chain each of `feature_edges` belongs to; a chain runs from corner to corner."""
    @property
    def feature_kind(self) -> _Indices:
        """(E,) why it is a feature: 0 marked, 1 detected, 2 an open border and nothing else."""
    @property
    def feature_source(self) -> _Indices:
        """(E, 2) the edge of the input under the middle of each of `feature_edges`, as a pair of the input's vertices."""
    @property
    def corner_source(self) -> CornerPoints: ...
    @property
    def report(self) -> dict[str, Any]:
        """What was done: counts, quality, seconds a stage, warnings."""

def retopologize(
    mesh: Mesh,
    feature_edges: ArrayLike | None = None,
    feature_verts: ArrayLike | None = None,
    target_faces: int = 4000,
    *,
    edge_length: float | None = None,
    density: ArrayLike | None = None,
    detect: bool = False,
    detect_angle: float = ...,
    detect_continue_angle: float = ...,
    detect_length: float = 0.04,
    corner_angle: float = ...,
    base_vertices: int = 100,
    coarseness: float = 0.5,
    pairing: Literal["valence", "matching"] = "valence",
    improve: bool = True,
    symmetry: Literal["x", "y", "z"] | Sequence[Sequence[float]] | None = None,
    symmetry_tolerance: float = 0.01,
    templates: Iterable[_Template] | None = None,
    catalogue: str | None = None,
    progress: _Progress | None = None,
) -> RetopologyResult:
    """An all-quad mesh of a surface in which marked edges are chains of edges and corners of features stay where they are.
    Open borders are features without being marked.

    feature_edges: (E, 2) vertex pairs, edges of faces, each given once; None for none. What leaves no room for quads of the size
        is left out and reported: parts shorter than half an edge, and where corners are more than one for ten quads the
        shortest curves.
    feature_verts: (N,) vertices that stay vertices where they are; None for none.
    target_faces: how many quads, 1 to 4,000,000.
    edge_length: longest edges where the density is 1, shorter where the surface bends, in place of target_faces; scene units.
    density: (V,) how much denser the edges are round each vertex, above 0: edges are 1/density as long; None for 1.
    detect: whether edges between faces that turn sharply are features as well.
    detect_angle: detected curves start at edges turned by more than this; radians, 0 to pi, by default 40 degrees.
    detect_continue_angle: they go on over edges turned by more than this; radians, 0 to detect_angle, by default 25 degrees.
    detect_length: shorter ones are dropped; fraction of the bounding-box diagonal, 0 to 1.
    corner_angle: features have a corner where they turn by more than this; radians, 0 to pi, by default 50 degrees.
    base_vertices: vertices of an even base triangulation, 4 to 100,000; features add more where they need them.
    coarseness: even edge lengths (0) or the coarsest layout, with the fewest patches (1); 0 to 1.
    pairing: how base triangles become patches; "matching" is the paper's rule.
    improve: whether irregular vertices away from features are taken out by laying disks of quads anew; never where
        coarseness is 1 or a template was chosen.
    symmetry: the plane about which the result is exactly symmetric, by index: "x", "y" or "z" for the plane through the
        origin across that axis, or (point, normal). The side that the normal points to decides.
    symmetry_tolerance: how far mirror images of the surface, its marks and borders may be off; fraction of the bounding-box
        diagonal, 0 or more, `inf` for anything.
    templates: for pairs of base triangles, [(place, name)] or [(place, name, quarter turns)]: the place is a base edge (a
        number of `base_edges`) or a point (x, y, z), which takes the pair nearest to it; the name is one of
        `template_catalogue()` or of `catalogue`.
    catalogue: templates of your own, the text of a JSON file; `template_catalogue()` is the one built in.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises InvalidMeshError, Cancelled, or QuadloomError when a feature is no edge of the surface, marks are not symmetric
    (its elements "edges" are vertex pairs) or an option is out of range."""

def template_catalogue() -> str:
    """The built-in templates as a JSON text: the form that `catalogue` has."""

@final
class BaseTriangulation:
    """The base triangulation of a `RetopologySession`."""

    @property
    def mesh(self) -> Mesh:
        """Straight triangles."""
    @property
    def edges(self) -> _Indices:
        """(B, 2) its edges, as vertex pairs."""
    @property
    def paths(self) -> list[_Floats]:
        """Those edges as they lie on the surface: (N, 3) points each, from first to second vertex."""
    @property
    def chain(self) -> _Indices:
        """(B,) the feature chain that each lies on, -1 for none."""

@final
class RetopologySession:
    """A surface whose features are edited: what `retopologize` makes, kept from one edit to the next.

    It is made with the arguments of `retopologize`, and costs the time to the base triangulation. Only `improve` is False
    by default: it goes over the whole mesh, at the end of editing say. An edit makes anew only the base triangles about
    what changes, where that is possible, and the next quads only those on and beside them: the result then depends on the
    order of edits (the report's "base_triangles_edited" is not None, "patches_kept" is not 0), but keeps every promise.
    After an error nothing has changed."""

    def __new__(
        cls,
        mesh: Mesh,
        feature_edges: ArrayLike | None = None,
        feature_verts: ArrayLike | None = None,
        target_faces: int = 4000,
        *,
        edge_length: float | None = None,
        density: ArrayLike | None = None,
        detect: bool = False,
        detect_angle: float = ...,
        detect_continue_angle: float = ...,
        detect_length: float = 0.04,
        corner_angle: float = ...,
        base_vertices: int = 100,
        coarseness: float = 0.5,
        pairing: Literal["valence", "matching"] = "valence",
        improve: bool = False,
        symmetry: Literal["x", "y", "z"] | Sequence[Sequence[float]] | None = None,
        symmetry_tolerance: float = 0.01,
        templates: Iterable[_Template] | None = None,
        catalogue: str | None = None,
        progress: _Progress | None = None,
    ) -> RetopologySession: ...
    @property
    def feature_edges(self) -> _Indices:
        """(E, 2) the marked edges as they were given last."""
    @property
    def feature_verts(self) -> _Indices:
        """(N,) the marked vertices as they were given last."""
    def set_features(
        self,
        feature_edges: ArrayLike | None = None,
        feature_verts: ArrayLike | None = None,
        *,
        progress: _Progress | None = None,
    ) -> dict[str, Any]:
        """Makes these the features, in place of those before. Returns what was done: base triangles "removed" and "added",
        and whether the "whole" base was made anew."""
    def add_features(
        self,
        feature_edges: ArrayLike | None = None,
        feature_verts: ArrayLike | None = None,
        *,
        progress: _Progress | None = None,
    ) -> dict[str, Any]:
        """Marks edges and vertices, each not marked yet. Returns what `set_features` does."""
    def remove_features(
        self,
        feature_edges: ArrayLike | None = None,
        feature_verts: ArrayLike | None = None,
        *,
        progress: _Progress | None = None,
    ) -> dict[str, Any]:
        """Takes marks away. Returns what `set_features` does."""
    def move_features(self, from_edges: ArrayLike, to_edges: ArrayLike, *, progress: _Progress | None = None) -> dict[str, Any]:
        """Takes edges away and marks others, in one step. Returns what `set_features` does."""
    def base(self) -> BaseTriangulation:
        """The base triangulation: of the kept half when there is a plane of symmetry."""
    def quads(
        self, *, templates: Iterable[_Template] | None = None, draft: bool = False, progress: _Progress | None = None
    ) -> RetopologyResult:
        """The quads: what `retopologize` returns. `templates` as there, in place of those before. A `draft` is for a first
        look: patches and counts are those of the result, but its vertices are hardly smoothed; it takes half the time."""
    def field(
        self,
        feature_edges: ArrayLike | None = None,
        feature_verts: ArrayLike | None = None,
        *,
        progress: _Progress | None = None,
    ) -> _Floats:
        """(V,) the harmonic field of a feature at the vertices of the mesh, 0 to 1: 1 on these edges and vertices, 0 on all
        other features and base vertices."""

@final
class Boundary:
    """What `explain_boundary` finds; true when the outline has a tiling."""

    @property
    def verdict(
        self,
    ) -> Literal["angle", "turning", "open", "not_simple", "refuted", "untileable", "tileable"]:
        """The first fault found, or none."""
    @property
    def sentence(self) -> str:
        """What is wrong and what to change, or what any tiling consists of."""
    @property
    def corners(self) -> _Indices:
        """(N,) the corners at fault; for "not_simple" pairs of edges, by the corners they leave."""
    @property
    def points(self) -> _Floats:
        """(V, 2) the corners, the first at the origin and the first edge along x; and the end when it is open."""
    @property
    def closes(self) -> bool:
        """Whether the outline ends where it begins."""
    @property
    def simple(self) -> bool:
        """Whether it closes without touching itself."""
    @property
    def tileable(self) -> bool:
        """Whether it has a tiling."""
    @property
    def squares(self) -> tuple[int, int, int] | None:
        """Squares of any tiling, turned by 0, 30 and 60 degrees; None when the outline does not close. A negative number
        refutes it."""
    @property
    def triangles(self) -> tuple[int, int, int, int] | None:
        """Triangles of any tiling, turned by 0, 30, 60 and 90 degrees; None when the outline does not close. A negative
        number refutes it."""
    @property
    def defect(self) -> int | None:
        """Other than zero, it refutes the outline; its size is the least number of thin rhombi that could help."""
    def __bool__(self) -> bool: ...

@final
class Symmetry:
    """A symmetry of an outline: a rotation about a centre or a reflection in an axis."""

    @property
    def reflection(self) -> bool:
        """Whether it is a reflection."""
    @property
    def angle(self) -> float:
        """Degrees: of a rotation the angle, of a reflection the direction of its axis."""
    @property
    def centre(self) -> tuple[float, float]:
        """The centre of a rotation, or a point of the axis."""

@final
class Tiling:
    """One tiling."""

    @property
    def mesh(self) -> Mesh:
        """The tiles as a mesh with unit edges in the plane z = 0; the outline's first corner is the origin, its first edge
        along x."""
    @property
    def kinds(self) -> _Indices:
        """(F,) what each face is: 0 a triangle, 1 a square, 2 a thin rhombus."""
    @property
    def rhombi_at_least(self) -> int:
        """No tiling of the outline has fewer thin rhombi: equal to their number, but where the proof would have taken too
        long."""
    @property
    def orientations(self) -> _Indices:
        """(F,) by how many times 30 degrees each face is turned; 0 to 3 for triangles, 0 to 2 for squares, 0 to 5 for
        rhombi."""
    @property
    def configurations(self) -> dict[str, int]:
        """How many inner vertices, those of rhombi apart, have each configuration: "triangles", "squares", "rows",
        "butterfly"."""
    def svg(self, width: int = 800) -> str:
        """A picture, `width` pixels wide: triangles warm, squares cold, a shade for each orientation; rhombi magenta."""

@final
class TilingIterator:
    """Goes through `Tilings` in order."""

    def __iter__(self) -> TilingIterator: ...
    def __next__(self) -> Tiling: ...

@final
class Tilings:
    """All tilings of an outline, in a fixed order: a sequence of `Tiling`."""

    @property
    def count(self) -> int:
        """How many there are; `len` only takes numbers below 2^63."""
    @property
    def states(self) -> int:
        """States of the search."""
    @property
    def symmetries(self) -> list[Symmetry]:
        """The symmetries of the outline, the identity first."""
    def __len__(self) -> int: ...
    def __bool__(self) -> bool: ...
    def __getitem__(self, index: int, /) -> Tiling: ...
    def __iter__(self) -> Iterator[Tiling]: ...
    def sample(self, n: int, seed: int = 0) -> list[Tiling]:
        """`n` tilings drawn independently, each tiling equally likely; the same for the same seed. Empty when there is
        none."""
    def best(
        self,
        objective: Literal["regular", "fractured"] | Mapping[str, int],
        *,
        progress: _Progress | None = None,
    ) -> tuple[Tiling, int] | None:
        """A tiling with the least sum of weights over its inner vertices, proven, and that sum; None when there is none.

        objective: "regular" (fewest butterflies), "fractured" (most), or integer weights by configuration: "triangles",
        "squares", "rows" and "butterfly". A butterfly is a vertex with two triangles, a square, a triangle and a square
        round it. Vertices of the outline have no weight."""
    def symmetric(
        self, group: Literal["reflection"] | int | Sequence[Symmetry], *, progress: _Progress | None = None
    ) -> Tilings:
        """Those tilings that are exactly symmetric.

        group: "reflection" (in the axis with the most such tilings), a number n for n-fold rotation about the outline's
        centre, or a list of `symmetries` that must all hold."""

def count_tilings(code: ArrayLike, *, rhombi: int = 0, memory: int = 4294967296, progress: _Progress | None = None) -> int:
    """Number of ways to tile an outline by triangles and squares with unit edges; exact, of any size.

    code: interior angles in units of 30 degrees, 2 to 11, counter-clockwise, of a closed simple polygon with unit edges.
    rhombi: how many thin rhombi (30 degrees) the tilings have besides.
    memory: most bytes for the states of the search.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises QuadloomError when the code is no closed simple polygon (elements["corners"]) or the memory is used up."""

def tilings(code: ArrayLike, *, memory: int = 4294967296, progress: _Progress | None = None) -> Tilings:
    """All tilings of an outline by triangles and squares with unit edges, in a fixed order; they are made when asked for.
    Arguments and errors as of `count_tilings`."""

def find_tiling(
    code: ArrayLike, seed: int = 0, *, rhombi: bool = False, memory: int = 4294967296, progress: _Progress | None = None
) -> Tiling | None:
    """A tiling of an outline, another for another seed; None when there is none.

    rhombi: where there is no tiling by triangles and squares, take the fewest thin rhombi (30 degrees) besides, as near to
    the outline as they can lie. None then means that no number of them helps; QuadloomError "unsettled", that none was found
    but some may.

    Quick where there are too many tilings to count. Not each tiling is equally likely: for that, see `Tilings.sample`."""

def explain_boundary(code: ArrayLike, *, memory: int = 4294967296, progress: _Progress | None = None) -> Boundary:
    """Says whether a boundary code closes, is simple and can be tiled; and if not, why not. Any code gets an answer."""

def repair_boundary(code: ArrayLike, *, memory: int = 4294967296, progress: _Progress | None = None) -> _Indices | None:
    """The nearest boundary code that can be tiled: the fewest exchanges of neighbouring edges, each of which adds or removes
    a rhombus of 30 degrees at the border; the code itself when it can be tiled. None when few exchanges do not help."""

@final
class Fit:
    """What `fit_boundary` finds: an outline that can be tiled, near a curve."""

    @property
    def code(self) -> _Indices:
        """(V,) the boundary code."""
    @property
    def tiling(self) -> Tiling:
        """One tiling of the outline: there is one even where the search for another takes too long."""
    @property
    def points(self) -> _Floats:
        """(V, 2) the corners in the plane of the curve."""
    @property
    def origin(self) -> tuple[float, float]:
        """Where the first corner lies: a tiling's vertex p belongs at origin + edge_length * (p turned by rotation)."""
    @property
    def rotation(self) -> float:
        """Direction of the first edge, radians."""
    @property
    def edge_length(self) -> float:
        """As given."""
    @property
    def greatest_distance(self) -> float:
        """Greatest distance from a point of either to the other, in edge lengths."""
    @property
    def mean_distance(self) -> float:
        """Mean distance of the corners from the curve, in edge lengths."""

def fit_boundary(
    points: ArrayLike,
    edge_length: float,
    *,
    rotation: float | None = None,
    tries: int = 96,
    seed: int = 0,
    loops: int = 4000,
    progress: _Progress | None = None,
) -> Fit:
    """The outline of a region near a closed curve that triangles and squares can tile.

    points: (N, 2) floats, the corners of a polygon that does not cross itself, in either sense.
    edge_length: of the tiles, in the units of the points.
    rotation: angle between the x axis and the edges, up to multiples of 30 degrees; radians, None takes the best found.
    tries: placements tried, 1 to 100000.
    seed: another one tries others.
    loops: looked at in the search for a nearer outline, 0 to 1000000; 0 keeps the symmetry of the one found first.

    Raises QuadloomError for a curve that is too small for a tile or longer than 1000 edges. The outline keeps within about
    0.7 edge lengths of the curve."""

@final
class Schedule:
    """A mesh of triangles and quads as a list of parts: panels, their types, nodes and edges. Ids are indices of faces and
    vertices. Lengths are in scene units. Two are equal when all they hold is."""

    @property
    def tolerance(self) -> float:
        """No corner of a panel is further than this from where its type has it."""
    @property
    def mirror(self) -> bool:
        """Whether mirror images are one type."""
    @property
    def types(self) -> _Indices:
        """(F,) the type of each panel, an index into `type_names`."""
    @property
    def mirrored(self) -> NDArray[np.bool_]:
        """(F,) whether a panel is the mirror image of its type."""
    @property
    def misfit(self) -> _Floats:
        """(F,) greatest distance of a corner from where the type has it."""
    @property
    def area(self) -> _Floats:
        """(F,) areas, scene units squared; a quad's is that of its projection onto its best plane."""
    @property
    def deviation(self) -> _Floats:
        """(F,) greatest distance of a corner from the plane nearest to all: of a quad half the distance of its diagonals."""
    @property
    def planarity(self) -> _Floats:
        """(F,) The distance between the diagonals, twice the `deviation`, over their mean length; 0 for triangles."""
    @property
    def type_names(self) -> list[str]:
        """T1, T2, ... of triangles, Q1, Q2, ... of quads, the frequent ones first."""
    @property
    def type_counts(self) -> _Indices:
        """(T,) how many panels each type has."""
    @property
    def type_models(self) -> _Indices:
        """(T,) the panel whose shape each type has."""
    @property
    def edges(self) -> _Indices:
        """(E, 2) the edges, as pairs of nodes."""
    @property
    def edge_lengths(self) -> _Floats:
        """(E,) their lengths."""
    @property
    def edge_classes(self) -> _Indices:
        """(E,) their classes of length, from the shortest; none differs from the middle of its class by more than
        `tolerance`."""
    def to_json(self) -> str:
        """All of it as JSON text, with every digit."""
    @staticmethod
    def from_json(text: str) -> Schedule:
        """Reads what `to_json` wrote. Raises QuadloomError with the code "text" when the text is no schedule."""
    def to_csv(self, table: Literal["panels", "types", "nodes", "edges"] = "panels") -> str:
        """One table as comma-separated values with a line of headings."""
    def unrolled(
        self,
        format: Literal["svg", "dxf"] = "svg",
        *,
        sheet: tuple[float, float] | None = None,
        gap: float | None = None,
        millimetres: float = 1000.0,
        labels: bool = True,
        progress: _Progress | None = None,
    ) -> str:
        """All panels laid flat on sheets, as a drawing in millimetres: each on its best plane, as seen from outside, those of
        a type beside one another and turned alike. A panel carries its id and type, and along its edges its neighbours' ids.

        format: "svg", or "dxf" (AutoCAD 2000, layers CUT, LABEL and SHEET).
        sheet: width and height of a sheet, scene units, above 0; None for one sheet that is large enough.
        gap: free space round panels, scene units, 0 or more; None for a tenth of the mean edge length.
        millimetres: how many a scene unit has, above 0.
        labels: whether ids are written.

        Raises QuadloomError for options out of range and panels larger than the sheet (code "sheet", elements "faces")."""
    def __len__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

def panel_schedule(
    mesh: Mesh, *, tolerance: float | None = None, mirror: bool = False, progress: _Progress | None = None
) -> Schedule:
    """Measures the panels of a mesh of triangles and quads and sorts them into types that can be made alike.

    mesh: any; faces may be open, non-manifold or apart.
    tolerance: no corner of a panel is further than this from where its type has it, the two laid on their best planes,
    outside up, and turned to one another; scene units, above 0; None for a hundredth of the mean edge length.
    mirror: whether a panel and its mirror image are one type, as when panels may be turned over.

    Raises InvalidMeshError for faces with more than four corners, without area or with a vertex twice, and positions that
    are no numbers; QuadloomError for a tolerance out of range."""

@final
class SurfaceResult:
    """What `tile_surface` returns."""

    @property
    def mesh(self) -> Mesh:
        """The panels, triangles and quads, with the topology of the surface."""
    @property
    def panels(self) -> Schedule:
        """The panels measured and sorted into types, as `panel_schedule` does."""
    @property
    def edge_length(self) -> float:
        """Length of the edges asked for, scene units: shorter than `edge_length` where panels of that size had no room."""
    @property
    def irregular_verts(self) -> _Indices:
        """(N,) vertices whose angle defect is not zero, a triangle's corner counting 60 and a square's 90 degrees."""
    @property
    def defects(self) -> _Indices:
        """(N,) their defects in units of 30 degrees; the sum is 12 times the Euler characteristic."""
    @property
    def turned_faces(self) -> _Indices:
        """(N,) panels with a corner that faces away from the surface: none but where no size had room."""
    @property
    def patch_graph(self) -> PatchGraph | None:
        """The patches of partition="patches"; None where none were asked for or found."""
    @property
    def report(self) -> dict[str, Any]:
        """What was done: counts, quality, seconds a stage, warnings."""
    def zigzag(
        self,
        side: int,
        edges: int = 1,
        *,
        pair: bool = False,
        spread: bool = False,
        position: float = 0.5,
        progress: _Progress | None = None,
    ) -> SurfaceResult:
        """The same surface with a zigzag on a side of its patch graph: edges that leave the side's direction by 30 degrees.
        Other sides change as little and as near as may be; only patches beside sides that changed get other panels, and sides
        and patches keep their indices: report["edited_sides"], report["edited_patches"]. This result stays as it is.

        side: index of a side of `patch_graph`.
        edges: how many turn, 1 to 100, to the left as the side runs; to the right when negative.
        pair: as many then turn to the other side, so that the side runs on in its direction.
        spread: they lie apart along the side instead of one after the other: a more fractured pattern.
        position: where along the side the middle is wished for, 0 to 1; elsewhere where only that has panels.
        progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

        Raises InfeasibleError with the code "no_patches", "zigzag_open" (nothing closes) or "zigzag_untileable" (the patches in
        its elements have no panels then); QuadloomError when an option is out of range; Cancelled."""
    def zigzag_patch(
        self,
        patch: int,
        edges: int = 1,
        *,
        first: int = 0,
        pair: bool = False,
        spread: bool = False,
        position: float = 0.5,
        progress: _Progress | None = None,
    ) -> SurfaceResult:
        """The same surface with zigzags on all three sides of a patch (a triple), or on two opposite sides of one of four (a
        pair): the side that leaves its corner `first`, counting corners that are not straight, and the one opposite. Sides as
        they run round the patch counter-clockwise; else as `zigzag`; "patch_sides" when it has more sides."""

@final
class PatchGraph:
    """The patches that a surface was divided into: disks that can be laid flat, with corners at multiples of 30 degrees."""

    def __new__(
        cls,
        nodes: ArrayLike,
        side_nodes: ArrayLike,
        side_offsets: ArrayLike | None = None,
        side_points: ArrayLike | None = None,
        *,
        side_c_indices: ArrayLike | None = None,
    ) -> PatchGraph:
        """A graph for `PatchDesign`: nodes (N, 3) and sides (S, 2) between them, straight, or along the points (P, 3) of
        side_points, those of side s from side_offsets[s] to side_offsets[s + 1], both ends included, near a surface.
        side_c_indices: as the attribute; None where nothing is known. It has no patches yet: the design finds them."""
    @property
    def nodes(self) -> _Floats:
        """(N, 3) where sides end, scene units."""
    @property
    def defects(self) -> _Indices:
        """(N,) the curvature at each node in units of 30 degrees: 12 less the c-indices there, on the border 6 less them."""
    @property
    def side_offsets(self) -> _Indices:
        """(S + 1,) where the points of each side begin in `side_points`, and their number."""
    @property
    def side_points(self) -> _Floats:
        """(P, 3) the sides as polylines on the surface, both ends included; scene units."""
    @property
    def side_nodes(self) -> _Indices:
        """(S, 2) the nodes where each side begins and ends."""
    @property
    def patch_offsets(self) -> _Indices:
        """(F + 1,) where the corners of each patch begin, and their number."""
    @property
    def corner_nodes(self) -> _Indices:
        """(C,) the node at each corner, counter-clockwise about its patch."""
    @property
    def c_indices(self) -> _Indices:
        """(C,) the interior angle at each corner in units of 30 degrees; 6 where the border passes a node straight."""
    @property
    def corner_sides(self) -> _Indices:
        """(C,) the side that leaves each corner."""
    @property
    def side_c_indices(self) -> _Indices:
        """(S, 2) the c-index where each side begins, in the patch on its left, and where it ends, in the patch on its right; 0
        where there is no patch, or it is not known."""
    @property
    def face_patches(self) -> _Indices:
        """(F,) the patch of each panel. This and what follows is empty with pattern="random", whose panels lie across sides."""
    @property
    def side_vert_offsets(self) -> _Indices:
        """(S + 1,) where the vertices of each side begin in `side_verts`, and their number."""
    @property
    def side_verts(self) -> _Indices:
        """(K,) the vertices of the panels along each side as it runs, both ends included; vertex n is node n."""
    @property
    def course_offsets(self) -> _Indices:
        """(S + 1,) where the edges of each side begin in `side_courses`, and their number."""
    @property
    def side_courses(self) -> _Indices:
        """(E,) where each edge along a side goes, in units of 30 degrees from the side's own direction: 0 straight on, 1 to the
        left, -1 to the right. Between 0 and another lies a vertex with the c-indices 5 and 7."""

@final
class PatchDesign:
    """A surface being divided into patches by hand: its parts, the ways to divide each, and the panels of what was chosen.
    A part of defect 0 is a patch. Immutable: dividing a part gives another design, so any step can be taken back."""

    def __new__(
        cls,
        mesh: Mesh,
        edge_length: float | None = None,
        feature_edges: ArrayLike | None = None,
        *,
        target_panels: int = 1000,
        patch_graph: PatchGraph | None = None,
        corners: ArrayLike | None = None,
        feature_angle: float = ...,
        corner_angle: float = ...,
        progress: _Progress | None = None,
    ) -> PatchDesign:
        """Begins with the disks that the surface is cut into; or, given a patch_graph that lies near the surface, with it.
        Borders and followed edges are sides whether it has them or not; c-indices stay where they are known, fit the angles
        and close, else the nearest that close are taken. The other arguments are those of `tile_surface` with patches.

        Raises InfeasibleError for surfaces that cannot be cut into flat disks (code "no_patches") and graphs that are no
        partition ("graph_far", "graph_apart", "graph_open", "graph_not_flat", "graph_not_closing"; elements "nodes" and "sides"
        of the graph); and what `tile_surface` raises."""
    @property
    def defects(self) -> _Indices:
        """(P,) the total interior defect of each part in units of 30 degrees; 0 of patches."""
    @property
    def patch_graph(self) -> PatchGraph | None:
        """The parts as they are now: its patches are the parts, in their order, flat or not. None where two corners of a
        part fall together."""
    @property
    def edge_length(self) -> float:
        """Length of the panels' edges, scene units, before a count of panels is met exactly."""
    def partitions(self, part: int, *, progress: _Progress | None = None) -> list[PatchPartition]:
        """The admissible partitions of a part: none makes a part of greater defect. Those that divide the defect come first,
        then those that only cut flat parts off; each the best first. Deterministic."""
    def divided(self, partition: PatchPartition) -> PatchDesign:
        """The design with a part divided; the parts made come last. Raises QuadloomError when the partition is one of
        another design."""
    def tile(
        self,
        *,
        pattern: Literal["regular", "fractured", "symmetric", "random"] = "regular",
        seed: int = 0,
        patch_panels: int = 40,
        shaping_rounds: int = 60,
        flattening_rounds: int = 15,
        closeness: float = 1.0,
        planarity: float = 0.0,
        fairness: float = 0.0,
        uniformity: float = 0.0,
        borders: Literal["slide", "keep"] = "slide",
        features: Literal["slide", "keep"] = "slide",
        type_tolerance: float | None = None,
        mirror: bool = False,
        progress: _Progress | None = None,
    ) -> SurfaceResult:
        """The panels, as `tile_surface` makes them. Parts that are no patches yet are divided automatically. Raises
        InfeasibleError "no_lengths" when that finds nothing, or no lengths of sides close all patches."""

@final
class PatchPartition:
    """One way to divide a part of a `PatchDesign`."""

    @property
    def score(self) -> float:
        """Lower is better: rounding errors of 30 degrees, gaps, bends, creases crossed and parts, summed."""
    @property
    def defects(self) -> _Indices:
        """(P,) the total interior defect of each part made, in units of 30 degrees."""
    @property
    def c_indices(self) -> list[_Indices]:
        """(C,) for each part made: its c-indices, counter-clockwise."""
    @property
    def curves(self) -> list[_Floats]:
        """(N, 3) for each curve: its points on the surface, scene units."""

def tile_surface(
    mesh: Mesh,
    edge_length: float | None = None,
    feature_edges: ArrayLike | None = None,
    *,
    target_panels: int = 1000,
    partition: Literal["even", "patches"] = "even",
    corners: ArrayLike | None = None,
    pattern: Literal["regular", "fractured", "symmetric", "random"] = "regular",
    seed: int = 0,
    patch_panels: int = 40,
    feature_angle: float = ...,
    corner_angle: float = ...,
    shaping_rounds: int = 60,
    flattening_rounds: int = 15,
    closeness: float = 1.0,
    planarity: float = 5.0,
    fairness: float = 0.0,
    uniformity: float = 0.0,
    borders: Literal["slide", "keep"] = "slide",
    features: Literal["slide", "keep"] = "slide",
    type_tolerance: float | None = None,
    mirror: bool = False,
    progress: _Progress | None = None,
) -> SurfaceResult:
    """Covers a surface by panels: triangles and quads that are near to equilateral triangles and squares of one edge length.
    The result has the surface's topology; its border runs on the surface's, and marked edges become chains of edges.

    edge_length: of the panels, scene units, above 0; None for about `target_panels` panels.
    feature_edges: (E, 2) vertex pairs, edges of faces that edges of panels follow; None for none.
    target_panels: about how many panels, 1 to 2,000,000, when there is no edge_length.
    partition: "even" spreads irregular vertices evenly and always succeeds; "patches" divides the surface into large patches
        that are flat in themselves, as the paper does; where none are found the report says so and the panels are even.
    corners: (N, 2) border vertices and their c-indices, 2 to 10, instead of those nearest to their angles; patches only.
    pattern: "regular", as periodic as the surface allows; "fractured", both panels in every patch that allows it, with as many
        butterflies as there can be; "symmetric", with as many symmetries as the outline of each patch allows; "random", drawn
        from all tilings of each patch. With partition="even" fractured is random and symmetric is regular.
    seed: of the pattern, unless it is regular; the same seed gives the same panels.
    patch_panels: panels of a patch of the random pattern, 12 to 200: more of them leave fewer traces of the regular one.
    feature_angle: edges between faces that turn by more than this are followed too; radians, 0 to pi, by default 50 degrees.
    corner_angle: borders and followed lines keep a vertex where they turn by more; radians, 0 to pi, by default 30 degrees.
    shaping_rounds: rounds that make panels regular, on the surface; 0 to 1000.
    flattening_rounds: further rounds that make them flat, near the surface; 0 to 1000.
    closeness: weight of nearness to the surface in the latter, as all weights against that of regularity, 1; 0.001 to 1000.
    planarity: weight of flat quads in the latter; 0 to 1000.
    fairness: weight in the latter of the curvature that the panels had on the surface, against wiggles; 0 to 1000.
    uniformity: weight in all rounds of one length for all edges and one for all diagonals; 0 to 1000.
    borders, features: "slide", so that vertices move along borders and along followed edges, or "keep" them at equal steps.
    type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises InvalidMeshError, Cancelled, or QuadloomError when a feature is no edge of the surface (its element "features" is
    a position in the list) or an option is out of range."""

@final
class PolyhedronResult:
    """What `tile_polyhedron` returns."""

    @property
    def mesh(self) -> Mesh:
        """The panels, triangles and quads, with the topology of the polyhedron."""
    @property
    def panels(self) -> Schedule:
        """The panels measured and sorted into types, as `panel_schedule` does."""
    @property
    def patch_graph(self) -> PatchGraph:
        """A patch for each face of the polyhedron, in order."""
    @property
    def irregular_verts(self) -> _Indices:
        """(N,) vertices whose angle defect is not zero, a triangle's corner counting 60 and a square's 90 degrees."""
    @property
    def defects(self) -> _Indices:
        """(N,) their defects in units of 30 degrees; the sum is 12 times the Euler characteristic."""
    @property
    def irregularity(self) -> float:
        """The greatest departure of an edge from the mean edge, and of a quad's diagonal from sqrt 2 of it; in edges."""
    @property
    def regular(self) -> bool:
        """Whether that is below a millionth: all panels are equilateral triangles and squares."""
    @property
    def report(self) -> dict[str, Any]:
        """What was done: counts, patches that got other side lengths or rhombi, those edited."""
    def zigzag(
        self,
        side: int,
        edges: int = 1,
        *,
        pair: bool = False,
        spread: bool = False,
        position: float = 0.5,
        progress: _Progress | None = None,
    ) -> PolyhedronResult:
        """The same polyhedron with a zigzag on a side of its patch graph; as `SurfaceResult.zigzag`."""
    def zigzag_patch(
        self,
        patch: int,
        edges: int = 1,
        *,
        first: int = 0,
        pair: bool = False,
        spread: bool = False,
        position: float = 0.5,
        progress: _Progress | None = None,
    ) -> PolyhedronResult:
        """The same polyhedron with zigzags on all three sides of a patch, or on two opposite ones of four; as
        `SurfaceResult.zigzag_patch`."""

def tile_polyhedron(
    mesh: Mesh,
    edge_length: float | None = None,
    *,
    cones: bool = True,
    seed: int = 0,
    rounds: int = 400,
    type_tolerance: float | None = None,
    mirror: bool = False,
    progress: _Progress | None = None,
) -> PolyhedronResult:
    """Turns a polyhedron into triangles and squares: each face becomes a patch of them, and the whole is shaped to be as regular
    as its combinatorics allow, without regard to the faces' shape: to a millionth of an edge where such a mesh is near. Faces
    may have any number of corners; the mesh may be open, of any genus and in parts.

    edge_length: of the panels, scene units, above 0; None for the mean length of the polyhedron's edges.
    cones: whether faces whose angles leave 30 or 60 degrees, as a decagon's or a pentagon's, keep that at a point inside.
    seed: which of the tilings of the faces.
    rounds: of shaping, 0 to 10000; 0 leaves the faces as flat as they were.
    type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises InvalidMeshError; InfeasibleError "no_c_indices" (elements["faces"]: faces whose corners cannot be multiples of 30
    degrees) or "no_lengths" (no side lengths near to these close all faces); QuadloomError for options; Cancelled."""

@final
class FoldResult:
    """What `fold_tiling` returns."""

    @property
    def mesh(self) -> Mesh:
        """The folded sheet, in space."""
    @property
    def panels(self) -> Schedule:
        """The panels measured and sorted into types, as `panel_schedule` does: two types when it is regular."""
    @property
    def face_source(self) -> _Indices:
        """(F,) the face of the tiling that each face was."""
    @property
    def vert_target(self) -> _Indices:
        """(V,) the vertex that each vertex of the tiling became; -1 where all faces at it were cut out."""
    @property
    def irregular_verts(self) -> _Indices:
        """(N,) vertices whose angle defect is not zero."""
    @property
    def defects(self) -> _Indices:
        """(N,) their defects in units of 30 degrees; the sum is 12 times the Euler characteristic."""
    @property
    def irregularity(self) -> float:
        """The greatest departure of an edge from the mean edge, and of a square's diagonal from sqrt 2 of it; in edges."""
    @property
    def regular(self) -> bool:
        """Whether that is below a millionth: all panels are equilateral triangles and squares."""

def fold_tiling(
    mesh: Mesh,
    *,
    cut: ArrayLike | None = None,
    glue: Sequence[tuple[ArrayLike, ArrayLike]] | None = None,
    runs: ArrayLike | None = None,
    zips: ArrayLike | None = None,
    rounds: int = 400,
    type_tolerance: float | None = None,
    mirror: bool = False,
    progress: _Progress | None = None,
) -> FoldResult:
    """Cuts parts out of a plane tiling, glues borders together and shapes what comes out into a regular mesh in space:
    equilateral triangles and squares of one edge length. All gluings are made together, on the border that is there once the
    faces are cut out.

    mesh: of triangles and squares with one edge length, such as `Tiling.mesh`; it may be bent already.
    cut: (N,) faces to cut out first; None for none.
    glue: pairs of runs, each a list of vertices along the border: vertex k of the first becomes vertex k of the second.
    runs: (N, 4) vertices a, b, c, d: the border from a to b with faces on its left is glued to that from c to d with faces on
    its right; a to c, b to d.
    zips: (N, 2) a vertex and a number of edges: so many edges of the border to both sides of the vertex are glued.
    rounds: of shaping, 0 to 10000; 0 leaves the first shape as it was found.
    type_tolerance, mirror: what counts as one type of panels, as in `panel_schedule`.
    progress: called as progress(stage, fraction) at least every 50 ms; a false answer other than None cancels.

    Raises InvalidMeshError when the mesh is no such tiling; InfeasibleError with the code "glue_lengths", "glue_orientation",
    "glue_border", "glue_twice" or "glue_surface" and the elements concerned; QuadloomError for options; Cancelled."""
