"""The add-on comes and goes without a trace."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy
import pytest

import addon
from addon.blender import panels
from addon.blender.engine import BihPreviewEngine
from addon.blender.properties import BihSettings, settings_of
from addon.pipeline.settings import PASSES, Settings

ROOT = Path(__file__).resolve().parents[2]


def engine_panels() -> set[str]:
    return {
        panel.__name__
        for panel in bpy.types.Panel.__subclasses__()
        if BihPreviewEngine.bl_idname in getattr(panel, "COMPAT_ENGINES", ())
    }


def test_register_and_unregister_twice(scene):
    for _ in range(2):
        addon.register()
        assert scene.bih.structure == "bih"
        assert hasattr(bpy.types, "RENDER_PT_bih")
        scene.render.engine = "BIH_PREVIEW"
        assert {"RENDER_PT_format", "DATA_PT_lens"} <= engine_panels()
        addon.unregister()
        assert not hasattr(bpy.types.Scene, "bih")
        assert not hasattr(bpy.types, "RENDER_PT_bih")
        assert engine_panels() == set()
        with pytest.raises(TypeError):
            scene.render.engine = "BIH_PREVIEW"


def test_defaults_are_those_of_the_pipeline(registered):
    assert settings_of(registered) == Settings()


def test_every_choice_reaches_the_settings(registered):
    chosen = registered.bih
    chosen.leaf_size, chosen.samples, chosen.shadows, chosen.overlay_depth = 7, 9, False, 3
    chosen.passes = {"depth", "cost"}
    registered.render.threads_mode, registered.render.threads = "FIXED", 2
    expected = Settings(threads=2, leaf_size=7, samples=9, shadows=False, passes=("depth", "cost"), overlay_depth=3)
    assert settings_of(registered) == expected
    chosen.passes = set()
    assert settings_of(registered).passes == ("combined",)


def test_every_property_says_what_it_costs(registered):
    properties = [p for p in BihSettings.bl_rna.properties if p.identifier not in {"rna_type", "name"}]
    assert {p.identifier for p in properties} == {
        "structure", "layout", "heuristic", "build", "presort", "precision", "leaf_size", "samples", "shadows",
        "viewport_samples", "passes", "overlay_depth", "shading", "soft_shadows", "ambient_occlusion",
        "ambient_occlusion_distance", "smooth",
    }  # fmt: skip
    for p in properties:
        for word in ("time", "memory", "error"):
            assert word in p.description, (p.identifier, word)
    assert {item.identifier for item in BihSettings.bl_rna.properties["passes"].enum_items} == set(PASSES)
    assert all(item.description for item in BihSettings.bl_rna.properties["passes"].enum_items)


def test_choices_are_saved_with_the_scene(registered, tmp_path):
    registered.bih.samples = 5
    registered.render.engine = "BIH_PREVIEW"
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert bpy.context.scene.bih.samples == 1
    bpy.ops.wm.open_mainfile(filepath=path)
    assert (bpy.context.scene.bih.samples, bpy.context.scene.render.engine) == (5, "BIH_PREVIEW")


def test_the_panel_is_the_engines_own(registered):
    class Context:
        engine = "CYCLES"

    assert not panels.RENDER_PT_bih.poll(Context)
    Context.engine = "BIH_PREVIEW"
    assert panels.RENDER_PT_bih.poll(Context)


WITHOUT_BIHTREE = """
import sys
sys.modules["bihtree"] = None
import bpy, addon
bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
addon.register()
scene = bpy.context.scene
scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
scene.collection.objects.link(scene.camera)
scene.render.engine = "BIH_PREVIEW"
try:
    bpy.ops.render.render()
except RuntimeError as error:
    print("REPORTED", error)
scene.render.engine = "BLENDER_WORKBENCH"
addon.unregister()
"""


def test_registers_where_the_native_module_is_missing():
    done = subprocess.run([sys.executable, "-c", WITHOUT_BIHTREE], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "REPORTED Error: the module bihtree cannot be imported" in done.stdout
    assert "Traceback" not in done.stderr


WITHOUT_BPY = """
import sys
sys.modules["bpy"] = None
import addon, addon.blender.command_line, addon.blender.job
"""


def test_what_needs_no_blender_imports_without_it():
    subprocess.run([sys.executable, "-c", WITHOUT_BPY], cwd=ROOT, check=True)
