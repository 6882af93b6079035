"""What panels show of bakes: progress or buttons, how each target stands, what is in the way, how long it will take."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace

import bpy

from ...core import native
from ...core.bake.estimate import in_words, ray_seconds, solver_seconds
from ...core.bake.luminance import MAX_RAYS, rays_per_texel
from ...core.errors import BakeError, message_of
from ...core.messages import Messages
from ...core.scene.uv_map import check_uvs
from ...core.target import Target
from .. import compat
from ..cycles.colors import bytes_of_colors, seconds_of_colors
from ..cycles.cycles_light import seconds_estimate
from ..images.files import check_image
from ..images.results import check_editable
from ..jobs.run.linked_color import needs_cycles
from ..jobs.state import Row, Status, state
from ..live import timer
from ..node.find import find_misplaced, find_node, find_targets, materials_of, rendered_counts, was_baked_elsewhere
from ..popup import wrap
from ..read.visibility import ObjectInstance, by_name, check_instance, with_instanced

# Objects whose warnings, and rows, that a panel shows; and of collections that are looked at (7 ms): it is drawn often.
MOST_OBJECTS, MOST_LOOKED_AT = 8, 1000

ICONS = {
    Status.NEVER: "RADIOBUT_OFF",
    Status.BAKED: "CHECKMARK",
    Status.WARNED: "ERROR",
    Status.FAILED: "CANCEL",
    Status.CANCELLED: "PANEL_CLOSE",
    Status.STALE: "FILE_REFRESH",
    Status.RUNNING: "RENDER_STILL",
}

# A direct solver of fewer seconds needs no warning.
LONG_SECONDS = 10.0


def problems_of(obj, places: dict[str, int]) -> Messages:
    """Errors that a bake of the object would end with, as far as they are known without baking.

    `places` is the result of `rendered_counts`. An error of the object as a whole comes once for each of its targets.
    """
    misplaced = find_misplaced([obj] if obj.instance_type == "NONE" else [])
    messages = Messages(message for bake in misplaced for message in bake.messages)
    materials, view_layer = materials_of(obj), bpy.context.view_layer
    if materials and obj.name not in view_layer.objects:  # an instance alone
        materials = [one for one in materials if not was_baked_elsewhere(one)]
    if not materials:
        return messages
    times = places.get(obj.name, 0)
    for material in materials:
        node = find_node(material)
        checks = [
            lambda: obj.data.uv_layers or check_uvs(None),
            lambda: check_instance(obj.name, ObjectInstance(obj, None, times) if times else None, view_layer),
            lambda node=node: node.surface().check(),
        ]
        if bpy.context.scene.beamspread.output == "LUMINANCE":
            checks.append(lambda material=material: check_editable(material))
        if node.image is not None:
            checks.append(lambda node=node: check_image(node.image))
        for check in checks:
            try:
                check()
            except BakeError as error:
                messages.add(message_of(error, str(Target(obj.name, material.name))))
    return messages


# Of a panel beside its text, and of a letter on average, at a user-interface scale of 1.
BORDER_PIXELS, LETTER_PIXELS = 60, 6.4


def draw_lines(layout, context, lines: Iterable[str], icon: str) -> None:
    """Draw texts after an icon each, wrapped to the panel's width."""
    pixels = context.region.width / context.preferences.system.ui_scale
    width = max(20, int((pixels - BORDER_PIXELS) / LETTER_PIXELS))
    for text in lines:
        column = layout.column(align=True)
        for number, line in enumerate(wrap(text, width)):
            column.label(text=line, icon="BLANK1" if number else icon)


def draw_bake(layout, context, material_name: str = "") -> None:
    """The progress, or problems of the selected objects and the Bake buttons; then how targets stand."""
    if native.problem:
        draw_lines(layout, context, [native.problem], "ERROR")
        return
    shown = Messages()
    if state.is_running():
        draw_progress(layout, context)
    else:
        shown = draw_problems(layout, context)
        draw_buttons(layout)
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
    chosen, places = list(view_layer.objects.selected)[:MOST_OBJECTS], rendered_counts(view_layer)
    inner = with_instanced(chosen)[len(chosen) :][:MOST_LOOKED_AT]
    own = {obj.name for obj in view_layer.objects} if inner else set()
    shown, left = Messages(), MOST_OBJECTS
    for obj in [*chosen, *(one for one in inner if one.name not in own)]:
        problems = problems_of(obj, places) if left else Messages()
        draw_lines(layout, context, dict.fromkeys(f"{obj.name}: {message}" for message in problems), "ERROR")
        shown.add(*problems)
        left -= bool(problems)
    return shown


def draw_buttons(layout) -> None:
    column = layout.column(align=True)
    row = column.row(align=True)
    row.scale_y = 1.4
    row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL").objects = "SELECTED"
    row.operator("beamspread.bake", text="Bake All").objects = "ALL"
    stale = sum(row.is_stale for row in state.rows.values())
    if stale:
        column.operator("beamspread.bake", text=f"Bake {stale} Out of Date", icon="FILE_REFRESH").objects = "STALE"


