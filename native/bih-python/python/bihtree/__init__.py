"""bihtree: ray queries on triangle meshes by a Bounding Interval Hierarchy."""

from ._bihtree import Stats, Tree, __version__, cpu_features
from .errors import BihError, Cancelled, FileFormatError, GeometryError
from .hits import HitLists, Hits
from .picture import Camera, render
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
