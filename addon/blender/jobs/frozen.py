"""Warnings where one bake is shown in all frames although the light changes: in panels, and as an animation renders."""

from __future__ import annotations

import logging

import bpy
from bpy.app.handlers import persistent

from ...core.messages import Message, warning
from ...core.target import Target
from .. import popup
from ..images.facts import is_sequence
from ..node.find import find_bakeable, image_of
from ..read.motion import Motion
from ..registration import all_or_nothing, handlers

REMEDY = "Bake Animation bakes each frame (Render > Beamspread > Animation)."

OF_TILES = "Blender shows no sequences of UDIM tiles: their frames are files for other programs."

MAX_NAMES = 3
"""Number of names in a sentence."""


def frozen(scene, targets: list[Target]) -> tuple[Message, ...]:
    """Warnings about targets that show one bake while lamps or objects of the scene move."""
    shown = [target for target in targets if (image := image_of(target)) is not None and not is_sequence(image)]
    if not shown:
        return ()
    motion = Motion(scene)
    lamps = list(motion.lamps())
    moving = lamps or list(motion.objects())
    if not moving:
        return ()
    names, verb = _listed(moving), "changes" if len(moving) == 1 else "change"
    baked = _listed(list(dict.fromkeys(target.object_name for target in shown)))
    shows = "shows" if len({target.object_name for target in shown}) == 1 else "show"
    is_tiled = [image_of(target).source == "TILED" for target in shown]
    remedy = " ".join([REMEDY] * (not all(is_tiled)) + [OF_TILES] * any(is_tiled))
    return (warning(baked, f"{names} {verb} with time, but {baked} {shows} one bake in all frames.", remedy),)


def _listed(names: list[str]) -> str:
    """Names in a sentence: "'A', 'B' and 4 more"."""
    quoted = [f"'{name}'" for name in names]
    if len(quoted) > MAX_NAMES:
        quoted = [", ".join(quoted[: MAX_NAMES - 1]), f"{len(quoted) - MAX_NAMES + 1} more"]
        return " and ".join(quoted)
    return " and ".join(filter(None, [", ".join(quoted[:-1]), quoted[-1]]))


class _Render:
    """The render that runs: an animation renders more than one frame.

    Attributes
    ----------
    frame : the first one; None before it.
    is_said : True once the warnings were shown.
    """

    def __init__(self) -> None:
        self.frame: int | None = None
        self.is_said = False


_render = _Render()


@persistent
def _begin(*_arguments) -> None:
    _render.frame, _render.is_said = None, False


@persistent
def _before_frame(scene, *_arguments) -> None:
    """Show the warnings at the second frame. In a window this runs in a thread, which may not read the scene."""
    if _render.frame is None:
        _render.frame = scene.frame_current
    elif not _render.is_said and scene.frame_current != _render.frame:
        _render.is_said = True
        if bpy.app.background:
            _say()
        else:
            bpy.app.timers.register(_say)


def _say() -> None:
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    sentences = [str(message) for message in frozen(scene, find_bakeable(view_layer))]
    if sentences and bpy.app.background:
        logging.getLogger(__name__).warning("Beamspread: %s", " ".join(sentences))
    elif sentences:
        popup.show_soon("Beamspread: the bake stands still in this animation", sentences)


register, unregister = all_or_nothing(*handlers(render_init=_begin, render_pre=_before_frame))
