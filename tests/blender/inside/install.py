"""Runs inside a runtime: installs the zip named on the command line, as Blender's preferences would."""

import os
import sys

import bpy

done = bpy.ops.extensions.package_install_files(
    filepath=sys.argv[-1], repo="user_default", enable_on_install=False, overwrite=True
)
sys.stdout.flush()
# Not exit(): bpy 4.5 can hang at interpreter exit.
os._exit(0 if done == {"FINISHED"} else 1)
