"""render: every pass against the queries on Camera.rays() and against what light does."""

import bihtree
import numpy as np
import pytest

from tests import meshes
from tests.native.views import clip_to_world, look_at, orthographic, perspective
from tests.variants import every_tree

WIDTH, HEIGHT = 70, 50
PASSES = ("combined", "depth", "normal", "position", "triangle", "cost")
CHANNELS = {"combined": 4, "depth": 1, "normal": 3, "position": 3, "triangle": 1, "cost": 2}
LIGHT = np.dtype([("kind", "u1"), ("position", "f8", 3), ("direction", "f8", 3), ("colour", "f4", 3)])
SUN, POINT = 0, 1
VIEW = look_at((0.5, -1.5, 1.4), (0.5, 0.5, 0))
CAMERAS = {
    "perspective": clip_to_world(VIEW, perspective(0.035, 0.025, 0.1, 100)),
    "orthographic": clip_to_world(VIEW, orthographic(0.84, 0.6, 0.25, 100)),
}
TERRAIN = meshes.terrain(24)


def light(kind, position=(0, 0, 0), direction=(0, 0, -1), colour=(1, 1, 1)):
    return np.array([(kind, position, direction, colour)], LIGHT)


@every_tree
@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_passes_are_those_of_the_queries(variant, name, dtype):
    mesh = TERRAIN.astype(dtype)
    tree = variant.tree(*mesh)
    camera = bihtree.Camera(CAMERAS[name], WIDTH, HEIGHT)
    passes = bihtree.render(tree, camera, passes=PASSES)
    assert set(passes) == set(PASSES)
    for key, picture in passes.items():
        assert picture.shape == (HEIGHT, WIDTH, CHANNELS[key])
        assert picture.dtype == (np.int32 if key == "triangle" else np.float32)
    flat = {key: picture.reshape(WIDTH * HEIGHT, -1) for key, picture in passes.items()}

    origins, directions = camera.rays()
    hits = tree.intersect(origins, directions)
    hit = hits.hit
    assert 500 < hit.sum() < WIDTH * HEIGHT
    assert np.array_equal(flat["triangle"][:, 0], hits.triangle)
    assert np.array_equal(flat["cost"], np.stack(tree.traversal_cost(origins, directions), axis=1))

    corners = mesh.corners().astype(np.float64)[hits.triangle[hit]]
    weights = np.stack([1 - hits.u[hit] - hits.v[hit], hits.u[hit], hits.v[hit]], axis=1).astype(np.float64)
    position = (weights[:, :, None] * corners).sum(axis=1)
    assert np.allclose(flat["position"][hit], position, rtol=0, atol=1e-6)
    start = VIEW[:3, 3] if name == "perspective" else VIEW[:3, 3] - 0.25 * VIEW[:3, 2]
    assert np.allclose(flat["depth"][hit, 0], (position - start) @ -VIEW[:3, 2], rtol=0, atol=2e-6)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= -np.sign((normal * directions[hit]).sum(axis=1, keepdims=True))
    assert np.allclose(flat["normal"][hit], normal, rtol=0, atol=1e-6)

    assert np.isinf(flat["depth"][~hit]).all()
    for key in ("normal", "position", "combined"):
        assert not flat[key][~hit].any()
    assert (flat["combined"][hit, 3] == 1).all()


def test_the_first_row_is_the_bottom_one():
    """Four triangles in the corners of the picture, named by their rows."""
    places = [(-1, -1), (1, -1), (-1, 1), (1, 1)]
    corners = [[[x, y, 0], [x * 0.5, y, 0], [x, y * 0.5, 0]] for x, y in places]
    camera = bihtree.Camera(np.diag([1, 1, -1.0, 1]), 9, 9)
    triangle = bihtree.render(bihtree.Tree(*meshes.from_corners(corners)), camera, passes=["triangle"])["triangle"][
        ..., 0
    ]
    assert (triangle[0, 0], triangle[0, -1], triangle[-1, 0], triangle[-1, -1], triangle[4, 4]) == (0, 1, 2, 3, -1)


def test_nothing_nearer_than_the_near_plane_or_beyond_the_far_one():
    mesh = meshes.from_corners([[[-9, -9, -z], [9, -9, -z], [0, 9, -z]] for z in (0.5, 1.0, 2.0, 4.0, 4.5)])
    for near, far, row in [(0.75, 3, 1), (1.5, 3, 2), (2.5, 3.5, -1), (4.25, 9, 4)]:
        camera = bihtree.Camera(np.linalg.inv(perspective(near * 0.5, near * 0.5, near, far)), 3, 3)
        triangle = bihtree.render(bihtree.Tree(*mesh), camera, passes=["triangle"])["triangle"]
        assert (triangle == row).all()


