"""Image files: plain pictures and multilayer EXR.

Arrays have their first row at the bottom, files at the top: every function here turns them over. OpenImageIO is
imported when a file is read or written, so that rendering works in a Blender without it (4.2 and 4.3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import UserError

MULTILAYER = (".exr",)
LINEAR = (".hdr",)
EIGHT_BIT = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".bmp", ".tga")

MISS_DEPTH = np.float32(1e10)
"""Depth of a miss in an EXR, as in the depth passes that Blender's own engines write: compositors cope with it, and
not with infinity."""

LAYER = "ViewLayer"
CHANNELS = {
    "combined": ("Combined.R", "Combined.G", "Combined.B", "Combined.A"),
    "depth": ("Depth.Z",),
    "normal": ("Normal.X", "Normal.Y", "Normal.Z"),
    "position": ("Position.X", "Position.Y", "Position.Z"),
    "triangle": ("Triangle.X",),
    "instance": ("Instance.X",),
    "object_index": ("Object Index.X",),
    "material_index": ("Material Index.X",),
    # Two passes, because Blender 4.2 reads one of two channels as garbage.
    "cost": ("CostNodes.X", "CostTests.X"),
}
"""The channels of each pass in an EXR, after `LAYER` and a dot."""


def openimageio() -> Any:
    """The OpenImageIO module; UserError where it is missing."""
    try:
        return import_module("OpenImageIO")
    except ImportError:
        raise UserError(
            "image files need the Python module OpenImageIO, and it is missing: use Blender 4.5 or later, "
            "or install it for this Python (pip install OpenImageIO; on Debian the package python3-openimageio)"
        ) from None


def version() -> str | None:
    """OpenImageIO's version, or None where it is missing."""
    try:
        return str(openimageio().VERSION_STRING)
    except UserError:
        return None


def check_format(path: Path, *, kinds: tuple[str, ...] = EIGHT_BIT + LINEAR + MULTILAYER) -> None:
    """Raise UserError unless the suffix of `path` is one of `kinds` and this OpenImageIO can write it."""
    if path.suffix.lower() not in kinds or openimageio().ImageOutput.create(str(path)) is None:
        raise UserError(f"cannot write {path}: its name must end in one of {' '.join(kinds)}", exit_status=2)


