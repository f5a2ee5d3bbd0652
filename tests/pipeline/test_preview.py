"""The main job on scenes whose picture is known, its files, and all the ways in which it must end cleanly."""

import json
import re
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bihtree
import numpy as np
import OpenImageIO
import pytest

from addon.pipeline import image, looks, preview
from addon.pipeline.camera import CameraView, framing_view, perspective_view
from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh
from addon.pipeline.scene import LIGHT_DTYPE, SUN, SceneData
from addon.pipeline.settings import DEFAULT_PASSES, PASSES, Settings
from tests import meshes

ROOT = Path(__file__).resolve().parents[2]


def front(width: int = 40, height: int = 30) -> CameraView:
    """From (0.5, -4, 0.5) along +y."""
    eye, target, up = np.array([0.5, -4, 0.5]), np.array([0.5, 0, 0.5]), np.array([0, 0, 1.0])
    return perspective_view(eye, target, up, width, height, field_of_view=1.0, near=0.1, far=100.0)


def box(name: str = "Box") -> Mesh:
    return Mesh(name, *meshes.box())


def one_box(view: CameraView | None = None) -> SceneData:
    return SceneData.of_mesh(box(), view or front())


def two_boxes() -> SceneData:
    """A unit box, and the same mesh 10 units behind it and twice as large, with a sun from above."""
    behind = np.diag([2.0, 2.0, 2.0, 1.0])
    behind[:3, 3] = 0, 10, 1
    sun = np.zeros(1, LIGHT_DTYPE)
    sun["kind"], sun["direction"], sun["colour"] = SUN, (0, 0, -1), 3
    return SceneData([box()], np.array([0, 0], np.int32), np.stack([np.eye(4), behind]), "two", front(), sun)


def test_every_pass_of_a_box_seen_from_the_front() -> None:
    passes = preview.trace(one_box(), Settings()).passes
    assert {name: (values.shape, values.dtype.str) for name, values in passes.items()} == {
        "combined": ((30, 40, 4), "<f4"),
        "depth": ((30, 40, 1), "<f4"),
        "normal": ((30, 40, 3), "<f4"),
        "position": ((30, 40, 3), "<f4"),
        "triangle": ((30, 40, 1), "<i4"),
        "cost": ((30, 40, 2), "<f4"),
    }
    hit = passes["triangle"][..., 0] >= 0
    assert 0 < hit.sum() < hit.size
    # The side y = 0 fills what is seen, rows 4 and 5 of the box, at a depth of 4.
    assert set(passes["triangle"][hit].ravel().tolist()) == {4, 5}
    assert passes["depth"][hit] == pytest.approx(4)
    assert passes["normal"][hit] == pytest.approx(np.broadcast_to([0, -1, 0], (hit.sum(), 3)))
    assert (passes["combined"][hit][:, 3] == 1).all()
    assert (passes["depth"][~hit] == np.inf).all()
    assert (passes["combined"][~hit] == 0).all()
    size = 40 / (2 * 4 * np.tan(0.5))  # pixels of one unit at that depth
    assert hit.sum() == pytest.approx(size**2, rel=0.2)


def test_a_hit_is_projected_to_the_middle_of_its_pixel() -> None:
    view = framing_view(np.array([[0.0] * 3, [1.0] * 3]), 37, 23)
    passes = preview.trace(one_box(view), Settings()).passes
    row, column = np.nonzero(passes["triangle"][..., 0] >= 0)
    projected = view.project(passes["position"][row, column])
    assert len(row) > 50
    assert projected[:, 0] == pytest.approx(column + 0.5, abs=1e-3)
    assert projected[:, 1] == pytest.approx(row + 0.5, abs=1e-3)
    assert projected[:, 3] == pytest.approx(passes["depth"][row, column, 0], rel=1e-5)


def test_depth_of_an_orthographic_camera_counts_from_the_camera() -> None:
    # At z = 5, looking down, near 1.5 and far 21.5, 3 units wide: the box's top is 4 units away.
    clip_to_world = np.array([[1.5, 0, 0, 0.5], [0, 1.5, 0, 0.5], [0, 0, -10.0, -6.5], [0, 0, 0, 1.0]])
    view = CameraView(clip_to_world, 15, 15, 1.5, perspective=False)
    depth = preview.trace(one_box(view), Settings()).passes["depth"]
    assert np.isfinite(depth).sum() == 25
    assert depth[np.isfinite(depth)] == pytest.approx(4)


