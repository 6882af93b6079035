"""Bakes in panels: progress or buttons, errors beforehand, and the status of each target."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from ...core import native
from ...core.messages import Level, Message, Messages
from ...core.time_left import duration
from .. import compat
from ..jobs.announced import line_of, seconds_of_frames, simulation_line, spread_lines
from ..jobs.problems import problems_of
from ..jobs.run.files_run import frames_of
from ..jobs.state import Row, Status, state
from ..live import timer
from ..node.find import find_targets, has_node, rendered_counts
from ..popup import wrap
from ..read.visibility import with_instanced

# Objects whose errors and rows a panel shows, and objects of collections that it checks; more slow the drawing down.
MAX_OBJECTS, MAX_CHECKED = 8, 1000

# Selected objects whose bakes are announced; more slow the drawing down.
MAX_ANNOUNCED = 100

ICONS = {
    Status.NEVER: "RADIOBUT_OFF",
    Status.REFUSED: "CANCEL",
    Status.BAKED: "CHECKMARK",
    Status.WARNED: "ERROR",
    Status.FAILED: "CANCEL",
    Status.CANCELLED: "PANEL_CLOSE",
    Status.STALE: "FILE_REFRESH",
    Status.RUNNING: "RENDER_STILL",
}


# Pixels beside a panel's text, of the tabs of a side bar, and of an average letter, at a user-interface scale of 1.
BORDER_PIXELS, TAB_PIXELS, LETTER_PIXELS = 60, 24, 6.4


def draw_lines(layout, context, lines: Iterable[str], icon: str) -> None:
    """Draw texts after an icon each, wrapped to the panel's width."""
    pixels = context.region.width / context.preferences.system.ui_scale
    beside = BORDER_PIXELS + TAB_PIXELS * (context.region.type == "UI")
    width = max(20, int((pixels - beside) / LETTER_PIXELS))
    for text in lines:
        column = layout.column(align=True)
        for number, line in enumerate(wrap(text, width)):
            column.label(text=line, icon="BLANK1" if number else icon)


def draw_bake(layout, context, material_name: str = "") -> None:
    """Draw the progress, or errors of the selected objects and the Bake buttons; then the status of targets."""
    if native.problem:
        draw_lines(layout, context, [native.problem], "ERROR")
        return
    shown = Messages()
    if state.is_running():
        draw_progress(layout, context)
    else:
        shown = draw_problems(layout, context)
        draw_buttons(layout, context)
        draw_announced(layout, context)
        draw_lines(layout, context, map(str, state.frozen), "ERROR")
        row = layout.row()
        row.use_property_split = False  # as wide as the buttons above
        row.prop(context.scene.beamspread, "use_live", toggle=True, icon="PLAY")
        # An error that keeps an object from being baked keeps Live from following it, too.
        new = Messages(message for message in timer.messages() if message not in shown)
        draw_lines(layout, context, [message.line() for message in new], "INFO")
        shown.add(*new)
    draw_results(layout, context, material_name, shown)


def draw_problems(layout, context) -> Messages:
    """Draw and return the errors that selected objects, and the objects that these instance, would end with."""
    # `context.object` is empty in the render properties.
    view_layer = context.view_layer
    chosen, counts = list(view_layer.objects.selected)[:MAX_OBJECTS], rendered_counts(view_layer)
    inner = with_instanced(chosen)[len(chosen) :][:MAX_CHECKED]
    known = {obj.name for obj in view_layer.objects} if inner else set()
    shown, left = Messages(), MAX_OBJECTS
    for obj in [*chosen, *(obj for obj in inner if obj.name not in known)]:
        problems = problems_of(obj, counts) if left else Messages()
        texts = map(str, problems)
        lines = [text if f"'{obj.name}'" in text else f"{obj.name}: {text}" for text in texts]
        draw_lines(layout, context, dict.fromkeys(lines), "ERROR")
        shown.add(*problems)
        left -= bool(problems)
    return shown


