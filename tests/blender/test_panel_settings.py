"""What the panel lets a person choose, and what it made of a file that a former version saved."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import bpy
import pytest

from addon.blender import classes, panels, properties, sidebar
from addon.blender.engine import BihPreviewEngine
from addon.blender.properties import BUILD_TEXT, PRESORT_TEXT, own_choice, settings_of, why_not
from addon.pipeline import built
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import GOES_WITH, HEURISTICS, LAYOUTS, PRECISIONS, STRUCTURES
from tests.meshes import icosphere

FORMER = Path(__file__).with_name("saved_by_0_1_0.blend")


def test_whatever_is_chosen_can_be_built(registered):
    """Every combination of every choice gives settings, and of each structure the ones that bihtree takes."""
    from addon.pipeline.mesh import Mesh

    ball, tried = SceneData.of_mesh(Mesh("Ball", *icosphere(1))), set()
    chosen = registered.bih
    for structure, layout, heuristic, build, presort, leaf_size in product(
        STRUCTURES, LAYOUTS, HEURISTICS, BUILD_TEXT, PRESORT_TEXT, (0, 2)
    ):
        chosen.structure, chosen.layout, chosen.heuristic = structure, layout, heuristic
        chosen.build, chosen.presort, chosen.leaf_size = build, presort, leaf_size
        settings = settings_of(registered)
        options = built.tree_options(settings)
        if str(options) not in tried:
            tried.add(str(options))
            stats = built.build(ball, settings).tree.stats
            assert (stats.structure, stats.layout, stats.heuristic) == (
                structure, own_choice(chosen, "layout"), own_choice(chosen, "heuristic"),
            )  # fmt: skip
            assert (stats.build == "on_demand") == (build == "on_demand" and structure == "bih")
    assert len(tried) > 50


def test_one_line_says_why_something_cannot_be_chosen(registered):
    chosen = registered.bih
    parts = ("on demand", "bucket sort", "leaf size")
    assert [why_not(chosen, part) for part in parts] == ["", "", ""]
    chosen.structure = "bvh"
    assert [bool(why_not(chosen, part)) for part in parts] == [True, True, False]
    chosen.structure = "kd_tree"
    whys = [why_not(chosen, part) for part in parts]
    assert all(whys) and not any("\n" in why or len(why) > 60 for why in whys)
    assert "kd-Tree" in whys[0]
    assert properties.notes(chosen) == [*whys, "A kd-Tree has no layout Wide: Classic is used",
                                        "A kd-Tree has no heuristic Global: SAH is used"]  # fmt: skip
    chosen.structure = "bih"
    assert properties.notes(chosen) == []


@pytest.mark.parametrize("name", ["build", "presort"])
def test_a_choice_reaches_the_parts_of_the_work(registered, name):
    part = {"build": "on demand", "presort": "bucket sort"}[name]
    for item in registered.bih.bl_rna.properties[name].enum_items:
        setattr(registered.bih, name, item.identifier)
        forced = settings_of(registered).parts
        assert forced.get(part) is {"auto": None, "on_demand": True, "always": True}.get(item.identifier, False)


def test_a_file_of_the_former_version_is_read(registered):
    """Saved by Blender 4.2 when there were eight properties, each with another value than its default."""
    bpy.ops.wm.open_mainfile(filepath=str(FORMER))
    scene = bpy.context.scene
    chosen = scene.bih
    assert scene.render.engine == "BIH_PREVIEW"
    assert (chosen.structure, chosen.layout, chosen.precision) == ("bih", "compact", "exact")
    assert (chosen.leaf_size, chosen.samples, chosen.shadows, chosen.overlay_depth) == (3, 5, False, 9)
    assert chosen.passes == {"combined", "cost"}
    assert (chosen.heuristic, chosen.build, chosen.presort) == ("global", "auto", "auto")


def test_all_values_are_saved_and_read(registered, tmp_path):
    """By number, so a choice keeps its meaning whatever is added behind it."""
    wanted = {"structure": "kd_tree", "layout": "classic", "heuristic": "sah", "build": "on_demand", "presort": "never"}
    for name, value in wanted.items():
        setattr(registered.bih, name, value)
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert {name: getattr(bpy.context.scene.bih, name) for name in wanted} == wanted
    order = {
        name: [item.value for item in bpy.context.scene.bih.bl_rna.properties[name].enum_items]
        for name in ("structure", "layout", "heuristic", "precision")
    }
    assert order == {name: list(range(3)) for name in order}
    assert (STRUCTURES, LAYOUTS, HEURISTICS, PRECISIONS) == (
        ("bih", "bvh", "kd_tree"), ("wide", "compact", "classic"), ("global", "local", "sah"),
        ("watertight", "exact", "fast"),
    )  # fmt: skip


def test_a_structure_has_its_own_choices_and_no_others():
    assert {name: set(choices["layout"]) for name, choices in GOES_WITH.items()} == {
        "bih": set(LAYOUTS), "bvh": {"wide", "compact"}, "kd_tree": {"classic"},
    }  # fmt: skip


def test_both_places_have_their_panels(registered):
    for panel in (*panels.PANELS, *sidebar.PANELS):
        assert hasattr(bpy.types, panel.__name__)
    assert {panel.bl_category for panel in sidebar.PANELS} == {"BIH"}


def test_what_is_traced_can_be_changed_in_the_properties(registered):
    """Materials, the world and lights: the panels are Eevee's own, and there is no second one for lights."""
    from addon.blender.compat import material_index_panel

    engine = BihPreviewEngine.bl_idname
    for name in (*panels.EEVEES, material_index_panel(), "RENDER_PT_color_management", "DATA_PT_lens"):
        assert engine in getattr(bpy.types, name).COMPAT_ENGINES, name
    assert engine not in bpy.types.DATA_PT_light.COMPAT_ENGINES
    classes.unregister()
    try:
        for panel in bpy.types.Panel.__subclasses__():
            assert engine not in getattr(panel, "COMPAT_ENGINES", ()), panel
    finally:
        classes.register()


def test_words_of_choices_are_never_cut_off() -> None:
    """Wide, Compact and Classic in panels of several widths, in pixels."""
    from addon.blender.panel_parts import place_of_choices

    words = ["Wide", "Compact", "Classic"]
    assert [place_of_choices(words, width) for width in (500, 240, 120)] == ["beside", "below", "stacked"]
    assert place_of_choices(words, 320) == "beside", "3 x 61 of 192"
    assert place_of_choices([*words, "One more"], 320) == "below"


def test_names_are_short_where_a_panel_is_narrow(registered) -> None:
    """Short names in a panel of 190 pixels, the narrowest that Blender's own words fit; whole ones in a wide panel."""
    from addon.blender import panel_parts
    from addon.blender.overlay_properties import BihOverlaySettings
    from addon.blender.properties import BihSettings

    known = {**BihSettings.bl_rna.properties, **BihOverlaySettings.bl_rna.properties}
    for name, short in panel_parts.SHORT_NAMES.items():
        assert panel_parts.name_that_fits(known[name].name, short, 400) == known[name].name
        assert panel_parts.name_that_fits(known[name].name, short, 0.4 * 190) == short
        assert len(short) < len(known[name].name) and short in known[name].name
    assert panel_parts.name_that_fits("Viewport Samples", None, 10) == "Viewport Samples"