def test_instances_follow_one_another_and_the_nearer_hides_the_other() -> None:
    traced = preview.trace(two_boxes(), Settings())
    rows = set(np.unique(traced.passes["triangle"]).tolist())
    assert {-1, 4, 5} < rows
    assert max(rows) in range(12, 24)
    assert traced.passes["depth"][traced.passes["triangle"] >= 12] == pytest.approx(14)
    assert traced.report["instances"] == 2
    assert traced.report["meshes"] == 1
    assert traced.report["triangles"] == 24


@pytest.mark.parametrize("asked", [("normal",), ("depth", "triangle"), PASSES])
def test_passes_do_not_depend_on_what_else_is_asked_for(asked: tuple[str, ...]) -> None:
    scene = two_boxes()
    assert scene.camera
    traced = preview.trace(scene, Settings(passes=asked, samples=2, seed=3))
    assert set(traced.passes) == {*asked, "combined", "depth"}
    camera = bihtree.Camera(scene.camera.clip_to_world, 40, 30)
    for name, values in traced.passes.items():
        alone = bihtree.render(
            bihtree.Tree(*scene.flatten(), layout="wide"),
            camera,
            passes=(name,),
            samples=2,
            seed=3,
            lights=scene.lights,
            objects=looks.objects(scene, PASSES, has_surfaces=False),
        )
        assert (values == alone[name]).all()


def test_only_what_the_outputs_are_made_of_is_traced() -> None:
    settings = Settings(passes=("normal",))
    for outputs, made in (
        (preview.Outputs(), set()),
        (preview.Outputs((Path("a.exr"),)), set()),
        (preview.Outputs((Path("a.exr"), Path("b.png"))), {"combined"}),
        (preview.Outputs(overlay=Path("b.png")), {"combined", "depth"}),
    ):
        assert set(preview.trace(two_boxes(), settings, outputs=outputs).passes) == {"normal"} | made


def test_shadows_and_lights_reach_the_picture() -> None:
    lit = preview.trace(two_boxes(), Settings()).passes["combined"]
    scene = two_boxes()
    dark = SceneData(scene.meshes, scene.instance_mesh, scene.instance_matrix, camera=scene.camera)
    assert (preview.trace(dark, Settings()).passes["combined"] != lit).any()


def test_the_bunny_in_the_picture_is_the_bunny_that_rays_hit() -> None:
    bunny = meshes.shared_mesh("stanford-bunny")
    view = framing_view(np.stack([bunny.vertices.min(axis=0), bunny.vertices.max(axis=0)]), 64, 48)
    traced = preview.trace(SceneData.of_mesh(Mesh("bunny", *bunny), view), Settings())
    hits = traced.tree.intersect(*bihtree.Camera(view.clip_to_world, 64, 48).rays())
    assert traced.report["triangles"] == 69451
    assert (traced.passes["triangle"].ravel() == hits.triangle).all()
    assert hits.hit.mean() > 0.1


def test_the_report_is_plain_json_and_adds_up() -> None:
    scene = two_boxes()
    traced = preview.trace(scene, Settings(samples=3, passes=("combined",)), export_seconds=1.25)

    def refuse(token: str) -> None:
        raise AssertionError(f"{token} is not JSON")

    report = json.loads(json.dumps(traced.report, allow_nan=False), parse_constant=refuse)
    assert report == traced.report
    assert report["scene"] == "two"
    assert report["export_seconds"] == 1.25
    assert (report["width"], report["height"], report["samples"]) == (40, 30, 3)
    assert report["primary_rays"] == 40 * 30 * 3
    assert report["rays_per_second"] * report["trace_seconds"] == pytest.approx(3600)
    assert report["bytes_per_triangle"] * report["triangles"] == pytest.approx(report["tree_bytes"])
    assert report["tree_bytes"] <= report["bound_bytes"]
    assert report["vertices"] == 2 * len(box().vertices)
    assert report["layout"] == "wide"
    assert report["leaves"] == (traced.tree.nodes()["kind"] == 1).sum() < report["nodes"]
    assert report["threads"] >= 1
    assert report["versions"]["bihtree"] == bihtree.__version__
    kept = {part["part"]: part["kept"] for part in report["needs"]}
    assert (kept["normal pass"], kept["triangle pass"], kept["combined pass"]) == (False, False, True)
    assert all(isinstance(part["why"], str) and part["why"] for part in report["needs"])


