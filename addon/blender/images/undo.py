"""Undo brings back what an image has packed, but not the pixels that are shown: here they are loaded again."""

from __future__ import annotations

import uuid

import bpy
from bpy.app.handlers import persistent

# Of an image: a number of what is packed, which travels with undo as the packed file does.
KEY = "beamspread_stamp"

_shown: dict[str, str] = {}
"""Stamp of the pixels that an image shows, by its name, where this session baked them: others may be painted."""


def stamp(image) -> None:
    """Note that the image shows what it has just packed."""
    image[KEY] = _shown[image.name] = uuid.uuid4().hex


@persistent
def _show_what_is_kept(*_arguments) -> None:
    for image in bpy.data.images:
        kept = image.get(KEY, "")
        if _shown.get(image.name, kept) != kept:
            # Not `reload`: it would pack the image's file anew, where there is one.
            image.buffers_free()
            image.gl_free()
            _shown[image.name] = kept


@persistent
def _forget(*_arguments) -> None:
    _shown.clear()


HANDLERS = {"undo_post": _show_what_is_kept, "redo_post": _show_what_is_kept, "load_pre": _forget}


def register() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
