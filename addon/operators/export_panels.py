"""`quadloom.export_panels`: the panels of the active object as tables, JSON, or drawings of them laid flat."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import bpy
import numpy as np
from bpy.app.translations import pgettext_rpt as translated
from bpy.props import BoolProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from .. import bridge, messages, native, selection
from ..attributes import Snapshot
from ..jobs import JobOperator
from ..tiling_options import EXPORT_PANELS_OPTIONS, ExportPanelsOptions, export_panels_uses

# The first table goes into the file asked for, the others beside it.
TABLES = ("panels", "types", "nodes", "edges")
MILLIMETRES_A_METRE = 1000.0


@dataclass(frozen=True)
class Task:
    """What one run writes, read from Blender before it starts."""

    name: str
    own: Snapshot
    """The object's mesh in its own space, for errors."""
    mesh: Snapshot
    """In the world."""
    path: Path
    format: str
    types: dict[str, Any]
    drawing: dict[str, Any]

    def run(self, progress: native.Progress | None) -> Outcome:
        """The schedule as files. Writes none of them and touches no bpy."""
        schedule = native.panel_schedule(self.mesh, progress=progress, **self.types)
        return Outcome(self._files(schedule, progress), len(schedule), len(schedule.type_names))

    def _files(self, schedule: Any, progress: native.Progress | None) -> dict[Path, str]:
        path = self.path
        if self.format == "json":
            return {path: schedule.to_json()}
        if self.format == "csv":
            first, *others = TABLES
            beside = {path.with_name(f"{path.stem}_{table}{path.suffix}"): schedule.to_csv(table) for table in others}
            return {path: schedule.to_csv(first), **beside}
        return {path: native.unrolled(schedule, self.format, progress=progress, **self.drawing)}


@dataclass(frozen=True)
class Outcome:
    """What a run made."""

    files: dict[Path, str]
    panels: int
    types: int


class QUADLOOM_OT_export_panels(ExportPanelsOptions, JobOperator, bpy.types.Operator, ExportHelper):
    """Write the faces of the active object as panels: a schedule with ids, types, areas, planarity, nodes and edges, or the
    panels laid flat on sheets. Works with any mesh of triangles and quads; lengths are those of the world"""

    bl_idname = "quadloom.export_panels"
    bl_label = "Export Panels"
    bl_options: ClassVar = {"REGISTER"}
    why_not: ClassVar = staticmethod(selection.why_no_surface)

    filter_glob: StringProperty(
        name="Filter", description="Files shown", default="*.csv;*.json;*.svg;*.dxf", options={"HIDDEN", "SKIP_SAVE"}
    )
    in_browser: BoolProperty(
        name="From the File Browser",
        description="Whether the path is from there",
        options={"HIDDEN", "SKIP_SAVE"},
        default=False,
    )

    @property
    def filename_ext(self) -> str:
        """The extension of the format chosen."""
        return f".{self.format}"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks for the file; then `execute` runs on a worker thread with a progress bar and Esc."""
        self.in_browser = True
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Measures the object in the world and writes the files."""
        if self.in_browser and not bpy.app.background:
            return self.start(context, self._task.run) if self._prepare(context) else {"CANCELLED"}
        return JobOperator.execute(self, context)

    def draw(self, context: bpy.types.Context) -> None:
        """The side of the file browser."""
        self.layout.use_property_split = True
        for name in EXPORT_PANELS_OPTIONS:
            row = self.layout.row()
            row.enabled = export_panels_uses(self, name)
            row.prop(self, name)

    def finish(self, context: bpy.types.Context, outcome: Outcome) -> set[str]:
        """Writes the files."""
        try:
            for path, text in outcome.files.items():
                path.write_text(text, encoding="utf-8", newline="")
        except OSError as error:
            self.report({"ERROR"}, translated("Cannot write: {cause}").format(cause=error))
            return {"CANCELLED"}
        text = translated("{panels:,} panels of {types:,} types written to {files}")
        names = ", ".join(path.name for path in outcome.files)
        self.report({"INFO"}, text.format(panels=outcome.panels, types=outcome.types, files=names))
        return {"FINISHED"}

    def fail(self, context: bpy.types.Context, error: Exception) -> set[str]:
        """Says what is wrong and selects it. What is not the wheel's error is a bug and is raised."""
        if not isinstance(error, native.NativeError):
            raise error
        self.report({"ERROR"}, messages.shown(context, error, self._task.name, self._task.own))
        return {"CANCELLED"}

    def _prepare(self, context: bpy.types.Context) -> bool:
        """Reads the object into a task; reports and returns False when it cannot be worked on."""
        obj = context.active_object
        depsgraph = context.evaluated_depsgraph_get()
        mesh = bridge.read(obj, depsgraph)
        to_world = bridge.world_matrix(obj, depsgraph)
        if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-30:
            self.report({"ERROR"}, translated("“{name}” has a scale of zero: scale it up first").format(name=obj.name))
            return False
        path = Path(bpy.path.ensure_ext(bpy.path.abspath(self.filepath), self.filename_ext))
        types = {"tolerance": self.type_tolerance or None, "mirror": self.mirror}
        drawing = {
            "sheet": tuple(self.sheet) if all(self.sheet) else None,
            "gap": self.gap,
            "millimetres": MILLIMETRES_A_METRE * context.scene.unit_settings.scale_length,
            "labels": self.labels,
        }
        self._task = Task(obj.name, mesh, mesh.transformed(to_world), path, self.format, types, drawing)
        return True


def register() -> None:
    """Adds the operator."""
    bpy.utils.register_class(QUADLOOM_OT_export_panels)


def unregister() -> None:
    """Removes the operator."""
    bpy.utils.unregister_class(QUADLOOM_OT_export_panels)
