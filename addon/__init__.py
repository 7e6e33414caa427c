"""Quadloom: booleans of quad meshes that stay quad meshes, retopology along marked edges, and outlines and surfaces in
triangles and squares.

Layers: operators -> jobs, bridge, native and what lies between; panels name operators by their bl_idname only; native.py
alone imports the wheel. What touches bpy runs on the main thread. attributes.py, features.py, layouts.py, outline.py,
patch_graphs.py, patterns.py, symmetry.py, tilings.py and native.py touch no bpy: they run on a job's thread too.
"""

from . import command, jobs, properties
from .operators import (
    boolean,
    design_patches,
    edit_patches,
    export_panels,
    mark_corners,
    retopologize,
    select_defects,
    tile_curve,
    tile_polyhedron,
    tile_surface,
)
from .panels import main
from .panels import retopologize as retopologize_panel
from .panels import tile_curve as tile_curve_panel
from .panels import tile_surface as tile_surface_panel

modules = (
    properties,
    jobs,
    boolean,
    retopologize,
    select_defects,
    tile_curve,
    tile_surface,
    design_patches,
    edit_patches,
    mark_corners,
    tile_polyhedron,
    export_panels,
    main,
    retopologize_panel,
    tile_curve_panel,
    tile_surface_panel,
    command,
)


def register() -> None:
    """Registers every module, in order."""
    for module in modules:
        module.register()


def unregister() -> None:
    """Unregisters every module, in reverse order."""
    for module in reversed(modules):
        module.unregister()
