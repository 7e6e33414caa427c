"""The options of tilings, declared once: each operator and the panel's settings both inherit them."""

import math

from bpy.props import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from .feature_options import FeatureOptions


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


class TypeOptions:
    """What counts as one type of panel, a mixin."""

    type_tolerance: FloatProperty(
        name="Type Tolerance",
        description="Panels are of one type when no corner is further than this from where the type has it. 0 takes a "
        "hundredth of the mean edge length",
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


class ShapeOptions:
    """What the last rounds of shaping aim at besides regularity, a mixin."""

    planarity: FloatProperty(
        name="Flat Quads",
        description="How strongly those rounds make quads flat, against regular panels",
        default=0.0,
        min=0.0,
        max=1000.0,
        soft_max=100.0,
    )
    fairness: FloatProperty(
        name="Fairness",
        description="How strongly those rounds keep the curvature that the panels had on the surface, against wiggles",
        default=0.0,
        min=0.0,
        max=1000.0,
        soft_max=100.0,
    )
    uniformity: FloatProperty(
        name="Uniformity",
        description="How strongly all rounds give all edges one length, and all diagonals one",
        default=0.0,
        min=0.0,
        max=1000.0,
        soft_max=100.0,
    )
    borders: EnumProperty(
        name="Borders",
        description="What nodes on open borders do",
        items=[("slide", "Slide", "Move along the border"), ("keep", "Keep", "Stay at equal steps along the border")],
        default="slide",
    )
    features: EnumProperty(
        name="Followed Edges",
        description="What nodes on followed edges do",
        items=[("slide", "Slide", "Move along the edges"), ("keep", "Keep", "Stay at equal steps along the edges")],
        default="slide",
    )


class ColorOptions:
    """What materials of panels show, a mixin."""

    color_by: EnumProperty(
        name="Colour By",
        description="What the materials of the panels show",
        items=[
            ("kind", "Kind", "Triangles and squares"),
            ("type", "Panel Type", "One material a type; rare types share one"),
            ("planarity", "Planarity", "How far the diagonals of a panel pass one another, over their mean length"),
            ("area", "Area", "From the smallest to the largest panel"),
        ],
        default="kind",
    )


class TileSurfaceOptions(FeatureOptions, ShapeOptions, ColorOptions, TypeOptions):
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
    partition: EnumProperty(
        name="Layout",
        description="How the surface is divided before it is tiled",
        items=[
            ("even", "Even", "Irregular nodes spread evenly over the surface"),
            ("patches", "Patches", "Large patches that are flat in themselves; irregular nodes where the surface curves"),
        ],
        default="even",
    )
    patch_graph: StringProperty(
        name="Patch Graph",
        description="Mesh object whose edges are the sides of the patches, drawn near the surface. Without one, patches are "
        "found; with the patches of a surface active, those are taken",
        default="",
    )
    corners: BoolProperty(
        name="Marked Corners",
        description="Vertices marked as corners of patches have the angles marked there, on borders and followed edges",
        default=True,
    )
    show_patches: BoolProperty(
        name="Show Patch Graph",
        description="Add the borders of the patches as another object. Move its nodes or redraw its edges, then tile with it",
        default=False,
    )
    pattern: EnumProperty(
        name="Pattern",
        description="Which of the many tilings of the surface to take",
        items=[
            ("regular", "Regular", "As periodic as the surface allows"),
            ("fractured", "Fractured", "Triangles and squares mixed in every patch that allows it, as brokenly as they can be"),
            ("symmetric", "Symmetric", "Triangles and squares mixed, each patch with as many symmetries as its outline allows"),
            ("random", "Random", "Triangles and squares drawn at random, patch by patch"),
        ],
        default="regular",
    )
    seed: IntProperty(name="Seed", description="Another seed is another pattern", default=0, min=0)
    patch_panels: IntProperty(
        name="Patch Panels",
        description="Panels of a patch of the random pattern: more leave fewer traces of the regular one, and take longer",
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
    again: BoolProperty(
        name="Tile the Source Again",
        description="With panels or patches active, tile the surface that they were made from. Without this the panels "
        "themselves are tiled",
        default=True,
    )
    hide_input: BoolProperty(
        name="Hide Input",
        description="Hide the object in the viewport and in renders, and the panels before. None of them is altered",
        default=True,
    )


SURFACE_OPTIONS = (
    *FeatureOptions.__annotations__, "size_by", "panel_count", "panel_size", "detect", "detect_angle", "corner_angle", "corners"
)  # fmt: skip
"""Those that say what is divided into patches; the others say how it is tiled."""
TILE_SURFACE_OPTIONS = (
    *FeatureOptions.__annotations__, *TileSurfaceOptions.__annotations__, *ShapeOptions.__annotations__,
    *ColorOptions.__annotations__, *TypeOptions.__annotations__,
)  # fmt: skip


def tile_surface_uses(options: TileSurfaceOptions, name: str) -> bool:
    """Whether an option has a say."""
    if name in {"panel_count", "panel_size"}:
        return options.size_by == ("count" if name == "panel_count" else "edge_length")
    if name in {"show_patches", "corners"}:
        return options.partition == "patches" or options.patch_graph != ""
    if name == "partition":
        return options.patch_graph == ""
    if name == "seed":
        return options.pattern != "regular"
    if name == "patch_panels":
        return options.pattern == "random" and options.partition == "even"
    if name in {"closeness", "planarity", "fairness"}:
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