def test_the_same_bits_for_any_threads_and_every_tile():
    camera = bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT)
    options = {"passes": PASSES, "samples": 3, "lights": light(SUN, direction=(1, 1, -2))}
    whole = bihtree.render(bihtree.Tree(*TERRAIN, threads=1), camera, **options)
    tree = bihtree.Tree(*TERRAIN, threads=3)
    for tile in [
        (0, 0, WIDTH, HEIGHT),
        (0, 0, 1, 1),
        (13, 7, 40, 33),
        (WIDTH - 1, HEIGHT - 1, 1, 1),
        (0, 10, WIDTH, 1),
    ]:
        part = bihtree.render(tree, camera, **options, tile=tile)
        x, y, width, height = tile
        for name in PASSES:
            assert part[name].tobytes() == whole[name][y : y + height, x : x + width].tobytes(), (name, tile)


def test_only_the_passes_asked_for():
    camera = bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT)
    tree = bihtree.Tree(*TERRAIN)
    whole = bihtree.render(tree, camera, passes=PASSES)
    assert list(bihtree.render(tree, camera)) == ["combined"]
    for name in PASSES:
        alone = bihtree.render(tree, camera, passes=[name])
        assert list(alone) == [name] and alone[name].tobytes() == whole[name].tobytes()


def test_samples_and_seed():
    camera = bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT)
    tree = bihtree.Tree(*TERRAIN)
    one = bihtree.render(tree, camera, passes=PASSES, samples=1, seed=5)
    many = bihtree.render(tree, camera, passes=PASSES, samples=16, seed=5)
    assert one["combined"].tobytes() == bihtree.render(tree, camera, samples=1, seed=6)["combined"].tobytes()
    assert many["combined"].tobytes() == bihtree.render(tree, camera, samples=16, seed=5)["combined"].tobytes()
    assert many["combined"].tobytes() != bihtree.render(tree, camera, samples=16, seed=6)["combined"].tobytes()
    for name in PASSES[1:]:
        assert one[name].tobytes() == many[name].tobytes()
    share = many["combined"][..., 3]
    assert np.array_equal(share * 16, np.round(share * 16))
    assert ((0 < share) & (share < 1)).sum() > 50
    counted = np.zeros((HEIGHT, WIDTH), np.float32)
    for sample in range(16):
        counted += tree.intersect(*camera.rays(sample=sample)).hit.reshape(HEIGHT, WIDTH)
    assert np.array_equal(bihtree.render(tree, camera, samples=16)["combined"][..., 3] * 16, counted)


def test_a_picture_goes_on_where_another_one_ended():
    """Pixels, a wide sun and ambient occlusion: sixteen pictures of a sample each are one of sixteen."""
    camera = bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT)
    tree = bihtree.Tree(*TERRAIN)
    sun = np.zeros(1, [*LIGHT.descr, ("size", "f4", 2)])
    sun["direction"], sun["colour"], sun["size"] = (0.7, 0.1, -0.3), 3, 0.5
    given = {"lights": sun, "ambient_occlusion": True, "seed": 3}
    singles = [bihtree.render(tree, camera, first_sample=sample, **given)["combined"] for sample in range(16)]
    whole = bihtree.render(tree, camera, samples=16, **given)["combined"]
    assert np.allclose(np.mean(np.array(singles, float), axis=0), whole, rtol=1e-6, atol=1e-7)
    assert singles[0].tobytes() == bihtree.render(tree, camera, **given)["combined"].tobytes()
    halves = [bihtree.render(tree, camera, samples=8, first_sample=first, **given)["combined"] for first in (0, 8)]
    assert np.allclose(np.mean(np.array(halves, float), axis=0), whole, rtol=1e-6, atol=1e-7)
    later = bihtree.render(tree, camera, passes=PASSES, first_sample=5)
    rays = camera.rays(sample=5)
    assert np.array_equal(later["triangle"].ravel(), tree.intersect(*rays).triangle)


def above(lights=None, *, shadows=True, extra=()):
    """The middle of a floor at z = 0, lit and seen straight from above by an orthographic camera: RGB."""
    floor = meshes.from_corners([[[-9, -9, 0], [9, -9, 0], [-9, 9, 0]], [[9, 9, 0], [-9, 9, 0], [9, -9, 0]], *extra])
    camera = bihtree.Camera(clip_to_world(look_at((0, 0, 8), (0, 0, 0), (0, 1, 0)), orthographic(1, 1, 1, 20)), 1, 1)
    return bihtree.render(bihtree.Tree(*floor), camera, lights=lights, shadows=shadows)["combined"][0, 0, :3]


HIGH = [[-1, -1, 9], [1, -1, 9], [0, 1, 9]]  # above the camera, between the floor and what shines from higher up


def test_a_sun_by_lamberts_law():
    dark = above(light(SUN, colour=(0, 0, 0)))
    upright = above(light(SUN, colour=(3, 2, 1))) - dark
    assert np.allclose(upright, 0.8 / np.pi * np.array([3, 2, 1]), rtol=1e-5)
    slanted = above(light(SUN, direction=(2 * np.sqrt(3), 0, -2), colour=(3, 2, 1))) - dark
    assert np.allclose(slanted, upright / 2, rtol=1e-5)
    from_below = above(light(SUN, direction=(0, 0, 1), colour=(3, 2, 1)))
    assert np.array_equal(from_below, dark)


