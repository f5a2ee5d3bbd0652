"""Blender's instances as rows of OBJECT_DTYPE."""

from __future__ import annotations

import bpy

from ..pipeline.scene import HIDDEN, HOLDOUT, NO_SHADOW
from .surfaces import Surfaces

Row = tuple[int, int, int]


class Objects:
    """Rows for instances, each asked for once: a million of them may show a few objects. `layer` is the view layer that
    they are in, as Blender has it now."""

    layer: bpy.types.ViewLayer | None = None

    def __init__(self, surfaces: Surfaces | None) -> None:
        self._surfaces = surfaces
        self._rows: dict[tuple[object, ...], Row] = {}

    def row_of(self, instance: bpy.types.DepsgraphObjectInstance) -> Row:
        """The row of its first surface (0 where materials are not read), its pass index and its flags."""
        owner = instance.object
        parent = instance.parent if instance.is_instance else None
        key = (owner.data, instance.instance_object if parent else owner, parent)
        row = self._rows.get(key)
        if row is None:
            flags = self._flags(owner) | (self._flags(parent) if parent else 0)
            first = self._surfaces.first_of(owner) if self._surfaces else 0
            row = self._rows[key] = (first, owner.pass_index, flags)
        return row

    def _flags(self, owner: bpy.types.Object) -> int:
        hidden = 0 if owner.visible_camera else HIDDEN
        shadow = 0 if owner.visible_shadow else NO_SHADOW
        held_out = owner.is_holdout or owner.original.holdout_get(view_layer=self.layer)
        return hidden | shadow | (HOLDOUT if held_out else 0)
