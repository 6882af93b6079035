"""Keeps the rows of `state` true: looks at what a scene's bakes have read once changes to the scene come to rest.

Handlers only note what changed; the look follows in a timer of the window. In background nobody waits for it, and
whoever needs the rows calls `refresh`.
"""

from __future__ import annotations

import time
from dataclasses import replace

import bpy
from bpy.app.handlers import persistent

from ....core.bake.runner import Bake
from ....core.messages import Level, Message, note, warning
from ....core.target import Target
from ...images.facts import Record, facts_of, note_bake, record_in, record_of, record_of_bake
from ...images.files import file_of
from ...images.sequence import file_at, is_sequence
from ...images.undo import is_undone
from ...node.find import find_bakeable, find_misplaced, find_node
from ...read.visibility import by_name
from ...registration import all_or_nothing, handlers
from ..state import Row, Status, redraw, state
from .fingerprint import IMAGE, QUALITY, Fingerprints, Parts, image_part

# After the last change; and after the last look so long that looks take at most such a part of the time. One alone may
# take longer: the first of a file, and after undo, reads all meshes, and those that follow don't.
REST_SECONDS, MOST_OF_THE_TIME = 0.3, 0.1

FIRST_LOOK = "first look"

fingerprints = Fingerprints()
_waiting: list[tuple[Bake, Parts | None]] = []
_last = {"change": 0.0, "took": 0.0, "next": 0.0, "is looking": False}


def refresh(context) -> None:
    """Bring the rows of all targets of the context's scene up to date."""
    _keep_waiting()
    context.view_layer.update()  # in 3.4 it has None in place of what a script has just removed
    targets = find_bakeable(context.view_layer, context.scene.objects)
    recorded = {target: record for target in targets if (record := _record(target, context.scene)) is not None}
    now = fingerprints.of(context, recorded) if recorded else {}
    state.rows = {target: _row(target, recorded.get(target), now.get(target)) for target in targets}
    state.rows |= {row.target: row for row in _failures_of_others(context.scene, targets)}


def _failures_of_others(scene, targets: list[Target]) -> list[Row]:
    """Of what is no target, as a node inside a group.

    Neither of an object that is gone, nor of one that has another material in its place by now.
    """
    others = [row for row in state.failures() if row.target not in targets]
    named, objects = {target.object_name for target in targets}, by_name(scene) if others else {}
    others = [row for row in others if row.target.object_name in objects]
    again = find_misplaced(objects[name] for name in named & {row.target.object_name for row in others})
    misplaced = {bake.target for bake in again}
    return [row for row in others if row.target.object_name not in named or row.target in misplaced]


def parts_of(context, targets: list[Target]) -> dict[Target, Parts]:
    """What bakes of the targets read now, to be kept with what they make; see `keep`."""
    return fingerprints.of(context, targets)


def keep(bake: Bake, parts: Parts | None, is_first_look: bool = False) -> None:
    """Note in the node's image what the bake in it has read and said."""
    image = _image(bake.target)
    if image is None or parts is None:
        return
    parts = parts | {IMAGE: image_part(image)}  # the bake may have made it
    if is_first_look:
        parts[QUALITY] = FIRST_LOOK
    note_bake(image, bake.target, record_of_bake(bake, parts, image.is_dirty))


def keep_later(bake: Bake, parts: Parts | None) -> None:
    """As `keep`, once Blender has put the bake's pixels into the image; from any thread."""
    _waiting.append((bake, parts))


def _keep_waiting() -> None:
    while _waiting:
        keep(*_waiting.pop(0))


def _image(target: Target):
    node = find_node(bpy.data.materials.get(target.material_name))
    return None if node is None else node.image


def _record(target: Target, scene) -> Record | None:
    image = _image(target)
    if is_sequence(image):
        path = file_at(image, scene.frame_current)
        return path and record_in(path)
    return None if image is None else record_of(image, target)


