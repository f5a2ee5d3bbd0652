"""The guide's pictures from the screenshots of the tests: python -m tools.guide_images

tests/blender/test_overlay_window.py, test_viewport.py and test_many_window.py leave them, and where the regions are, in
build/screenshots.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import OpenImageIO

PROJECT = Path(__file__).resolve().parent.parent
SCREENSHOTS = PROJECT / "build" / "screenshots"
IMAGES = PROJECT / "docs" / "images"
WIDTH = 640
"""Pixels across of a picture of the viewport."""

VIEWS = ("planes", "boxes", "leaves", "ray", "play", "cost", "on-demand", "compare", "mesh")
RENDERED = {"border": "border", "large pixels": "pixel-size"}
"""Of Rendered mode: the screenshot, and the picture's name."""
MANY = {"some": "many-read", "traced": "many-traced"}
PANELS = {"panel": ("planes", "sidebar"), "node": ("node", "sidebar"), "properties": ("properties", "properties")}


def main() -> int:
    if not all((SCREENSHOTS / name).exists() for name in ("report.json", "viewport.json", "many.json")):
        tests = "tests/blender/test_overlay_window.py, test_viewport.py and test_many_window.py"
        print(f"{SCREENSHOTS} has not all of them: run {tests} first", file=sys.stderr)
        return 1
    regions = json.loads((SCREENSHOTS / "report.json").read_text())
    x, y, _, height = regions["viewport"]
    # without the sidebar, and without the headers on top
    regions["viewport"] = [x, y, regions["sidebar"][0] - x, height - 70]
    for name in VIEWS:
        save(name, f"guide-{name}", regions["viewport"], WIDTH)
    for name, (shot, region) in PANELS.items():
        save(shot, f"guide-{name}", regions[region], regions[region][2])
    shots = json.loads((SCREENSHOTS / "viewport.json").read_text())["shots"]
    for shot, name in RENDERED.items():
        place = shots[shot]["place"]
        width, height = place["width"], place["height"]
        seen = [place["x"] + width // 4, place["y"] + height // 4, width // 2, height // 2]  # what stands in the middle
        save(f"viewport {shot}", f"guide-{name}", seen, WIDTH)
    x, y, across, height = json.loads((SCREENSHOTS / "many.json").read_text())["place"]
    for shot, name in MANY.items():
        save(f"many {shot}", f"guide-{name}", [x, y, across, height - 70], WIDTH)
    return 0


def save(shot: str, name: str, region: list[int], width: int) -> None:
    """Cut the region (x, y from below, width, height) out of a screenshot, and reduce it to `width` pixels."""
    screen = OpenImageIO.ImageBuf(str(SCREENSHOTS / f"{shot}.png"))
    left, bottom, across, high = region
    top = screen.spec().height - bottom - high
    cut = OpenImageIO.ImageBufAlgo.cut(screen, OpenImageIO.ROI(left, left + across, top, top + high, 0, 1, 0, 3))
    small = OpenImageIO.ROI(0, width, 0, round(high * width / across), 0, 1, 0, 3)
    reduced = OpenImageIO.ImageBufAlgo.resize(cut, "triangle", roi=small)
    path = IMAGES / f"{name}.png"
    reduced.specmod().attribute("png:compressionLevel", 9)
    if not reduced.write(str(path), "uint8"):
        raise OSError(f"{path}: {reduced.geterror()}")
    print(f"{path}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    sys.exit(main())
