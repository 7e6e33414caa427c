"""`quadloom.tile_curve`: the panels it makes, their attributes, and when it says no."""

import json
import math
import time

import bpy
import numpy as np
import pytest
import shapes
from conftest import refused
from mathutils import Matrix

L_SHAPE = [(0, 0), (4, 0), (4, 1.7), (1.7, 1.7), (1.7, 4), (0, 4)]
STAR = [((3 - 1.5 * (k % 2)) * math.sin(k * math.pi / 5), (3 - 1.5 * (k % 2)) * math.cos(k * math.pi / 5)) for k in range(10)]
ELLIPSE = [(3 * math.cos(t * math.pi / 32), 1.5 * math.sin(t * math.pi / 32)) for t in range(64)]
ALL_OUTLINES = {"L": L_SHAPE, "star": STAR, "ellipse": ELLIPSE}


def curve(splines, kind: str = "POLY", cyclic: bool = True) -> bpy.types.Object:
    """An active curve object; each spline is a list of points in the plane or in space."""
    data = bpy.data.curves.new("Outline", "CURVE")
    data.dimensions = "3D"
    for points in splines:
        spline = data.splines.new(kind)
        spline.points.add(len(points) - 1)
        for point, co in zip(spline.points, points, strict=True):
            point.co = (*co, *[0] * (3 - len(co)), 1)
        spline.use_cyclic_u = cyclic
    return activate(bpy.data.objects.new("Outline", data))


def circle(radius: float = 2.0) -> bpy.types.Object:
    bpy.ops.curve.primitive_bezier_circle_add(radius=radius)
    bpy.context.active_object.name = "Outline"
    return bpy.context.active_object


def activate(obj: bpy.types.Object) -> bpy.types.Object:
    if obj.name not in bpy.context.scene.collection.objects:
        bpy.context.scene.collection.objects.link(obj)
    shapes.choose(obj)
    return obj


def mesh_outline(verts, faces, edges=()) -> bpy.types.Object:
    mesh = bpy.data.meshes.new("Outline")
    mesh.from_pydata([(*co, *[0] * (3 - len(co))) for co in verts], edges, faces)
    return activate(bpy.data.objects.new("Outline", mesh))


def tile(**options) -> bpy.types.Object:
    assert bpy.ops.quadloom.tile_curve(**options) == {"FINISHED"}
    return bpy.context.active_object


def report(made: bpy.types.Object) -> dict:
    return json.loads(made["quadloom_report"])


def area(points) -> float:
    x, y = np.asarray(points, float)[:, :2].T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def check_panels(made: bpy.types.Object, size: float) -> float:
    """Every edge has the size, every face is a regular triangle or square, and together they are a disk. Their area."""
    verts, faces = shapes.arrays(made, world=True)
    assert {len(face) for face in faces} <= {3, 4}
    edges = {frozenset((f[k], f[(k + 1) % len(f)])) for f in faces for k in range(len(f))}
    lengths = [np.linalg.norm(np.subtract(*verts[list(edge)])) for edge in edges]
    assert np.allclose(lengths, size, rtol=2e-5)
    assert len(made.data.edges) == len(edges), "no loose edges"
    assert len(verts) - len(edges) + len(faces) == 1, "Euler characteristic of a disk"
    directed = [(f[k], f[(k + 1) % len(f)]) for f in faces for k in range(len(f))]
    assert len(set(directed)) == len(directed), "all faces turn the same way"
    border = [edge for edge in directed if edge[::-1] not in set(directed)]
    following = dict(border)
    assert len(following) == len(border), "the border does not touch itself"
    loop = [border[0][0]]
    while following[loop[-1]] != loop[0]:
        loop.append(following[loop[-1]])
    assert len(loop) == len(border), "one border"
    # Squares, and not rhombi: the areas of the faces add up to that inside the border.
    flat, _ = shapes.arrays(made)
    assert np.abs(flat[:, 2]).max() == 0
    scale = made.matrix_world.median_scale
    total = sum(size**2 * (1.0 if len(face) == 4 else math.sqrt(3) / 4) for face in faces)
    assert area(flat[loop]) * scale**2 == pytest.approx(total, rel=1e-4)
    assert sum(area(flat[list(face)]) for face in faces) * scale**2 == pytest.approx(total, rel=1e-4)
    assert not made.data.validate()
    return total


