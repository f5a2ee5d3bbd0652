"""A scene-linear picture as Blender shows it: through the view transform, exposure, curves and gamma of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy
import numpy as np
from numpy.typing import NDArray

from ..pipeline.image import read_image
from .compat import as_png


class Display:
    """The view of one scene. It must stay open as long as this is used."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene

    def __call__(self, picture: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Scene-linear premultiplied (H, W, 4) as finished 8-bit pixels with straight alpha."""
        height, width = picture.shape[:2]
        image = bpy.data.images.new("BIH", width, height, alpha=True, float_buffer=True)
        try:
            image.alpha_mode = "PREMUL"
            image.pixels.foreach_set(np.ascontiguousarray(picture, np.float32).ravel())
            with TemporaryDirectory() as folder, _png(self._scene):
                path = Path(folder) / "picture.png"
                image.save_render(str(path), scene=self._scene)
                finished: NDArray[np.uint8] = read_image(path).astype(np.uint8, copy=False)
        finally:
            bpy.data.images.remove(image)
        return finished


@contextmanager
def _png(scene: bpy.types.Scene) -> Iterator[None]:
    """Files are PNG of 8 bits with alpha meanwhile, and without noise."""
    render = scene.render
    dither, render.dither_intensity = render.dither_intensity, 0.0
    try:
        with as_png(render.image_settings):
            yield
    finally:
        render.dither_intensity = dither
