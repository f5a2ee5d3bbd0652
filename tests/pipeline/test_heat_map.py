"""The heat map: its colours grow with the work, and its legend says the pass's own numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from addon.pipeline import cost_map, heat_map, image, preview
from addon.pipeline.settings import Settings
from tests.pipeline.test_preview import two_boxes


def cost(height: int = 90, width: int = 160) -> np.ndarray:
    """Nothing at the left, 99 nodes and as many triangles at the right."""
    row = np.linspace(0, 99, width).round()
    return np.broadcast_to(row[None, :, None], (height, width, 2)).astype(np.float32)


def test_lightness_grows_with_the_work() -> None:
    shown = heat_map.colours(cost())[0] @ (0.2126, 0.7152, 0.0722)
    assert (np.diff(shown) >= 0).all()
    assert shown[-1] > shown[0] + 0.7
    assert (heat_map.colours(np.zeros((2, 2, 2), np.float32)) == cost_map.RAMP[0]).all()


def test_the_legend_says_what_was_counted() -> None:
    lines = heat_map.legend_texts(cost(), {"scene": "slope"})
    assert "scene: slope" in lines
    assert "nodes visited: 49.5 on average, 99 at most" in lines
    assert "triangles tested: 49.5 on average, 99 at most" in lines
    steps = [line for line in lines if line.split()[0].isdigit()]
    assert [int(step.split()[0]) for step in steps] == [0, 49, 98, 147, 196]


def test_the_legend_lies_where_there_is_least_work() -> None:
    picture = heat_map.draw(cost(), {})
    plain = (heat_map.colours(cost()) * 255 + 0.5).astype(np.uint8)
    differs = (picture != plain).any(axis=2)
    assert picture.shape == (90, 160, 3)
    assert differs[:, :80].sum() > 500
    assert not differs[:, 100:].any()


def test_it_is_written_beside_the_picture(tmp_path: Path) -> None:
    outputs = preview.Outputs((tmp_path / "a.png",), heat_map=tmp_path / "heat.png")
    scene, settings = two_boxes(), Settings(passes=("combined",))
    traced = preview.trace(scene, settings, outputs=outputs)
    assert set(traced.passes) == {"combined", "cost"}
    preview.write(traced, scene, settings, outputs)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "heat.png"]
    assert image.read_image(tmp_path / "heat.png").shape == (30, 40, 3)