@pytest.mark.parametrize("pattern", ["any", "regular", "fractured", "symmetric"])
@pytest.mark.parametrize("name", ALL_OUTLINES)
def test_succeeds_with_panels_of_one_size(name, pattern):
    curve([ALL_OUTLINES[name]])
    made = tile(panel_size=0.35, pattern=pattern, straight=False)
    assert made.name == "Outline Panels"
    assert check_panels(made, 0.35) == pytest.approx(area(ALL_OUTLINES[name]), rel=0.12)


def test_a_bezier_circle_succeeds_whatever_its_thickness():
    circle(2.0)
    plain = tile(panel_size=0.3)
    assert check_panels(plain, 0.3) == pytest.approx(math.pi * 4, rel=0.06)
    verts, _ = shapes.arrays(plain, world=True)
    assert np.linalg.norm(verts, axis=1).max() < 2.0 + 0.3
    thick = circle(2.0)
    thick.data.extrude, thick.data.bevel_depth = 0.4, 0.1
    assert np.array_equal(shapes.arrays(tile(panel_size=0.3))[0], shapes.arrays(plain)[0])


def test_a_filled_curve_and_a_nurbs_circle_succeed():
    filled = circle(2.0)
    filled.data.dimensions = "2D"
    check_panels(tile(panel_size=0.5), 0.5)
    bpy.ops.curve.primitive_nurbs_circle_add(radius=2.0)
    check_panels(tile(panel_size=0.5), 0.5)


def test_a_plane_mesh_and_a_wire_give_what_the_curve_gives():
    curve([L_SHAPE])
    expected = shapes.arrays(tile(panel_size=0.4))[0]
    mesh_outline(L_SHAPE, [[0, 1, 2, 3], [0, 3, 4, 5]])
    assert shapes.arrays(tile(panel_size=0.4))[0] == pytest.approx(expected, abs=1e-5)
    mesh_outline(L_SHAPE, [], [(k, (k + 1) % 6) for k in range(6)])
    assert shapes.arrays(tile(panel_size=0.4))[0] == pytest.approx(expected, abs=1e-5)


def test_modifiers_and_edits_in_edit_mode_count():
    square = mesh_outline([(0, 0), (2, 0), (2, 2), (0, 2)], [[0, 1, 2, 3]])
    square.modifiers.new("array", "ARRAY").use_merge_vertices = True
    assert check_panels(tile(panel_size=0.5), 0.5) == pytest.approx(8.0)
    activate(square)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(0.5, 0.5, 0.5))
    made = tile(panel_size=0.5)
    assert bpy.context.mode == "OBJECT"
    assert check_panels(made, 0.5) == pytest.approx(2.0)


def test_edits_of_a_curve_in_edit_mode_count():
    curve([[(0, 0), (2, 0), (2, 2), (0, 2)]])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(0.5, 0.5, 0.5))
    assert check_panels(tile(panel_size=0.25), 0.25) == pytest.approx(1.0)


def test_an_outline_of_whole_panels_is_filled_exactly():
    side = 4 * 0.5
    corners = [(0.0, 0.0)]
    for k in range(11):
        x, y = corners[-1]
        corners.append((x + side * math.cos(k * math.pi / 6), y + side * math.sin(k * math.pi / 6)))
    curve([corners])
    made = tile(panel_size=0.5)
    assert check_panels(made, 0.5) == pytest.approx(area(corners), rel=1e-5)
    verts, _ = shapes.arrays(made, world=True)
    for corner in corners:
        assert np.linalg.norm(verts[:, :2] - corner, axis=1).min() < 1e-5
    assert report(made)["distance"] == 0
    assert int(report(made)["patterns"]) == math.comb(8, 4), "dodecagons with equal sides a have C(2a, a)"


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_straight_sides_stay_straight_with_whole_panels(angle):
    cos, sin = math.cos(angle), math.sin(angle)
    corners = [(x * cos - y * sin, x * sin + y * cos) for x, y in L_SHAPE]
    curve([corners])
    made = tile(panel_size=0.4)
    # 4 / 0.4 and 1.7 / 0.4 panels, rounded.
    assert check_panels(made, 0.4) == pytest.approx((10**2 - 6**2) * 0.4**2)
    verts, _ = shapes.arrays(made, world=True)
    for corner in corners:
        assert np.linalg.norm(verts[:, :2] - corner, axis=1).min() < 0.25 * 0.4 * math.sqrt(2)
    assert 0 < report(made)["distance"] < 0.25 * math.sqrt(2)


