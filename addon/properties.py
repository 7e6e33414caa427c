"""The options of the tools, declared once: each operator and the panel's settings both inherit them."""

import math
from pathlib import Path

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import native

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


class TileCurveOptions:
    """Options of `quadloom.tile_curve`, a mixin."""

    panel_size: FloatProperty(
        name="Panel Size",
        description="Length of every edge",
        default=0.25,
        min=1e-4,
        soft_min=0.01,
        soft_max=10.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    pattern: EnumProperty(
        name="Pattern",
        description="Which of the patterns that fill the outline to take",
        items=[
            ("any", "Any", "Every pattern can be had: go through them with Number", 0),
            ("regular", "Regular", "Large fields of triangles and of squares: the fewest vertices where they alternate", 1),
            ("fractured", "Fractured", "Triangles and squares mixed: the most vertices where they alternate", 2),
            ("symmetric", "Symmetric", "Only exactly symmetric patterns, the most symmetric ones there are", 3),
        ],
        default="any",
    )
    number: IntProperty(
        name="Number",
        description="Another number is another pattern of the same outline. All come before one comes again, unless there are "
        "too many to count",
        default=1,
        min=1,
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed tries other places for the panels along the curve, and starts from another pattern",
        default=0,
        min=0,
    )
    straight: BoolProperty(
        name="Straight Sides",
        description="Where all angles are multiples of 30 degrees, keep the sides straight, with whole panels along each, if a "
        "pattern exists, or thin rhombi help where whole panels fit exactly. Otherwise the border runs along the outline in "
        "zigzag",
        default=True,
    )
    fix_rotation: BoolProperty(
        name="Fix Rotation",
        description="Turn the panels' edges as said, instead of as they follow the curve best",
        default=False,
    )
    rotation: FloatProperty(
        name="Rotation",
        description="Angle of the panels' edges against the object's X axis. It repeats every 30 degrees",
        default=0.0,
        soft_min=0.0,
        soft_max=math.radians(30.0),
        subtype="ANGLE",
    )
    memory: IntProperty(
        name="Memory",
        description="Most megabytes for counting. Large outlines have more patterns than can be counted; one is found anyway",
        default=64,
        min=16,
        max=1 << 16,
        soft_max=4096,
    )


TILE_CURVE_OPTIONS = tuple(TileCurveOptions.__annotations__)


def tile_curve_uses(options: TileCurveOptions, name: str) -> bool:
    """Whether an option has a say: there is one most regular pattern, and a rotation only where it is fixed."""
    if name == "number":
        return options.pattern in {"any", "symmetric"}
    return name != "rotation" or options.fix_rotation


def _template_names(options: bpy.types.AnyType, context: bpy.types.Context, text: str) -> list[str]:
    """The templates there are to choose from, for the search in the field."""
    try:
        file = bpy.path.abspath(options.template_file)
        return native.template_names(Path(file).read_text() if file else None)
    except (OSError, ValueError, KeyError, TypeError):
        # The operator says what is wrong with the file.
        return native.template_names(None)


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
        description="Search for irregular vertices away from features that can go. Slower, and the layout gets lost",
        default=False,
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


class TypeOptions:
    """What counts as one type of panel, a mixin."""

    type_tolerance: FloatProperty(
        name="Type Tolerance",
        description="Panels are of one type when no corner is further than this from where the type has it. 0 takes a hundredth "
        "of the mean edge length",
        default=0.0,
        min=0.0,
        soft_max=0.1,
        precision=4,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    mirror: BoolProperty(
        name="Mirror Images Alike",
        description="Count a panel and its mirror image as one type, as when panels may be turned over",
        default=False,
    )


class TileSurfaceOptions(FeatureOptions, TypeOptions):
    """Options of `quadloom.tile_surface`, a mixin."""

    size_by: EnumProperty(
        name="Size",
        description="How the size of the panels is given",
        items=[
            ("count", "Panel Count", "About so many panels in all"),
            ("edge_length", "Edge Length", "Edges of this length"),
        ],
        default="count",
    )
    panel_count: IntProperty(
        name="Panels",
        description="About how many panels the result has",
        default=1000,
        min=1,
        soft_min=50,
        soft_max=20_000,
        max=2_000_000,
    )
    panel_size: FloatProperty(
        name="Edge Length",
        description="Length of the panels' edges, in the world",
        default=0.25,
        min=1e-6,
        soft_min=0.01,
        soft_max=10.0,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    pattern: EnumProperty(
        name="Pattern",
        description="Which of the many tilings of the surface to take",
        items=[
            ("regular", "Regular", "Hexagons of triangles between squares, as periodic as the surface allows"),
            ("random", "Random", "Triangles and squares drawn at random, patch by patch"),
        ],
        default="regular",
    )
    seed: IntProperty(name="Seed", description="Another seed is another random pattern", default=0, min=0)
    patch_panels: IntProperty(
        name="Patch Panels",
        description="Panels of a patch of the random pattern. More of them leave fewer traces of the regular one and take longer",
        default=40,
        min=12,
        max=200,
    )
    detect: BoolProperty(
        name="Follow Sharp Edges",
        description="Edges that bend sharply become lines of edges as well, without being marked",
        default=True,
    )
    detect_angle: FloatProperty(
        name="Angle",
        description="Edges where faces turn by more than this are followed",
        default=math.radians(50.0),
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    corner_angle: FloatProperty(
        name="Corner Angle",
        description="Where a border or a followed line turns by more than this, a node stays at the corner",
        default=math.radians(30.0),
        min=0.0,
        max=math.pi,
        subtype="ANGLE",
    )
    shaping_rounds: IntProperty(
        name="Regularity",
        description="Rounds that make the panels regular while they stay on the surface. 0 leaves them as they were laid",
        default=60,
        min=0,
        max=1000,
        soft_max=200,
    )
    flattening_rounds: IntProperty(
        name="Planarity",
        description="Further rounds that make the panels flat and may lift them off the surface. 0 keeps every node on it",
        default=15,
        min=0,
        max=1000,
        soft_max=100,
    )
    closeness: FloatProperty(
        name="Closeness",
        description="How strongly those rounds hold the nodes to the surface, against flat and regular panels",
        default=1.0,
        min=0.001,
        max=1000.0,
        soft_min=0.05,
        soft_max=20.0,
    )
    color_by: EnumProperty(
        name="Colour By",
        description="What the materials of the panels show",
        items=[
            ("kind", "Kind", "Triangles and squares"),
            ("type", "Panel Type", "One material a type; rare types share one"),
            ("planarity", "Planarity", "How far corners are off the plane of their panel, over the mean diagonal"),
            ("area", "Area", "From the smallest to the largest panel"),
        ],
        default="kind",
    )
    hide_input: BoolProperty(
        name="Hide Input",
        description="Hide the object in the viewport and in renders. It is never altered",
        default=True,
    )


TILE_SURFACE_OPTIONS = (
    *FeatureOptions.__annotations__, *TileSurfaceOptions.__annotations__, *TypeOptions.__annotations__
)  # fmt: skip


def tile_surface_uses(options: TileSurfaceOptions, name: str) -> bool:
    """Whether an option has a say."""
    if name in {"panel_count", "panel_size"}:
        return options.size_by == ("count" if name == "panel_count" else "edge_length")
    if name in {"seed", "patch_panels"}:
        return options.pattern == "random"
    if name == "closeness":
        return options.flattening_rounds > 0
    return name != "detect_angle" or options.detect


class ExportPanelsOptions(TypeOptions):
    """Options of `quadloom.export_panels`, a mixin."""

    format: EnumProperty(
        name="Format",
        description="What to write",
        items=[
            ("csv", "CSV Tables", "Panels, their types, nodes and edges, in four tables for spreadsheets"),
            ("json", "JSON", "All of it in one file, with every digit"),
            ("svg", "SVG Drawing", "The panels laid flat, in millimetres, for laser cutters and browsers"),
            ("dxf", "DXF Drawing", "The panels laid flat, in millimetres, for CAD and CNC machines"),
        ],
        default="csv",
    )
    sheet: FloatVectorProperty(
        name="Sheet",
        description="Width and height of the sheets that the panels are laid out on. 0 takes one sheet that is large enough",
        size=2,
        default=(0.0, 0.0),
        min=0.0,
        subtype="XYZ_LENGTH",
        unit="LENGTH",
    )
    gap: FloatProperty(
        name="Gap",
        description="Free space round the panels on a sheet",
        default=0.01,
        min=0.0,
        soft_max=0.5,
        precision=4,
        subtype="DISTANCE",
        unit="LENGTH",
    )
    labels: BoolProperty(
        name="Labels",
        description="Write the id and the type on each panel, and the ids of its neighbours along its edges",
        default=True,
    )


EXPORT_PANELS_OPTIONS = (*ExportPanelsOptions.__annotations__, *TypeOptions.__annotations__)


def export_panels_uses(options: ExportPanelsOptions, name: str) -> bool:
    """Whether an option has a say."""
    return name not in {"sheet", "gap", "labels"} or options.format in {"svg", "dxf"}


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
