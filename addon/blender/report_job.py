"""What a report needs of the host: the scene of a file, and the method that only Blender has."""

from __future__ import annotations

from argparse import Namespace
from importlib.util import find_spec

from ..report.error.methods import Method
from ..report.error.subject import Subject
from . import job


def read(arguments: Namespace) -> Subject:
    """The .blend or the mesh that a command line names. Raises UserError."""
    source = job.Source(arguments.scene, arguments.mesh, arguments.frame)
    scene, settings, _ = job.read(source)
    return Subject(scene, settings, str(arguments.scene or arguments.mesh))


def methods() -> list[Method]:
    """Blender's own tree; it says itself where there is no Blender."""
    from .bvh_tree import BlenderTree

    return [BlenderTree("" if find_spec("bpy") else "there is no Blender here")]
