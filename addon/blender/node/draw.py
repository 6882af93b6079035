"""Layout of the node's properties and buttons, in the node editor and in panels."""

from __future__ import annotations

import bpy

from .output import former_output, is_in_group, is_shown, plain_of

# Units of length: shortest length shown in it, its length in meters, its name; the largest unit first.
UNITS = ((1.0, 1.0, "m"), (1e-2, 1e-2, "cm"), (1e-4, 1e-3, "mm"), (0.0, 1e-6, "µm"))


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
    row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL")
    draw_properties(node, layout)


def draw_properties(node, layout) -> None:
    """Draw the node's properties and buttons."""
    layout.prop(node, "preset")
    _draw_color(node, layout)
    _draw_channels(layout, node, "mean_free_path", "Mean Free Path")
    meters = bpy.context.scene.unit_settings.scale_length
    lengths = readable_lengths([length * meters for length in node.mean_free_path])
    layout.label(text=f"Mean free path: {lengths}", icon="DRIVER_DISTANCE")
    layout.prop(node, "anisotropy")
    layout.prop(node, "ior")
    layout.prop(node, "thickness")
    layout.prop(node, "edges")
    layout.template_ID(node, "image", new="image.new", open="image.open")
    _draw_map(node, layout)
    _draw_actions(node, layout)


def _draw_color(node, layout) -> None:
    if node.has_texture():
        layout.label(text="Color: from texture", icon="TEXTURE")
        layout.prop(node, "texture_blur")
        return
    layout.prop(node, "color_mode")
    if node.color_mode == "BASE_COLOR":
        layout.prop(node, "base_color")
    else:
        _draw_channels(layout, node, "albedo", "Scattering Albedo")


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
    elif node.image is not None and not is_in_group(node):
        column.operator("beamspread.toggle_result", text="Show Baked Result", icon="IMAGE_DATA")
    if node.image is not None:
        text = "Make Plain Nodes" if plain_of(node) is None else "Remove Plain Nodes"
        column.operator("beamspread.make_plain", text=text, icon="NODETREE")


def _draw_channels(layout, node, name: str, label: str) -> None:
    column = layout.column(align=True)
    for index, channel in enumerate("RGB"):
        column.prop(node, name, index=index, text=channel if index else f"{label} {channel}")
