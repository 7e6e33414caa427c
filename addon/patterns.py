"""From an outline to the panels that fill it: fits, counts and chooses. Runs on a job's thread: touches no bpy.

The fit and the count of the last outline are kept, so that going through its patterns in the redo panel takes no time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from decimal import Decimal
from random import Random
from typing import Any

import numpy as np

from . import native, outline, symmetry
from .attributes import Array
from .outline import STEP, OutlineError, StraightOutline

# Counts with more digits are shown rounded.
MOST_DIGITS = 9
# With such an outline the fit alone takes half a minute. A little below the wheel's own limit, to leave room for `GROWTHS`.
MOST_PANELS_ROUND = 900
MEBIBYTE = 1 << 20
TRIANGLE_AREA = math.sqrt(3) / 4
# The kinds of panels as the wheel numbers them, and in how many ways each can be turned.
TRIANGLE, SQUARE, RHOMBUS = 0, 1, 2
ORIENTATIONS = np.array([4, 3, 6])
# Why the wheel takes no code: this outline only seemed to consist of whole panels.
NOT_A_CODE = {"too_short", "too_long", "angle", "turning", "open", "not_simple"}
# Rotations tried within 30 degrees for a symmetric outline.
ROTATIONS = 12
# By how many panels the outline is let out or taken in when none of those is symmetric.
GROWTHS = (0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3)
# Step from a pattern to the next, as a fraction of all: with the golden ratio patterns that follow one another differ much.
GOLDEN = (618_033_988_749_895, 10**15)

# Sentences to translate that the artist should read, with values to put in.
Notes = list[tuple[str, dict[str, Any]]]


@dataclass(frozen=True)
class Request:
    """What to make. Lengths in scene units, angles in radians."""

    points: Array
    """(N,2) the outline, which does not cross itself."""
    panel_size: float
    straight: bool
    """Whether sides stay straight where they can."""
    rotation: float | None
    """Of the panels' edges against the x axis, up to 30 degrees; None for the best."""
    pattern: str
    """"any", "regular", "fractured" or "symmetric"."""
    number: int
    seed: int
    memory: int
    """Mebibytes for the states of a search."""


@dataclass(frozen=True)
class Layout:
    """The panels, in the plane of the outline."""

    positions: Array
    """(V,2)."""
    face_offsets: Array
    corner_verts: Array
    kinds: Array
    """(F,) 0 for triangles, 1 for squares, 2 for thin rhombi."""
    orientations: Array
    """(F,) by how many times 30 degrees each panel is turned against `rotation`: triangles 0 to 3, squares 0 to 2, rhombi 0
    to 5."""
    rotation: float
    """Of the panels' edges against the x axis, 0 to 30 degrees; radians."""
    count: int | None
    """How many patterns the outline has of the kind asked for; None when there are too many to count, or rhombi."""
    distance: float
    """Between outline and panels, in panels, at most; 0 when they agree."""
    notes: Notes = field(default_factory=list)
    rhombi_at_least: int = 0
    """No pattern has fewer rhombi than this, for sure."""


@dataclass
class _Place:
    """An outline that has patterns."""

    code: Array
    origin: tuple[float, float]
    rotation: float
    distance: float
    tilings: Any = None
    """All patterns, or None when there are too many to count."""
    own: Any = None
    """The pattern that the outline was cut from, if it was."""
    searched: bool = True
    """Whether other patterns can be found without counting."""
    rhombic: bool = False
    """Whether it takes rhombi to fill it."""


_last: tuple[object, _Place, Notes] | None = None


def lay(request: Request, progress: native.Progress | None) -> Layout:
    """The panels of the pattern asked for. Raises OutlineError, NativeError, Cancelled."""
    place, notes = _place(request, progress)
    if place.rhombic:
        tiling = native.find_tiling(place.code, _seed(request), rhombi=True, memory=_bytes(request), progress=progress)
        text = (
            "No pattern of triangles and squares fills the outline: {count} thin rhombi close it. Turn off Straight Sides for "
            "a near outline without"
        )
        layout = _layout(request, place, tiling, None, notes)
        note = (text, {"count": int((layout.kinds == RHOMBUS).sum())})
        return replace(layout, notes=[*notes, note], rhombi_at_least=tiling.rhombi_at_least)
    if place.tilings is None:
        tiling, sentence = _uncounted(request, place, progress)
        notes = [*notes, (sentence, {"memory": request.memory})]
        return _layout(request, place, tiling, None, notes)
    try:
        tiling, count = _counted(request, place.tilings, progress)
    except native.NativeError as error:
        if error.code == "memory":
            raise _too_many(request) from error
        raise
    return _layout(request, place, tiling, count, notes)


