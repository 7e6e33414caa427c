"""`quadloom.export_panels`: the panels of the active object as tables, JSON, or drawings of them laid flat."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import StringProperty
from bpy_extras.io_utils import ExportHelper

from .. import bridge, messages, native, selection
from ..tiling_options import EXPORT_PANELS_OPTIONS, ExportPanelsOptions, export_panels_uses

# The first table goes into the file asked for, the others beside it.
TABLES = ("panels", "types", "nodes", "edges")
MILLIMETRES_A_METRE = 1000.0


class QUADLOOM_OT_export_panels(ExportPanelsOptions, bpy.types.Operator, ExportHelper):
    """Write the faces of the active object as panels: a schedule with ids, types, areas, planarity, nodes and edges, or the
    panels laid flat on sheets. Works with any mesh of triangles and quads; lengths are those of the world"""

    bl_idname = "quadloom.export_panels"
    bl_label = "Export Panels"
    bl_options: ClassVar = {"REGISTER"}

    filter_glob: StringProperty(
        name="Filter", description="Files shown", default="*.csv;*.json;*.svg;*.dxf", options={"HIDDEN", "SKIP_SAVE"}
    )

    @property
    def filename_ext(self) -> str:
        """The extension of the format chosen."""
        return f".{self.format}"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Grey, with the reason, unless a mesh is active."""
        reason = selection.why_no_surface(context)
        if reason is not None:
            cls.poll_message_set(reason)
        return reason is None

    def draw(self, context: bpy.types.Context) -> None:
        """The side of the file browser."""
        self.layout.use_property_split = True
        for name in EXPORT_PANELS_OPTIONS:
            row = self.layout.row()
            row.enabled = export_panels_uses(self, name)
            row.prop(self, name)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Measures the object in the world and writes the files."""
        obj = context.active_object
        depsgraph = context.evaluated_depsgraph_get()
        mesh = bridge.read(obj, depsgraph)
        to_world = bridge.world_matrix(obj, depsgraph)
        if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-30:
            self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
            return {"CANCELLED"}
        try:
            schedule = native.panel_schedule(
                mesh.transformed(to_world), progress=None, tolerance=self.type_tolerance or None, mirror=self.mirror
            )
            files = self._files(schedule, context.scene.unit_settings.scale_length)
        except native.NativeError as error:
            text = messages.sentence(error, (obj.name,))
            where = messages.select_elements(context, error, [obj], [mesh])
            self.report({"ERROR"}, text + (f" ({where})" if where else ""))
            return {"CANCELLED"}
        try:
            for path, text in files.items():
                path.write_text(text, encoding="utf-8", newline="")
        except OSError as error:
            self.report({"ERROR"}, translated("Cannot write: {cause}").format(cause=error))
            return {"CANCELLED"}
        text = translated("{panels:,} panels of {types:,} types written to {files}")
        names = ", ".join(path.name for path in files)
        self.report({"INFO"}, text.format(panels=len(schedule), types=len(schedule.type_names), files=names))
        return {"FINISHED"}

    def _files(self, schedule: Any, scale_length: float) -> dict[Path, str]:
        """What to write where."""
        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), self.filename_ext))
        if self.format == "json":
            return {path: schedule.to_json()}
        if self.format == "csv":
            first, *others = TABLES
            beside = {path.with_name(f"{path.stem}_{table}{path.suffix}"): schedule.to_csv(table) for table in others}
            return {path: schedule.to_csv(first), **beside}
        sheet = tuple(self.sheet) if all(self.sheet) else None
        millimetres = MILLIMETRES_A_METRE * scale_length
        drawing = native.unrolled(
            schedule, self.format, sheet=sheet, gap=self.gap, millimetres=millimetres, labels=self.labels
        )  # fmt: skip
        return {path: drawing}


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_export_panels)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_export_panels)
