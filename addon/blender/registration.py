"""Everything that Blender must know of, in and out again: the classes and the command."""

from __future__ import annotations

import bpy

from . import classes, command_line

_commands: list[object] = []
"""What Blender gave for the command it keeps, and wants back."""


def register() -> None:
    classes.register()
    _commands.append(bpy.utils.register_cli_command("bih", command_line.execute))


def unregister() -> None:
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    classes.unregister()