def _counted(request: Request, tilings: Any, progress: native.Progress | None) -> tuple[Any, int]:
    """The pattern asked for among all, and how many there are of its kind."""
    if request.pattern in {"regular", "fractured"}:
        tiling, _ = native.best_tiling(tilings, request.pattern, progress=progress)
        return tiling, tilings.count
    if request.pattern == "symmetric":
        tilings = _most_symmetric(tilings, progress)
    return tilings[_index(request, tilings.count)], tilings.count


def _uncounted(request: Request, place: _Place, progress: native.Progress | None) -> tuple[Any, str]:
    """A pattern found without counting, or that from which the outline was cut; and a sentence that says so."""
    if request.pattern == "symmetric" and place.own is not None and symmetry.is_symmetric(native.tiling_mesh(place.own)[0]):
        text = "Too many patterns to count with {memory} MB: only one symmetric pattern was found. "
        return place.own, text + "Allow more memory or larger panels"
    if request.pattern != "any":
        raise _too_many(request)
    if place.searched:
        try:
            tiling = native.find_tiling(place.code, _seed(request), memory=_bytes(request), progress=progress)
            text = "Too many patterns to count with {memory} MB: this one was found without. "
            return tiling, text + "Allow more memory or larger panels"
        except native.NativeError as error:
            if error.code != "memory":
                raise
            if place.own is None:
                raise _too_many(request) from error
            place.searched = False
    text = "Too many patterns to search with {memory} MB: Number has no effect, Seed has. "
    return place.own, text + "Allow more memory or larger panels"


def _seed(request: Request) -> int:
    """Of a pattern found without counting."""
    return request.seed + (request.number << 32)


def _bytes(request: Request) -> int:
    return request.memory * MEBIBYTE


def count_text(count: int) -> str:
    """The number with its digits, or "about 1.2e11"."""
    return f"{count:,}" if len(str(count)) <= MOST_DIGITS else "about " + f"{Decimal(count):.1e}".replace("e+", "e")


def _too_many(request: Request) -> OutlineError:
    text = "“{name}” has too many patterns to search with {memory} MB: allow more memory or take larger panels"
    return OutlineError(text + ("" if request.pattern == "any" else ", or the pattern Any"), memory=request.memory)


