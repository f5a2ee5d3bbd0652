"""Image files: what is written is what was given, in the encoding that the format wants, or nothing is left."""

import resource
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from addon.pipeline import image
from addon.pipeline.errors import UserError
from addon.pipeline.files import written_beside

RNG = np.random.default_rng(5)


def decoded(code: float) -> float:
    """IEC 61966-2-1 from an sRGB value in [0, 1] to a linear one: the inverse of what is tested."""
    return code / 12.92 if code <= 0.04045 else ((code + 0.055) / 1.055) ** 2.4


def smooth(height: int = 24, width: int = 40) -> np.ndarray:
    """A premultiplied picture whose four corners differ, with cover 0, partial and 1."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    cover = np.clip(2 * x / width - 0.25, 0, 1)
    colour = np.stack([x / width, y / height, 1 - x / width * 0.5], axis=2)
    return np.concatenate([colour * cover[..., None], cover[..., None]], axis=2).astype(np.float32)


def opaque() -> np.ndarray:
    picture = smooth()
    picture[..., 3] = 1
    return picture


def passes(height: int = 13, width: int = 17) -> dict[str, np.ndarray]:
    made = {name: RNG.normal(0, 2, (height, width, len(channels))) for name, channels in image.CHANNELS.items()}
    arrays: dict[str, np.ndarray] = {name: values.astype(np.float32) for name, values in made.items()}
    arrays["triangle"] = RNG.integers(0, 2**31 - 1, (height, width, 1)).astype(np.int32)
    arrays["triangle"][0, :4, 0] = [-1, 2**31 - 1, 2**24 + 1, 0]
    arrays["depth"][3, 5] = np.inf
    return arrays


def channels_of(path: Path) -> dict[str, np.ndarray]:
    """Every channel of a file's one image, in its own type, first row at the bottom."""
    source = OpenImageIO.ImageInput.open(str(path))
    assert not source.seek_subimage(1, 0)
    source.seek_subimage(0, 0)
    spec = source.spec()
    return {
        name: source.read_image(0, 0, at, at + 1, spec.channelformats[at] if spec.channelformats else spec.format)[
            ::-1, :, 0
        ]
        for at, name in enumerate(spec.channelnames)
    }


def test_srgb_codes_are_the_nearest_of_the_standard() -> None:
    for code in range(256):
        low, high = (decoded((code + half) / 255) for half in (-0.4999, 0.4999))
        ends = np.array([[[max(low, 0), decoded(code / 255), min(high, 1), 1]]], np.float32)
        assert image.to_srgb8(ends, alpha=False).tolist() == [[[code] * 3]]


def test_srgb_of_what_no_screen_can_show() -> None:
    assert image.encode_srgb(np.array([-1.0, -np.inf, np.nan, 1.5, np.inf])).tolist() == pytest.approx([0, 0, 0, 1, 1])


def test_alpha_is_straight_in_bytes() -> None:
    half = decoded(128 / 255)
    picture = np.array([[[0, 0, 0, 0], [half / 4, 0, half / 4, 0.25], [1, half, 0, 1], [2, 0.5, 0, 0.5]]], np.float32)
    assert image.to_srgb8(picture).tolist() == [
        [[0, 0, 0, 0], [128, 0, 128, 64], [255, 128, 0, 255], [255, 255, 0, 128]]
    ]
    over_black = image.to_srgb8(picture, alpha=False)
    assert over_black[0, 0].tolist() == [0, 0, 0]
    assert over_black[0, 2].tolist() == [255, 128, 0]
    assert decoded(over_black[0, 1, 0] / 255) == pytest.approx(half / 4, rel=0.02)


@pytest.mark.parametrize("suffix", image.EIGHT_BIT)
def test_an_8_bit_file_holds_the_encoded_picture(tmp_path: Path, suffix: str) -> None:
    picture = opaque()
    image.write_picture(tmp_path / f"a{suffix}", picture)
    got = image.read_image(tmp_path / f"a{suffix}")
    error = np.abs(got[..., :3].astype(int) - image.to_srgb8(picture, alpha=False))
    assert got.dtype == np.uint8
    assert error.mean() <= (2 if suffix in (".jpg", ".jpeg", ".webp") else 0)
    assert (got[..., 3:] == 255).all()


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tga"])
def test_partial_cover_survives(tmp_path: Path, suffix: str) -> None:
    image.write_picture(tmp_path / f"a{suffix}", smooth())
    assert (image.read_image(tmp_path / f"a{suffix}") == image.to_srgb8(smooth())).all()


def test_a_linear_file_stays_linear(tmp_path: Path) -> None:
    picture = opaque() * np.float32(40)
    image.write_picture(tmp_path / "a.hdr", picture)
    got = image.read_image(tmp_path / "a.hdr")
    # Radiance shares one exponent: an error of 1/256 of the largest of the three.
    assert (np.abs(got - picture[..., :3]) <= picture[..., :3].max(axis=2, keepdims=True) / 128).all()


