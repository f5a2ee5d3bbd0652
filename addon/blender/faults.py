"""What is broken in a scene, object by object: Blender evaluates the rest, and so do we."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .compat import modifier_errors


def faults(depsgraph: bpy.types.Depsgraph) -> Iterator[str]:
    """A line for each driver that fails, each modifier that says why it fails, and whatever is linked from a file that
    is not there."""
    for owner in depsgraph.objects:
        name = f"object {owner.name!r}"
        for block in filter(None, (owner.original, owner.original.data)):
            if block.is_missing:
                library = block.library
                yield f"{name} is linked from {library.filepath if library else 'a file'}, which is missing"
                break
        for block in (owner, owner.data):
            animation = getattr(block, "animation_data", None)
            for curve in animation.drivers if animation else ():
                if not curve.driver.is_valid:
                    yield f"{name}: the driver of {curve.data_path} fails"
        for modifier in owner.modifiers:
            if modifier.show_viewport or modifier.show_render:
                for error in modifier_errors(modifier):
                    yield f"{name}: modifier {modifier.name!r} fails: {error}"
