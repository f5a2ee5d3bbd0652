"""Pictures in one call."""

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Tree
from .scene import Scene

__all__ = ["Camera", "render"]

@final
class Camera:
    """A camera and the size of its picture in pixels."""

    def __new__(cls, clip_to_world: ArrayLike, width: int, height: int) -> Camera:
        """clip_to_world (4, 4): the inverse of projection times view, as OpenGL and Blender have it. Raises
        GeometryError for a singular matrix and for a size below 1 or above 65536."""

    def rays(self, *, sample: int = 0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origins on the near plane and directions of unit length, both (height * width, 3), row by row from the lower
        left; sample 0 goes through the centres of the pixels."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...

def render(
    scene: Tree | Scene,
    camera: Camera,
    *,
    passes: Sequence[str] = ...,
    samples: int = 1,
    first_sample: int = 0,
    seed: int = 0,
    shadows: bool = True,
    ambient_occlusion: bool = False,
    ambient_occlusion_distance: float = ...,
    lights: ArrayLike | None = None,
    ambient: tuple[float, float, float] | None = None,
    background: tuple[float, float, float, float] | None = None,
    surfaces: ArrayLike | None = None,
    objects: ArrayLike | None = None,
    materials: ArrayLike | None = None,
    corner_normals: ArrayLike | None = None,
    tile: tuple[int, int, int, int] | None = None,
    progress: Callable[[float], bool | None] | None = None,
) -> dict[str, NDArray[Any]]:
    """Trace one picture of a tree or of a scene in one call, between the camera's clip planes.

    passes, each (height, width, channels), first row at the bottom. float32: combined (4, scene-linear, multiplied by
    alpha), depth (1, along the viewing axis: from a perspective camera, from an orthographic one's near plane; inf for
    a miss), normal (3, unit, world: the triangle's own, facing the ray, or the one between corner_normals on that
    side; 0 for a miss), position (3; 0 for a miss), cost (2: nodes visited, triangles tested). int32: triangle (1; -1
    for a miss), instance (1, the row of objects; -1 for a miss), object_index and material_index (1, what the rows of
    objects and surfaces say; 0 for a miss). By default combined alone.
    samples: rays a pixel for combined; the other passes show the first.
    first_sample: its number. Sample 0 goes through the pixel's centre, and with the later ones it fills the pixel, the
        lights and the hemisphere evenly: but for rounding, the mean of pictures of one sample each is the picture of
        all of them.
    seed: shifts the places of all samples but sample 0, and those on lights.
    lights: a structured array, one row a light. kind: 0 a sun (colour: irradiance in W/m² along direction), 1 a point,
        2 a spot, 3 a rectangle, 4 an ellipse (colour: power in W), 5 a headlight (colour: radiance of a white surface
        that faces the camera ray). position (3), direction (3: where a sun, a spot, a rectangle and an ellipse shine),
        colour (3). Fields that may be absent: size (2: a sun's angle from side to side in radians, a radius, or width
        and height; 0), axis (3: along the width), spot (2: angle from side to side in radians, and blend from 0 to 1),
        shadowless (whether nothing that stands before it hides it; False). A light with a size is sampled once by each
        sample of a pixel, and its shadows are soft. No lights and no ambient: a headlight.
    shadows: whether lights are hidden by what stands before them.
    ambient: radiance from everywhere around; None: beside lights a dim headlight, so that nothing is black.
    ambient_occlusion: what stands within ambient_occlusion_distance hides the surroundings and the headlight: one ray
        more a sample.
    background: red, green, blue, multiplied by alpha, and alpha where nothing is hit; None: all 0.
    surfaces: a structured array, one row a material slot of an object: base (3, reflectance), and where there is such
        a field emission (3, radiance) and index (for material_index). None: all is grey, 0.8.
    objects: a structured array, one row an object: first_triangle, where its triangles begin (they end where the next
        ones do; the first begin at 0), and where there is such a field first_surface (0), index (for object_index; 0)
        and flags (the sum of 1: camera rays pass through it, 2: shadow rays do, 4: a holdout, where it is seen
        combined is 0). None: one object.
    materials: (T,) int32, the material slot of each triangle: its surface is row first_surface + slot; None: all 0.
    corner_normals: (T, 3, 3) floats, normals at the corners of each triangle, of any length; None: flat. Neither is
        kept.
    Of a Scene the objects are its instances, one row each without first_triangle, and the pass instance has their rows;
    materials and corner_normals are sequences with one array or None for each of its trees, normals in the mesh's own
    space. A picture of precision "fast" is decided exactly there.
    tile: (x, y, width, height) in pixels from the lower left: only that part, in its own size.
    progress: called on this thread with the share done, from 0 to 1; returning False cancels.

    The same bits for any number of threads, instruction set and tile.

    Raises TypeError (a scene that is neither), ValueError (an unknown pass, samples below 1), GeometryError (tile,
    lights, surfaces, a slot without one, objects, materials, corner_normals, numbers that are not finite), Cancelled.
    """
