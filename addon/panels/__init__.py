"""Panels: they name operators by their bl_idname only."""
