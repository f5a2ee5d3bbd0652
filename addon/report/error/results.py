"""All that a report has found so far."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .hits import Hits
from .image_error import Image
from .left_out import LeftOut
from .stability import Stability


@dataclass
class Results:
    """What stands in results.json. Sections are filled as they are measured."""

    scene: str
    source: str
    triangles: int
    vertices: int
    vertex_precision: str
    options: dict[str, Any]
    machine: dict[str, str]
    incomplete: str = ""
    """Why it ended before its end; empty where all was measured."""
    seconds: float = 0.0
    notes: list[str] = field(default_factory=list)
    """What was left out, and why."""
    hits: Hits = field(default_factory=Hits)
    image: Image = field(default_factory=Image)
    stability: Stability = field(default_factory=Stability)
    left_out: LeftOut = field(default_factory=LeftOut)
