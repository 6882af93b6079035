"""Live in this process: a timer switches the session on and off and steps it, and handlers pass on events."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ...core import native
from ...core.errors import text_of
from ...core.messages import Messages, note
from ..node.tree import release_images
from ..read.scene_cache import listeners
from ..registration import all_or_nothing, handlers
from .preview import remove_strays
from .session import Session, is_looked_at

BUSY_SECONDS, IDLE_SECONDS, OFF_SECONDS = 0.01, 0.05, 0.5
"""Seconds between steps: while something changes or is rendered, while nothing does, and while Live is off."""


class _Live:
    """The session of the process.

    Attributes
    ----------
    session : None while Live is off.
    failure : reason why Live was switched off; "" if the user did so.
    was_on : True if Live was on since the file was opened.
    """

    def __init__(self) -> None:
        self.session: Session | None = None
        self.scene_name = ""
        self.failure = ""
        self.was_on = False
        self.image_count = 0  # number of images at the last search for strays


live = _Live()


def messages() -> Messages:
    """Messages of Live for panels."""
    found = Messages()
    if bpy.context.scene.beamspread.use_live and not is_looked_at(bpy.context):
        found.add(note("", "Live waits for a 3D View in Material Preview or Rendered."))
    if live.session is not None:
        found.add(*live.session.messages())
    elif live.failure:
        found.add(note("", f"Live was switched off: {live.failure}"))
    return found


def step(context) -> float:
    """Do the work of one tick; the seconds until the next one."""
    scene = context.scene
    is_on = not native.problem and scene is not None and scene.beamspread.use_live
    if not is_on or scene.name != live.scene_name:
        end()
    if len(bpy.data.images) != live.image_count:
        _remove_strays()
    if not is_on:
        return OFF_SECONDS
    if live.session is not None and live.session.rests(context):
        return IDLE_SECONDS
    if not is_looked_at(context):
        return IDLE_SECONDS
    if live.session is None:
        live.session, live.scene_name, live.failure, live.was_on = Session(), scene.name, "", True
    return BUSY_SECONDS if live.session.step(context) else IDLE_SECONDS


def end(can_remove: bool = True) -> None:
    """Switch off; `can_remove`: hidden images can be removed, see `Session.end`."""
    session, live.session = live.session, None
    if session is not None:
        session.end(can_remove)


def _remove_strays() -> None:
    remove_strays(set() if live.session is None else live.session.names())
    live.image_count = len(bpy.data.images)


def _tick() -> float:
    try:
        return step(bpy.context)
    except Exception as error:  # noqa: BLE001 - Blender would drop the timer, and Live would be on and dead
        live.failure = text_of(error)
        end()
        bpy.context.scene.beamspread.use_live = False
        return OFF_SECONDS


def _changed(depsgraph) -> None:
    """Take note of a change, of any change after undo and loading."""
    if depsgraph is None:
        if live.session is not None:
            live.session.recover()
        _remove_strays()
    elif live.session is not None and depsgraph.mode == "VIEWPORT" and depsgraph.scene.name == live.scene_name:
        live.session.note(depsgraph)


@persistent
def before_undo(*_arguments) -> None:
    """Take Live's images out of all trees: undo knows nothing of them."""
    if live.was_on:
        release_images()


@persistent
def hide_previews(*_arguments) -> None:
    """Show own images before saves and exports, which keep them, and Blender's Bake, which may fill a plain group's."""
    if live.session is not None:
        live.session.hide()


@persistent
def show_previews(*_arguments) -> None:
    """Show previews again after a save or an export."""
    if live.session is not None:
        live.session.show()


@persistent
def _leave_file(*_arguments) -> None:
    end(can_remove=False)
    live.was_on = False
    live.image_count = -1  # where the next file can't be opened, this one stays, and hidden images go in the next step


def _start() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(_tick, first_interval=OFF_SECONDS, persistent=True)


def _stop() -> None:
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    end()


register, unregister = all_or_nothing(
    *handlers(
        save_pre=hide_previews,
        save_post=show_previews,
        object_bake_pre=hide_previews,
        undo_pre=before_undo,
        redo_pre=before_undo,
        load_pre=_leave_file,
    ),
    (lambda: listeners.append(_changed), lambda: listeners.remove(_changed)),
    (_start, _stop),
)
