"""Errors for the artist: a sentence that names the objects, and the elements to mend, selected."""

from __future__ import annotations

import re
from collections.abc import Sequence

import bpy
from bpy.app.translations import pgettext_rpt as translated

from . import bridge
from .attributes import Snapshot
from .native import NativeError
from .patch_graphs import Drawn


def sentence(error: NativeError, names: Sequence[str]) -> str:
    """The wheel's sentence, which calls the operands A and B and a single one "the mesh", with the objects' names in their
    places."""
    text = translated(str(error))
    if len(names) == 1:
        text = re.sub(r"^the mesh\b", f"“{names[0]}”", text)
    else:
        text = re.sub(r"\b[AB]\b", lambda found: f"“{names['AB'.index(found[0])]}”", text)
    return text[:1].upper() + text[1:]


def select_elements(
    context: bpy.types.Context,
    error: NativeError,
    objects: Sequence[bpy.types.Object],
    snapshots: Sequence[Snapshot],
) -> str:
    """Selects what the error is about on the objects, makes the first of them active, and says what was selected."""
    said = []
    for obj, snapshot, elements in zip(objects, snapshots, error.elements, strict=False):
        if not any(len(index) for index in elements.values()):
            continue
        if not said:
            context.view_layer.objects.active = obj
        if not bridge.can_select(obj, snapshot):
            text = translated("“{name}” has modifiers that change its topology: apply them to see where")
            said.append(text.format(name=obj.name))
            continue
        counts = bridge.select(context, obj, elements)
        said.append(translated("selected on “{name}”: {counts}").format(name=obj.name, counts=count_text(counts)))
    return "; ".join(said)


def shown(context: bpy.types.Context, error: NativeError, name: str, snapshot: Snapshot) -> str:
    """The sentence about the object of this name, with the elements selected on it while it is still there."""
    text = sentence(error, (name,))
    obj = bpy.data.objects.get(name)
    where = select_elements(context, error, [obj], [snapshot]) if obj is not None else ""
    return f"{text} ({where})" if where else text


def shown_on_graph(context: bpy.types.Context, error: NativeError, patches: bpy.types.Object, drawn: Drawn) -> str:
    """The sentence about a patch graph, with nodes and sides selected on its object."""
    text = sentence(error, (patches.name,))
    snapshot = bridge.read_base(patches)
    elements = drawn.elements(error.graph, snapshot.edges)
    context.view_layer.objects.active = patches
    if len(drawn.side_of_edge) != len(snapshot.edges):
        where = translated("“{name}” has modifiers that change its topology: apply them to see where").format(name=patches.name)
    else:
        counts = count_text(bridge.select(context, patches, elements))
        where = translated("selected on “{name}”: {counts}").format(name=patches.name, counts=counts)
    return f"{text} ({where})"


def count_text(counts: dict[str, int]) -> str:
    """For example "3 vertices, 1 edge", without the zeros."""
    one = {"verts": "vertex", "edges": "edge", "faces": "face"}
    many = {"verts": "vertices", "edges": "edges", "faces": "faces"}
    parts = [f"{n:,} {translated(one[kind] if n == 1 else many[kind])}" for kind, n in counts.items() if n]
    return ", ".join(parts)