def _row(target: Target, record: Record | None, now: Parts | None) -> Row:
    if is_sequence(_image(target)):
        return _row_of_frames(target, record, now)
    changed = [] if record is None or now is None else record.changed(now)
    if record is not None and not record.is_dirty and _image(target).is_dirty:
        changed.append("pixels of the image")
    if record is not None and _has_lost_its_file(_image(target)):
        changed = [*(name for name in changed if name != IMAGE), "file of the image, which is gone"]
    said = state.status_of(target)
    if said is not None and said.status in (Status.FAILED, Status.CANCELLED):
        return replace(said, is_stale=bool(changed))
    if record is None:
        return Row(target, Status.NEVER)
    earlier = (*_why_later(_image(target)), *record.messages())
    subject = str(target)
    if changed and changed != [QUALITY]:
        why = warning(subject, f"Changed since its bake: {', '.join(changed)}.")
        return Row(target, Status.STALE, (why, *earlier), True)
    again = [warning(subject, _why_again(record.parts[QUALITY], now[QUALITY]))] if changed else []
    status = Status.WARNED if any(one.level == Level.WARNING for one in (*again, *earlier)) else Status.BAKED
    return Row(target, status, (*again, *earlier), bool(changed))


def _row_of_frames(target: Target, record: Record | None, now: Parts | None) -> Row:
    """Of a sequence, by the frame that is shown; a bake does not make it anew, and so it is not up for one."""
    first, last, *_ = facts_of(_image(target)).frames
    subject, shown = str(target), f"Shows the frames {first} to {last} of a batch."
    if record is None or now is None:
        return Row(target, Status.BAKED, (note(subject, f"{shown} Changes since then are not known."),))
    warnings, changed = record.messages(), record.changed(now)
    if changed:
        why = warning(subject, f"{shown} Changed since this frame was baked: {', '.join(changed)}.")
        return Row(target, Status.STALE, (why, *warnings))
    return Row(target, Status.WARNED if warnings else Status.BAKED, (note(subject, shown), *warnings))


def _has_lost_its_file(image) -> bool:
    path = file_of(image)
    return path is not None and not path.is_file()


def _why_later(image) -> list[Message]:
    if not is_undone(image):
        return []
    text = f"Undo does not restore files: '{file_of(image).name}' still holds the later bake."
    return [warning(image.name, text, "To get the earlier one, undo the changes between them as well and bake again.")]


def _why_again(baked: str, wanted: str) -> str:
    if baked == FIRST_LOOK:
        return "Quick preview by direct light alone: its final bake has not ended."
    return f"Baked in {baked} quality, and not in {wanted}."


def look_soon() -> None:
    """Have the rows refreshed once nothing changes any more."""
    _last["change"] = time.monotonic()
    if not bpy.app.background and not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=REST_SECONDS)


def _look() -> float | None:
    began = time.monotonic()
    waiting = max(_last["change"] + REST_SECONDS, _last["next"]) - began
    if waiting > 0:
        return waiting
    context = bpy.context
    if context.window is not None or context.window_manager.windows:
        window = context.window or context.window_manager.windows[0]
        _last["is looking"] = True
        try:
            with context.temp_override(window=window):
                refresh(bpy.context)
        finally:
            ended = time.monotonic()
            before, _last["took"] = _last["took"], ended - began
            _last["is looking"], _last["next"] = False, ended + min(before, _last["took"]) / MOST_OF_THE_TIME
        redraw(bpy.context)
    return None


@persistent
def _on_update(_scene, depsgraph) -> None:
    changed = [
        update.id.original.as_pointer()
        for update in depsgraph.updates
        if update.is_updated_geometry or not isinstance(update.id, bpy.types.Object)
    ]
    fingerprints.forget(changed)
    if any(update.is_updated_geometry and isinstance(update.id, bpy.types.Object) for update in depsgraph.updates):
        fingerprints.forget_scatter()
    if not _last["is looking"]:
        look_soon()  # also where there is no update: Blender 3.4 names none for strokes on images


@persistent
def _before_saving(*_arguments) -> None:
    _keep_waiting()


@persistent
def _before_loading(*_arguments) -> None:
    _waiting.clear()


@persistent
def _on_all(*_arguments) -> None:
    """Undo and loading bring other data-blocks, of which nothing is known."""
    fingerprints.forget()
    look_soon()


def _stop_looking() -> None:
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    fingerprints.forget()


register, unregister = all_or_nothing(
    *handlers(
        depsgraph_update_post=_on_update,
        frame_change_post=_on_update,
        undo_post=_on_all,
        redo_post=_on_all,
        save_pre=_before_saving,
        load_pre=_before_loading,
        load_post=_on_all,
    ),
    (look_soon, _stop_looking),
)
