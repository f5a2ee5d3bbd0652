"""The overlay picture as a file: what `blender --command bih render --overlay` writes.

Blender reads the annotations as values, so they are not postponed here.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from .modal_work import FileWork
from .properties import settings_of
from .scene_work import SceneWork
from .worker import Worker


class BIH_OT_render_overlay(FileWork, SceneWork, bpy.types.Operator):
    bl_idname = "bih.render_overlay"
    bl_label = "Save Overlay"
    bl_description = (
        "Trace what the camera sees, draw the tree over it down to Overlay Depth, and save the picture. Takes seconds "
        "of time and the memory of a tree meanwhile; needs OpenImageIO"
    )

    suffix = ".png"
    filepath: StringProperty(name="File", description="The picture to write: .png, .jpg, .tif", subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.png;*.jpg;*.tif", options={"HIDDEN"})

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        from ..pipeline import preview

        path = self.path()
        outputs = preview.Outputs(overlay=path)
        preview.check_outputs(outputs)
        scene = self.scene_read(context, with_camera=True)
        settings = replace(settings_of(context.scene), passes=outputs.passes)

        def work(told: Any) -> Path:
            traced = preview.trace(scene, settings, outputs=outputs, progress=told)
            preview.write(traced, scene, settings, outputs, progress=told)
            return path

        return Worker("BIH overlay", work)

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        return f"BIH: wrote {result}"
