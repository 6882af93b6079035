"""Registers the add-on's parts with Blender, in order; each part knows its classes."""

from . import engine, nodes, operators, settings, ui

PARTS = (settings, nodes, engine, operators, ui)


def register() -> None:
    """Add the add-on to Blender."""
    for part in PARTS:
        part.register()


def unregister() -> None:
    """Take it out again, in reverse."""
    for part in reversed(PARTS):
        part.unregister()
