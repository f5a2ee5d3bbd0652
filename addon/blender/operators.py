"""The panel's button for a report: it reads the scene, measures in the background, and opens the page.

Blender reads the annotations as values, so they are not postponed here.
"""

import tempfile
from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from .properties import settings_of
from .scene_work import SceneWork
from .worker import Worker

FOR_SCRIPTS = {"HIDDEN", "SKIP_SAVE"}


class BIH_OT_report(SceneWork, bpy.types.Operator):
    bl_idname = "bih.report"
    bl_label = "Error Report"
    bl_description = (
        "Measure error against run time for what the viewport shows: wrong hits, time and memory of each method, "
        "stability, and what the scene does without. Opens a page in the browser; Esc ends it early"
    )

    quick: BoolProperty(
        name="Quick",
        description="Fewer rays and rounds: about a minute of time instead of several, the same memory; small error "
        "rates are less sure",
        default=True,
    )
    # A click of the button does not go on with what a script asked for.
    only: StringProperty(name="Sections", description="Names of sections, with commas; empty: all", options=FOR_SCRIPTS)
    folder: StringProperty(name="Folder", description="Where the page is written", options=FOR_SCRIPTS)

    def started(self, context: bpy.types.Context) -> Worker[Path]:
        from ..report.error.command import options_of
        from ..report.error.subject import Subject
        from .background import report_worker

        scene = context.scene
        subject = Subject(
            self.scene_read(context, with_camera=True), settings_of(scene), bpy.data.filepath or scene.name
        )
        # What is empty is said at once.
        assert subject.mesh and subject.camera
        folder = Path(self.folder) if self.folder else _own_folder()
        return report_worker(subject, options_of(self.quick, self.only or None), folder)

    def finished(self, context: bpy.types.Context, result: Path) -> str:
        if self.is_in_window:
            bpy.ops.wm.url_open(url=result.as_uri())
        return f"BIH report: {result}"

    def line(self) -> str:
        """The report knows better how long it takes."""
        return self.work.line


def _own_folder() -> Path:
    """The extension's own; where it is no extension, a new temporary one."""
    package = ".".join(str(__package__).split(".")[:3])
    if package.startswith("bl_ext."):
        return Path(bpy.utils.extension_path_user(package, path="report", create=True))
    return Path(tempfile.mkdtemp(prefix="bih-report-"))
