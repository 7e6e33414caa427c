"""What all panels draw alike: sentences that wrap, and the button of a tool."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from typing import Any

import bpy

# Width of a letter of the interface font at the default scale.
PIXELS_A_LETTER = 8


def sentences(context: bpy.types.Context, layout: bpy.types.UILayout, texts: Iterable[str], *, icon: str = "NONE") -> None:
    """Sentences one below another, wrapped to the width of the sidebar: labels do not wrap by themselves. The icon stands
    before the first line."""
    column = layout.column(align=True)
    for text in texts:
        for line in textwrap.wrap(text, max(context.region.width // PIXELS_A_LETTER, 20)):
            column.label(text=line, icon=icon)
            icon = "NONE" if icon == "NONE" else "BLANK1"


def button(layout: bpy.types.UILayout, operator: str, settings: Any, options: Iterable[str], *, icon: str) -> None:
    """The button that runs a tool with the panel's settings; `INVOKE` gives the progress bar and Esc."""
    row = layout.row()
    row.scale_y = 1.4
    row.operator_context = "INVOKE_DEFAULT"
    made = row.operator(operator, icon=icon)
    for name in options:
        setattr(made, name, getattr(settings, name))
