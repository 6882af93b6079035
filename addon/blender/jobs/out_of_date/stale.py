"""Keeps the rows of `state` up to date: compares bakes with the scene once changes to it have come to rest.

The scene's cache notes changes; a timer of the window scans the scene. In background no timer runs: call `refresh`.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

import bpy
from bpy.app.handlers import persistent

from ....core.bake.pace import pace
from ....core.bake.runner import Bake
from ....core.messages import Level, Message, note, warning
from ....core.target import Target
from ...images.facts import (
    Frames,
    Record,
    facts_of,
    file_at,
    follow_name,
    is_sequence,
    note_bake,
    record_in,
    record_of,
    record_of_bake,
    remember,
)
from ...images.files import file_of
from ...images.udim import is_tiled, missing_files
from ...images.undo import is_undone
from ...node.find import find_bakeable, find_misplaced, image_of, rendered_counts
from ...node.node import upgrade_appended_nodes
from ...read.scene_cache import listeners
from ...read.visibility import by_name, render_visible_names
from ...registration import all_or_nothing, handlers
from ..announced import MAX_TARGETS, announce
from ..frozen import frozen
from ..problems import problems_of
from ..state import Row, Status, redraw, state
from .fingerprint import IMAGE, OTHERS, QUALITY, Parts, changed_objects, fingerprints, image_part

REST_SECONDS = 0.3
"""Seconds without changes before a scan."""

MAX_SHARE = 0.1
"""Largest share of the time that scans may take; more makes the window less responsive.

The first scan of a file or after undo does not count: it reads all meshes, and later ones do not.
"""

QUICK_PREVIEW = "first look"  # as files of earlier versions have it

UNKNOWN = (
    "Changes since its bake are not known: an earlier version of the add-on made it.",
    "Bake it again: later changes will be named here.",
)

_waiting: list[tuple[Bake, Parts | None]] = []
_last = {"change": 0.0, "took": 0.0, "next": 0.0, "is scanning": False}


def refresh(context) -> None:
    """Bring the rows of all targets of the context's scene up to date."""
    _keep_waiting()
    context.view_layer.update()  # in 3.4 it has None in place of removed objects
    images = {target: image_of(target) for target in find_bakeable(context.view_layer, context.scene.objects)}
    records = {target: _record(target, image, context.scene) for target, image in images.items()}
    recorded = [target for target, record in records.items() if record is not None]
    remember(recorded)
    for target in recorded:
        pace.recall(target.object_name, records[target].ratios)
    now = fingerprints(context, recorded) if recorded else {}
    state.announced = announce(context, list(images))
    state.frozen = frozen(context.scene, list(images))
    rows = {target: _row(target, image, records[target], now.get(target)) for target, image in images.items()}
    problems = _problems(context, list(images))
    rows = {target: _with_problems(row, problems.get(target, ())) for target, row in rows.items()}
    rows |= {row.target: row for row in _failures_of_others(context.scene, list(images))}
    state.rows = _refused(context) | rows


def _problems(context, targets: list[Target]) -> dict[Target, list[Message]]:
    """Errors that bakes of the targets would end with."""
    if len(targets) > MAX_TARGETS:
        return {}
    objects, counts, problems = by_name(context.scene), rendered_counts(context.view_layer), {}
    named = {str(target): target for target in targets}
    for name in dict.fromkeys(target.object_name for target in targets):
        for message in problems_of(objects[name], counts) if name in objects else ():
            if message.subject in named:
                problems.setdefault(named[message.subject], []).append(message)
    return problems


def _with_problems(row: Row, problems: Iterable[Message]) -> Row:
    """The row of a target that the next bake refuses, with the reason. A bake that is up to date stays one."""
    if not problems or row.status not in (Status.NEVER, Status.STALE):
        return row
    status = Status.REFUSED if row.status == Status.NEVER else row.status
    return replace(row, status=status, messages=(*row.messages, *problems))


def _refused(context) -> dict[Target, Row]:
    """Rows of nodes that no bake can use, as that of a text."""
    visible = render_visible_names(context.view_layer)
    shown = (obj for obj in context.scene.objects if obj.name in visible)
    misplaced = find_misplaced(shown, with_images=True)
    return {bake.target: Row(bake.target, Status.REFUSED, tuple(bake.messages)) for bake in misplaced}


def _failures_of_others(scene, targets: list[Target]) -> list[Row]:
    """Rows of failures that have no target, as of a node inside a group.

    Failures of objects that are gone, or that have another material by now, are left out.
    """
    rows = [row for row in state.failures() if row.target not in targets]
    named, objects = {target.object_name for target in targets}, by_name(scene) if rows else {}
    rows = [row for row in rows if row.target.object_name in objects]
    again = find_misplaced(objects[name] for name in named & {row.target.object_name for row in rows})
    misplaced = {bake.target for bake in again}
    return [row for row in rows if row.target.object_name not in named or row.target in misplaced]


def parts_of(context, targets: list[Target]) -> dict[Target, Parts]:
    """Digests of the parts of the scene that bakes of the targets read now, for `keep`."""
    return fingerprints(context, targets, is_for_bake=True)


def keep(bake: Bake, parts: Parts | None, is_preview: bool = False) -> None:
    """Record in the node's image the digests and messages of the bake in it."""
    image = image_of(bake.target)
    if image is None or parts is None:
        return
    parts = parts | {IMAGE: image_part(image)}  # the bake may have made it
    if is_preview:
        parts[QUALITY] = QUICK_PREVIEW
    note_bake(image, bake.target, record_of_bake(bake, parts, image.is_dirty))


def keep_later(bake: Bake, parts: Parts | None) -> None:
    """Call `keep` later, once Blender has put the bake's pixels into the image; any thread may call this."""
    _waiting.append((bake, parts))


