"""`quadloom.select_defects`: select what is wrong with the mesh in Edit Mode, and say how much of it there is."""

from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import BoolProperty, EnumProperty

from .. import bridge, messages, native
from ..attributes import Array

# (identifier: the list of `quadloom.check`, name, description, kind of element)
DEFECTS = (
    ("border_edges", "Open Borders", "Edges of one face only", "edges"),
    ("nonmanifold_edges", "Non-Manifold Edges", "Edges of three faces or more", "edges"),
    ("nonmanifold_verts", "Non-Manifold Vertices", "Vertices where surfaces touch in one point", "verts"),
    ("misoriented_edges", "Flipped Neighbors", "Edges whose two faces point to opposite sides", "edges"),
    ("inside_out_components", "Inside Out", "Closed parts that face inwards, or outwards inside another part", "faces"),
    ("self_intersecting_faces", "Self-Intersections", "Faces that cut through other faces", "faces"),
    ("degenerate_faces", "Degenerate Faces", "Faces that use a vertex twice", "faces"),
    ("zero_area_faces", "Zero-Area Faces", "Faces whose corners lie on one line", "faces"),
    ("duplicate_faces", "Duplicate Faces", "Faces on top of one another", "faces"),
    ("duplicate_verts", "Duplicate Vertices", "Vertices at one position", "verts"),
    ("isolated_verts", "Loose Vertices", "Vertices without a face", "verts"),
    ("nonfinite_verts", "Invalid Positions", "Vertices whose position is not a number", "verts"),
    ("triangles", "Triangles", "Faces with three corners", "faces"),
    ("ngons", "N-gons", "Faces with more than four corners", "faces"),
)


class QUADLOOM_OT_select_defects(bpy.types.Operator):
    """Select what keeps this mesh from a quad boolean: open borders, non-manifold parts, self-intersections, faces that are
    not quads"""

    bl_idname = "quadloom.select_defects"
    bl_label = "Select Defects"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    kinds: EnumProperty(
        name="Kinds",
        description="Which defects to select",
        items=[(name, label, text, 1 << bit) for bit, (name, label, text, _) in enumerate(DEFECTS)],
        options={"ENUM_FLAG"},
        default={name for name, *_ in DEFECTS},
    )
    extend: BoolProperty(name="Extend", description="Keep what is selected already", default=False)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Grey, with the reason, outside Edit Mode."""
        reason = native.problem
        if reason is None and context.mode != "EDIT_MESH":
            reason = translated("Only in Edit Mode of a mesh")
        if reason is not None:
            cls.poll_message_set(reason)
        return reason is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Checks the mesh, selects, and reports a count a kind."""
        obj = context.edit_object
        defects = native.check(bridge.read_base(obj))
        chosen: dict[str, list[Array]] = {"verts": [], "edges": [], "faces": []}
        said = []
        for name, label, _, element in DEFECTS:
            found = _indices(getattr(defects, name), element) if name in self.kinds else []
            if len(found):
                chosen[element].append(found)
                said.append(f"{pgettext_iface(label)} {len(found):,}")
        elements = {kind: np.concatenate(lists) for kind, lists in chosen.items() if lists}
        counts = bridge.select(context, obj, elements, extend=self.extend)
        if said:
            text = translated("{defects}; selected: {counts}")
            self.report({"WARNING"}, text.format(defects=", ".join(said), counts=messages.count_text(counts)))
        else:
            self.report({"INFO"}, translated("No defects found"))
        return {"FINISHED"}


def _indices(listed: Any, element: str) -> Array:
    """One array from what `quadloom.check` lists: single indices, pairs of faces or vertices, or one array a component."""
    if isinstance(listed, (list, tuple)):
        listed = np.concatenate([np.empty(0, np.int32), *map(np.asarray, listed)])
    return np.asarray(listed) if element == "edges" else np.unique(listed)


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_select_defects)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_select_defects)
