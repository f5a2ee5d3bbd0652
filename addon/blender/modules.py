"""Modules that are not everywhere, and what to do where one is missing."""

from __future__ import annotations

from importlib import import_module

from ..pipeline.errors import UserError

ADVICE = {
    "numpy": "Blender and the bpy wheel bring it (pip install bpy, for Python 3.11); "
    "in the repository, `make preview` sets everything up",
    "bihtree": "Install the extension from the zip for this platform; in the repository, `make preview` builds it",
    "bpy": "Install it for Python 3.11 (pip install bpy), or run this in Blender: blender --command bih render …",
}


def why_missing(name: str) -> str:
    """Empty where the module imports; else one line for a person."""
    try:
        import_module(name)
    except ImportError as error:
        return f"the module {name} cannot be imported ({error}). {ADVICE[name]}"
    return ""


def require(*names: str) -> None:
    """Raise UserError for the first of the modules that does not import."""
    for name in names:
        if missing := why_missing(name):
            raise UserError(missing)
