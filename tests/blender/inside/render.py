"""F12 on the open file with the installed extension, and Blender saves the picture: IMAGE WIDTH HEIGHT.

With `again` as a fourth argument, the extension is disabled and enabled twice before.
"""

import sys

import addon_utils
import bpy

MODULE = "bl_ext.user_default.bih"
ENGINE = "BIH_PREVIEW"


def is_registered() -> bool:
    return hasattr(bpy.types.Scene, "bih") and hasattr(bpy.types, "RENDER_PT_bih")


def disable_and_enable() -> None:
    assert is_registered()
    addon_utils.disable(MODULE)
    assert not is_registered()
    addon_utils.enable(MODULE)
    assert is_registered()


image, width, height, *again = sys.argv[sys.argv.index("--") + 1 :]
if again:
    disable_and_enable()
    disable_and_enable()

scene = bpy.context.scene
scene.render.engine = ENGINE
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "PNG"
scene.render.image_settings.color_mode = "RGBA"
scene.render.image_settings.color_depth = "8"
scene.render.dither_intensity = 0.0  # dither would change the last bit on purpose
scene.render.filepath = image
assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