def draw_buttons(layout, context) -> None:
    column = layout.column(align=True)
    row = column.row(align=True)
    row.scale_y = 1.4
    if has_node(list(context.view_layer.objects.selected)[:MAX_CHECKED]):
        row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL").objects = "SELECTED"
        row.operator("beamspread.bake", text="Bake All").objects = "ALL"
    else:
        row.operator("beamspread.bake", text="Bake All", icon="RENDER_STILL").objects = "ALL"
        draw_lines(column, context, ["No selected object has a Beamspread node"], "INFO")
    stale = sum(row.is_stale for row in state.rows.values())
    if stale:
        column.operator(
            "beamspread.bake", text=f"Update {stale} Object{'s' if stale > 1 else ''}", icon="FILE_REFRESH"
        ).objects = "STALE"


def draw_announced(layout, context) -> None:
    """Draw how long bakes of the selected objects, and of all, will take."""
    everything = list(state.announced)
    chosen = find_targets(list(context.view_layer.objects.selected)[:MAX_ANNOUNCED]) or everything
    line, line_of_all = line_of(state.announced, chosen), line_of(state.announced, everything)
    if line and line_of_all and len(chosen) < len(everything):
        line = f"{line}; all {line_of_all.lower()}"
    simulation = simulation_line(state.announced, chosen) if line else ""
    draw_lines(layout, context, filter(None, [line, simulation]), "TIME")
    lines = spread_lines(state.announced, chosen)
    draw_lines(layout, context, lines, "MATERIAL")


def draw_animation(layout, context) -> None:
    """Draw Bake Animation with its frames, and how long it will take."""
    settings, (first, last) = context.scene.beamspread, frames_of(context.scene)
    column = layout.column(align=True)
    column.operator("beamspread.bake_animation", icon="RENDER_ANIMATION")
    column = layout.column(align=True)
    column.prop(settings, "use_frame_range")
    if settings.use_frame_range:
        column.prop(settings, "frame_first")
        column.prop(settings, "frame_last")
    count = last - first + 1
    chosen = find_targets(list(context.view_layer.objects.selected)[:MAX_ANNOUNCED]) or list(state.announced)
    seconds = seconds_of_frames(state.announced, chosen, count) if count > 0 else None
    text = f"Frames {first} to {last}"
    draw_lines(layout, context, [text if seconds is None else f"{text}: about {duration(seconds)}"], "TIME")


def draw_progress(layout, context) -> None:
    """Draw the stage, its progress, and Cancel."""
    column = layout.column(align=True)
    draw_lines(column, context, [state.run.title()], "RENDER_STILL")
    compat.draw_progress_bar(column, state.run.progress.time_fraction(), state.run.in_short())
    column.operator("beamspread.cancel", icon="X")


def draw_results(layout, context, material_name: str, shown: Messages) -> None:
    """Draw the status of each target of one material, or of all, with the messages that are not `shown` yet."""
    rows = [row for row in state.rows.values() if material_name in ("", row.target.material_name)]
    if not rows:
        return
    # Rows that need attention come first.
    rows.sort(key=lambda row: row.status in (Status.NEVER, Status.BAKED))
    box = layout.box().column(align=True)
    times = Counter(target.object_name for target in state.rows)
    for row in rows[:MAX_OBJECTS]:
        status = _status(row)
        name = row.target.object_name if times[row.target.object_name] == 1 else str(row.target)
        draw_lines(box, context, [f"{name}: {status.value}"], ICONS[status])
        draw_lines(box, context, [str(item) for item in row.messages if not _is_among(item, shown)], "DOT")
        shown.add(*row.messages)
    if len(rows) > MAX_OBJECTS:
        box.label(text=f"And {len(rows) - MAX_OBJECTS} more", icon="BLANK1")


def _is_among(message: Message, shown: Messages) -> bool:
    """True if a message is shown, or one of the same words: a bake keeps no subject of what it said."""
    words = {str(item) for item in shown.of(Level.WARNING, Level.INFO)}
    return message in shown or (not message.subject and str(message) in words)


def _status(row: Row) -> Status:
    running = state.run is not None and state.run.target == row.target
    return Status.RUNNING if running else row.status
