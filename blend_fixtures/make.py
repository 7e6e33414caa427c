"""Makes the .blend files of this folder from the shipped meshes. Run it inside bpy 4.2, the oldest supported, so that every
supported Blender opens them:

    python tools/blenders.py bpy-4.2    # says where it is; then: PATH/bin/python blend_fixtures/make.py
"""

import os
import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent


def load(name: str, color: tuple[float, float, float, float], material: str) -> bpy.types.Object:
    """A shipped mesh with one material, a planar UV map and a vertex group that rises with y."""
    before = set(bpy.data.objects)
    bpy.ops.wm.obj_import(filepath=str(HERE / "meshes" / f"{name.lower()}_quad.obj"), forward_axis="Y", up_axis="Z")
    (obj,) = set(bpy.data.objects) - before
    obj.name = obj.data.name = name
    obj.data.materials.clear()
    obj.data.materials.append(bpy.data.materials.new(material))
    obj.data.materials[0].diffuse_color = color
    positions = np.array([v.co for v in obj.data.vertices])
    layer = obj.data.uv_layers.new(name="Planar")
    for corner, loop in enumerate(obj.data.loops):
        layer.data[corner].uv = positions[loop.vertex_index, :2]
    group = obj.vertex_groups.new(name="Height")
    weights = (positions[:, 1] - positions[:, 1].min()) / np.ptp(positions[:, 1])
    for vertex, weight in enumerate(weights):
        group.add([vertex], float(weight), "REPLACE")
    return obj


bpy.ops.wm.read_factory_settings(use_empty=True)
load("Spot", (0.9, 0.62, 0.36, 1.0), "Hide")
blub = load("Blub", (0.4, 0.6, 0.85, 1.0), "Scales")
# Mirrored, so that a result with turned faces is noticed.
blub.scale = (-0.6, 0.6, 0.6)
blub.location, blub.rotation_euler = (0.12, 0.03, -0.1), (0.0, 1.36, 0.0)
bpy.ops.wm.save_as_mainfile(filepath=str(HERE / "spot_and_blub.blend"), compress=True)
sys.stdout.flush()
os._exit(0)
