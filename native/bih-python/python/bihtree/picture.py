"""Pictures in one call."""

from ._bihtree import Camera, render

__all__ = ["Camera", "render"]
