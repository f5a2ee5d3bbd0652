"""What this scene does without: each part kept or left out, why, and what that saves. The picture has the same bits
either way; what each threshold was measured by is in docs/decisions/needs.md."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import looks
from .image import CHANNELS
from .reach import share_in_view, unreached
from .scene import SceneData
from .settings import PARTS, PASSES, Settings
from .sharing import shared

SORTED_TRIANGLES = 65_536
"""From more triangles on the bucket sort comes first."""
ON_DEMAND_TRIANGLES = 250_000
ON_DEMAND_SHARE = 0.25
"""From so many triangles on, and with at most this share of them in view, a tree is built where rays go."""
LEAF = {"wide": 8, "compact": 8, "classic": 8}
"""Up to so many triangles are one leaf: each ray tests all of them."""

INSTANCED_TRIANGLES = 65_536
"""From so many triangles on that are there more than once, each mesh has one tree, and instances show it, where the
picture has no more rays than that: to flatten and build one takes as long as one or two rays lose."""
FLATTENED_TRIANGLES = 4_000_000
"""From so many on also where it has more rays: flattened they would take some 80 bytes each."""

FAST = "precision fast: another tree may round a hit in another way"


@dataclass(frozen=True)
class Part:
    """A row of the table."""

    name: str
    kept: bool
    why: str
    saves: str = ""
    """What leaving it out saves; empty where it is kept."""


@dataclass(frozen=True)
class Plan:
    """What is done: the scene without the objects that no ray reaches, and the options of the tree and the picture."""

    parts: tuple[Part, ...]
    scene: SceneData
    whole: SceneData
    reached: NDArray[np.bool_]
    tree: Mapping[str, Any]
    render: Mapping[str, Any]
    flatten: Mapping[str, Any]
    is_instanced: bool = False
    """Whether each mesh of `scene` has a tree, and instances show it: nothing is flattened."""

    def rows_of_all(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Triangle rows of the flattened scene as rows of the whole one; -1 stays."""
        if self.reached.all():
            return rows
        counts = self.whole.triangle_counts
        left_out = np.cumsum(np.where(self.reached, 0, counts))[self.reached]
        ends = np.cumsum(counts[self.reached])
        moved = rows + left_out[np.minimum(np.searchsorted(ends, rows, side="right"), len(ends) - 1)]
        return np.where(rows < 0, rows, moved).astype(np.int32)

    def rows_of_instances(self, rows: NDArray[np.int32], instances: NDArray[np.int32]) -> NDArray[np.int32]:
        """Triangle rows of meshes as those of the flattened scene; -1 stays."""
        counts = self.scene.triangle_counts
        starts = np.cumsum(counts) - counts
        return np.where(rows < 0, rows, rows + starts[np.maximum(instances, 0)]).astype(np.int32)

    def instances_of_all(self, rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Instance rows of the traced scene as rows of the whole one; -1 stays."""
        return np.where(rows < 0, rows, np.flatnonzero(self.reached)[np.maximum(rows, 0)]).astype(np.int32)


@dataclass(frozen=True)
class _Case:
    """What speaks for and against one part: `spare` says why the picture is the same without it, `needed` why it is
    kept; without `spare` it is always kept."""

    needed: str
    spare: str = ""
    saves: str = ""
    pays: bool = True
    """Whether leaving it out takes less time, by what was measured."""


def plan(scene: SceneData, settings: Settings, wanted: Collection[str], *, tree_shown: bool) -> Plan:
    """Decide everything once. `wanted` names the passes to trace, `tree_shown` says that a picture of the tree is made
    too. The scene has a camera and triangles."""
    view = scene.camera
    assert view is not None
    parts: list[Part] = []
    chosen = {"shadow rays": "shadows", "ambient occlusion": "ambient_occlusion", "smooth normals": "smooth"}
    off = {part for part, name in chosen.items() if not getattr(settings, name)}
    if tree_shown:
        off.add("instances")

    def is_kept(name: str, case: _Case) -> bool:
        is_off = name in off
        parts.append(_decided(name, case, None if is_off else settings.parts.get(name)))
        return parts[-1].kept

    passes = tuple(name for name in PASSES if is_kept(f"{name} pass", _pass(scene, name, wanted)))
    is_kept("normals", _normals(scene, passes, settings.samples))
    is_smooth = is_kept("smooth normals", _smooth(scene, settings, passes))
    has_surfaces = is_kept("materials", _materials(scene, passes))
    around = looks.surroundings(scene, settings)
    scene, whole = replace(scene, lights=looks.lights(scene, settings)), scene
    lights = scene.lights
    occlusion = is_kept("ambient occlusion", _occlusion(scene, settings, passes, around))
    shadows = is_kept("shadow rays", _shadows(scene, settings, "combined" in passes))
    if not is_kept("lights without power", _dark(scene, settings, shadows)):
        lights = lights[_powers(lights)]
    reached = np.ones(len(scene.instance_mesh), bool)
    why_whole = _why_whole(scene, settings, passes, tree_shown)
    distance = (settings.ambient_occlusion_distance or np.inf) if occlusion else 0.0
    apart = np.zeros(len(reached), bool) if why_whole else _apart(replace(scene, lights=lights), shadows, distance)
    if not is_kept("objects out of reach", _objects(scene, apart, why_whole)):
        reached = ~apart
    shown = scene if reached.all() else scene.only(reached)
    count = shown.triangle_count
    is_instanced = is_kept("instances", _instances(shown, settings, tree_shown))
    if is_instanced:
        shown = shared(shown)
        count = max(len(mesh.triangles) for mesh in shown.meshes)
    flatten: dict[str, Any] = {"transform_all": is_kept("world transform", _transform(shown))}
    is_double = is_kept("double precision", _double(shown, settings, passes))
    flatten["dtype"] = None if settings.precision == "fast" else np.float64 if is_double else np.float32
    tree: dict[str, Any] = {}
    if settings.structure != "bih":
        parts += [Part(name, False, f"a {settings.structure} has none") for name in ("bucket sort", "on demand")]
    else:
        if settings.heuristic == "global":
            tree["presort"] = is_kept("bucket sort", _sort(count))
        else:
            parts.append(Part("bucket sort", False, "it sorts by the cells of the global heuristic"))
        if is_instanced and not settings.parts.get("on demand"):
            parts.append(Part("on demand", False, "meshes are shared: each is built once, for all that show it"))
        elif is_kept("on demand", _on_demand(shown, count)):
            tree["build"] = "on_demand"
    leaf = LEAF.get(settings.layout, 0) if settings.structure == "bih" and settings.precision != "fast" else 0
    if is_kept("tree", _tree(count, leaf, settings)):
        tree["leaf_size"] = 1 if settings.leaf_size is None and count <= leaf else settings.leaf_size
    else:
        tree["leaf_size"] = leaf
    rays = view.width * view.height * settings.samples
    tree["threads"] = settings.threads if is_kept("threads", _threads(rays, settings)) else 1
    render = {"passes": passes, "lights": lights, "shadows": shadows, **around}
    if occlusion:
        render |= {"ambient_occlusion": True, "ambient_occlusion_distance": distance}
    flat = not is_instanced
    render["corner_normals"] = looks.corner_normals(shown, flat=flat) if is_smooth else None
    render["objects"] = looks.objects(shown, passes, has_surfaces=has_surfaces, flat=flat)
    if has_surfaces and len(scene.surfaces):
        render |= {"surfaces": scene.surfaces, "materials": looks.materials(shown, flat=flat)}
    parts.sort(key=lambda part: PARTS.index(part.name))
    return Plan(tuple(parts), shown, whole, reached, tree, render, flatten, is_instanced)


def report(parts: Iterable[Part], native: Mapping[str, str]) -> list[dict[str, object]]:
    """The table as plain JSON values; `native` is what the construction itself left out, by part."""
    rows: list[dict[str, object]] = [
        {"part": part.name, "kept": part.kept, "why": part.why, "saves": part.saves} for part in parts
    ]
    rows += [
        {"part": name, "kept": False, "why": why, "saves": ""} for name, why in native.items() if name != "presort"
    ]
    return rows


def lines(parts: Iterable[Mapping[str, Any]]) -> list[str]:
    """The table as text: part, kept or left out, why, what it saves."""
    rows = [(str(part["part"]), "kept" if part["kept"] else "left out", sentence(part)) for part in parts]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(2)]
    return [f"{name:<{widths[0]}}  {what:<{widths[1]}}  {why}" for name, what, why in rows]


def sentence(part: Mapping[str, Any]) -> str:
    """Why it is kept or left out, and what that saves."""
    return f"{part['why']}; saves {part['saves']}" if part["saves"] else str(part["why"])


def _decided(name: str, case: _Case, forced: bool | None) -> Part:
    if not case.spare:
        return Part(name, True, case.needed)
    if forced or (forced is None and not case.pays):
        return Part(name, True, "kept as asked" if forced else case.needed)
    return Part(name, False, case.spare, case.saves)


def _pass(scene: SceneData, name: str, wanted: Collection[str]) -> _Case:
    assert scene.camera is not None
    if name in wanted:
        return _Case("asked for")
    saved = 4 * len(CHANNELS[name]) * scene.camera.width * scene.camera.height
    return _Case("", "not asked for", f"{saved:,} bytes not made")


def _normals(scene: SceneData, passes: Sequence[str], samples: int) -> _Case:
    assert scene.camera is not None
    if looks.BY_NORMAL & set(passes):
        return _Case("a pass shows them, or is shaded by them")
    rays = scene.camera.width * scene.camera.height * samples
    return _Case("", "no pass shows them or is shaded by them", f"up to {rays:,} normals not computed")


def _smooth(scene: SceneData, settings: Settings, passes: Sequence[str]) -> _Case:
    saves = f"up to {36 * scene.triangle_count:,} bytes of corner normals"
    if not looks.BY_NORMAL & set(passes):
        return _Case("", "no pass shows normals or is shaded by them", saves)
    shown = [scene.meshes[row] for row in np.unique(scene.instance_mesh)]
    smooth = sum(mesh.corner_normals is not None for mesh in shown)
    if not smooth:
        return _Case("", "every face is flat", saves)
    if not settings.smooth:
        return _Case("", "flat faces were chosen", saves)
    return _Case(f"meshes with smooth faces: {smooth}")


def _materials(scene: SceneData, passes: Sequence[str]) -> _Case:
    saves = f"up to {4 * scene.triangle_count:,} bytes of material slots"
    if not looks.BY_SURFACE & set(passes):
        return _Case("", "no pass shows a material or is coloured by one", saves)
    if not len(scene.surfaces):
        return _Case("", "no object has a material", saves)
    return _Case(f"surfaces: {len(scene.surfaces)}")


def _occlusion(scene: SceneData, settings: Settings, passes: Sequence[str], around: Mapping[str, Any]) -> _Case:
    assert scene.camera is not None
    saves = f"up to {scene.camera.width * scene.camera.height * settings.samples:,} rays"
    if "combined" not in passes:
        return _Case("", "no pass is shaded", saves)
    if not settings.ambient_occlusion:
        return _Case("", "ambient occlusion is off", saves)
    if "ambient" in around and not any(around["ambient"]):
        return _Case("", "the world is black: no light comes from all around", saves)
    return _Case("ambient occlusion was chosen")


def _powers(lights: NDArray[np.void]) -> NDArray[np.bool_]:
    """(L,) whether a light gives any."""
    given: NDArray[np.bool_] = (lights["colour"] != 0).any(axis=1)
    return given


def _shadows(scene: SceneData, settings: Settings, is_shaded: bool) -> _Case:
    assert scene.camera is not None
    rays = scene.camera.width * scene.camera.height * settings.samples
    if not is_shaded:
        return _Case("", "no pass is shaded", f"up to {rays * max(1, len(scene.lights)):,} rays")
    if not len(scene.lights):
        which = "the headlight was chosen" if settings.shading == "headlight" else "no light in the scene"
        why = f"{which}: the headlight shines from the camera, so nothing that it sees is in shadow"
        return _Case("", why, f"up to {rays:,} rays")
    saved = f"up to {rays * len(scene.lights):,} rays"
    if not settings.shadows:
        return _Case("", "shadows are off", saved)
    if not _powers(scene.lights).any():
        return _Case("", "no light of the scene has any power", saved)
    return _Case(f"lights that cast shadows: {np.count_nonzero(_powers(scene.lights))}")


def _dark(scene: SceneData, settings: Settings, shadows: bool) -> _Case:
    assert scene.camera is not None
    given = _powers(scene.lights)
    if given.all():
        return _Case("", "there are none")
    if not given.any():
        return _Case("without any light the headlight would be brighter")
    dark = int(np.count_nonzero(~given))
    rays = scene.camera.width * scene.camera.height * settings.samples * dark
    saves = f"up to {rays:,} shadow rays" if shadows else "their cosines"
    return _Case("", f"lights that give none: {dark}", saves)


def _why_whole(scene: SceneData, settings: Settings, passes: Collection[str], tree_shown: bool) -> str:
    """Why all objects stay, wherever they are; empty where some may be left out."""
    if len(scene.instance_mesh) < 2:
        return "one object"
    if settings.parts.get("objects out of reach"):
        return "kept as asked"
    if tree_shown:
        return "the whole tree is shown"
    if "cost" in passes:
        return "the cost pass counts the work in the whole tree"
    return FAST if settings.precision == "fast" else ""


def _apart(scene: SceneData, shadows: bool, distance: float) -> NDArray[np.bool_]:
    """(M,) the instances that no ray reaches; none where nothing else would be left."""
    apart = unreached(scene, shadows=shadows, distance=distance)
    kept = int(scene.triangle_counts[~apart].sum())
    return apart if kept else np.zeros(len(apart), bool)


def _objects(scene: SceneData, apart: NDArray[np.bool_], why_whole: str) -> _Case:
    if not apart.any():
        return _Case(why_whole or "a ray may reach every object")
    triangles = int(scene.triangle_counts[apart].sum())
    count = int(np.count_nonzero(apart))
    what = f"{count:,} objects lie outside the picture, and where no shadow comes from"
    return _Case("", what, f"{triangles:,} triangles of the tree")


def _instances(scene: SceneData, settings: Settings, tree_shown: bool) -> _Case:
    """Where meshes are shown often enough, each has one tree; flattened, the same triangles are in one."""
    assert scene.camera is not None
    total, saves = scene.triangle_count, "rays led from tree to tree"
    rays = scene.camera.width * scene.camera.height * settings.samples
    least = min(max(INSTANCED_TRIANGLES, rays), FLATTENED_TRIANGLES)
    if tree_shown:
        return _Case("", "the whole tree is shown", saves)
    if len(scene.instance_mesh) < 2:
        return _Case("instances, as asked", "one object", saves)
    if total < least:
        few = f"{total:,} triangles, fewer than {least:,}: flattened, {rays:,} rays are traced sooner"
        return _Case("instances, as asked", few, saves)
    meshes = shared(scene).meshes
    once = sum(len(mesh.triangles) for mesh in meshes)
    if total - once < least:
        return _Case("instances, as asked", f"{once:,} of {total:,} triangles are there once", saves)
    equal = len(np.unique(scene.instance_mesh)) - len(meshes)
    found = f", equal meshes found: {equal}" if equal else ""
    return _Case(f"{total:,} triangles are images of {once:,}{found}", "flattened, as asked", saves, pays=False)


def _transform(scene: SceneData) -> _Case:
    if scene.moves:
        return _Case("objects are moved, turned or scaled")
    vertices = scene.vertex_count
    copied = "" if len(scene.instance_mesh) > 1 else " and not copied"
    what = "no object is moved, turned or scaled"
    return _Case("", what, f"{vertices:,} vertices not transformed{copied}")


def _double(scene: SceneData, settings: Settings, passes: Collection[str]) -> _Case:
    if settings.precision == "fast":
        return _Case(FAST)
    doubles = [row for row in np.unique(scene.instance_mesh) if scene.meshes[row].vertices.dtype == np.float64]
    if not doubles:
        vertices = scene.vertex_count
        return _Case("", "no mesh has double precision", f"{12 * vertices:,} bytes of vertices")
    if "cost" in passes:
        return _Case("the cost pass counts the work in double precision")
    if scene.moves:
        return _Case("a moved vertex is no number of single precision")
    for row in doubles:
        vertices = scene.meshes[row].vertices
        with np.errstate(over="ignore"):
            if not (vertices.astype(np.float32) == vertices).all():
                return _Case(f"object {scene.meshes[row].name!r} has vertices that single precision does not hold")
    vertices = scene.vertex_count
    what = "single precision holds every vertex"
    return _Case("", what, f"{12 * vertices:,} bytes of vertices, and tests in double precision")


def _sort(triangles: int) -> _Case:
    if triangles <= SORTED_TRIANGLES:
        why = f"{triangles:,} triangles, no more than {SORTED_TRIANGLES:,}: sorted in place as fast"
        return _Case("", why, f"{8 * triangles:,} bytes of sorted keys")
    why = f"{triangles:,} triangles, more than {SORTED_TRIANGLES:,}"
    return _Case(why, "sorted in place, as asked", f"{8 * triangles:,} bytes of sorted keys", pays=False)


def _on_demand(scene: SceneData, triangles: int) -> _Case:
    saves = "a look at each node's flag"
    if triangles < ON_DEMAND_TRIANGLES:
        why = f"{triangles:,} triangles, fewer than {ON_DEMAND_TRIANGLES:,}: all are built sooner than asked for"
        return _Case("", why, saves)
    share = share_in_view(scene)
    if share > ON_DEMAND_SHARE:
        return _Case("", f"about {share:.0%} of the triangles are in view: most get built", saves)
    return _Case(f"about {share:.0%} of the triangles are in view", "all is built, as asked", saves, pays=False)


def _tree(triangles: int, leaf: int, settings: Settings) -> _Case:
    if settings.leaf_size is not None:
        return _Case("a leaf size was chosen")
    if triangles > leaf:
        why = f"{triangles:,} triangles, more than one leaf of {leaf}"
        return _Case(why if leaf else FAST if settings.precision == "fast" else f"a {settings.structure}")
    return _Case("", f"{triangles} triangles fit one leaf: each ray tests them all", "all inner nodes")


def _threads(rays: int, settings: Settings) -> _Case:
    if settings.threads:
        return _Case(f"{settings.threads} threads were chosen")
    why = f"{rays:,} rays: all threads stand ready, and one of its own would have to be started"
    return _Case(why, "one thread, as asked", "other threads", pays=False)