def test_sides_run_in_zigzag_when_asked():
    curve([L_SHAPE])
    made = tile(panel_size=0.4, straight=False)
    check_panels(made, 0.4)
    assert {len(face.vertices) for face in made.data.polygons} == {3, 4}


def test_an_outline_of_whole_panels_without_pattern_gets_a_near_one():
    # A rhombus of 30 degrees closes on the lattice, and no tile fits its corner.
    corners = [(0, 0), (2, 0), (2 + 2 * math.cos(math.pi / 6), 1), (2 * math.cos(math.pi / 6), 1)]
    curve([corners])
    made = tile(panel_size=0.25)
    check_panels(made, 0.25)
    assert 0 < report(made)["distance"] < 3


def test_thin_rhombi_close_an_outline_of_whole_panels_without_pattern():
    # A regular dodecagon with two neighbouring edges exchanged: the area is half a square short.
    code = [5, 5, 4, 7, 4, 5, 5, 5, 5, 5, 5, 5]
    corners, direction = [(0.0, 0.0)], 0
    for angle in code[1:]:
        x, y = corners[-1]
        corners.append((x + 0.5 * math.cos(direction * math.pi / 6), y + 0.5 * math.sin(direction * math.pi / 6)))
        direction += 6 - angle
    curve([corners])
    made = tile(panel_size=0.5)
    assert report(made)["rhombi"] == 1
    assert report(made)["distance"] == 0
    assert report(made)["patterns"] is None
    verts, faces = shapes.arrays(made)
    kinds = [item.value for item in made.data.attributes["tile_kind"].data]
    assert sorted(set(kinds)) == [0, 1, 2]
    areas = {0: math.sqrt(3) / 4, 1: 1.0, 2: 0.5}
    for face, kind, polygon in zip(faces, kinds, made.data.polygons, strict=True):
        assert area(verts[list(face)]) == pytest.approx(0.25 * areas[kind], rel=1e-4)
        assert polygon.material_index == kind
    assert made.material_slots[2].material.name == "Rhombus Panels"
    for corner in corners:
        assert np.linalg.norm(verts[:, :2] - corner, axis=1).min() < 1e-5
    # Without straight sides no rhombus is needed.
    activate(bpy.data.objects["Outline"])
    made = tile(panel_size=0.5, straight=False)
    assert report(made)["rhombi"] == 0
    check_panels(made, 0.5)


@pytest.mark.parametrize(
    "place",
    [
        Matrix.Translation((3, -2, 1)) @ Matrix.Rotation(0.7, 4, "X") @ Matrix.Rotation(0.4, 4, "Z"),
        Matrix.Diagonal((1.0, 1.5, 0.7, 1.0)),
        Matrix.Diagonal((-2.0, 1.0, 1.0, 1.0)),
        Matrix.Translation((1000, 0, 0)) @ Matrix.Rotation(math.pi / 2, 4, "X"),
    ],
)
def test_panels_have_their_size_in_the_world_and_lie_in_the_plane(place):
    source = curve([ELLIPSE])
    source.matrix_world = place
    bpy.context.view_layer.update()
    made = tile(panel_size=0.4)
    world = np.array(place)
    corners = np.column_stack([ELLIPSE, np.zeros(len(ELLIPSE))]) @ world[:3, :3].T + world[:3, 3]
    bpy.context.view_layer.update()
    total = check_panels(made, 0.4)
    normal = np.cross(world[:3, 0], world[:3, 1])
    assert total == pytest.approx(area(ELLIPSE) * np.linalg.norm(normal), rel=0.1)
    verts, _ = shapes.arrays(made, world=True)
    assert np.abs((verts - world[:3, 3]) @ (normal / np.linalg.norm(normal))).max() < 1e-3
    assert np.linalg.norm(verts.mean(axis=0) - corners.mean(axis=0)) < 0.4


def test_an_upright_curve_stands_up():
    curve([[(x, 0, y) for x, y in L_SHAPE]])
    verts, _ = shapes.arrays(tile(panel_size=0.4), world=True)
    assert np.abs(verts[:, 1]).max() < 1e-6
    assert np.ptp(verts[:, 2]) > 3


