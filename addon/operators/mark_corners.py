"""`quadloom.mark_corners`: say which vertices are corners of patches, and at what angle."""

from __future__ import annotations

from typing import ClassVar

import bmesh
import bpy
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import EnumProperty

from .. import messages, tilings


class QUADLOOM_OT_mark_corners(bpy.types.Operator):
    """Mark the selected vertices as corners of patches with this angle inside, for Tile Surface with the layout
    Patches. Corners lie on open borders and followed edges. “c_index_corner” keeps them, in units of 30 degrees"""

    bl_idname = "quadloom.mark_corners"
    bl_label = "Mark Patch Corners"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    angle: EnumProperty(
        name="Angle",
        description="Angle of the patch inside the corner, in degrees",
        items=[
            ("0", "Clear", "No corner: the angle of the surface decides", 0),
            *((str(c), f"{30 * c}°", f"A corner of {30 * c} degrees", c) for c in range(2, 11)),
        ],
        default="3",
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Grey, with the reason, unless in Edit Mode of a mesh."""
        if context.mode != "EDIT_MESH":
            cls.poll_message_set("Only in Edit Mode of a mesh: select the corners there")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Writes the attribute."""
        obj = context.edit_object
        edit = bmesh.from_edit_mesh(obj.data)
        layer = edit.verts.layers.int.get(tilings.CORNER) or edit.verts.layers.int.new(tilings.CORNER)
        chosen = [vert for vert in edit.verts if vert.select]
        if not chosen:
            self.report({"ERROR"}, translated("No vertex is selected: select the corners first"))
            return {"CANCELLED"}
        for vert in chosen:
            vert[layer] = int(self.angle)
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        text = translated("{counts} cleared") if self.angle == "0" else translated("{counts} marked as corners of {angle}°")
        self.report({"INFO"}, text.format(counts=messages.count_text({"verts": len(chosen)}), angle=30 * int(self.angle)))
        return {"FINISHED"}


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_mark_corners)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_mark_corners)