def encode_srgb(linear: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Scene-linear values of any shape, clipped to [0, 1] (NaN to 0), to sRGB in [0, 1] (IEC 61966-2-1)."""
    x = np.fmin(np.fmax(np.asarray(linear, np.float64), 0.0), 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1.0 / 2.4) - 0.055)


def to_srgb8(picture: NDArray[np.float32], *, alpha: bool = True) -> NDArray[np.uint8]:
    """Scene-linear premultiplied (H, W, 4) to 8-bit sRGB: (H, W, 4) with straight alpha, or (H, W, 3) over black."""
    colour, cover = picture[..., :3], picture[..., 3:]
    if not alpha:
        return _to_bytes(encode_srgb(colour))
    straight = np.divide(colour, cover, out=np.zeros_like(colour), where=cover > 0.0)
    opacity = np.fmin(np.fmax(cover.astype(np.float64), 0.0), 1.0)
    return _to_bytes(np.concatenate([encode_srgb(straight), opacity], axis=2))


def _to_bytes(values: NDArray[np.float64]) -> NDArray[np.uint8]:
    return (values * 255.0 + 0.5).astype(np.uint8)


Display = Callable[[NDArray[np.float32]], NDArray[np.uint8]]
"""Makes of a scene-linear premultiplied picture (H, W, 4) finished pixels (H, W, 4) with straight alpha."""


def write_picture(path: Path, picture: NDArray[np.float32], display: Display | None = None) -> None:
    """Write a scene-linear premultiplied picture (H, W, 4) as a plain image.

    8-bit formats get what `display` makes of it, None: sRGB, with straight alpha where they have one, else over black;
    linear formats get the colours over black. A failure (OSError) leaves what was written so far: write through
    `written_beside`.
    """
    if path.suffix.lower() in LINEAR:
        _write(path, picture[..., :3], {})
        return
    has_alpha = bool(_output(path).supports("alpha"))
    if display is None:
        write_srgb8(path, to_srgb8(picture, alpha=has_alpha))
        return
    # What is over black before it is displayed has no alpha left to lose.
    opaque = picture if has_alpha else np.concatenate([picture[..., :3], np.ones_like(picture[..., 3:])], axis=2)
    write_srgb8(path, display(opaque)[..., : 4 if has_alpha else 3])


def write_srgb8(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write finished sRGB pixels, (H, W, 3) or (H, W, 4) with straight alpha, to an 8-bit format; fails as
    `write_picture` does."""
    attributes: dict[str, str | int] = {
        "oiio:ColorSpace": "sRGB",
        "oiio:UnassociatedAlpha": 1,
        "CompressionQuality": 95,
        "jpeg:subsampling": "4:4:4",  # thin lines keep their colour
    }
    _write(path, pixels, attributes)


def write_passes(path: Path, passes: Mapping[str, NDArray[np.generic]]) -> None:
    """Write passes (H, W, C) as one multilayer EXR, float32 without loss, that Blender opens as its own.

    Triangle ids are 32-bit unsigned, a miss 4294967295 (-1 when read as int32); Blender shows them as float32, exact
    to 2^24. Depth of a miss is `MISS_DEPTH`. Fails as `write_picture` does.
    """
    names: list[str] = []
    planes: list[NDArray[np.float32]] = []
    for name, values in passes.items():
        names += [f"{LAYER}.{channel}" for channel in CHANNELS[name]]
        if name == "triangle":
            planes.append(np.ascontiguousarray(values, np.int32).view(np.float32))
        elif name == "depth":
            planes.append(np.where(np.isinf(values), MISS_DEPTH, values).astype(np.float32))
        else:
            planes.append(np.asarray(values, np.float32))
    _write(path, np.concatenate(planes, axis=2), {"compression": "zip"}, names)
    if "triangle" in passes:
        _declare_uint(path, f"{LAYER}.{CHANNELS['triangle'][0]}")


def _declare_uint(path: Path, channel: str) -> None:
    """Turn a float channel of an EXR into an unsigned one, its bits untouched.

    OpenImageIO's Python takes one type for all channels and would round ids above 2^24. In the header a channel is
    its name, a zero byte and its type as a little-endian int32, 0 UINT or 2 FLOAT (OpenEXR File Layout, "Channel
    list"); ZIP compression does not look at types.
    """
    name = channel.encode() + b"\0"
    with path.open("r+b") as file:
        at = file.read(1 << 16).find(name + (2).to_bytes(4, "little"))
        if at < 0:
            raise OSError(f"no channel {channel} in the header that OpenImageIO wrote")
        file.seek(at + len(name))
        file.write((0).to_bytes(4, "little"))


def _output(path: Path) -> Any:
    output = openimageio().ImageOutput.create(str(path))
    if output is None:
        raise OSError(openimageio().geterror())
    return output


def _write(path: Path, pixels: NDArray[Any], attributes: Mapping[str, str | int], names: Sequence[str] = ()) -> None:
    height, width, channels = pixels.shape
    spec = openimageio().ImageSpec(width, height, channels, "uint8" if pixels.dtype == np.uint8 else "float")
    for name, value in attributes.items():
        spec.attribute(name, value)
    if names:
        spec.channelnames = tuple(names)
    _check_room(path, pixels.nbytes)
    output = _output(path)
    done = output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels[::-1]))
    # A full disk may show only when the last buffer is flushed.
    if not (output.close() and done):
        raise OSError(output.geterror())


def _check_room(path: Path, raw_bytes: int) -> None:
    """Raise OSError unless the disk takes a file as large as the encoded picture can be.

    On a full disk OpenImageIO's PNG, BMP and Targa writers report success, and its JPEG writer ends the process.
    """
    # Half as much again covers what rows are padded by and what an encoder adds where nothing compresses.
    block = bytes(1 << 20)
    with path.open("wb") as file:
        for _ in range((raw_bytes + raw_bytes // 2 >> 20) + 1):
            file.write(block)


def read_image(path: Path) -> NDArray[np.generic]:
    """Read the first image of a file: (H, W, C) in the file's own type (float32 where channels differ), first row at
    the bottom, alpha as stored. Raises UserError."""
    oiio = openimageio()
    as_stored = oiio.ImageSpec()
    as_stored.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), as_stored)
    if source is None:
        raise UserError(f"cannot read {path}: {oiio.geterror()}")
    spec = source.spec()
    pixels = source.read_image(0, 0, 0, spec.nchannels, "float" if spec.channelformats else spec.format)
    source.close()
    if pixels is None:
        raise UserError(f"cannot read {path}: {source.geterror()}")
    return np.ascontiguousarray(pixels[::-1])
