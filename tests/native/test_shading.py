"""Lights with a size, the surroundings, materials, smooth normals and flags, against what light does."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.native.views import clip_to_world, look_at, orthographic, perspective

LIGHT = np.dtype(
    [("kind", "u1"), ("position", "f8", 3), ("direction", "f8", 3), ("axis", "f8", 3)]
    + [("size", "f8", 2), ("spot", "f8", 2), ("colour", "f4", 3), ("shadowless", "?")]
)
SURFACE = np.dtype([("base", "f4", 3), ("emission", "f4", 3), ("index", "i4")])
OBJECT = np.dtype([("first_triangle", "i8"), ("first_surface", "i4"), ("index", "i4"), ("flags", "u1")])
SUN, POINT, SPOT, RECTANGLE, ELLIPSE, HEADLIGHT = range(6)
HIDDEN, NO_SHADOW, HOLDOUT = 1, 2, 4
BLACK = (0.0, 0.0, 0.0)


def light(kind, position=(0, 0, 3), direction=(0, 0, -1), size=(0, 0), spot=(1, 0), colour=(1, 1, 1), shadowless=False):
    return np.array([(kind, position, direction, (1, 0, 0), size, spot, colour, shadowless)], LIGHT)


def floor(half=50.0):
    """z = 0, two triangles."""
    return [
        [[-half, -half, 0], [half, -half, 0], [half, half, 0]],
        [[-half, -half, 0], [half, half, 0], [-half, half, 0]],
    ]


def view(centre=(0, 0), half=1e-6, size=1, height=40.0):
    """Straight down on `centre`, `half` a width to each side."""
    eye = (*centre, height)
    matrix = clip_to_world(look_at(eye, (*centre, 0), (0, 1, 0)), orthographic(half, half, 0.1, 100))
    return bihtree.Camera(matrix, size, size)


def seen(corners, camera=None, passes=("combined",), threads=0, **options):
    tree = bihtree.Tree(*meshes.from_corners(corners), threads=threads)
    return bihtree.render(tree, camera or view(), passes=passes, **{"ambient": BLACK, **options})


def red(corners, camera=None, **options):
    return float(seen(corners, camera, **options)["combined"][0, 0, 0])


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.3])
def test_a_sun_on_a_tilted_plane(angle):
    shown = red(floor(), lights=light(SUN, direction=(np.sin(angle), 0, -np.cos(angle)), colour=(3, 0, 0)))
    assert shown == pytest.approx(0.8 / np.pi * 3 * np.cos(angle), rel=1e-6)


def test_a_wide_sun_gives_what_a_narrow_one_does():
    """Its irradiance is the same at any angle, as long as all of it is above the horizon."""
    for angle in (1e-6, 0.3, 2.0):
        shown = red(floor(), samples=1024, lights=light(SUN, size=(angle, 0), colour=(3, 0, 0)))
        assert shown == pytest.approx(0.8 / np.pi * 3, rel=1e-3)


@pytest.mark.parametrize("radius", [0.0, 1e-9, 0.5, 2.9])
def test_a_point_light_at_a_distance(radius):
    """A sphere that shines evenly gives what its centre would (Lambert's law for a sphere that is all seen)."""
    shown = red(floor(), samples=1024, lights=light(POINT, size=(radius, 0), colour=(90, 0, 0)))
    assert shown == pytest.approx(0.8 / np.pi * 90 / (4 * np.pi * 9), rel=2e-3)


def test_a_spot_fades_between_its_cones():
    lamp = light(SPOT, spot=(1.2, 0.25), colour=(90, 0, 0))
    edge, inner = np.cos(0.6), np.cos(0.6) + 0.25 * (1 - np.cos(0.6))
    for x in (0.0, 0.5, 1.4, 1.7, 1.9, 2.1, 5.0):
        shown = red(floor(), view((x, 0)), lights=lamp)
        cosine = 3 / np.hypot(3, x)
        share = np.clip((cosine - edge) / (inner - edge), 0, 1)
        expected = 0.8 / np.pi * 90 / (4 * np.pi * (9 + x * x)) * cosine * share**2 * (3 - 2 * share)
        assert shown == pytest.approx(expected, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("kind", [RECTANGLE, ELLIPSE])
def test_an_area_light_by_its_form_factor(kind):
    """The irradiance beneath its middle: of a disk π L r²/(r² + d²), of a rectangle Lambert's sum over its sides."""
    shown = red(floor(), samples=4096, lights=light(kind, size=(2, 2), colour=(90, 0, 0)))
    if kind == ELLIPSE:
        irradiance = np.pi * 90 / (np.pi * np.pi) * 1 / (1 + 9)
    else:
        # Four corners' rectangles of 1 x 1, each (A atan B + C atan D) / 2π of a full hemisphere.
        a = 1 / 3
        b = a / np.sqrt(1 + a * a)
        irradiance = 90 / (np.pi * 4) * 4 * 0.5 * 2 * b * np.arctan(b)
    assert shown == pytest.approx(0.8 / np.pi * irradiance, rel=2e-3)
    behind = red(floor(), lights=light(kind, direction=(0, 0, 1), size=(2, 2), colour=(90, 0, 0)))
    assert behind == 0


def half_plane(height):
    """What covers x < 0 at some height."""
    return [
        [[-90, -90, height], [0, -90, height], [0, 90, height]],
        [[-90, -90, height], [0, 90, height], [-90, 90, height]],
    ]


def test_the_penumbra_of_a_sun_is_as_wide_as_its_disk_seen_from_the_edge():
    """An edge 2 above the floor: shade ends at ±2 tan(angle / 2), and inside it the share of the disk is seen."""
    angle, height = 0.4, 2.0
    reach = height * np.tan(angle / 2)
    camera = view((0, 0), half=2 * reach, size=64, height=1.0)
    lamp = light(SUN, size=(angle, 0), colour=(1, 1, 1))
    row = seen([*floor(), *half_plane(height)], camera, samples=256, lights=lamp)["combined"][:, :, 0].mean(axis=0)
    x = ((np.arange(64) + 0.5) / 32 - 1) * 2 * reach
    full = 0.8 / np.pi
    width = 4 * reach / 64
    assert (row[x < -reach - width] == 0).all()
    assert row[x > reach + width] == pytest.approx(full, rel=0.03)
    assert ((0 < row) & (row < 0.995 * full))[np.abs(x) < reach - width].all()
    # The disk in the tangent plane; for small angles its rim is at x / height.
    s = np.clip(x / reach, -1, 1)
    share = 0.5 + (s * np.sqrt(1 - s * s) + np.arcsin(s)) / np.pi
    assert np.abs(row / full - share).max() < 0.03


def test_a_light_of_no_size_has_a_hard_shadow():
    camera = view((0, 0), half=1.0, size=64, height=1.0)
    row = seen([*floor(), *half_plane(2.0)], camera, lights=light(SUN))["combined"][0, :, 0]
    assert (row[:32] == 0).all() and row[32:] == pytest.approx(0.8 / np.pi)


def test_a_light_that_casts_no_shadow():
    shaded = [*floor(), [[-9, -9, 2], [9, -9, 2], [0, 9, 2]]]
    camera = view(height=1.0)
    assert red(shaded, camera, lights=light(SUN)) == 0
    assert red(shaded, camera, lights=light(SUN, shadowless=True)) == pytest.approx(0.8 / np.pi)


def test_ambient_occlusion_beside_a_wall():
    """At a distance a from a wall of height h the share (1 - a / √(a² + h²)) / 2 of the light is hidden."""
    wall, far = 2.0, 200.0
    corner = [*floor(300), [[0, -far, 0], [0, far, 0], [0, far, wall]], [[0, -far, 0], [0, far, wall], [0, -far, wall]]]
    for away in (0.05, 0.5, 2.0):
        options = {"ambient": (1, 1, 1), "ambient_occlusion": True, "samples": 4096}
        hidden = 0.5 * (1 - away / np.hypot(away, wall))
        assert red(corner, view((away, 0)), **options) == pytest.approx(0.8 * (1 - hidden), rel=3e-3)
        # All that is further away than the distance is left out.
        assert red(corner, view((away, 0)), **options, ambient_occlusion_distance=away / 2) == pytest.approx(0.8)
        assert red(corner, view((away, 0)), ambient=(1, 1, 1)) == pytest.approx(0.8)


def test_ambient_occlusion_dims_the_headlight_but_no_other_light():
    corner = [*floor(300), [[0, -200, 0], [0, 200, 0], [0, 200, 200]], [[0, -200, 0], [0, 200, 200], [0, -200, 200]]]
    beside = view((0.01, 0))
    options = {"ambient_occlusion": True, "samples": 4096}
    assert red(corner, beside, **options, lights=light(HEADLIGHT)) == pytest.approx(0.4, rel=0.02)
    assert red(corner, beside, **options, ambient=None) == pytest.approx(0.4, rel=0.02)
    assert red(corner, beside, **options, lights=light(SUN, colour=(3, 0, 0))) == pytest.approx(0.8 / np.pi * 3)


def test_a_headlight_beside_other_lights():
    lights = np.concatenate([light(HEADLIGHT, colour=(0.5, 0, 0)), light(SUN, colour=(3, 0, 0))])
    assert red(floor(), lights=lights) == pytest.approx(0.8 * (0.5 + 3 / np.pi))


def test_the_background_is_behind_all():
    camera = bihtree.Camera(clip_to_world(look_at((0, 0, 9), (0, 0, 0), (0, 1, 0)), orthographic(2, 2, 0.1, 20)), 8, 8)
    shown = seen(floor(1.0), camera, samples=4, background=(0.25, 0.5, 0.75, 1))["combined"]
    assert (shown[0, 0] == (0.25, 0.5, 0.75, 1)).all() and (shown[..., 3] == 1).all()
    assert (seen(floor(1.0), camera)["combined"][0, 0] == 0).all()


def four_triangles():
    """One in each quarter of the picture of `four`, and the camera for it."""
    corners = [[[x, y, 0], [x + 1, y, 0], [x, y + 1, 0]] for y in (-1, 0) for x in (-1, 0)]
    camera = bihtree.Camera(clip_to_world(look_at((0, 0, 9), (0, 0, 0), (0, 1, 0)), orthographic(1, 1, 0.1, 20)), 2, 2)
    return corners, camera


def test_slots_name_surfaces_and_objects_shift_them():
    corners, _ = four_triangles()
    camera = bihtree.Camera(
        clip_to_world(look_at((0.25 - 0.5, -0.25, 9), (-0.25, -0.25, 0), (0, 1, 0)), orthographic(1, 1, 0.1, 20)), 2, 2
    )
    surfaces = np.zeros(4, SURFACE)
    surfaces["base"] = [(0.1, 0, 0), (0.2, 0, 0), (0.3, 0, 0), (0.4, 0, 0)]
    surfaces["emission"][3] = 0, 0, 5
    surfaces["index"] = 11, 12, 13, 14
    objects = np.zeros(2, OBJECT)
    objects["first_triangle"], objects["first_surface"], objects["index"] = (0, 3), (1, 3), (7, 8)
    shown = seen(
        corners,
        camera,
        ("combined", "triangle", "instance", "object_index", "material_index"),
        lights=light(HEADLIGHT),
        surfaces=surfaces,
        objects=objects,
        materials=np.array([0, 1, 0, 0], np.int32),
    )
    assert shown["triangle"][..., 0].tolist() == [[0, 1], [2, 3]]
    assert shown["instance"][..., 0].tolist() == [[0, 0], [0, 1]]
    assert shown["object_index"][..., 0].tolist() == [[7, 7], [7, 8]]
    assert shown["material_index"][..., 0].tolist() == [[12, 13], [12, 14]]
    assert shown["combined"][..., 0] == pytest.approx(np.array([[0.2, 0.3], [0.2, 0.4]]))
    assert shown["combined"][..., 2].tolist() == [[0, 0], [0, 5]]
    missed = seen(corners, view((50, 50)), ("instance", "object_index", "material_index"))
    assert [int(missed[name][0, 0, 0]) for name in missed] == [-1, 0, 0]


def test_smooth_normals_are_between_those_of_the_corners():
    """On a sphere with its true normals: the normal of each pixel is that of the place, much nearer than flat ones."""
    mesh = meshes.icosphere(2)
    tree = bihtree.Tree(*mesh)
    matrix = clip_to_world(look_at((0, -4, 0), (0, 0, 0)), perspective(0.03, 0.03, 0.1, 20))
    camera = bihtree.Camera(matrix, 64, 64)
    normals = mesh.vertices[mesh.triangles]
    smooth = bihtree.render(tree, camera, passes=["normal", "position"], corner_normals=normals)
    # Of any length, and turned inside out: the side that is seen counts.
    turned = bihtree.render(tree, camera, passes=["normal"], corner_normals=-3 * normals.astype(np.float64))
    flat = bihtree.render(tree, camera, passes=["normal"])
    hit = np.linalg.norm(smooth["position"], axis=2) > 0
    place = smooth["position"] / np.maximum(np.linalg.norm(smooth["position"], axis=2, keepdims=True), 1e-9)
    error = {name: np.linalg.norm((shown - place)[hit], axis=1).max() for name, shown in
             (("smooth", smooth["normal"]), ("turned", turned["normal"]), ("flat", flat["normal"]))}  # fmt: skip
    assert hit.sum() > 1000
    assert error["smooth"] < 0.02 and error["turned"] < 0.02 and 0.1 < error["flat"]


def test_zero_and_nan_corner_normals_leave_the_triangles_own():
    normals = np.zeros((2, 3, 3), np.float32)
    normals[1] = np.nan
    shown = seen(floor(1), view((0, 0), half=0.5, size=8), ("normal",), corner_normals=normals)["normal"]
    assert (shown == (0, 0, 1)).all()


def stack_of(*heights):
    return [triangle for height in heights for triangle in np.array(floor(5)) + (0, 0, height)]


def flagged(*flags):
    objects = np.zeros(len(flags), OBJECT)
    objects["first_triangle"], objects["flags"] = 2 * np.arange(len(flags)), flags
    return objects


def test_camera_rays_pass_through_what_is_hidden_from_them():
    for heights in ((0, 1, 2), (0, 2, 2)):  # the second and the third may lie in one place
        shown = seen(stack_of(*heights), passes=("instance", "depth"), objects=flagged(0, 0, HIDDEN))
        assert shown["instance"][0, 0, 0] == 1 and shown["depth"][0, 0, 0] == pytest.approx(39.9 - heights[1])
        shown = seen(stack_of(*heights), passes=("instance",), objects=flagged(0, HIDDEN, HIDDEN))
        assert shown["instance"][0, 0, 0] == 0
    assert seen(stack_of(0), passes=("triangle",), objects=flagged(HIDDEN))["triangle"][0, 0, 0] == -1


def test_what_is_hidden_still_casts_its_shadow_and_what_casts_none_is_still_seen():
    lights = light(SUN)
    for flags, is_lit in ((HIDDEN, False), (HIDDEN | NO_SHADOW, True)):
        shown = seen(stack_of(0, 1), objects=flagged(0, flags), lights=lights)["combined"]
        assert bool(shown[0, 0, 0] > 0) is is_lit
    # In one place with one that casts a shadow.
    assert red(stack_of(0, 1, 1), objects=flagged(0, HIDDEN | NO_SHADOW, HIDDEN), lights=lights) == 0
    assert seen(stack_of(0, 1), passes=("instance",), objects=flagged(0, NO_SHADOW))["instance"][0, 0, 0] == 1


def test_a_holdout_is_a_hole_in_the_picture_and_no_other_pass():
    shown = seen(stack_of(0, 1), passes=("combined", "instance"), objects=flagged(0, HOLDOUT), background=(1, 1, 1, 1))
    assert (shown["combined"] == 0).all() and shown["instance"][0, 0, 0] == 1


def test_the_same_bits_for_any_threads_and_tile():
    mesh = meshes.terrain(16)
    matrix = clip_to_world(look_at((0.5, -1.5, 1.4), (0.5, 0.5, 0)), perspective(0.035, 0.025, 0.1, 100))
    camera = bihtree.Camera(matrix, 70, 50)
    lights = np.concatenate(
        [light(kind, (0.5, 0.5, 1.5), (0, 0.1, -1), (0.3, 0.2), (1, 0.5), (5, 6, 7)) for kind in range(5)]
    )
    options = {"lights": lights, "samples": 3, "seed": 4, "ambient": (0.1, 0.2, 0.3), "ambient_occlusion": True}
    whole = bihtree.render(bihtree.Tree(*mesh, threads=1), camera, **options)["combined"]
    tree = bihtree.Tree(*mesh, threads=3, build="on_demand")
    assert bihtree.render(tree, camera, **options)["combined"].tobytes() == whole.tobytes()
    x, y, width, height = tile = (13, 7, 40, 33)
    part = bihtree.render(tree, camera, **options, tile=tile)["combined"]
    assert part.tobytes() == whole[y : y + height, x : x + width].tobytes()
    other = bihtree.render(tree, camera, **{**options, "seed": 5})["combined"]
    assert other.tobytes() != whole.tobytes() and np.abs(other.mean() - whole.mean()) < 0.02 * whole.mean()


def objects_with(**fields):
    objects = np.zeros(2, OBJECT)
    objects["first_triangle"] = 0, 1
    for name, values in fields.items():
        objects[name] = values
    return objects


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"lights": light(9)}, "lights: row 0 is of kind 9"),
        ({"lights": light(POINT, size=(-1, 0))}, "lights: row 0 has the size -1"),
        ({"lights": light(SUN, colour=(np.nan, 0, 0))}, "lights: row 0 holds NaN in colour"),
        ({"lights": light(RECTANGLE, direction=(1, 0, 0))}, "lights: row 0 has its axis along it"),
        ({"lights": np.zeros(3)}, "lights: expected a structured array"),
        ({"surfaces": np.zeros(3)}, "surfaces: expected a structured array"),
        ({"surfaces": np.zeros(0, SURFACE), "materials": np.zeros(3, np.int32)}, r"materials: expected \(2,\) int32"),
        ({"materials": np.zeros(2, np.int64)}, r"materials: expected \(2,\) int32"),
        (
            {"surfaces": np.zeros(1, SURFACE), "materials": np.array([0, 1], np.int32)},
            "triangle 1 of object 0 has slot 1",
        ),
        (
            {"surfaces": np.zeros(1, SURFACE), "materials": np.array([-1, 0], np.int32)},
            "triangle 0 of object 0 has slot -1",
        ),
        ({"surfaces": np.zeros(2, SURFACE), "objects": objects_with(first_surface=(0, 2))}, "triangle 1 of object 1"),
        ({"objects": objects_with(first_triangle=(1, 2))}, "objects: row 0 begins at triangle 1"),
        ({"objects": objects_with(first_triangle=(0, 3))}, "objects: row 1 begins at triangle 3; there are 2"),
        ({"objects": objects_with(first_surface=(0, -1))}, "objects: first_surface of row 1 is -1"),
        ({"objects": np.zeros(0, OBJECT)}, "objects: there are none"),
        ({"corner_normals": np.zeros((2, 3), np.float32)}, r"corner_normals: expected \(2, 3, 3\) floats"),
        ({"background": (0, 0, np.inf, 0)}, "background: holds inf"),
        ({"ambient": (0, np.nan, 0)}, "ambient: holds NaN"),
        ({"ambient_occlusion_distance": 0.0}, "ambient_occlusion_distance: 0 is not above 0"),
    ],
)
def test_what_is_wrong_is_named(options, says):
    with pytest.raises(bihtree.GeometryError, match=says):
        seen(floor(), **options)
