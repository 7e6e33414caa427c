"""The options of the boolean and of retopology, declared once: each operator and the panel's settings both inherit them; and
where those settings are kept, the tilings' (tiling_options.py) among them."""

import math
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import native
from .feature_options import FeatureOptions
from .tiling_options import TileCurveOptions, TileSurfaceOptions

OPERATION_SIGNS = {"union": "\N{UNION}", "difference": "\N{MINUS SIGN}", "intersection": "\N{INTERSECTION}"}


class BooleanOptions:
    """Options of `quadloom.boolean`, a mixin."""

    operation: EnumProperty(
        name="Operation",
        description="What to make of the active object and the other selected one",
        items=[
            ("union", "Union", "Everything inside either object", "SELECT_EXTEND", 0),
            ("difference", "Difference", "The active object minus the other", "SELECT_SUBTRACT", 1),
            ("intersection", "Intersection", "What is inside both objects", "SELECT_INTERSECT", 2),
        ],
        default="union",
    )
    retraction_distance: FloatProperty(
        name="Retraction",
        description="How far from the intersection curve quads are replaced, in edge lengths. More room gives smoother flow "
        "and keeps fewer quads",
        default=1.0,
        min=0.0,
        max=10.0,
        soft_max=4.0,
    )
    alpha: FloatProperty(
        name="Regularity",
        description="0 keeps edge lengths even, 1 keeps irregular vertices few",
        default=0.5,
        min=0.01,
        max=0.99,
        subtype="FACTOR",
    )
    blend_radius: FloatProperty(
        name="Smoothing",
        description="Rounds the seam within this distance of the intersection curve. 0 keeps it sharp and moves no vertex "
        "that is kept",
        default=0.0,
        min=0.0,
        soft_max=1.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    layout: EnumProperty(
        name="Layout",
        description="How the quads of the operands are grouped into patches",
        items=[
            ("motorcycle", "Motorcycle Graph", "Separatrices stop where they meet: fewer, larger patches"),
            ("separatrices", "Full Separatrices", "Separatrices run to their end: finer patches, cleaner borders"),
        ],
        default="motorcycle",
    )
    filler: EnumProperty(
        name="Filler",
        description="How the gap along the seam is filled with quads",
        items=[
            ("auto", "Best of All", "Every filler is tried and the best result is taken"),
            ("patches", "Patches", "Patches that follow a cross field, as in the QuadMixer paper"),
            ("rings", "Rings", "Rings of quads along the curve"),
            ("matching", "Matching", "Triangles paired into quads: fits everywhere, least regular"),
        ],
        default="auto",
    )
    sharp_angle: FloatProperty(
        name="Sharp Angle",
        description="Edges sharper than this stay edges of the result, as do those marked sharp, seam or creased",
        default=math.radians(35.0),
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    mark_curve: BoolProperty(
        name="Mark Seam Sharp",
        description="Mark the intersection curve as sharp edges, so that it stays crisp with smooth shading. Has no effect "
        "when Smoothing rounds the seam",
        default=True,
    )
    hide_inputs: BoolProperty(
        name="Hide Inputs",
        description="Hide the two objects in the viewport and in renders. They are never altered",
        default=True,
    )


BOOLEAN_OPTIONS = tuple(BooleanOptions.__annotations__)


def _template_names(options: bpy.types.AnyType, context: bpy.types.Context, text: str) -> list[str]:
    """The templates there are to choose from, for the search in the field."""
    try:
        file = bpy.path.abspath(options.template_file)
        return native.template_names(Path(file).read_text() if file else None)
    except (OSError, ValueError, KeyError, TypeError):
        # The operator says what is wrong with the file.
        return native.template_names(None)


class RetopologizeOptions(FeatureOptions):
    """Options of `quadloom.retopologize`, a mixin."""

    detect: BoolProperty(
        name="Detect Sharp Edges",
        description="Edges that bend sharply become edge loops as well, without being marked",
        default=True,
    )
    detect_angle: FloatProperty(
        name="Angle",
        description="Where faces turn by more than this, a sharp curve begins. It goes on over edges somewhat less sharp",
        default=math.radians(40.0),
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    detect_length: FloatProperty(
        name="Minimum Length",
        description="Shorter curves are left out, as a part of the size of the object",
        default=0.04,
        min=0.0,
        max=1.0,
        soft_max=0.3,
        subtype="FACTOR",
    )
    mark_detected: BoolProperty(name="Mark Them Sharp", description="Mark the edges found as sharp in the result", default=True)
    size_by: EnumProperty(
        name="Size",
        description="How the size of the quads is given",
        items=[
            ("faces", "Face Count", "So many quads in all"),
            ("edge_length", "Edge Length", "Edges of this length"),
        ],
        default="faces",
    )
    target_faces: IntProperty(
        name="Faces",
        description="How many quads the result has, nearly",
        default=4000,
        min=1,
        soft_min=100,
        soft_max=100_000,
        max=4_000_000,
    )
    edge_length: FloatProperty(
        name="Edge Length",
        description="Length of the quads' edges, in the world",
        default=0.05,
        min=1e-6,
        soft_min=0.001,
        soft_max=10.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    density_group: StringProperty(
        name="Density",
        description="Vertex group that says where the quads are smaller. Without one they are even",
        default="",
    )
    density_factor: FloatProperty(
        name="Density Factor",
        description="How many times shorter edges are where the vertex group weighs 1",
        default=4.0,
        min=0.05,
        soft_min=1.0,
        max=20.0,
    )
    coarseness: FloatProperty(
        name="Coarseness",
        description="0 keeps the quads even in size, 1 keeps irregular vertices few and patches large",
        default=0.5,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    base_vertices: IntProperty(
        name="Layout Vertices",
        description="Corners of the layout between features. Fewer give larger patches, more follow the shape better",
        default=100,
        min=4,
        max=100_000,
        soft_min=20,
        soft_max=1000,
    )
    corner_angle: FloatProperty(
        name="Corner Angle",
        description="Where a curve turns by more than this it has a corner, which stays where it is",
        default=math.radians(50.0),
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    pairing: EnumProperty(
        name="Pairing",
        description="How the triangles of the layout are joined to patches",
        items=[
            ("valence", "By Valence", "Few irregular vertices"),
            ("matching", "Matching", "The rule of the paper: squarest patches, more irregular vertices"),
        ],
        default="valence",
    )
    improve: BoolProperty(
        name="Remove Irregular Vertices",
        description="Lay pieces of the mesh anew where that takes out irregular vertices away from features. Not with the "
        "coarsest layout, nor where a template was chosen",
        default=True,
    )
    symmetry: EnumProperty(
        name="Symmetry",
        description="Make the quads exactly symmetric about a plane through the object's origin",
        items=[
            ("none", "None", "As the surface comes"),
            ("x", "X", "Left and right: the plane across the object's X axis"),
            ("y", "Y", "Front and back: the plane across the object's Y axis"),
            ("z", "Z", "Above and below: the plane across the object's Z axis"),
        ],
        default="none",
    )
    symmetry_flip: BoolProperty(
        name="Keep Negative Side",
        description="The side of the plane where coordinates are negative decides, instead of the positive one",
        default=False,
    )
    symmetry_tolerance: FloatProperty(
        name="Tolerance",
        description="How far the two sides may differ, as a part of the size of the object",
        default=0.01,
        min=0.0,
        max=1.0,
        soft_max=0.1,
        subtype="FACTOR",
    )
    template: StringProperty(
        name="Template",
        description="Pattern for the patch of the layout nearest to the 3D cursor, such as “knuckle”, a loop of edges for a "
        "joint, an eye or a mouth. Empty for none",
        default="",
        search=_template_names,
        search_options={"SORT", "SUGGESTION"},
    )
    template_turn: IntProperty(
        name="Quarter Turns",
        description="How often the template is turned by a quarter",
        default=0,
        min=0,
        max=3,
    )
    template_file: StringProperty(
        name="Template File",
        description="JSON file with templates of your own, beside the built-in ones",
        default="",
        subtype="FILE_PATH",
    )
    keep_layout: BoolProperty(
        name="Keep Layout",
        description="When the same surface is done again with other marks, the layout stays as it is where nothing changed: "
        "quicker, but the result depends on what was marked before",
        default=False,
    )
    field: EnumProperty(
        name="Show Field",
        description="Give the result an attribute “quadloom_field”: 1 on the edges marked this way, falling to 0 at other "
        "edge loops, as the layout is made from it",
        items=[
            ("none", "None", "No attribute"),
            ("sharp", "Sharp", "The field of edges marked sharp"),
            ("seam", "Seams", "The field of UV seams"),
            ("crease", "Creases", "The field of edges with a crease"),
            ("bevel", "Bevel Weights", "The field of edges with a bevel weight"),
            ("freestyle", "Freestyle", "The field of edges marked for Freestyle"),
            ("selected", "Selected", "The field of the edges selected in Edit Mode"),
        ],
        default="none",
    )
    preview: BoolProperty(
        name="Show Layout",
        description="Add the edges of the layout as a second object in front of the result",
        default=False,
    )
    hide_input: BoolProperty(
        name="Hide Input",
        description="Hide the object in the viewport and in renders. It is never altered",
        default=True,
    )


RETOPOLOGIZE_OPTIONS = (*FeatureOptions.__annotations__, *RetopologizeOptions.__annotations__)


def retopologize_uses(options: RetopologizeOptions, name: str) -> bool:
    """Whether an option has a say."""
    if name in {"detect_angle", "detect_length", "mark_detected"}:
        return options.detect
    if name in {"target_faces", "edge_length"}:
        return options.size_by == ("faces" if name == "target_faces" else name)
    if name in {"symmetry_flip", "symmetry_tolerance"}:
        return options.symmetry != "none"
    if name == "template_turn":
        return options.template != ""
    return name != "density_factor" or options.density_group != ""


class RetopologizeSettings(RetopologizeOptions, bpy.types.PropertyGroup):
    """What the panel's Retopologize button will do."""

    # An artist marks, runs and marks again; scripts want the same result whatever was run before.
    keep_layout: BoolProperty(
        name="Keep Layout",
        description="When the same surface is done again with other marks, the layout stays as it is where nothing changed: "
        "quicker, but the result depends on what was marked before",
        default=True,
    )


class TileCurveSettings(TileCurveOptions, bpy.types.PropertyGroup):
    """What the panel's Tile Curve button will do."""


class TileSurfaceSettings(TileSurfaceOptions, bpy.types.PropertyGroup):
    """What the panel's Tile Surface button will do."""


class QuadloomSettings(BooleanOptions, bpy.types.PropertyGroup):
    """What the panel's buttons will do, saved with the scene."""

    retopologize: PointerProperty(type=RetopologizeSettings)
    tile_curve: PointerProperty(type=TileCurveSettings)
    tile_surface: PointerProperty(type=TileSurfaceSettings)


classes = (RetopologizeSettings, TileCurveSettings, TileSurfaceSettings, QuadloomSettings)


def register() -> None:
    """Adds `scene.quadloom`."""
    for cls in classes:
        bpy.utils.register_class(cls)
    bpy.types.Scene.quadloom = PointerProperty(type=QuadloomSettings)


def unregister() -> None:
    """Removes `scene.quadloom`."""
    del bpy.types.Scene.quadloom
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)
