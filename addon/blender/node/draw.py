"""How the node looks: its properties in the node editor and in panels, and its buttons."""

from __future__ import annotations

import bpy

from .output import former_output, is_in_group, is_shown, plain_of
from .tree import BASE_COLOR

# The largest unit first: the least length that it suits, metres of one, its name.
UNITS = ((1.0, 1.0, "m"), (1e-2, 1e-2, "cm"), (1e-4, 1e-3, "mm"), (0.0, 1e-6, "µm"))


def readable_lengths(metres) -> str:
    """Lengths in the unit that suits the longest of them, three digits each: "0.41, 0.36, 0.3 mm"."""
    longest = max(map(abs, metres))
    scale, unit = next((scale, unit) for least, scale, unit in UNITS if longest >= least)
    values = [f"{length / scale:.3g}" for length in metres]
    return f"{values[0] if len(set(values)) == 1 else ', '.join(values)} {unit}"


def draw_node(node, layout) -> None:
    """In the node editor: with the Bake button on top."""
    if not hasattr(bpy.types, "BEAMSPREAD_OT_bake"):
        # Before Blender 4.5 the node's class stays while nodes use it.
        layout.label(text="The add-on Beamspread is disabled.", icon="ERROR")
        return
    row = layout.row()
    row.scale_y = 1.2
    row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL")
    draw_properties(node, layout)


def draw_properties(node, layout) -> None:
    """The node's properties, in the node editor and in panels."""
    layout.prop(node, "preset")
    _draw_color(node, layout)
    _draw_channels(layout, node, "mean_free_path", "Path")
    metres = bpy.context.scene.unit_settings.scale_length
    # In few letters: side bars are narrow.
    layout.label(text=readable_lengths([length * metres for length in node.mean_free_path]), icon="DRIVER_DISTANCE")
    layout.prop(node, "anisotropy")
    layout.prop(node, "ior")
    layout.prop(node, "thickness")
    layout.template_ID(node, "image", new="image.new", open="image.open")
    _draw_actions(node, layout)


def _draw_color(node, layout) -> None:
    if node.has_texture():
        layout.label(text=f"Color: the texture at {BASE_COLOR}", icon="TEXTURE")
        layout.prop(node, "texture_blur")
        return
    layout.prop(node, "color_mode")
    if node.color_mode == "BASE_COLOR":
        layout.prop(node, "base_color")
    else:
        _draw_channels(layout, node, "albedo", "Albedo")


def _draw_actions(node, layout) -> None:
    column = layout.column(align=True)
    column.operator("beamspread.from_principled", text="From Principled", icon="IMPORT")
    if is_shown(node):
        if former_output(node) is not None:
            column.operator("beamspread.toggle_result", text="Show Former Shader", icon="LOOP_BACK")
    elif node.image is not None and not is_in_group(node):
        column.operator("beamspread.toggle_result", text="Show Baked Result", icon="IMAGE_DATA")
    if node.image is not None:
        text = "Make Plain Nodes" if plain_of(node) is None else "Remove Plain Nodes"
        column.operator("beamspread.make_plain", text=text, icon="NODETREE")


def _draw_channels(layout, node, name: str, label: str) -> None:
    column = layout.column(align=True)
    for index, channel in enumerate(("Red", "Green", "Blue")):
        column.prop(node, name, index=index, text=channel if index else f"{label} {channel}")
