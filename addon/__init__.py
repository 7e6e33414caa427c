"""Quadloom: booleans of quad meshes that stay quad meshes.

Layers: operators -> jobs, bridge, attributes, native; panels name operators by their bl_idname only; native.py alone imports
the wheel. What touches bpy runs on the main thread; attributes.py and native.py touch no bpy and run on a job's thread.
"""

from . import command, jobs, properties
from .operators import boolean, select_defects
from .panels import main

modules = (properties, jobs, boolean, select_defects, main, command)


def register() -> None:
    """Registers every module, in order."""
    for module in modules:
        module.register()


def unregister() -> None:
    """Unregisters every module, in reverse order."""
    for module in reversed(modules):
        module.unregister()
