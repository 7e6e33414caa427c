"""The outline that a tiling fills: one closed plane loop, found among a mesh's or a wire's edges. Touches no bpy.

Each fault has its own sentence, with a remedy and the vertices to look at. An outline whose angles are multiples of 30 degrees
can keep straight sides, with whole panels along each: then it is a boundary code (Peng et al. 2018, 3.1) already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .attributes import Array, edge_indices

# How far from their plane points may lie, as a fraction of the outline's size: drawn outlines are rarely exact.
PLANAR_TOLERANCE = 1e-3
# A plane this near to one of the object's own (radians) is that plane: the result gets round angles.
SNAP_ANGLE = 1e-5
# How well a side fits whole panels, in panels, and an angle 30 degrees, in radians, to be read exactly.
EXACT_TOLERANCE = 2e-3
# Points nearer together than this, in panels, are one to the fit, whose outline strays by half a panel anyway.
THIN_DISTANCE = 0.05
# How far the corners of a straight outline may move, in panels, and how many sides may be rounded either way.
MOST_DISTANCE = 1.0
MOST_FREE_SIDES = 12
# Directions of edges are multiples of this.
STEP = np.pi / 6
# The unit vectors in those directions, in the basis 1, z, z^2, z^3 of z = exp(i STEP); z^4 = z^2 - 1.
_HALF = np.array([(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (-1, 0, 1, 0), (0, -1, 0, 1)])
UNITS = np.concatenate([_HALF, -_HALF])


class OutlineError(Exception):
    """Why an object is no outline: a sentence to translate, with values to put in, and the vertices concerned."""

    def __init__(self, sentence: str, verts: Sequence[int] | Array = (), **values: Any) -> None:
        super().__init__(sentence.format(name="the object", **values))
        self.sentence = sentence
        self.values = values
        self.verts = np.asarray(verts, np.int64)


@dataclass(frozen=True)
class Plane:
    """A frame in the world: its third axis is the plane's normal."""

    origin: Array
    axes: Array
    """(3,3): one unit axis a column."""

    @property
    def matrix(self) -> Array:
        """(4,4): the frame's space to the world."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.axes, self.origin
        return matrix


@dataclass(frozen=True)
class StraightOutline:
    """An outline of whole panels: see `straight_outline`."""

    code: Array
    """(N,) interior angles in units of 30 degrees, counter-clockwise."""
    origin: tuple[float, float]
    rotation: float
    """Direction of the first edge, radians."""
    distance: float
    """Greatest distance of its corners from those drawn, in panels; 0 when they agree."""


def closed_loop(positions: Array, edges: Array, face_offsets: Array, corner_verts: Array) -> Array:
    """(N,) the vertices round the border of the faces, or round the edges where there are no faces."""
    odd = ~np.isfinite(positions).all(axis=1)
    if odd.any():
        raise OutlineError("“{name}” has points whose position is not a number: delete them", np.flatnonzero(odd))
    if len(edges) == 0:
        raise OutlineError("“{name}” is empty: draw a closed outline first")
    border = edges
    if len(corner_verts):
        following = np.arange(len(corner_verts)) + 1
        following[face_offsets[1:] - 1] = face_offsets[:-1]
        at = edge_indices(edges, np.stack([corner_verts, corner_verts[following]], axis=1))
        faces = np.bincount(at, minlength=len(edges))
        if (faces == 0).any():
            raise OutlineError("“{name}” has edges without a face: delete them, or all faces", edges[faces == 0].ravel())
        if (faces > 2).any():
            raise OutlineError("“{name}” has edges with more than two faces: delete faces there", edges[faces > 2].ravel())
        border = edges[faces == 1]
        if len(border) == 0:
            raise OutlineError("“{name}” is closed all round and has no border: delete all but one flat side")
    valence = np.bincount(border.ravel(), minlength=len(positions))
    if (valence == 1).any():
        text = "“{name}” is open: close it (in Edit Mode, Alt C on a curve, F between the ends of a mesh)"
        raise OutlineError(text, np.flatnonzero(valence == 1))
    if (valence > 2).any():
        raise OutlineError("“{name}” touches itself or branches: keep one plain loop", np.flatnonzero(valence > 2))
    loops = _walk(border)
    if len(loops) > 1:
        longest = max(loops, key=lambda loop: np.ptp(positions[loop], axis=0).max())
        text = (
            "“{name}” has {count} loops, and holes are not supported: keep one loop, separate them (P in Edit Mode) and "
            "tile each, or use Tile Surface, which takes a mesh with holes"
        )
        others = np.concatenate([loop for loop in loops if loop is not longest])
        raise OutlineError(text, others, count=len(loops))
    return loops[0]


def _walk(edges: Array) -> list[Array]:
    """The loops of edges of which two meet at each vertex."""
    neighbours: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    loops, seen = [], set()
    for start in neighbours:
        if start in seen:
            continue
        loop, before, at = [start], start, neighbours[start][0]
        while at != start:
            loop.append(at)
            one, other = neighbours[at]
            before, at = at, one if other == before else other
        seen.update(loop)
        loops.append(np.array(loop))
    return loops


def flatten(points: Array, to_world: Array, verts: Array) -> tuple[Plane, Array]:
    """The plane of world points, whose names are `verts`, and the points in it, (N,2).

    The plane's origin lies below the object's own, and its axes run along the object's as far as they can."""
    centre = points.mean(axis=0)
    _, spread, directions = np.linalg.svd(points - centre, full_matrices=False)
    size = np.ptp(points, axis=0).max()
    if size == 0 or spread[1] <= 1e-6 * spread[0]:
        raise OutlineError("“{name}” encloses nothing: all of it lies on a line", verts)
    axes = to_world[:3, :3] / np.linalg.norm(to_world[:3, :3], axis=0)
    normal = directions[2]
    along = axes.T @ normal
    nearest = int(np.argmax(np.abs(along)))
    normal = normal * np.sign(along[nearest])
    if np.linalg.norm(np.cross(normal, axes[:, nearest])) < SNAP_ANGLE:
        normal = axes[:, nearest]
    off = np.abs((points - centre) @ normal)
    if off.max() > PLANAR_TOLERANCE * size:
        text = "“{name}” is not flat: points lie up to {distance:.3g} off its plane. Flatten it, e.g. with S Z 0 in Edit Mode"
        raise OutlineError(text, verts[off > PLANAR_TOLERANCE * size], distance=off.max())
    first = axes[:, (nearest + 1) % 3]
    first = first - normal * (first @ normal)
    first /= np.linalg.norm(first)
    frame = np.stack([first, np.cross(normal, first), normal], axis=1)
    origin = to_world[:3, 3]
    origin = origin - normal * ((origin - centre) @ normal)
    return Plane(origin, frame), (points - origin) @ frame[:, :2]


