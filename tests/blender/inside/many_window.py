"""In a window: many instances, whose boxes are seen while they are read and their tree is built: FOLDER.

FOLDER/report.json is written last: where the 3D viewport is, and what was told meanwhile.
"""

import gc
import json
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import bpy
import numpy as np
import window_steps as w
from bl_ext.user_default.bih.addon.blender import export, viewport
from bl_ext.user_default.bih.addon.blender.trees import TREES
from bl_ext.user_default.bih.addon.pipeline import built, prepared

SIDE = 160
folder = Path(sys.argv[sys.argv.index("--") + 1])
report: dict[str, object] = {}
go_on = threading.Event()
"""Trees are built when this is set: until then whoever waits for one waits."""


def waiting(name: str, owner: object) -> None:
    real = getattr(owner, name)

    def when_told(*arguments: object, **options: object) -> object:
        go_on.wait(60)
        return real(*arguments, **options)

    setattr(owner, name, when_told)


def set_up() -> Iterator[None]:
    """25,600 cubes on a plane, shown by a vertex each of one object, from above; hardly any are read at a time."""
    for found in list(bpy.data.objects):
        bpy.data.objects.remove(found)
    cube = bpy.data.meshes.new("Cube")
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    cube.from_pydata(corners, [], faces)
    points = bpy.data.meshes.new("Points")
    points.vertices.add(SIDE * SIDE)
    places = np.zeros((SIDE * SIDE, 3), np.float32)
    places[:, 0] = np.arange(SIDE * SIDE) % SIDE * 2.0 - SIDE
    places[:, 1] = np.arange(SIDE * SIDE) // SIDE * 2.0 - SIDE
    points.vertices.foreach_set("co", places.ravel())
    owner, shown = (bpy.data.objects.new(mesh.name, mesh) for mesh in (points, cube))
    for made in (owner, shown):
        bpy.context.scene.collection.objects.link(made)
    shown.parent, owner.instance_type = owner, "VERTS"
    owner.show_instancer_for_viewport = False
    space = w.area("VIEW_3D").spaces[0]
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    space.overlay.show_cursor = space.overlay.show_text = space.overlay.show_object_origins = False
    space.show_gizmo = space.show_region_toolbar = space.show_region_hud = False
    space.clip_end = 5000.0
    space.region_3d.view_location, space.region_3d.view_distance = (0.0, 0.0, 0.0), 3.2 * SIDE
    bpy.context.scene.render.engine = "BIH_PREVIEW"
    viewport.SLICE = viewport.LONGEST_SLICE = 0.0
    export.INSTANCES_A_TICK = 2048
    yield from w.drawn(6)


def seen() -> viewport.Viewport | None:
    return next((found for found in gc.get_objects() if isinstance(found, viewport.Viewport)), None)


def snap(name: str) -> Iterator[None]:
    yield from w.drawn(6)
    w.shot(folder / f"{name}.png")


def in_rendered_mode() -> Iterator[None]:
    shares: list[float] = []
    real = prepared.prepare
    waiting("prepare", prepared)
    w.area("VIEW_3D").spaces[0].shading.type = "RENDERED"
    yield from w.until(lambda: seen() is not None)
    while seen()._is_reading:
        share = seen()._export.share
        if not shares or share != shares[-1]:
            shares.append(share)
        if 0.3 < share < 0.7 and not (folder / "some.png").exists():
            w.shot(folder / "some.png")
        yield
    report["shares"] = shares
    bpy.data.objects["Points"].location.z += 1.0
    yield from w.until(lambda: seen()._is_reading and seen()._bounds is not None)
    report["read_at_once"] = seen()._export.shown_count
    yield from w.until(lambda: not seen()._is_reading)
    yield from snap("boxes")
    go_on.set()
    yield from w.until(lambda: not seen()._is_behind())
    yield from snap("traced")
    prepared.prepare = real
    go_on.clear()


def as_a_tree() -> Iterator[None]:
    w.area("VIEW_3D").spaces[0].shading.type = "SOLID"
    yield from w.until(lambda: seen() is None)
    yield from snap("before")
    waiting("build", built)
    trees = TREES.of(w.window().scene)
    real, parts = export.Export.read, []

    def read(self: export.Export, *arguments: object, seconds: float) -> bool:
        parts.append(self.share)
        return real(self, *arguments, seconds=0.0)

    export.Export.read = read
    for name in ("escaped", "built"):
        parts.clear()
        with w.within(w.area("VIEW_3D")):
            assert bpy.ops.bih.build("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield from w.until(lambda: len(parts) > 2)
        if name == "escaped":
            w.press("ESC")
            yield from w.until(lambda: trees.bounds is None)
            report["escaped"] = list(parts)
            yield from w.drawn(6)
    yield from w.until(lambda: any(thread.name == "BIH build" for thread in threading.enumerate()))
    report["parts"] = list(parts)
    yield from snap("built-boxes")
    go_on.set()
    yield from w.until(lambda: trees.main is not None)
    yield from snap("built")
    report["bounds"] = trees.bounds is not None
    report["triangles"] = trees.main.tree.stats.triangles


def steps() -> Iterator[None]:
    yield from set_up()
    place = w.region(w.area("VIEW_3D"))
    report["place"] = [place.x, place.y, place.width, place.height]
    yield from in_rendered_mode()
    yield from as_a_tree()
    (folder / "report.json").write_text(json.dumps(report))


bpy.context.preferences.system.viewport_aa = "FXAA"  # one look at the scene for a redraw, not eight
w.run(steps())
