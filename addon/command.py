"""`blender --command quadloom boolean A B -o OUT`, `... retopologize MESH -o OUT`, `... tile-curve OUTLINE -o OUT`,
`... tile-surface MESH -o OUT`, `... export-panels MESH -o OUT`: the tools for scripts and farms.

A, B, MESH and OUTLINE are OBJ files, or FILE.blend:OBJECT. OUT is an .obj or a .blend file; of
`export-panels` .csv, .json, .svg or .dxf. Exit code 0, or 1 with the reason
on stderr.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import bpy

from .features import SOURCES
from .properties import OPERATION_SIGNS

_handle = None


def main(arguments: list[str]) -> int:
    """Runs the command; `arguments` is what follows `--command quadloom`."""
    parser = argparse.ArgumentParser(prog="blender --command quadloom", description="The tools of Quadloom.")
    verbs = parser.add_subparsers(dest="verb", required=True)
    boolean = verbs.add_parser("boolean", help="combine two meshes of quads")
    boolean.add_argument("a", help="FILE.obj or FILE.blend:OBJECT")
    boolean.add_argument("b", help="FILE.obj or FILE.blend:OBJECT")
    boolean.add_argument("--operation", choices=list(OPERATION_SIGNS), default="union")
    boolean.add_argument("--filler", choices=["auto", "patches", "rings", "matching"], default="auto")
    boolean.add_argument("--layout", choices=["motorcycle", "separatrices"], default="motorcycle")
    boolean.add_argument("--retraction-distance", type=float, default=1.0, metavar="EDGES")
    boolean.add_argument("--alpha", type=float, default=0.5, help="0 even edge lengths ... 1 few irregular vertices")
    boolean.add_argument("--blend-radius", type=float, default=0.0, help="smoothing along the seam, scene units")
    retopologize = verbs.add_parser("retopologize", help="lay quads along the marked and sharp edges of a mesh")
    retopologize.add_argument("mesh", help="FILE.obj or FILE.blend:OBJECT")
    retopologize.add_argument(
        "--features", type=_sources, default="sharp,seam,crease,material_borders", metavar="SOURCE,...",
        help=f"marks that become edge loops, or none: {', '.join(SOURCES)}",
    )  # fmt: skip
    size = retopologize.add_mutually_exclusive_group()
    size.add_argument("--target-faces", type=int, default=4000, metavar="COUNT", help="how many quads")
    size.add_argument("--edge-length", type=float, help="length of the edges instead, scene units")
    retopologize.add_argument("--no-detect", dest="detect", action="store_false", help="do not look for sharp edges")
    retopologize.add_argument("--detect-angle", type=float, default=40.0, metavar="DEGREES", help="where sharp curves begin")
    retopologize.add_argument(
        "--detect-length", type=float, default=0.04, help="of the shortest, as a part of the object's size"
    )
    retopologize.add_argument("--density-group", default="", help="vertex group that says where the quads are smaller")
    retopologize.add_argument("--density-factor", type=float, default=4.0, help="how many times shorter edges are at weight 1")
    retopologize.add_argument("--coarseness", type=float, default=0.5, help="0 even edge lengths ... 1 few irregular vertices")
    retopologize.add_argument("--base-vertices", type=int, default=100, help="corners of the layout between features")
    retopologize.add_argument("--symmetry", choices=["none", "x", "y", "z"], default="none", help="plane through the origin")
    retopologize.add_argument("--symmetry-tolerance", type=float, default=0.01, help="as a part of the object's size")
    retopologize.add_argument("--preview", action="store_true", help="with the layout's edges as a second object")
    tile_curve = verbs.add_parser("tile-curve", help="fill an outline with triangles and squares")
    tile_curve.add_argument("outline", help="FILE.obj or FILE.blend:OBJECT, a closed flat curve or a flat mesh")
    tile_curve.add_argument("--panel-size", type=float, default=0.25, help="length of every edge, scene units")
    tile_curve.add_argument("--pattern", choices=["any", "regular", "fractured", "symmetric"], default="any")
    tile_curve.add_argument("--number", type=int, default=1, help="which of the patterns, from 1")
    tile_curve.add_argument("--seed", type=int, default=0)
    tile_curve.add_argument("--no-straight", dest="straight", action="store_false", help="let the border run in zigzag")
    tile_curve.add_argument("--rotation", type=float, metavar="DEGREES", help="of the edges; without it the best")
    tile_curve.add_argument("--memory", type=int, default=64, metavar="MB", help="for counting the patterns")
    tile_surface = verbs.add_parser("tile-surface", help="cover a mesh with panels: triangles and squares")
    tile_surface.add_argument("mesh", help="FILE.obj or FILE.blend:OBJECT")
    tile_surface.add_argument(
        "--features", type=_sources, default="sharp,seam,crease,material_borders", metavar="SOURCE,...",
        help=f"marks that panel edges follow, or none: {', '.join(SOURCES)}",
    )  # fmt: skip
    size = tile_surface.add_mutually_exclusive_group()
    size.add_argument("--panel-count", type=int, default=1000, metavar="COUNT", help="about how many panels")
    size.add_argument("--panel-size", type=float, help="length of their edges instead, scene units")
    tile_surface.add_argument("--partition", choices=["even", "patches"], default="even", help="how the surface is divided")
    tile_surface.add_argument(
        "--patch-graph", metavar="FILE", help="FILE.obj or FILE.blend:OBJECT, whose edges are the sides of the patches"
    )
    tile_surface.add_argument("--pattern", choices=["regular", "fractured", "symmetric", "random"], default="regular")
    tile_surface.add_argument("--seed", type=int, default=0)
    tile_surface.add_argument("--no-detect", dest="detect", action="store_false", help="do not follow sharp edges")
    tile_surface.add_argument("--shaping-rounds", type=int, default=60, help="rounds that make panels regular")
    tile_surface.add_argument("--flattening-rounds", type=int, default=15, help="further rounds that make them flat")
    tile_surface.add_argument("--closeness", type=float, default=1.0, help="weight of nearness to the surface in these")
    tile_surface.add_argument("--color-by", choices=["kind", "type", "planarity", "area"], default="kind")
    export_panels = verbs.add_parser("export-panels", help="write panels as tables, JSON or drawings of them laid flat")
    export_panels.add_argument("mesh", help="FILE.obj or FILE.blend:OBJECT, of triangles and quads")
    export_panels.add_argument("--sheet", type=float, nargs=2, default=(0.0, 0.0), metavar=("WIDTH", "HEIGHT"))
    export_panels.add_argument("--gap", type=float, default=0.01, help="free space round panels, scene units")
    export_panels.add_argument("--no-labels", dest="labels", action="store_false", help="write no ids on the panels")
    for verb in (tile_surface, export_panels):
        verb.add_argument("--type-tolerance", type=float, default=0.0, help="of panels of one type; scene units")
        verb.add_argument("--mirror", action="store_true", help="count mirror images as one type")
    for verb in (boolean, retopologize, tile_curve, tile_surface):
        verb.add_argument("-o", "--output", type=Path, required=True, help="an .obj or a .blend file")
    export_panels.add_argument("-o", "--output", type=Path, required=True, help="a .csv, .json, .svg or .dxf file")
    given = parser.parse_args(arguments)
    suffixes = [".csv", ".json", ".svg", ".dxf"] if given.verb == "export-panels" else [".obj", ".blend"]
    try:
        if given.output.suffix not in suffixes:
            raise ValueError(f"{given.output}: the output must be one of: {', '.join(suffixes)}")
        if given.verb == "boolean":
            names = ("operation", "filler", "layout", "alpha", "blend_radius", "retraction_distance")
            _select([_load(given.a), _load(given.b)])
            bpy.ops.quadloom.boolean(hide_inputs=True, **{name: getattr(given, name) for name in names})
        elif given.verb == "retopologize":
            names = ("target_faces", "detect", "detect_length", "density_group", "density_factor", "coarseness")
            names += ("base_vertices", "preview", "symmetry", "symmetry_tolerance")
            options = {name: getattr(given, name) for name in names}
            options |= {source: source in given.features for source in SOURCES}
            options["detect_angle"] = math.radians(given.detect_angle)
            if given.edge_length is not None:
                options |= {"size_by": "edge_length", "edge_length": given.edge_length}
            _select([_load(given.mesh)])
            bpy.ops.quadloom.retopologize(hide_input=True, **options)
        elif given.verb == "tile-surface":
            names = (
                "panel_count",
                "partition",
                "pattern",
                "seed",
                "detect",
                "shaping_rounds",
                "flattening_rounds",
                "closeness",
            )
            options = {name: getattr(given, name) for name in (*names, "color_by", "type_tolerance", "mirror")}
            options |= {source: source in given.features for source in SOURCES}
            if given.panel_size is not None:
                options |= {"size_by": "edge_length", "panel_size": given.panel_size}
            if given.patch_graph is not None:
                options["patch_graph"] = _load(given.patch_graph).name
            _select([_load(given.mesh)])
            bpy.ops.quadloom.tile_surface(hide_input=True, **options)
        elif given.verb == "export-panels":
            options = {name: getattr(given, name) for name in ("sheet", "gap", "labels", "type_tolerance", "mirror")}
            _select([_load(given.mesh)])
            path = str(given.output.resolve())
            bpy.ops.quadloom.export_panels(filepath=path, format=given.output.suffix[1:], **options)
        else:
            options = {name: getattr(given, name) for name in ("panel_size", "pattern", "number", "seed", "straight", "memory")}
            if given.rotation is not None:
                options |= {"fix_rotation": True, "rotation": math.radians(given.rotation)}
            _select([_load(given.outline)])
            bpy.ops.quadloom.tile_curve(**options)
        if given.verb != "export-panels":
            _save(given.output)
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: what an operator reports as an error
        print(f"quadloom: {error}", file=sys.stderr)
        return 1
    return 0


def _sources(text: str) -> set[str]:
    """Sources of features, separated by commas."""
    found = {word for word in text.split(",") if word not in {"", "none"}}
    if found - set(SOURCES):
        raise argparse.ArgumentTypeError(f"{', '.join(sorted(found - set(SOURCES)))}: choose from {', '.join(SOURCES)}")
    return found


def _select(objects: list[bpy.types.Object]) -> None:
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def _save(output: Path) -> None:
    if output.suffix == ".blend":
        bpy.ops.wm.save_as_mainfile(filepath=str(output.resolve()))
    else:
        bpy.ops.wm.obj_export(
            filepath=str(output.resolve()), export_selected_objects=True, forward_axis="Y", up_axis="Z",
            export_materials=False,
        )  # fmt: skip


def _load(name: str) -> bpy.types.Object:
    """The mesh object that FILE.obj or FILE.blend:OBJECT names."""
    path, _, wanted = name.rpartition(":") if ".blend:" in name else (name, "", "")
    if not Path(path).exists():
        raise OSError(f"{path}: no such file")
    if wanted:
        with bpy.data.libraries.load(path) as (stored, loaded):
            if wanted not in stored.objects:
                raise ValueError(f"{path} has no object {wanted!r}; it has: {', '.join(stored.objects)}")
            loaded.objects = [wanted]
        obj = loaded.objects[0]
        bpy.context.scene.collection.objects.link(obj)
        return obj
    before = set(bpy.data.objects)
    # The axes that leave coordinates as they are.
    bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    made = sorted(set(bpy.data.objects) - before, key=lambda obj: obj.name)
    if len(made) != 1:
        raise ValueError(f"{path} has {len(made)} objects; give a file with one")
    return made[0]


def register() -> None:
    """Adds the command to Blender's."""
    global _handle
    _handle = bpy.utils.register_cli_command("quadloom", main)


def unregister() -> None:
    """Takes the command back."""
    bpy.utils.unregister_cli_command(_handle)
