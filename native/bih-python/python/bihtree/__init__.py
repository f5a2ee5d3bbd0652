"""bihtree: ray queries on triangle meshes by a Bounding Interval Hierarchy."""

from ._bihtree import Camera, Stats, Tree, __version__, cpu_features, render
from .errors import BihError, Cancelled, FileFormatError, GeometryError
from .hits import HitLists, Hits
from .scene import Scene

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
