"""Layout of the node's properties and buttons, in the node editor and in panels."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...core.bake.estimate import simulation_seconds
from ...core.bake.pace import Estimate
from ...core.bake.steps import to_simulate
from ...core.errors import BakeError
from ...core.ldf.library import SIMULATING
from ...core.scene.texture import MULTIPLIED
from ...core.target import BACK, FRONT
from ...core.time_left import duration
from .output import former_output, has_plain, is_in_group, is_shown
from .path import meters_per_unit
from .tree import all_nodes

# Units of length: shortest length shown in it, its length in meters, its name; the largest unit first.
UNITS = ((1.0, 1.0, "m"), (1e-2, 1e-2, "cm"), (1e-4, 1e-3, "mm"), (0.0, 1e-6, "µm"))

MIN_SIMULATION = 1.0
"""Shortest simulation that is announced, seconds."""

bent_materials: set[str] = set()
"""Names of the materials of surfaces that bend, whose media are simulated for curves as well; scans keep it."""


def readable_lengths(meters) -> str:
    """Lengths in one unit, which suits the longest of them, with three digits: "0.41, 0.36, 0.3 mm"."""
    longest = max(map(abs, meters))
    scale, unit = next((scale, unit) for shortest, scale, unit in UNITS if longest >= shortest)
    values = [f"{length / scale:.3g}" for length in meters]
    return f"{values[0] if len(set(values)) == 1 else ', '.join(values)} {unit}"


def draw_node(node, layout) -> None:
    """Draw the node in the node editor: the Bake button, then its properties."""
    if not hasattr(bpy.types, "BEAMSPREAD_OT_bake"):
        # Before Blender 4.5 the node's class stays registered while nodes use it.
        layout.label(text="The add-on Beamspread is disabled.", icon="ERROR")
        return
    row = layout.row()
    row.scale_y = 1.2
    # Without a node among the selected objects, the operator bakes all.
    row.operator("beamspread.bake", text="Bake" if _is_selected(node) else "Bake All", icon="RENDER_STILL")
    draw_properties(node, layout)


def _is_selected(node) -> bool:
    """True if a selected object has the node's material, or one with another Beamspread node."""
    materials = (slot.material for obj in bpy.context.view_layer.objects.selected for slot in obj.material_slots)
    trees = {material.node_tree for material in materials if material is not None}
    return node.id_data in trees or any(other.id_data in trees for other in all_nodes())


def draw_properties(node, layout) -> None:
    """Draw the node's properties and buttons."""
    _draw_preset(node, layout)
    _draw_color(node, layout)
    _draw_path(node, layout)
    layout.prop(node, "anisotropy")
    layout.prop(node, "ior")
    layout.prop(node, "is_infinite")
    if not node.is_infinite:
        layout.prop(node, "thickness")
        layout.prop(node, "side")
    if line := new_medium_line(node):
        layout.label(text=line, icon="TIME")
    layout.prop(node, "edges")
    sides = node.sides()
    for side, name in ((FRONT, "image"), (BACK, "image_back")):
        if side in sides:
            # An empty text would still take half of the row.
            label = {"text": side.title()} if len(sides) > 1 else {}
            layout.template_ID(node, name, new="image.new", open="image.open", **label)
    _draw_map(node, layout)
    _draw_actions(node, layout)


def _draw_preset(node, layout) -> None:
    """Draw the preset: in panels over the whole width, since half of it would cut long names."""
    if not layout.use_property_split:
        layout.prop(node, "preset")
        return
    row = layout.row()
    row.use_property_split = False
    row.prop(node, "preset", text="", icon="PRESET")


def _draw_color(node, layout) -> None:
    if node.has_texture():
        layout.label(text="Color: from texture", icon="TEXTURE")
        layout.prop(node, "texture_method")
        if node.texture_method == MULTIPLIED:
            layout.prop(node, "texture_blur")
        else:
            layout.prop(node, "color_mode", text="Texture of")
        return
    layout.prop(node, "color_mode")
    if node.color_mode == "BASE_COLOR":
        layout.prop(node, "base_color")
    else:
        _draw_channels(layout, node, "albedo", "Albedo")


def _draw_path(node, layout) -> None:
    """Draw the path as one length, by hand or by a slider, with a color; below it the lengths of the channels."""
    column = layout.column(align=True)
    # Their names do not fit into a field of the default width.
    column.prop(node, "path_length", text="Path")
    column.prop(node, "path_slider", text="Slider", slider=True)
    layout.prop(node, "path_color")
    lengths = readable_lengths([length * meters_per_unit() for length in node.mean_free_path])
    # Three lengths beside their name would not fit into a side bar of the default width.
    lines = ["Mean free path:", lengths] if "," in lengths else [f"Mean free path: {lengths}"]
    column = layout.column(align=True)
    for number, line in enumerate(lines):
        column.label(text=line, icon="BLANK1" if number else "DRIVER_DISTANCE")


def new_medium_line(node) -> str:
    """A line about the simulation of the node's medium that the next bake needs; "" without one."""
    seconds = seconds_to_simulate(node)
    return f"New medium: simulated in {duration(seconds)}" if seconds > MIN_SIMULATION else ""


def seconds_to_simulate(node) -> float:
    """Seconds in which the next bake simulates the node's medium; 0 if it is known, or if it can't be one."""
    surface, settings = node.surface(), bpy.context.scene.beamspread.for_bake()
    if node.has_texture():  # the medium needs its color, which is not known yet
        surface = replace(surface, base_color=(0.5, 0.5, 0.5))
    bent = filter(None, map(bpy.data.materials.get, bent_materials))
    is_bent = any(material.node_tree == node.id_data for material in bent)
    try:
        surface.check()
        media = to_simulate(surface, settings, is_bent)
        seconds = simulation_seconds(media, settings, is_bent)
    except (BakeError, ImportError):  # the bake says why; the module may be missing
        return 0.0
    return Estimate(SIMULATING[settings.quality], "", seconds).corrected()


def _draw_map(node, layout) -> None:
    """Draw the choice among the UV maps of the active object; those that modifiers make are typed."""
    mesh = getattr(bpy.context.view_layer.objects.active, "data", None)
    if hasattr(mesh, "uv_layers"):
        layout.prop_search(node, "uv_map", mesh, "uv_layers", icon="GROUP_UVS", results_are_suggestions=True)
    else:
        layout.prop(node, "uv_map", icon="GROUP_UVS")


def _draw_actions(node, layout) -> None:
    column = layout.column(align=True)
    column.operator("beamspread.from_principled", text="From Principled", icon="IMPORT")
    if is_shown(node):
        if former_output(node) is not None:
            column.operator("beamspread.toggle_result", text="Show Former Shader", icon="LOOP_BACK")
    elif any(node.shown_images()) and not is_in_group(node):
        column.operator("beamspread.toggle_result", text="Show Baked Result", icon="IMAGE_DATA")
    if any(node.shown_images()):
        if has_plain(node):
            column.operator("beamspread.make_plain", text="Remove Plain Nodes", icon="NODETREE")
        else:
            column.operator_menu_enum("beamspread.make_plain", "kind", text="Make Plain Nodes", icon="NODETREE")


def _draw_channels(layout, node, name: str, label: str) -> None:
    column = layout.column(align=True)
    for index, channel in enumerate("RGB"):
        column.prop(node, name, index=index, text=channel if index else f"{label} {channel}")
