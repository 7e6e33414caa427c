"""The options of the tools, declared once: each operator and the panel's settings both inherit them."""

import math

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

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


class TileCurveSettings(TileCurveOptions, bpy.types.PropertyGroup):
    """What the panel's Tile Curve button will do."""


class QuadloomSettings(BooleanOptions, bpy.types.PropertyGroup):
    """What the panel's buttons will do, saved with the scene."""

    tile_curve: PointerProperty(type=TileCurveSettings)


def register() -> None:
    """Adds `scene.quadloom`."""
    bpy.utils.register_class(TileCurveSettings)
    bpy.utils.register_class(QuadloomSettings)
    bpy.types.Scene.quadloom = PointerProperty(type=QuadloomSettings)


def unregister() -> None:
    """Removes `scene.quadloom`."""
    del bpy.types.Scene.quadloom
    bpy.utils.unregister_class(QuadloomSettings)
    bpy.utils.unregister_class(TileCurveSettings)
