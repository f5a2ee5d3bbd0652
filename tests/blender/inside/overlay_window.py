"""In a window: the panels and the overlay, step by step, with a screenshot of each: FOLDER.

FOLDER/report.json is written last: where the 3D viewport is, and what was counted.
"""

import json
import sys
import threading
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
    view.show_gizmo = view.show_region_toolbar = view.show_region_hud = False
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
    """As a button calls it: what it changes can be undone."""
    with w.within(w.area("VIEW_3D")):
        done: set[str] = getattr(bpy.ops.bih, name)("INVOKE_DEFAULT", True, **options)
    return done


def steps() -> Iterator[None]:
    from bl_ext.user_default.bih.addon.blender.trees import TREES

    yield from set_up()
    viewport = w.area("VIEW_3D")
    view = viewport.spaces.active.region_3d
    scene = bpy.context.scene
    chosen, trees = scene.bih_overlay, TREES.of(scene)
    chosen.most_lines = 200_000  # the same picture whatever draws
    yield from snap("before")
    yield from built()
    for name, kind in (("viewport", "WINDOW"), ("sidebar", "UI")):
        place = w.region(viewport, kind)
        report[name] = [place.x, place.y, place.width, place.height]
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
    w.press("LEFTMOUSE", *at(0.42, 0.55))
    yield from w.until(lambda: trees.path is not None)
    report["ray"] = [chosen.shown, len(trees.path.visited), trees.path.triangle]
    front = view.view_rotation.copy()
    view.view_rotation = front @ Quaternion((0.0, 1.0, 0.0), 0.9)
    yield from snap("ray")
    for _ in range(4):
        called("select_node", to="parent")
    chosen.shown = "nothing"
    report["node"] = trees.selected
    place = w.region(viewport, "UI")
    w.scroll("WHEELDOWNMOUSE", 30, place)
    yield from snap("node")
    w.scroll("WHEELUPMOUSE", 60, place)
    called("select_node", to="none")
    view.view_rotation = front

    chosen.shown, chosen.first_depth, chosen.last_depth = "planes", 0, 2
    called("play_construction", pause=0.3)
    yield from w.until(lambda: chosen.last_depth >= 3)
    yield
    w.shot(folder / "play.png")
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

    scene.bih.build, scene.bih.leaf_size, scene.camera.data.lens = "on_demand", 1, 190.0
    yield from built()
    chosen.shown, chosen.first_depth, chosen.last_depth = "leaves", 0, 32
    yield from snap("on-demand")
    scene.bih.build, scene.bih.leaf_size = "auto", 0

    yield from built()
    chosen.shown, chosen.first_depth, chosen.last_depth = "planes", 0, 5
    called("compare")
    yield from w.until(lambda: trees.other is not None)
    yield from snap("compare")
    report["compare"] = list(view.view_location)
    called("free")
    view.view_distance, view.view_location = 5.2, (0.0, 0.0, 0.0)

    scene.bih.structure = "kd_tree"
    yield from snap("kd-tree")
    scene.bih.structure = "bih"
    yield from built()
    chosen.is_shown = False
    viewport.spaces.active.shading.color_type = "OBJECT"
    bpy.ops.ed.undo_push(message="before the mesh")
    yield from snap("mesh-before")
    called("mesh_from_tree", last_depth=4)
    yield from snap("mesh")
    press_undo()
    yield from w.until(lambda: not any(each.name.startswith("Tree of") for each in bpy.data.collections))
    yield from snap("mesh-undone")
    report["trees"] = trees.main is not None

    # a build of some seconds goes on beside the window, and Escape ends it
    bpy.context.scene.objects["Suzanne"].modifiers["Smooth"].levels = 5
    bpy.context.scene.bih.structure, former = "kd_tree", trees.main
    called("build")
    yield
    report["builds"] = [thread.name for thread in threading.enumerate()].count("BIH build")
    w.press("ESC", *at(0.5, 0.5))
    yield from w.until(lambda: "BIH build" not in [thread.name for thread in threading.enumerate()])
    yield from w.drawn()
    report["escaped"] = trees.main is former
    bpy.context.scene.objects["Suzanne"].modifiers["Smooth"].levels = 2
    bpy.context.scene.bih.structure = "bih"

    # the tree of what is deleted is gone, until undo
    chosen = bpy.context.scene.bih_overlay
    chosen.is_shown, chosen.shown, chosen.first_depth, chosen.last_depth = True, "planes", 0, 5
    bpy.ops.ed.undo_push(message="before it is deleted")
    yield from snap("not-deleted")
    bpy.data.objects.remove(bpy.context.scene.objects["Suzanne"])
    bpy.ops.ed.undo_push(message="deleted")
    yield from snap("deleted")
    press_undo()
    yield from w.until(lambda: "Suzanne" in bpy.context.scene.objects)
    yield from snap("undeleted")

    bpy.context.scene.render.engine = "BIH_PREVIEW"
    place = w.region(w.area("PROPERTIES"))
    report["properties"] = [place.x, place.y, place.width, place.height]
    w.area("PROPERTIES").spaces[0].context = "RENDER"
    yield from snap("properties")
    (folder / "report.json").write_text(json.dumps(report))


def press_undo() -> None:
    x, y = at(0.4, 0.5)
    w.window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=x, y=y)
    for value in ("PRESS", "RELEASE"):
        w.window().event_simulate(type="Z", value=value, x=x, y=y, ctrl=True)


bpy.context.preferences.system.viewport_aa = "FXAA"  # one look at the scene for a redraw, not eight
w.run(steps())
