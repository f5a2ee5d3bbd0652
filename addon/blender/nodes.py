"""What shader nodes say without being evaluated: constants, and which shader is at the end."""

from __future__ import annotations

import bpy

CONSTANTS = {"RGB", "VALUE"}
OUTPUTS = {"OUTPUT_MATERIAL", "OUTPUT_WORLD"}


def shader_of(tree: bpy.types.NodeTree | None) -> bpy.types.Node | None:
    """The node that the tree's output is linked to."""
    nodes = tree.nodes if tree else ()
    output = next((node for node in nodes if node.type in OUTPUTS and node.is_active_output), None)
    return _source(output.inputs["Surface"]) if output else None


def colour_of(socket: bpy.types.NodeSocket) -> tuple[float, float, float] | None:
    """The colour of an input; None where something else than a constant drives it."""
    node = _source(socket)
    if socket.is_linked and (node is None or node.type not in CONSTANTS):
        return None
    value = node.outputs[0].default_value if node else socket.default_value
    if isinstance(value, float):
        return (value, value, value)
    return (value[0], value[1], value[2])


def number_of(socket: bpy.types.NodeSocket) -> float | None:
    """The number of an input; None where something else than a constant drives it."""
    colour = colour_of(socket) if not socket.is_linked or _is_value(socket) else None
    return colour[0] if colour else None


def _is_value(socket: bpy.types.NodeSocket) -> bool:
    node = _source(socket)
    return node is not None and node.type == "VALUE"


def _source(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that a socket is linked to, through reroutes."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None