def test_faces_carry_kind_orientation_and_material():
    circle()
    made = tile(panel_size=0.3, fix_rotation=True, rotation=0.2)
    verts, faces = shapes.arrays(made)
    kinds = [item.value for item in made.data.attributes["tile_kind"].data]
    turns = [item.value for item in made.data.attributes["tile_orientation"].data]
    assert made.data.attributes["tile_kind"].domain == made.data.attributes["tile_orientation"].domain == "FACE"
    assert set(kinds) == {0, 1}
    for face, kind, turn, polygon in zip(faces, kinds, turns, made.data.polygons, strict=True):
        assert len(face) == 3 + kind
        assert polygon.material_index == kind
        # Some edge, run counter-clockwise, points where the orientation says.
        step = verts[face[1]] - verts[face[0]]
        angle = math.atan2(step[1], step[0]) - 0.2 - turn * math.pi / 6
        repeats = angle / (math.pi / 2 if kind else 2 * math.pi / 3)
        assert repeats == pytest.approx(round(repeats), abs=1e-3)
    assert [slot.material.name for slot in made.material_slots] == ["Triangle Panels", "Square Panels"]


def test_materials_are_used_again():
    circle()
    first = tile(panel_size=0.4)
    first.data.materials[0].diffuse_color = (0, 1, 0, 1)
    circle()
    second = tile(panel_size=0.4)
    assert list(first.data.materials) == list(second.data.materials)
    assert second.data.materials[0].diffuse_color[1] == 1
    assert len(bpy.data.materials) == 2


def butterflies(made: bpy.types.Object) -> int:
    """Inner vertices with two triangles, a square, a triangle, a square round them, by angles alone."""
    verts, faces = shapes.arrays(made)
    around: dict[int, list] = {}
    for face in faces:
        centre = verts[list(face)].mean(axis=0)
        for vert in face:
            x, y, _ = centre - verts[vert]
            around.setdefault(vert, []).append((math.atan2(y, x), len(face)))
    found = 0
    for tiles in around.values():
        sizes = [size for _, size in sorted(tiles)]
        if sorted(sizes) == [3, 3, 3, 4, 4]:
            found += not any(sizes[k] == sizes[k - 1] == 4 for k in range(5))
    return found


def test_regular_has_the_fewest_butterflies_and_fractured_the_most():
    source = circle()
    counts = {}
    for pattern in ("regular", "any", "fractured"):
        activate(source)
        counts[pattern] = butterflies(tile(panel_size=0.28, pattern=pattern))
    assert counts["regular"] < counts["any"] < counts["fractured"]


def symmetries(made: bpy.types.Object) -> int:
    """How many rotations and reflections leave the panels as they are, the identity included."""
    verts, faces = shapes.arrays(made)
    centres = np.array([verts[list(face)].mean(axis=0)[:2] for face in faces], float)
    z = (centres - centres.mean(axis=0)) @ np.array([1, 1j])
    # A turn of the plane for which the edges lie at multiples of 30 degrees.
    z = z * np.exp(-1j * report(made)["rotation"])
    images = [np.exp(1j * k * np.pi / 6) * w for k in range(12) for w in (z, z.conj())]
    return sum(np.abs(image[:, None] - z[None]).min(axis=1).max() < 1e-3 for image in images)


@pytest.mark.parametrize("memory", [64, 16])
@pytest.mark.parametrize("size", [0.3, 0.15])
def test_a_symmetric_pattern_is_symmetric(size, memory):
    circle()
    made = tile(panel_size=size, pattern="symmetric", memory=memory)
    check_panels(made, size)
    assert symmetries(made) > 1


def test_any_pattern_is_rarely_symmetric():
    circle()
    assert symmetries(tile(panel_size=0.3)) == 1


def test_pattern_numbers_go_through_all_patterns_before_one_comes_again():
    source = curve([STAR])
    patterns, expected = set(), None
    for number in range(1, 100):
        activate(source)
        made = tile(panel_size=0.5, number=number)
        expected = int(report(made)["patterns"])
        verts, faces = shapes.arrays(made)
        patterns.add(tuple(sorted(verts[list(face)].mean(axis=0).round(3).tobytes() for face in faces)))
        if number == expected:
            break
    assert expected < 100
    assert len(patterns) == expected > 1


def test_seeds_and_rotations_give_other_outlines_and_the_same_ones_again():
    source = curve([ELLIPSE])

    def made(**options) -> bytes:
        activate(source)
        return shapes.arrays(tile(panel_size=0.4, **options))[0].tobytes()

    assert made(seed=1) != made(seed=2)
    assert made(seed=1) == made(seed=1)


