"""Undo of bakes. Blender restores the packed file of an image but not the pixels on display: they are loaded again.

Undo does not restore files: an image with a file keeps the facts about its bakes, and the last one counts as undone.
"""

from __future__ import annotations

import uuid
from dataclasses import replace

import bpy
from bpy.app.handlers import persistent

from ..registration import all_or_nothing, handlers
from .facts import ImageFacts, facts_of, set_facts

_shown: dict[str, str] = {}
"""Stamp of the pixels that an image shows, by its name, if this session baked them."""

_in_files: dict[tuple[str, str], ImageFacts] = {}
"""Facts of images with files before the last undo that had these images, by name and path."""


def stamp(image) -> None:
    """Note that the image shows the pixels that were just packed or written to its file."""
    _shown[image.name] = uuid.uuid4().hex
    set_facts(image, replace(facts_of(image), stamp=_shown[image.name], is_undone=False))


def is_undone(image) -> bool:
    """True if the last bake in the image's file was undone, which the file was not."""
    return facts_of(image).is_undone


@persistent
def _note_files(*_arguments) -> None:
    facts = {_key(image): facts_of(image) for image in bpy.data.images if _has_file(image)}
    _in_files.update((key, known) for key, known in facts.items() if known.stamp)


@persistent
def _show_packed_pixels(*_arguments) -> None:
    for image in bpy.data.images:
        facts = facts_of(image)
        if _key(image) in _in_files and _has_file(image):
            in_file = _in_files[_key(image)]
            facts = replace(in_file, is_undone=facts.stamp != in_file.stamp)
            set_facts(image, facts)
        if _shown.get(image.name, facts.stamp) != facts.stamp:
            # `reload` would pack the image's file again, if there is one.
            image.buffers_free()
            image.gl_free()
            _shown[image.name] = facts.stamp


def _key(image) -> tuple[str, str]:
    return image.name, image.filepath


def _has_file(image) -> bool:
    return image.source in ("FILE", "TILED") and image.packed_file is None


@persistent
def _forget(*_arguments) -> None:
    _shown.clear()
    _in_files.clear()


register, unregister = all_or_nothing(
    *handlers(
        undo_pre=_note_files,
        redo_pre=_note_files,
        undo_post=_show_packed_pixels,
        redo_post=_show_packed_pixels,
        load_pre=_forget,
    )
)