def _keep_waiting() -> None:
    while _waiting:
        keep(*_waiting.pop(0))


def _record(target: Target, image, scene) -> Record | None:
    if is_sequence(image):
        path = file_at(image, scene.frame_current)
        return path and record_in(path)
    record = None if image is None else record_of(image, target)
    if record is not None:
        follow_name(image, target)
    return record


def _row(target: Target, image, record: Record | None, now: Parts | None) -> Row:
    if is_sequence(image):
        return _row_of_frames(target, facts_of(image).frames, record, now)
    changed = [] if record is None or now is None else _changed(record, now)
    if record is not None and not record.is_dirty and image.is_dirty:
        changed.append("pixels of the image")
    if record is not None and _has_lost_its_file(image):
        changed = [*(name for name in changed if name != IMAGE), "image file (missing)"]
    last = state.status_of(target)
    if last is not None and last.status in (Status.FAILED, Status.CANCELLED):
        return replace(last, is_stale=bool(changed))
    if record is None:
        return Row(target, Status.NEVER, tuple(_shown_of_others(target, image)))
    subject, unknown = str(target), () if record.is_comparable() else (note(str(target), *UNKNOWN),)
    earlier = (*_why_later(image), *record.messages(), *unknown)
    if changed and changed != [QUALITY]:
        why = warning(subject, f"Changed since its bake: {_named(changed, record, now)}.")
        return Row(target, Status.STALE, (why, *earlier), True)
    again = [warning(subject, _why_again(record.parts[QUALITY], now[QUALITY]))] if changed else []
    status = Status.WARNED if any(message.level == Level.WARNING for message in (*again, *earlier)) else Status.BAKED
    return Row(target, status, (*again, *earlier), bool(changed))


def _changed(record: Record, now: Parts) -> list[str]:
    """Parts that have changed since a bake; of a record that has other digests, the quality alone is known."""
    return record.changed(now if record.is_comparable() else {QUALITY: now[QUALITY]})


def _named(changed: list[str], record: Record, now: Parts) -> str:
    """The changed parts in words."""
    return ", ".join(changed_objects(record.parts[OTHERS], now) if name == OTHERS else name for name in changed)


def _row_of_frames(target: Target, frames: Frames, record: Record | None, now: Parts | None) -> Row:
    """The row of an image sequence, by the frame that is shown. A bake does not renew it, so it is not up for one."""
    subject, shown = str(target), f"Shows the frames {frames.first} to {frames.last}."
    if record is None or now is None or not record.is_comparable():
        return Row(target, Status.BAKED, (note(subject, f"{shown} Changes since then are not known."),))
    warnings, changed = record.messages(), record.changed(now)
    if changed:
        why = warning(subject, f"{shown} Changed since this frame was baked: {_named(changed, record, now)}.")
        return Row(target, Status.STALE, (why, *warnings))
    return Row(target, Status.WARNED if warnings else Status.BAKED, (note(subject, shown), *warnings))


def _shown_of_others(target: Target, image) -> list[Message]:
    """The note about an object that was never baked, whose material shows an image with bakes of others."""
    if image is None or all(other.object_name == target.object_name for other in facts_of(image).bakes):
        return []
    # Without a subject, so that a panel shows it once for all such objects.
    return [note("", f"The image '{image.name}' has no bake of this object, which shows what lies at its UVs.")]


def _has_lost_its_file(image) -> bool:
    if is_tiled(image):
        return bool(missing_files(image))
    path = file_of(image)
    return path is not None and not path.is_file()


def _why_later(image) -> list[Message]:
    if not is_undone(image):
        return []
    text = f"Undo does not restore files: '{file_of(image).name}' still holds the later bake."
    return [warning(image.name, text, "To get the earlier one, undo the changes between them as well and bake again.")]


def _why_again(baked: str, wanted: str) -> str:
    if baked == QUICK_PREVIEW:
        return "Quick preview by direct light alone: its final bake has not ended."
    return f"Baked in {baked} quality, and not in {wanted}."


def scan_soon() -> None:
    """Refresh the rows once nothing changes any more."""
    _last["change"] = time.monotonic()
    if not bpy.app.background and not bpy.app.timers.is_registered(_scan):
        bpy.app.timers.register(_scan, first_interval=REST_SECONDS)


def _scan() -> float | None:
    began = time.monotonic()
    waiting = max(_last["change"] + REST_SECONDS, _last["next"]) - began
    if waiting > 0:
        return waiting
    context = bpy.context
    if context.window is not None or context.window_manager.windows:
        window = context.window or context.window_manager.windows[0]
        _last["is scanning"] = True
        try:
            with context.temp_override(window=window):
                upgrade_appended_nodes()
                refresh(bpy.context)
        finally:
            ended = time.monotonic()
            before, _last["took"] = _last["took"], ended - began
            _last["is scanning"], _last["next"] = False, ended + min(before, _last["took"]) / MAX_SHARE
        redraw(bpy.context)
    return None


def _on_change(_depsgraph) -> None:
    if not _last["is scanning"]:
        scan_soon()  # even without updates: Blender 3.4 reports none for strokes on images


@persistent
def _before_saving(*_arguments) -> None:
    _keep_waiting()


@persistent
def _before_loading(*_arguments) -> None:
    _waiting.clear()


def _stop_scanning() -> None:
    if bpy.app.timers.is_registered(_scan):
        bpy.app.timers.unregister(_scan)


register, unregister = all_or_nothing(
    *handlers(
        save_pre=_before_saving,
        load_pre=_before_loading,
    ),
    (lambda: listeners.append(_on_change), lambda: listeners.remove(_on_change)),
    (scan_soon, _stop_scanning),
)