def _index(request: Request, count: int) -> int:
    """Which of `count` patterns is meant. Successive numbers go through all of them before one comes again."""
    stride = max(count * GOLDEN[0] // GOLDEN[1], 1)
    while math.gcd(stride, count) != 1:
        stride += 1
    start = Random(request.seed).randrange(count) if request.seed else 0
    return (start + (request.number - 1) * stride) % count


def _place(request: Request, progress: native.Progress | None) -> tuple[_Place, Notes]:
    """Where the panels go: along straight sides when that can be, or near the outline; kept for the next call."""
    global _last
    symmetric = request.pattern == "symmetric"
    key = (
        request.points.tobytes(), request.panel_size, request.straight, request.rotation, request.seed, request.memory,
        symmetric,
    )  # fmt: skip
    if _last is not None and _last[0] == key:
        return _last[1:]
    panels_round = outline.perimeter(request.points) / request.panel_size
    if panels_round > MOST_PANELS_ROUND:
        text = "“{name}” would take {count:,.0f} panels round its border, more than {most:,}: choose larger panels"
        raise OutlineError(text, count=panels_round, most=MOST_PANELS_ROUND)
    if abs(outline.area(request.points)) < TRIANGLE_AREA * request.panel_size**2:
        raise _too_small(request)
    notes: Notes = []
    place = straight = None
    if request.straight:
        straight = outline.straight_outline(request.points, request.panel_size, request.rotation)
    if straight is not None and not (symmetric and symmetry.outline_order(straight.code) == 1):
        place = _straight_place(request, straight, progress)
        if place is None and straight.distance == 0 and not symmetric:
            place = _rhombic_place(request, straight, progress)
        if place is None and straight.distance == 0:
            notes.append(("Whole panels fit along the outline, but no pattern fills it: a near outline was taken", {}))
    if place is None:
        place = _symmetric_fit(request, progress) if symmetric else _fit(request, progress, rotation=request.rotation)
        place.tilings = _count(request, place.code, progress)
    _last = (key, place, notes)
    return place, notes


def _straight_place(request: Request, straight: StraightOutline, progress: native.Progress | None) -> _Place | None:
    """The outline with straight sides, or None when no pattern fills it."""
    try:
        counted = _count(request, straight.code, progress)
    except native.NativeError as error:
        if error.code in NOT_A_CODE:
            return None
        raise
    place = _Place(straight.code, straight.origin, straight.rotation, straight.distance, counted)
    if place.tilings is not None:
        return place if place.tilings.count else None
    try:
        found = native.find_tiling(straight.code, 0, memory=_bytes(request), progress=progress)
    except native.NativeError as error:
        if error.code == "memory":
            raise _too_many(request) from error
        raise
    return None if found is None else place


def _rhombic_place(request: Request, straight: StraightOutline, progress: native.Progress | None) -> _Place | None:
    """The outline with straight sides, to be filled with the help of rhombi; None when that is not known to be possible."""
    try:
        found = native.find_tiling(straight.code, _seed(request), rhombi=True, memory=_bytes(request), progress=progress)
    except native.NativeError as error:
        if error.code in {*NOT_A_CODE, "unsettled", "memory"}:
            return None
        raise
    if found is None:
        return None
    return _Place(straight.code, straight.origin, straight.rotation, straight.distance, rhombic=True)


def _count(request: Request, code: Array, progress: native.Progress | None) -> Any:
    """All patterns of an outline, or None when there are too many for the memory."""
    try:
        return native.tilings(code, memory=_bytes(request), progress=progress)
    except native.NativeError as error:
        if error.code == "memory":
            return None
        raise


def _fit(request: Request, progress: native.Progress | None, growth: float = 0.0, **options: Any) -> _Place:
    """A place near the outline, or near the outline scaled so that no point moves by more than `growth` panels."""
    points = outline.thinned(request.points, request.panel_size)
    centre = points.mean(axis=0)
    radius = np.linalg.norm(points - centre, axis=1).max()
    points = centre + (points - centre) * (1 + growth * request.panel_size / radius)
    try:
        fit = native.fit_boundary(points, request.panel_size, progress=progress, seed=request.seed, **options)
    except native.NativeError as error:
        # What else the fit refuses was refused before.
        raise _too_small(request) from error
    return _Place(fit.code, fit.origin, fit.rotation, fit.greatest_distance + abs(growth), own=fit.tiling)


def _too_small(request: Request) -> OutlineError:
    text = "“{name}” is too small for a panel of {size:.3g}: choose smaller panels"
    return OutlineError(text, size=request.panel_size)


def _symmetric_fit(request: Request, progress: native.Progress | None) -> _Place:
    """The outline with the most symmetries among those cut, about the middle, from a symmetric tiling of the plane."""
    rotations = [request.rotation]
    if request.rotation is None:
        centred = request.points - request.points.mean(axis=0)
        _, _, directions = np.linalg.svd(centred, full_matrices=False)
        principal = math.atan2(directions[0, 1], directions[0, 0])
        # Mirror axes of the plane's tiling lie 15 degrees apart: some of these keep the outline's. All keep its rotations.
        rotations = [base + k * STEP / ROTATIONS for base in (0.0, principal) for k in range(ROTATIONS)]
    for growth in GROWTHS:
        fits = [_fit(request, progress, growth=growth, rotation=rotation, tries=1, loops=0) for rotation in rotations]
        order = [symmetry.outline_order(fit.code) for fit in fits]
        if max(order) > 1:
            return min((fit for fit, n in zip(fits, order, strict=True) if n == max(order)), key=lambda fit: fit.distance)
    raise OutlineError("No symmetric outline lies near “{name}”: draw it symmetric, or take another pattern than Symmetric")


def _most_symmetric(tilings: Any, progress: native.Progress | None) -> Any:
    """The patterns with the greatest group of symmetries that any has."""
    for group in symmetry.groups(tilings.symmetries):
        found = native.symmetric_tilings(tilings, group, progress=progress)
        if found.count:
            return found
    raise OutlineError("“{name}” has no symmetric pattern at this panel size: change the size or take another pattern")


def _layout(request: Request, place: _Place, tiling: Any, count: int | None, notes: Notes) -> Layout:
    mesh, kinds, orientations = native.tiling_mesh(tiling)
    cos, sin = math.cos(place.rotation), math.sin(place.rotation)
    turn = request.panel_size * np.array([[cos, -sin], [sin, cos]])
    positions = mesh.positions[:, :2] @ turn.T + place.origin
    # Orientations count from the first edge, whose direction differs from outline to outline.
    steps = math.floor(place.rotation / STEP + 1e-6)
    orientations = (orientations + steps) % ORIENTATIONS[kinds]
    rotation = max(place.rotation - steps * STEP, 0.0)
    return Layout(positions, mesh.face_offsets, mesh.corner_verts, kinds, orientations, rotation, count, place.distance, notes)


def forget() -> None:
    """Frees what was kept of the last outline."""
    global _last
    _last = None
