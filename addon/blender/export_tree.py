"""The built tree as files: for bihtree.Tree.load, and its nodes for NumPy.

Blender reads the annotations as values, so they are not postponed here.
"""

from pathlib import Path
from typing import Any

import bpy
from bpy.props import StringProperty

from .build import built_tree
from .modal_work import FileWork
from .trees import OfBuiltTree
from .worker import Worker


class BIH_OT_export_tree(OfBuiltTree, FileWork, bpy.types.Operator):
    bl_idname = "bih.export_tree"
    bl_label = "Export Tree"
    bl_description = (
        "Save the built tree with its mesh for bihtree.Tree.load, and beside it an .npz of its nodes and their order "
        "for NumPy. Takes the time of writing it, hardly any memory; changes nothing in the scene"
    )

    suffix = ".bihtree"
    filepath: StringProperty(name="File", description="The saved tree; the .npz has its name", subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.bihtree;*.npz", options={"HIDDEN"})

    def started(self, context: bpy.types.Context) -> Worker[Any]:
        from ..pipeline import tree_files

        made, path = built_tree(context), self.path()
        tree_files.check(path)
        return Worker("BIH export", lambda told: tree_files.write(made.tree, path, told=told))

    def finished(self, context: bpy.types.Context, result: Any) -> str:
        return "BIH: wrote " + " and ".join(Path(path).name for path in result)
