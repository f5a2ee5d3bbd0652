"""bihtree: ray queries on triangle meshes by a Bounding Interval Hierarchy."""

from ._bihtree import Camera, HitLists, Hits, Scene, Stats, Tree, __version__, cpu_features, render
from .errors import BihError, Cancelled, FileFormatError, GeometryError

__all__ = [
    "BihError",
    "Camera",
    "Cancelled",
    "FileFormatError",
    "GeometryError",
    "HitLists",
    "Hits",
    "Scene",
    "Stats",
    "Tree",
    "__version__",
    "cpu_features",
    "render",
]
