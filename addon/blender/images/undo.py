"""Undo brings back what an image has packed, but not the pixels that are shown: here they are loaded again.

A file is not undone: what its image says of the bakes in it stays, too, and that the last one was undone.
"""

from __future__ import annotations

import uuid

import bpy
from bpy.app.handlers import persistent

from ..registration import all_or_nothing, handlers

OURS = "beamspread_"
"""How the names of all that an image says of bakes begin."""

# Of an image: a number of the last bake in it, which travels with undo as the packed file does.
KEY = f"{OURS}stamp"

_shown: dict[str, str] = {}
"""Stamp of the pixels that an image shows, by its name, where this session baked them: others may be painted."""

UNDONE = f"{OURS}undone"
"""Of an image: the bake that its file holds was undone."""

_in_files: dict[tuple[str, str], dict[str, str]] = {}
"""What images with files said of their bakes before the last undo at which they were there, by name and path."""


def stamp(image) -> None:
    """Note that the image shows what it has just packed, or what has just been written to its file."""
    image[KEY] = _shown[image.name] = uuid.uuid4().hex
    image.pop(UNDONE, None)


def is_undone(image) -> bool:
    """Whether the last bake in the image's file was undone, which the file was not."""
    return UNDONE in image


@persistent
def _note_files(*_arguments) -> None:
    _in_files.update({_key(image): _said(image) for image in bpy.data.images if KEY in image and _has_file(image)})


@persistent
def _show_what_is_kept(*_arguments) -> None:
    for image in bpy.data.images:
        if _key(image) in _in_files and _has_file(image):
            said = _in_files[_key(image)]
            is_other = image.get(KEY) != said[KEY]
            for key, text in said.items():
                image[key] = text
            if is_other:
                image[UNDONE] = "yes"
            else:
                image.pop(UNDONE, None)
        kept = image.get(KEY, "")
        if _shown.get(image.name, kept) != kept:
            # Not `reload`: it would pack the image's file anew, where there is one.
            image.buffers_free()
            image.gl_free()
            _shown[image.name] = kept


def _key(image) -> tuple[str, str]:
    return image.name, image.filepath


def _has_file(image) -> bool:
    return image.source == "FILE" and image.packed_file is None


def _said(image) -> dict[str, str]:
    return {key: value for key, value in image.items() if key.startswith(OURS)}


@persistent
def _forget(*_arguments) -> None:
    _shown.clear()
    _in_files.clear()


register, unregister = all_or_nothing(
    *handlers(
        undo_pre=_note_files,
        redo_pre=_note_files,
        undo_post=_show_what_is_kept,
        redo_post=_show_what_is_kept,
        load_pre=_forget,
    )
)