def test_the_rotation_asked_for_is_that_of_every_edge():
    curve([ELLIPSE])
    made = tile(panel_size=0.4, fix_rotation=True, rotation=0.1)
    verts, _ = shapes.arrays(made)
    for edge in made.data.edges:
        x, y, _ = verts[edge.vertices[1]] - verts[edge.vertices[0]]
        assert math.atan2(y, x) % (math.pi / 6) == pytest.approx(0.1, abs=1e-4)


def test_an_outline_with_too_many_patterns_gets_one_and_says_so():
    source = circle(2.0)
    start = time.monotonic()
    made = tile(panel_size=0.1, memory=16)
    check_panels(made, 0.1)
    assert report(made)["patterns"] is None
    assert time.monotonic() - start < 60
    activate(source)
    text = refused(bpy.ops.quadloom.tile_curve, panel_size=0.1, memory=16, pattern="regular")
    assert "too many patterns" in text


def test_counts_are_exact_up_to_nine_digits(module):
    text = module("patterns").count_text
    assert text(1) == "1"
    assert text(123_456_789) == "123,456,789"
    assert text(120_345_678_901) == "about 1.2e11"
    assert text(3 * 10**500) == "about 3.0e500"


def test_the_result_is_selected_and_the_input_unaltered():
    source = mesh_outline(L_SHAPE, [[0, 1, 2, 3], [0, 3, 4, 5]])
    before = shapes.fingerprint(source)
    made = tile(panel_size=0.4)
    assert list(bpy.context.selected_objects) == [made]
    assert made.name in bpy.context.collection.objects
    assert shapes.fingerprint(source) == before
    assert not source.hide_get()
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (2, 2), "no leftovers"


def test_a_curve_leaves_no_copies_behind():
    source = circle()
    points = [tuple(point.co) for point in source.data.splines[0].bezier_points]
    before = len(bpy.data.curves)
    tile(panel_size=0.4)
    assert [tuple(point.co) for point in source.data.splines[0].bezier_points] == points
    assert (len(bpy.data.objects), len(bpy.data.meshes), len(bpy.data.curves)) == (2, 1, before)


def test_undo_is_one_step():
    circle()
    bpy.ops.ed.undo_push(message="before")
    assert bpy.ops.quadloom.tile_curve("EXEC_DEFAULT", True, panel_size=0.4) == {"FINISHED"}
    assert len(bpy.data.objects) == 2
    bpy.ops.ed.undo()
    assert [obj.name for obj in bpy.data.objects] == ["Outline"]
    bpy.ops.ed.redo()
    assert len(bpy.data.objects) == 2


def test_a_cancelled_run_changes_nothing(module, monkeypatch):
    circle()
    native = module("native")

    def cancelled(*args, **options):
        raise native.Cancelled

    monkeypatch.setattr(native, "fit_boundary", cancelled)
    assert bpy.ops.quadloom.tile_curve(panel_size=0.123) == {"CANCELLED"}
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (1, 0)


def test_cancels_the_library_within_200_ms(module):
    jobs, native, patterns = module("jobs"), module("native"), module("patterns")
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    request = patterns.Request(points, 0.06, True, None, "any", 1, 0, 1024)
    job = jobs.Job(lambda progress: patterns.lay(request, progress))
    time.sleep(1.5)
    assert not job.finished
    start = time.monotonic()
    job.cancel()
    while not job.finished:
        time.sleep(0.005)
    assert time.monotonic() - start < 0.2
    with pytest.raises(native.Cancelled):
        job.outcome()


