"""Images that show for a while what is not theirs: whoever keeps, copies or saves pixels has them put back first."""

from __future__ import annotations

from typing import Protocol

import bpy
from bpy.app.handlers import persistent

# Of an image that was made to show previews, and holds nothing else: as if the node had none.
MADE_FOR_PREVIEWS = "beamspread_preview"


class Holder(Protocol):
    """Who shows previews."""

    def give_back(self) -> None:
        """Put the images' own pixels back."""

    def covers(self, image) -> bool:
        """Whether the image shows a preview."""


class _Previews:
    """Who shows them in this process."""

    holder: Holder | None = None


previews = _Previews()


def give_back() -> None:
    """Have all images show their own pixels."""
    if previews.holder is not None:
        previews.holder.give_back()


def covers(image) -> bool:
    """Whether the image shows a preview."""
    return previews.holder is not None and previews.holder.covers(image)


@persistent
def _before_saving(*_arguments) -> None:
    give_back()


@persistent
def _forget_made(*_arguments) -> None:
    """Undo, and files that Blender has saved by itself, bring back images that nobody shows previews in any more."""
    if previews.holder is None:
        for image in [one for one in bpy.data.images if MADE_FOR_PREVIEWS in one]:
            bpy.data.images.remove(image)


HANDLERS = {
    "save_pre": _before_saving,
    "undo_post": _forget_made,
    "redo_post": _forget_made,
    "load_post": _forget_made,
}


def register() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
