"""Materials that show what panels are like: their kind, type, planarity or area."""

from __future__ import annotations

import colorsys

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated

from .attributes import Array

Color = tuple[float, float, float, float]
Palette = tuple[list[tuple[str, Color]], Array]
"""Names and colours of materials, and (F,) which of them each panel has."""

# Of each kind of panel, by its number.
KINDS: tuple[tuple[str, Color], ...] = (
    ("Triangle Panels", (0.80, 0.42, 0.16, 1.0)),
    ("Square Panels", (0.16, 0.36, 0.58, 1.0)),
    ("Rhombus Panels", (0.54, 0.03, 0.21, 1.0)),
)
# More types than this would be more colours than can be told apart.
MOST_TYPES = 24
OTHER_COLOR: Color = (0.35, 0.35, 0.35, 1.0)
# Glass bends by about a hundredth of its width without being made to; a thousandth nobody sees.
PLANARITIES = (0.001, 0.0025, 0.005, 0.01, 0.02)
AREA_BANDS = 8
GOLDEN = 0.618_033_988_749_895


def by_type(types: Array, names: list[str], counts: Array) -> Palette:
    """A colour for each of the types with most panels; the others share one."""
    frequent = np.argsort(-counts, kind="stable")[:MOST_TYPES]
    place = np.full(len(names), len(frequent))
    place[frequent] = np.arange(len(frequent))
    # Hues a golden section apart differ much from one to the next.
    palette = [
        (f"Panel Type {names[kind]}", (*colorsys.hsv_to_rgb(0.05 + GOLDEN * k % 1, 0.75, 0.7), 1.0))
        for k, kind in enumerate(frequent.tolist())
    ]
    if len(names) > len(frequent):
        palette.append(("Other Panel Types", OTHER_COLOR))
    return palette, place[types]


def by_planarity(planarity: Array) -> Palette:
    """Blue for flat panels, by way of green and yellow to red for bent ones."""
    names = [translated("Planarity Below {limit:.2%}").format(limit=limit) for limit in PLANARITIES]
    names.append(translated("Planarity From {limit:.2%}").format(limit=PLANARITIES[-1]))
    return list(zip(names, _ramp(len(names)), strict=True)), np.searchsorted(PLANARITIES, planarity, side="right")


def by_area(area: Array) -> Palette:
    """Blue for the smallest panels to red for the largest."""
    low, high = float(area.min()), float(area.max())
    band = np.zeros(len(area), int)
    if high > low:
        band = np.minimum((AREA_BANDS * (area - low) / (high - low)).astype(int), AREA_BANDS - 1)
    names = [translated("Panel Area {band} of {count}").format(band=k + 1, count=AREA_BANDS) for k in range(AREA_BANDS)]
    return list(zip(names, _ramp(AREA_BANDS), strict=True)), band


def named(name: str, color: Color) -> bpy.types.Material:
    """The material of that name: what the artist made of it stays."""
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        material.diffuse_color = color
        if material.node_tree is None:  # before Blender 5
            material.use_nodes = True
        for node in material.node_tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                node.inputs["Base Color"].default_value = color
    return material


def _ramp(count: int) -> list[Color]:
    """Blue to red."""
    return [(*colorsys.hsv_to_rgb(0.62 * (1 - k / (count - 1)), 0.8, 0.75), 1.0) for k in range(count)]