# Each case: an outline, words of its sentence, and the points that end up selected.
SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2)]
RING = [*SQUARE, *[(0.5 + x / 2, 0.5 + y / 2) for x, y in SQUARE]]
RING_FACES = [[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
BAD_MESHES = {
    "open": (lambda: mesh_outline(SQUARE, [], [(0, 1), (1, 2), (2, 3)]), "is open", {0, 3}),
    "branching": (lambda: mesh_outline([*SQUARE, (3, 3)], [[0, 1, 2], [2, 3, 4]]), "touches itself", {2}),
    "holes": (lambda: mesh_outline(RING, RING_FACES), "holes are not supported", {4, 5, 6, 7}),
    "not flat": (lambda: mesh_outline([(0, 0), (2, 0, 1), (2, 2), (0, 2, 1)], [[0, 1, 2, 3]]), "not flat", {0, 1, 2, 3}),
    "crossing": (lambda: mesh_outline([(0, 0), (2, 2), (2, 0), (0, 2.5)], [[0, 1, 2, 3]]), "crosses", {0, 1, 2, 3}),
    "loose edge": (lambda: mesh_outline([*SQUARE, (3, 3)], [[0, 1, 2, 3]], [(2, 4)]), "without a face", {2, 4}),
    "on a line": (lambda: mesh_outline([(0, 0), (1, 0), (2, 0)], [[0, 1, 2]]), "on a line", {0, 1, 2}),
    "not a number": (
        lambda: mesh_outline([(0, 0), (2, 0), (2, float("nan")), (0, 2)], [[0, 1, 2, 3]]), "not a number", {2}
    ),
    "closed surface": (lambda: activate(shapes.add("Outline", shapes.box(1))), "closed all round", set()),
}  # fmt: skip
BAD_CURVES = {
    "open": (lambda: curve([SQUARE], cyclic=False), "is open", {0, 3}),
    "several splines": (lambda: curve([SQUARE, [(5, 0), (6, 0), (6, 1)]]), "2 loops", {4, 5, 6}),
    "not flat": (lambda: curve([[(0, 0), (2, 0, 1), (2, 2), (0, 2, 1)]]), "not flat", {0, 1, 2, 3}),
    "crossing": (lambda: curve([[(0, 0), (2, 2), (2, 0), (0, 2.5)]]), "crosses", {0, 1, 2, 3}),
    "spike": (lambda: curve([[(0, 0), (2, 0), (1, 0), (1, 2)]]), "crosses", {0, 1, 2, 3}),
    "not a number": (lambda: curve([[(0, 0), (2, 0), (2, float("nan")), (0, 2)]]), "not a number", {2}),
}


@pytest.mark.parametrize("case", BAD_MESHES)
def test_refuses_a_mesh_and_selects(case):
    make, words, expected = BAD_MESHES[case]
    source = make()
    for vertex in source.data.vertices:
        vertex.select = False
    text = refused(bpy.ops.quadloom.tile_curve)
    assert words in text
    assert "“Outline”" in text
    if expected:
        assert {vertex.index for vertex in source.data.vertices if vertex.select} == expected


@pytest.mark.parametrize("case", BAD_CURVES)
def test_refuses_a_curve_and_selects(case):
    make, words, expected = BAD_CURVES[case]
    source = make()
    text = refused(bpy.ops.quadloom.tile_curve)
    assert words in text
    assert "“Outline”" in text
    points = [point for spline in source.data.splines for point in spline.points]
    if expected:
        assert {k for k, point in enumerate(points) if point.select} == expected


def test_refuses_and_selects_in_edit_mode():
    source = mesh_outline(SQUARE, [], [(0, 1), (1, 2), (2, 3)])
    bpy.ops.object.mode_set(mode="EDIT")
    assert "is open" in refused(bpy.ops.quadloom.tile_curve)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert {vertex.index for vertex in source.data.vertices if vertex.select} == {0, 3}


def test_refuses_what_is_too_small_or_too_large_for_the_panels():
    source = circle(1.0)
    assert "too small for a panel of 5" in refused(bpy.ops.quadloom.tile_curve, panel_size=5.0)
    activate(source)
    assert "choose larger panels" in refused(bpy.ops.quadloom.tile_curve, panel_size=0.001)


def test_refuses_a_scale_of_zero():
    circle().scale.x = 0.0
    bpy.context.view_layer.update()
    assert "scale of zero" in refused(bpy.ops.quadloom.tile_curve)


def test_refuses_a_symmetric_pattern_where_there_is_none():
    curve([[(0, 0), (5, 0.3), (4.1, 2.2), (2.3, 2.9), (0.4, 1.1)]])
    assert "symmetric" in refused(bpy.ops.quadloom.tile_curve, panel_size=0.4, pattern="symmetric")


def test_refuses_other_objects_and_empty_ones_and_says_so():
    activate(bpy.data.objects.new("Empty", None))
    assert "neither a curve nor a mesh" in refused(bpy.ops.quadloom.tile_curve)
    mesh_outline([], [])
    assert "“Outline" in refused(bpy.ops.quadloom.tile_curve)
    activate(bpy.data.objects.new("Nothing", bpy.data.curves.new("Nothing", "CURVE")))
    assert "“Nothing” is empty" in refused(bpy.ops.quadloom.tile_curve)