def draw_progress(layout, context) -> None:
    """What is being done, a bar where Blender has one, the time left, and Cancel."""
    progress = state.progress
    column = layout.column(align=True)
    draw_lines(column, context, [f"{progress.doing or 'Baking'}: {progress.target}"], "RENDER_STILL")
    compat.draw_progress_bar(column, progress.everything, progress.in_short())
    column.operator("beamspread.cancel", icon="X")


def draw_results(layout, context, material_name: str, shown: Messages) -> None:
    """Draw the status of each target of one material, or of all, with the messages that are not `shown` yet."""
    rows = [row for row in state.rows.values() if material_name in ("", row.target.material_name)]
    if not rows:
        return
    # Rows that need attention come first.
    rows.sort(key=lambda row: row.status in (Status.NEVER, Status.BAKED))
    box = layout.box().column(align=True)
    for row in rows[:MOST_OBJECTS]:
        status = _status(row)
        draw_lines(box, context, [f"{row.target.object_name}: {status.value}"], ICONS[status])
        draw_lines(box, context, [str(message) for message in row.messages if message not in shown], "DOT")
        shown.add(*row.messages)
    if len(rows) > MOST_OBJECTS:
        box.label(text=f"And {len(rows) - MOST_OBJECTS} more", icon="BLANK1")


def _status(row: Row) -> Status:
    running = state.progress is not None and state.progress.target == row.target
    return Status.RUNNING if running else row.status


def estimates(context) -> list[str]:
    """How long what takes long will take for the objects that Bake would bake, in sentences."""
    settings, found = context.scene.beamspread, []
    selected = context.view_layer.objects.selected
    inner = {obj.name for obj in with_instanced(selected)}
    chosen = find_targets(selected) or [one for one in state.rows if one.object_name in inner] or list(state.rows)
    sizes = [_size(target, settings.resolution) for target in chosen]
    if not sizes:
        return []
    if settings.use_indirect:
        seconds = in_words(sum(seconds_estimate(*size) for size in sizes))
        them = "them" if len(sizes) > 1 else "it"
        slower = "" if compat.has_denoiser() else " This Blender has no denoiser: it traces more rays instead."
        found.append(f"Indirect light: about {seconds}{_of_many(sizes)}, where something stands above {them}.{slower}")
    objects = by_name(context.scene) if settings.output == "LUMINANCE" else {}
    pairs = [(target, size) for target, size in zip(chosen, sizes) if target.object_name in objects]
    asked = [size for one, size in pairs if needs_cycles(objects[one.object_name], one.material_name)]
    if asked:
        seconds = in_words(sum(seconds_of_colors(*size) for size in asked))
        memory = max(bytes_of_colors(*size) for size in asked) / 2**30
        found.append(f"Base color, by Cycles: about {seconds}{_of_many(asked)}, {memory:.1f} GB of memory.")
    if settings.solver == "direct" and settings.output == "LUMINANCE":
        lamps = [obj.data.type for obj in context.view_layer.objects if obj.type == "LIGHT"]
        suns = lamps.count("SUN")
        seconds = sum(solver_seconds(*size, suns, len(lamps) - suns, "direct") for size in sizes)
        if seconds > LONG_SECONDS:
            sized = f", up to {MAX_RAYS} times that if lamps have a size" if len(lamps) > suns else ""
            found.append(f"Direct solver: at least {in_words(seconds)}{sized}. FFT gives the same in seconds.")
    elif settings.output == "LUMINANCE" and _has_wide_lights(context):
        seconds = sum(_seconds_of_rays(target, size, settings.for_bake()) for target, size in zip(chosen, sizes))
        if seconds > LONG_SECONDS:
            found.append(f"Light of a size, as the world's: about {in_words(seconds)}. Fewer samples are quicker.")
    return found


def _of_many(sizes: list) -> str:
    return f" for {len(sizes)} objects" if len(sizes) > 1 else ""


def _has_wide_lights(context) -> bool:
    """Whether there is light that a bake sends many rays to, as far as it is known without reading the scene."""
    lamps = [obj for obj in context.view_layer.objects if obj.type == "LIGHT"]
    return context.scene.world is not None or any(not _is_narrow(obj.data) for obj in lamps)


def _is_narrow(lamp) -> bool:
    return lamp.type != "AREA" and not (lamp.angle if lamp.type == "SUN" else lamp.shadow_soft_size)


def _seconds_of_rays(target, size: tuple[int, int], settings) -> float:
    """About; as if the object filled its UV map."""
    node, obj = find_node(bpy.data.materials.get(target.material_name)), bpy.data.objects.get(target.object_name)
    if node is None or obj is None:
        return 0.0
    pitch = max(max(obj.dimensions) / max(size), 1e-9)
    rays = rays_per_texel(SimpleNamespace(pitch_x=pitch, pitch_y=pitch), node.surface().material, settings)
    return ray_seconds(size[0] * size[1], rays, settings.threads)


def _size(target, resolution: int) -> tuple[int, int]:
    """Of the target's image; one that is still to be made counts as a square."""
    node = find_node(bpy.data.materials.get(target.material_name))
    size = tuple(node.image.size) if node is not None and node.image else (0, 0)
    return (resolution, resolution) if 0 in size else size
