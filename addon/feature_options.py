"""Which marked edges a tool follows, declared once for all tools that do."""

from bpy.props import BoolProperty


class FeatureOptions:
    """Which marked edges a result follows: one switch for each of `features.SOURCES`, a mixin."""

    sharp: BoolProperty(name="Sharp", description="Edges marked sharp become lines of edges", default=True)
    seam: BoolProperty(name="Seams", description="UV seams become lines of edges", default=True)
    crease: BoolProperty(name="Creases", description="Edges with a crease become lines of edges", default=True)
    bevel: BoolProperty(name="Bevel Weights", description="Edges with a bevel weight become lines of edges", default=False)
    freestyle: BoolProperty(name="Freestyle", description="Edges marked for Freestyle become lines of edges", default=False)
    selected: BoolProperty(name="Selected", description="Edges selected in Edit Mode become lines of edges", default=False)
    uv_borders: BoolProperty(
        name="UV Islands", description="Borders between islands of the active UV map become lines of edges", default=False
    )
    material_borders: BoolProperty(
        name="Materials", description="Borders between materials become lines of edges", default=True
    )
