"""Blender's materials as rows of SURFACE_DTYPE, and its world as one colour."""

from __future__ import annotations

import bpy
import numpy as np

from ..pipeline.scene import SURFACE_DTYPE, Colour
from .compat import uses_nodes
from .nodes import colour_of, number_of, shader_of

GREY: Colour = (0.8, 0.8, 0.8)
"""What Blender gives a mesh without a material."""


class Surfaces:
    """Rows for the material slots of objects: objects with the same materials share theirs."""

    def __init__(self) -> None:
        self._rows: list[tuple[Colour, Colour, int]] = []
        self._first: dict[tuple[bpy.types.Material | None, ...], int] = {}
        self._simplified: dict[str, None] = {}

    def first_of(self, owner: bpy.types.Object) -> int:
        """The row of the object's first slot."""
        materials = _materials(owner)
        if materials not in self._first:
            self._first[materials] = len(self._rows)
            self._rows += [self._row(material) for material in materials]
        return self._first[materials]

    @property
    def rows(self) -> np.ndarray:
        """SURFACE_DTYPE; none where no object has a material."""
        if not any(any(materials) for materials in self._first):
            return np.zeros(0, SURFACE_DTYPE)
        return np.array(self._rows, SURFACE_DTYPE)

    @property
    def notes(self) -> list[str]:
        """One line about materials that are shown by their viewport colour."""
        if not self._simplified:
            return []
        names = ", ".join(repr(name) for name in self._simplified)
        return [f"textures and mixed shaders are not traced; viewport colours stand for them in the materials {names}"]

    def _row(self, material: bpy.types.Material | None) -> tuple[Colour, Colour, int]:
        if material is None:
            return GREY, (0.0, 0.0, 0.0), 0
        base, emission = _look(material)
        if base is None or emission is None:
            self._simplified[material.name] = None
        red, green, blue, _ = material.diffuse_color
        return base or (red, green, blue), emission or (0.0, 0.0, 0.0), material.pass_index


def world_colour(world: bpy.types.World | None) -> tuple[Colour | None, str]:
    """The scene-linear radiance of the world, None where there is no world, and a note where it is simplified."""
    if world is None:
        return None, ""
    plain = tuple(world.color)
    if not uses_nodes(world):
        return plain, ""
    shader = shader_of(world.node_tree)
    if shader is None:
        return (0.0, 0.0, 0.0), ""
    if shader.type == "BACKGROUND":
        colour, strength = colour_of(shader.inputs["Color"]), number_of(shader.inputs["Strength"])
        if colour is not None and strength is not None:
            return _scaled(colour, strength), ""
    return plain, f"world {world.name!r}: textures are not traced; its viewport colour stands for them"


def _materials(owner: bpy.types.Object) -> tuple[bpy.types.Material | None, ...]:
    """By slot, at least one: the object's own where a slot is linked to it, else the mesh's."""
    slots = owner.material_slots
    own = owner.data.materials
    found = (
        slots[row].material if row < len(slots) and slots[row].link == "OBJECT" else material
        for row, material in enumerate(own)
    )
    return tuple(found) or (None,)


def _look(material: bpy.types.Material) -> tuple[Colour | None, Colour | None]:
    """Reflectance and radiance; None for what is no constant."""
    if not uses_nodes(material):
        red, green, blue, _ = material.diffuse_color
        return (red, green, blue), (0.0, 0.0, 0.0)
    shader = shader_of(material.node_tree)
    black: Colour = (0.0, 0.0, 0.0)
    if shader is None:
        return black, black
    inputs = shader.inputs
    if shader.type == "BSDF_PRINCIPLED":
        return colour_of(inputs["Base Color"]), _emission(inputs["Emission Color"], inputs["Emission Strength"])
    if shader.type == "BSDF_DIFFUSE":
        return colour_of(inputs["Color"]), black
    if shader.type == "EMISSION":
        return black, _emission(inputs["Color"], inputs["Strength"])
    return None, black


def _emission(colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Colour | None:
    amount = number_of(strength)
    if amount == 0.0:
        return (0.0, 0.0, 0.0)
    given = colour_of(colour)
    return None if given is None or amount is None else _scaled(given, amount)


def _scaled(colour: Colour, factor: float) -> Colour:
    red, green, blue = colour
    return (red * factor, green * factor, blue * factor)