def test_a_point_by_the_inverse_square():
    dark = above(light(POINT, position=(0, 0, 2), colour=(0, 0, 0)))
    near = above(light(POINT, position=(0, 0, 2), colour=(100, 50, 25))) - dark
    assert np.allclose(near, 0.8 / np.pi * np.array([100, 50, 25]) / (4 * np.pi * 4), rtol=1e-5)
    far = above(light(POINT, position=(0, 0, 4), colour=(100, 50, 25))) - dark
    assert np.allclose(far, near / 4, rtol=1e-5)
    aside = above(light(POINT, position=(2, 0, 2), colour=(100, 50, 25))) - dark
    assert np.allclose(aside, near / 2 / np.sqrt(2), rtol=1e-5)


@pytest.mark.parametrize("lights", [light(SUN), light(POINT, position=(0, 0, 12), colour=(500, 500, 500))])
def test_shadows(lights):
    dark = above(light(SUN, colour=(0, 0, 0)))
    open_sky = above(lights)
    assert (open_sky > dark).all()
    assert np.array_equal(above(lights, extra=[HIGH]), dark)
    assert np.array_equal(above(lights, extra=[HIGH], shadows=False), open_sky)


def test_what_stands_behind_a_point_light_casts_no_shadow():
    lamp = light(POINT, position=(0, 0, 8.5), colour=(500, 500, 500))
    assert np.array_equal(above(lamp, extra=[HIGH]), above(lamp))


def test_lights_add_up():
    dark = above(light(SUN, colour=(0, 0, 0)))
    one, two = light(SUN, direction=(1, 0, -1)), light(POINT, position=(1, 2, 3), colour=(90, 90, 90))
    both = above(np.concatenate([one, two]))
    assert np.allclose(both - dark, (above(one) - dark) + (above(two) - dark), rtol=1e-5)


def test_a_headlight_where_there_is_no_light():
    bright = above()
    assert (bright > 0.5).all() and (bright == bright[0]).all()
    assert np.array_equal(bright, above(np.zeros(0, LIGHT)))
    camera = bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT)
    passes = bihtree.render(bihtree.Tree(*TERRAIN), camera, passes=("combined", "normal", "triangle"))
    hit = passes["triangle"][..., 0].ravel() >= 0
    facing = -(passes["normal"].reshape(-1, 3) * camera.rays()[1]).sum(axis=1)[hit]
    colour = passes["combined"].reshape(-1, 4)[hit]
    assert np.allclose(colour[:, :3], (bright[0] * facing)[:, None], rtol=0, atol=1e-5)


def test_no_surface_shadows_itself():
    """A closed sphere under a sun along the view: every pixel that faces the light is lit, at any distance from 0."""
    for offset in (0.0, 1000.0):
        sphere = meshes.icosphere(3, dtype=np.float64)
        tree = bihtree.Tree(sphere.vertices + offset, sphere.triangles)
        view = look_at((offset, offset, offset + 4), (offset, offset, offset), (0, 1, 0))
        camera = bihtree.Camera(clip_to_world(view, orthographic(1.2, 1.2, 1, 9)), 60, 60)
        for direction in [(0, 0, -1), (0.9, 0, -0.5)]:
            options = {"lights": light(SUN, direction=direction), "passes": ("combined", "normal", "triangle")}
            lit = bihtree.render(tree, camera, **options)
            bare = bihtree.render(tree, camera, **options, shadows=False)
            assert np.array_equal(lit["combined"], bare["combined"])


BAD = [
    ({"passes": ("combined", "beauty")}, ValueError, "beauty"),
    ({"samples": 0}, ValueError, "samples"),
    ({"first_sample": -1}, ValueError, "first_sample: -1 is below 0"),
    ({"first_sample": 2**32 - 2, "samples": 2}, ValueError, "samples: 2 are too many from first_sample 4294967294"),
    ({"tile": (0, 0, 0, 5)}, ValueError, "tile"),
    ({"tile": (60, 0, 20, 5)}, ValueError, "tile"),
    ({"tile": (0, 49, 5, 2)}, ValueError, "tile"),
    ({"lights": np.zeros(3)}, ValueError, "lights"),
    ({"lights": np.zeros(1, [("kind", "u1")])}, ValueError, "lights"),
    ({"lights": light(7)}, ValueError, "lights"),
]


@pytest.mark.parametrize(("options", "error", "name"), BAD)
def test_options_that_are_none(options, error, name):
    with pytest.raises(error, match=name):
        bihtree.render(bihtree.Tree(*TERRAIN), bihtree.Camera(CAMERAS["perspective"], WIDTH, HEIGHT), **options)


def test_a_tree_of_nothing():
    camera = bihtree.Camera(CAMERAS["perspective"], 4, 3)
    passes = bihtree.render(bihtree.Tree(np.empty((0, 3), np.float32)), camera, passes=PASSES)
    assert not passes["combined"].any() and (passes["triangle"] == -1).all() and np.isinf(passes["depth"]).all()