def test_the_summary_has_a_line_for_each_number() -> None:
    report = preview.trace(one_box(), Settings()).report
    lines = preview.summary(report)
    assert [" ".join(line.split()).lower() for line in lines] == [
        re.sub("[:,](?= )", "", line).lower() for line in preview.sentences(report)
    ]
    assert [line.split()[0] for line in lines] == ["export", "build", "trace", "tree", "rays"]


def test_triangles_without_area_are_counted_and_change_nothing() -> None:
    vertices, triangles = meshes.box()
    flat = np.concatenate([triangles, [[0, 0, 1], [2, 2, 2], [3, 5, 3]]]).astype(np.int32)
    with_flat = preview.trace(SceneData.of_mesh(Mesh("Box", vertices, flat), front()), Settings())
    without = preview.trace(one_box(), Settings())
    assert with_flat.report["rejected"] == 3
    assert "3 triangles have no area" in preview.summary(with_flat.report)[-1]
    for name in DEFAULT_PASSES:
        assert (with_flat.passes[name] == without.passes[name]).all()


def nan_box() -> SceneData:
    vertices, triangles = meshes.box()
    broken = vertices.copy()
    broken[5, 2] = np.nan
    return SceneData(
        [box(), Mesh("Broken", broken, triangles)],
        np.array([0, 1], np.int32),
        np.stack([np.eye(4)] * 2),
        camera=front(),
    )


EMPTY = Mesh("Empty", np.zeros((0, 3), np.float32), np.zeros((0, 3), np.int32))


@pytest.mark.parametrize(
    ("scene", "named"),
    [
        (SceneData.of_mesh(box()), "'Box' has no camera"),
        (SceneData([], np.zeros(0, np.int32), np.zeros((0, 4, 4)), "Nothing", front()), "'Nothing' has no mesh"),
        (SceneData.of_mesh(EMPTY, front()), "'Empty' has no triangles"),
        (
            SceneData([], np.zeros(0, np.int32), np.zeros((0, 4, 4)), camera=front(), skipped=["Smoke: a volume"]),
            "Smoke: a volume",
        ),
        (nan_box(), "'Broken': vertex 5 .*nan"),
    ],
)
def test_a_scene_that_cannot_be_traced_is_one_line_before_any_work(
    monkeypatch: pytest.MonkeyPatch, scene: SceneData, named: str
) -> None:
    monkeypatch.setattr(bihtree, "Tree", None)
    with pytest.raises(UserError, match=named) as caught:
        preview.trace(scene, Settings())
    assert caught.value.exit_status == 1
    assert "\n" not in str(caught.value)


def outputs_in(folder: Path) -> preview.Outputs:
    return preview.Outputs(
        images=(folder / "a.png", folder / "a.exr"), overlay=folder / "tree.png", stats=folder / "a.json"
    )


def test_all_files_of_one_trace_and_one_tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[Any] = []
    real = bihtree.Tree

    def counted(*arguments: Any, **options: Any) -> bihtree.Tree:
        built.append(real(*arguments, **options))
        return built[-1]

    monkeypatch.setattr(bihtree, "Tree", counted)
    scene, settings = two_boxes(), Settings(passes=("normal", "triangle"))
    outputs = outputs_in(tmp_path)
    traced = preview.trace(scene, settings)
    preview.write(traced, scene, settings, outputs)
    assert len(built) == 1
    assert sorted(tmp_path.iterdir()) == sorted(outputs.paths)
    assert (image.read_image(tmp_path / "a.png") == image.to_srgb8(traced.passes["combined"])).all()
    names = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec().channelnames
    assert set(names) == {f"ViewLayer.{channel}" for name in settings.passes for channel in image.CHANNELS[name]}
    overlay = image.read_image(tmp_path / "tree.png")
    assert overlay.shape == (30, 40, 3)
    assert (overlay != image.to_srgb8(traced.passes["combined"], alpha=False)).any()
    written = json.loads((tmp_path / "a.json").read_text())
    assert written == {
        **traced.report,
        "versions": {**traced.report["versions"], "OpenImageIO": OpenImageIO.VERSION_STRING},
    }


def test_progress_goes_up_stage_by_stage(tmp_path: Path) -> None:
    told: list[tuple[str, float]] = []
    scene = two_boxes()

    def progress(stage: str, fraction: float) -> None:
        told.append((stage, fraction))

    traced = preview.trace(scene, Settings(), progress=progress)
    preview.write(traced, scene, Settings(), outputs_in(tmp_path), progress=progress)
    order = ["build", "trace", "overlay", "write"]
    assert list(dict.fromkeys(stage for stage, _ in told)) == order
    assert told == sorted(told, key=lambda entry: (order.index(entry[0]), entry[1]))
    assert all(0 <= fraction <= 1 for _, fraction in told)
    assert told[-1] == ("write", 1)