def check_simple(points: Array, verts: Array) -> None:
    """Raises for a closed polygon, with corners named `verts`, that crosses or touches itself."""
    following = np.roll(points, -1, axis=0)
    low, high = np.minimum(points, following), np.maximum(points, following)
    # Pairs of segments whose extents along x overlap: few, but for outlines of many vertical lines.
    order = np.argsort(low[:, 0], kind="stable")
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    counts = np.maximum(ends - np.arange(len(order)) - 1, 0)
    starts = np.repeat(np.arange(len(order)), counts)
    offset = np.arange(len(starts)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
    i, j = order[starts], order[starts + offset]
    near = (low[i, 1] <= high[j, 1]) & (low[j, 1] <= high[i, 1])
    i, j = i[near], j[near]
    gap = (j - i) % len(points)
    next_to = (gap == 1) | (gap == len(points) - 1)

    def side(k: Array, point: Array) -> Array:
        return np.sign(_cross(following[k] - points[k], point - points[k]))

    apart = (side(i, points[j]) * side(i, following[j]) > 0) | (side(j, points[i]) * side(j, following[i]) > 0)
    # Neighbours share a point. They overlap when the second runs back along the first.
    first = np.where(gap == 1, i, j)
    step, next_step = following[first] - points[first], following[(first + 1) % len(points)] - following[first]
    back = (_cross(step, next_step) == 0) & ((step * next_step).sum(axis=1) < 0)
    crossing = np.where(next_to, back, ~apart)
    if crossing.any():
        segments = np.concatenate([i[crossing], j[crossing]])
        at = np.unique([segments, (segments + 1) % len(points)])
        raise OutlineError("“{name}” crosses or touches itself: move the points apart there", verts[at])


def _cross(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def merged(points: Array) -> Array:
    """(N,) bool: the points to keep so that none lies on the one before."""
    return np.any(points != np.roll(points, 1, axis=0), axis=1)


def area(points: Array) -> float:
    """Area inside a polygon; negative when it runs clockwise."""
    return float(_cross(points, np.roll(points, -1, axis=0)).sum()) / 2


def perimeter(points: Array) -> float:
    """Length of a closed polygon."""
    return float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())


def straight_outline(points: Array, panel_size: float, rotation: float | None) -> StraightOutline | None:
    """The outline with whole panels along each side, when its angles are multiples of 30 degrees and its sides lie at the
    rotation asked for, if any; None when no lengths near the drawn ones close."""
    if area(points) < 0:
        points = points[::-1]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = np.arctan2(_cross(before, after), (before * after).sum(axis=1))
    corner = np.abs(turn) > EXACT_TOLERANCE
    points, turn = points[corner], turn[corner]
    if len(points) < 3:
        return None
    side = np.roll(points, -1, axis=0) - points
    first = float(np.arctan2(side[0, 1], side[0, 0]))
    turns = np.rint(turn / STEP).astype(int)
    off_rotation = 0.0 if rotation is None else (first - rotation) / STEP
    if np.abs(turn - turns * STEP).max() > EXACT_TOLERANCE or abs(off_rotation - round(off_rotation)) > EXACT_TOLERANCE:
        return None
    directions = np.cumsum(np.append(0, turns[1:])) % 12
    counts = _closing_counts(np.linalg.norm(side, axis=1) / panel_size, directions)
    if counts is None or turns.sum() != 12:
        return None
    angle = first + directions * STEP
    steps = panel_size * counts[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    corners = np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
    corners += points.mean(axis=0) - corners.mean(axis=0)
    distance = float(np.linalg.norm(corners - points, axis=1).max() / panel_size)
    if distance > MOST_DISTANCE:
        return None
    code = np.concatenate([[6 - turn, *[6] * (count - 1)] for turn, count in zip(turns, counts, strict=True)])
    is_exact = distance < EXACT_TOLERANCE
    origin = points[0] if is_exact else corners[0]
    return StraightOutline(code.astype(np.int32), tuple(origin.tolist()), first, 0.0 if is_exact else distance)


def _closing_counts(panels: Array, directions: Array) -> Array | None:
    """The whole numbers next to these lengths for which sides in these directions close, exactly; the nearest ones."""
    low = np.maximum(np.floor(panels + EXACT_TOLERANCE), 1).astype(int)
    high = np.maximum(np.ceil(panels - EXACT_TOLERANCE), 1).astype(int)
    free = np.flatnonzero(high > low)
    if len(free) > MOST_FREE_SIDES:
        return None
    choices = np.arange(1 << len(free))[:, None] >> np.arange(len(free)) & 1
    counts = np.repeat(low[None], len(choices), axis=0)
    counts[:, free] += choices
    closing = counts[(counts @ UNITS[directions] == 0).all(axis=1)]
    if len(closing) == 0:
        return None
    return closing[np.argmin(((closing - panels) ** 2).sum(axis=1))]


def thinned(points: Array, panel_size: float) -> Array:
    """The outline with points dropped that lie close to the one kept before: the fit takes time for each."""
    kept = [points[0]]
    for point in points[1:]:
        if np.abs(point - kept[-1]).max() > THIN_DISTANCE * panel_size:
            kept.append(point)
    return np.array(kept)