def test_blender_reads_the_png_the_right_way_up_with_straight_alpha(tmp_path: Path) -> None:
    bpy = pytest.importorskip("bpy", reason="needs Blender as a module")
    image.write_picture(tmp_path / "a.png", smooth())
    loaded = bpy.data.images.load(str(tmp_path / "a.png"))
    pixels = np.empty(len(loaded.pixels), np.float32)
    loaded.pixels.foreach_get(pixels)
    width, height = loaded.size
    bpy.data.images.remove(loaded)
    assert (np.rint(pixels * 255).reshape(height, width, 4) == image.to_srgb8(smooth())).all()


def test_a_multilayer_exr_holds_the_bits_of_every_pass(tmp_path: Path) -> None:
    arrays = passes()
    image.write_passes(tmp_path / "a.exr", arrays)
    got = channels_of(tmp_path / "a.exr")
    assert len(got) == sum(values.shape[2] for values in arrays.values())
    for name, values in arrays.items():
        for number, channel in enumerate(image.CHANNELS[name]):
            stored, given = got[f"ViewLayer.{channel}"], values[..., number]
            if name == "triangle":
                assert stored.dtype == np.uint32
                assert (stored.view(np.int32) == given).all()
            else:
                assert stored.dtype == np.float32
                assert (stored == np.where(given == np.inf, np.float32(1e10), given)).all()


@pytest.mark.parametrize("names", [("combined",), ("combined", "depth"), tuple(image.CHANNELS)])
def test_blender_opens_the_exr_as_multilayer(tmp_path: Path, names: tuple[str, ...]) -> None:
    bpy = pytest.importorskip("bpy", reason="needs Blender as a module")
    arrays = passes()
    image.write_passes(tmp_path / "a.exr", {name: arrays[name] for name in names})
    loaded = bpy.data.images.load(str(tmp_path / "a.exr"))
    len(loaded.pixels)  # Blender looks at the file when the pixels are first asked for
    group = bpy.data.node_groups.new("passes", "CompositorNodeTree")
    node = group.nodes.new("CompositorNodeImage")
    node.image = loaded
    shown = {socket.name for socket in node.outputs if socket.enabled} - {"Alpha"}
    kind = loaded.type
    bpy.data.node_groups.remove(group)
    bpy.data.images.remove(loaded)
    assert kind == "MULTILAYER"
    assert shown == {channel.split(".")[0] for name in names for channel in image.CHANNELS[name]}


@contextmanager
def files_at_most(size: int) -> Iterator[None]:
    """The system refuses to let a file grow beyond `size` bytes, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("suffix", [*image.EIGHT_BIT, *image.LINEAR, *image.MULTILAYER])
def test_a_disk_that_fills_up_leaves_no_half_written_file(tmp_path: Path, suffix: str) -> None:
    target = tmp_path / f"a{suffix}"
    noise = RNG.random((256, 256, 4)).astype(np.float32)
    noise[..., 3] = 1  # WebP takes a minute over noise in it

    def write() -> None:
        with written_beside(target) as beside:
            if suffix in image.MULTILAYER:
                image.write_passes(beside, {"combined": noise})
            else:
                image.write_picture(beside, noise)

    with files_at_most(8192), pytest.raises(UserError, match=f"cannot write .*a{suffix}: .") as caught:
        write()
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []
    write()
    assert list(tmp_path.iterdir()) == [target]


def test_a_picture_that_the_format_cannot_hold_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"cannot write .*wide.jpg: ."), written_beside(tmp_path / "wide.jpg") as beside:
        image.write_picture(beside, np.zeros((1, 70000, 4), np.float32))
    assert list(tmp_path.iterdir()) == []


def test_names_that_no_image_can_have() -> None:
    for suffix in image.EIGHT_BIT + image.LINEAR + image.MULTILAYER:
        image.check_format(Path(f"a{suffix}"))
        image.check_format(Path(f"A{suffix.upper()}"))
    for name in ("a", "a.txt", "a.blend", "png", ".png"):
        with pytest.raises(UserError, match=r"must end in one of .png") as caught:
            image.check_format(Path(name))
        assert caught.value.exit_status == 2
    with pytest.raises(UserError, match=r"must end in one of .png"):
        image.check_format(Path("a.exr"), kinds=image.EIGHT_BIT)


def test_reading_what_is_not_there_or_not_an_image(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"cannot read .*none.png"):
        image.read_image(tmp_path / "none.png")
    (tmp_path / "text.png").write_text("no picture")
    with pytest.raises(UserError, match=r"cannot read .*text.png: ."):
        image.read_image(tmp_path / "text.png")
    image.write_picture(tmp_path / "whole.png", smooth())
    data = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "cut.png").write_bytes(data[: len(data) // 2])
    with pytest.raises(UserError, match=r"cannot read .*cut.png: ."):
        image.read_image(tmp_path / "cut.png")


def test_where_openimageio_is_missing_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenImageIO", None)
    assert image.version() is None
    with pytest.raises(UserError, match="pip install OpenImageIO") as caught:
        image.check_format(Path("a.png"))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 1