def test_a_cancel_at_any_moment_leaves_the_folder_as_it_was(tmp_path: Path) -> None:
    scene = two_boxes()
    (tmp_path / "a.png").write_text("old")

    stages: list[str] = []

    def job(calls: int) -> None:
        """The whole job, cancelled after so many calls of the progress."""
        left = iter(range(calls))

        def progress(stage: str, fraction: float) -> bool:
            stages.append(stage)
            return next(left, None) is not None

        traced = preview.trace(scene, Settings(), progress=progress)
        preview.write(traced, scene, Settings(), outputs_in(tmp_path), progress=progress)

    for number in range(1000):
        try:
            job(number)
        except bihtree.Cancelled:
            assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
            assert (tmp_path / "a.png").read_text() == "old"
        else:
            break
    assert set(stages) == {"build", "trace", "overlay", "write"}
    assert number > 7
    assert sorted(tmp_path.iterdir()) == sorted(outputs_in(tmp_path).paths)


def test_when_the_second_file_fails_the_first_is_not_there_either(tmp_path: Path) -> None:
    scene = one_box(front(256, 256))
    traced = preview.trace(scene, Settings())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2 << 20, hard))  # room for 256 x 256 of RGBA, not for every pass
    try:
        with pytest.raises(UserError, match=r"cannot write .*a\.exr: "):
            preview.write(traced, scene, Settings(), outputs_in(tmp_path))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == []
    preview.write(traced, scene, Settings(), outputs_in(tmp_path))
    assert len(list(tmp_path.iterdir())) == 4


@pytest.mark.parametrize(
    ("outputs", "named", "status"),
    [
        (lambda here: preview.Outputs(images=(here / "no" / "a.png",)), "there is no folder .*no", 1),
        (lambda here: preview.Outputs(stats=here / "no" / "a.json"), "there is no folder .*no", 1),
        (lambda here: preview.Outputs(images=(here,)), "it is a folder", 1),
        (lambda here: preview.Outputs(images=(here / "a.doc",)), "a.doc: its name must end in one of .png", 2),
        (lambda here: preview.Outputs(overlay=here / "a.exr"), "a.exr: its name must end in one of .png", 2),
        (lambda here: preview.Outputs((here / "a.png",), here / "a.png"), "two outputs have the name .*a.png", 2),
        (lambda here: preview.Outputs((here / "a.png", here / ".." / here.name / "a.png")), "two outputs", 2),
    ],
)
def test_outputs_are_checked_before_any_work(
    tmp_path: Path, outputs: Callable[[Path], preview.Outputs], named: str, status: int
) -> None:
    with pytest.raises(UserError, match=named) as caught:
        preview.check_outputs(outputs(tmp_path))
    assert caught.value.exit_status == status
    assert list(tmp_path.iterdir()) == []


WITHOUT_OPENIMAGEIO = """
import sys
sys.modules["OpenImageIO"] = None
from pathlib import Path
import numpy as np
from addon.pipeline import preview
from addon.pipeline.camera import framing_view
from addon.pipeline.errors import UserError
from addon.pipeline.mesh import Mesh
from addon.pipeline.scene import SceneData
from addon.pipeline.settings import Settings

mesh = Mesh("one", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
scene = SceneData.of_mesh(mesh, framing_view(np.array([[0.0] * 3, [1.0] * 3]), 20, 20))
traced = preview.trace(scene, Settings())
assert np.isfinite(traced.passes["depth"]).any()
preview.write(traced, scene, Settings(), preview.Outputs(stats=Path(sys.argv[1], "a.json")))
for outputs in (preview.Outputs((Path(sys.argv[1], "a.png"),)), preview.Outputs(overlay=Path(sys.argv[1], "a.png"))):
    try:
        preview.check_outputs(outputs)
    except UserError as error:
        print(error)
"""


def test_without_openimageio_only_pictures_in_files_are_missing(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_OPENIMAGEIO, str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    assert [("pip install OpenImageIO" in line) for line in done.stdout.splitlines()] == [True, True]
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
    assert json.loads((tmp_path / "a.json").read_text())["versions"]["OpenImageIO"] is None
