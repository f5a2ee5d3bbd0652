"""In a window: the panels and the overlay, step by step, with a screenshot of each: FOLDER.

FOLDER/report.json is written last: where the 3D viewport is, and what was counted.
"""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
import window_steps as w
from mathutils import Quaternion

folder = Path(sys.argv[sys.argv.index("--") + 1])
report = {}


def snap(name: str) -> Iterator[None]:
    yield from w.drawn()
    w.shot(folder / f"{name}.png")


def set_up() -> Iterator[None]:
    """A monkey in an empty room, seen from the front and the right; the tab of the sidebar is open."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    with w.within(w.area("VIEW_3D")):
        bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    monkey.modifiers.new("Smooth", "SUBSURF").levels = 2
    bpy.ops.object.select_all(action="DESELECT")
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, -6.0, 0.5)
    camera.rotation_euler = (1.5, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    camera.hide_set(True)
    viewport = w.area("VIEW_3D")
    view = viewport.spaces.active
    view.show_region_ui = True
    view.overlay.show_floor = view.overlay.show_axis_x = view.overlay.show_axis_y = False
    view.overlay.show_cursor = view.overlay.show_text = view.overlay.show_stats = False
    view.overlay.show_object_origins = False
    view.region_3d.view_rotation = Quaternion((0.82, 0.47, 0.16, 0.28))
    view.region_3d.view_location = (0.0, 0.0, 0.0)
    view.region_3d.view_distance = 5.2
    yield from w.drawn(6)
    w.region(viewport, "UI").active_panel_category = "BIH"
    yield from w.drawn()


def built() -> Iterator[None]:
    """As the panel's button does it."""
    from bl_ext.user_default.bih.addon.blender.trees import TREES

    trees = TREES.of(w.window().scene)
    former = trees.main
    with w.within(w.area("VIEW_3D")):
        assert bpy.ops.bih.build("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from w.until(lambda: trees.main is not former)


def at(x: float, y: float) -> tuple[int, int]:
    """A pixel of the window, by its share of the 3D viewport."""
    place = w.region(w.area("VIEW_3D"))
    return place.x + int(x * place.width), place.y + int(y * place.height)


def called(name: str, **options: object) -> set[str]:
    with w.within(w.area("VIEW_3D")):
        done: set[str] = getattr(bpy.ops.bih, name)("INVOKE_DEFAULT", **options)
    return done


def steps() -> Iterator[None]:
    from bl_ext.user_default.bih.addon.blender.trees import TREES

    yield from set_up()
    viewport = w.area("VIEW_3D")
    scene = bpy.context.scene
    chosen, trees = scene.bih_overlay, TREES.of(scene)
    yield from snap("before")
    yield from built()
    place = w.region(viewport)
    report["viewport"] = [place.x, place.y, place.width, place.height]
    chosen.last_depth = 4
    yield from snap("planes")
    chosen.last_depth = 9
    yield from snap("planes-deeper")
    chosen.shown, chosen.first_depth, chosen.last_depth = "boxes", 5, 5
    yield from snap("boxes")
    chosen.shown, chosen.first_depth, chosen.last_depth = "leaves", 0, 32
    yield from snap("leaves")

    assert called("pick_ray") == {"RUNNING_MODAL"}
    yield
    w.press("LEFTMOUSE", *at(0.5, 0.55))
    yield from snap("ray")
    report["ray"] = [chosen.shown, len(trees.path.visited), trees.path.triangle]
    called("select_node", to="parent")
    yield from snap("node")
    called("select_node", to="none")

    chosen.shown, chosen.first_depth, chosen.last_depth = "planes", 0, 2
    called("play_construction", pause=0.3)
    yield from w.until(lambda: chosen.last_depth >= 3)
    yield from snap("play")
    report["played"] = chosen.last_depth
    w.press("ESC", *at(0.5, 0.5))
    yield from w.drawn(8)
    report["stopped"] = chosen.last_depth
    yield from w.drawn(8)
    report["stays"] = chosen.last_depth

    chosen.shown = "nothing"
    called("cost_map")
    yield from w.until(lambda: trees.cost is not None)
    yield from snap("cost")
    chosen.cost = False

    scene.bih.build, scene.bih.leaf_size = "on_demand", 1
    yield from built()
    chosen.shown, chosen.last_depth = "planes", 9
    yield from snap("on-demand")
    scene.bih.build, scene.bih.leaf_size = "auto", 0

    yield from built()
    chosen.shown, chosen.first_depth, chosen.last_depth = "planes", 0, 5
    called("compare")
    yield from w.until(lambda: trees.other is not None)
    viewport.spaces.active.region_3d.view_distance = 8.5
    viewport.spaces.active.region_3d.view_location = (1.6, 0.0, 0.0)
    yield from snap("compare")
    called("free")

    scene.bih.structure = "kd_tree"
    yield from snap("kd-tree")
    scene.bih.structure = "bih"
    yield from built()
    chosen.is_shown = False
    called("mesh_from_tree", last_depth=4)
    viewport.spaces.active.shading.color_type = "OBJECT"
    yield from snap("mesh")
    (folder / "report.json").write_text(json.dumps(report))


w.run(steps())
