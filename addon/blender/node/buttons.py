"""Operators of the node's buttons, and its entry in the Shader Editor: Add > Shader > Beamspread."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty

from ...core.errors import ImageError
from .. import compat, popup
from ..registration import all_or_nothing, classes
from . import output, plain, principled
from .find import find_node
from .node import BeamspreadNode


def active_material(context):
    """Material that the editor or the properties show, else the active object's."""
    material = getattr(context, "material", None)
    if material is None and context.space_data is not None and context.space_data.type == "NODE_EDITOR":
        owner = context.space_data.id
        material = owner if isinstance(owner, bpy.types.Material) else None
    return material or getattr(context.object, "active_material", None)


class NodeOperator:
    """Operator on the Beamspread node of the active material."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        material = active_material(context)
        if find_node(material) is None:
            cls.poll_message_set("The active material has no Beamspread node")
            return False
        if material.library is not None:
            cls.poll_message_set("The material is linked from another file")
            return False
        return True

    def execute(self, context):
        return self.change(find_node(active_material(context)))


class BEAMSPREAD_OT_toggle_result(NodeOperator, bpy.types.Operator):
    """Switch the material between the baked result and the shader that it had before. Both stay in the tree"""

    bl_idname = "beamspread.toggle_result"
    bl_label = "Switch Baked Result and Former Shader"

    def change(self, node):
        shown = output.toggle(node)
        if not shown:
            self.report(
                {"ERROR"}, f"The shader '{node.former_node}' is gone: link another one to the material's output"
            )
            return {"CANCELLED"}
        self.report({"INFO"}, f"The material shows '{shown}'")
        return {"FINISHED"}


class BEAMSPREAD_OT_make_plain(NodeOperator, bpy.types.Operator):
    """Replace the node by standard Blender nodes, for glTF or machines without this add-on, or put the node back"""

    bl_idname = "beamspread.make_plain"
    bl_label = "Make Plain Nodes"

    kind: EnumProperty(
        name="Kind", description="Choose the nodes that show the bake", items=plain.KINDS, default=plain.COAT
    )

    def change(self, node):
        if output.has_plain(node):
            output.remove_plain(node)
            self.report({"INFO"}, "The Beamspread node shows the bake again")
            return {"FINISHED"}
        if self.kind == plain.GROUP:
            output.make_plain(node)
            return {"FINISHED"}
        try:
            exposure = plain.make(node, self.kind)
        except ImageError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if plain.leaves_out_back(node):
            self.report({"WARNING"}, "Both faces show the image of the front. Choose Group to show each its own")
        if plain.is_map_of_modifier(node):
            text = f"glTF files lack the UV map '{plain.map_of(node)}', which a modifier makes: apply the modifier"
            self.report({"WARNING"}, text)
        self.report({"INFO"}, exposure_line(exposure, self.kind))
        return {"FINISHED"}


def exposure_line(exposure: float, kind: str) -> str:
    """Sentence that tells what the image of plain nodes holds."""
    held = "The image of the plain nodes has 8 bits, as glTF needs"
    if exposure == 1:
        return held
    factor = 1 / exposure
    if kind == plain.UNLIT:
        return f"{held}, and holds the bake divided by {factor:g}: multiply by {factor:g} in the engine"
    return f"{held}, and holds the bake divided by {factor:g}; the strength of the emission is {factor:g}"


class BEAMSPREAD_OT_from_principled(NodeOperator, bpy.types.Operator):
    """Copy color, roughness, normal map, IOR and subsurface radius from the Principled BSDF or Subsurface Scattering"""

    bl_idname = "beamspread.from_principled"
    bl_label = "From Principled"

    _in_window = False

    def invoke(self, context, _event):
        self._in_window = not bpy.app.background
        return self.execute(context)

    def change(self, node):
        source = principled.find_shader(node)
        if source is None:
            text = (
                "The material has no Principled BSDF and no Subsurface Scattering. Add one, or set the values by hand"
            )
            self.report({"ERROR"}, text)
            return {"CANCELLED"}
        warnings = principled.take_over(node, source)
        for sentence in warnings:
            self.report({"WARNING"}, sentence)
        if warnings and self._in_window:
            popup.show_soon(f"Values copied from '{source.name}'", warnings)
        else:
            self.report({"INFO"}, f"Values copied from '{source.name}'")
        return {"FINISHED"}


def _draw_menu(self, context) -> None:
    if getattr(context.space_data, "tree_type", "") == "ShaderNodeTree":
        self.layout.separator()
        operator = self.layout.operator("node.add_node", text=BeamspreadNode.bl_label)
        operator.type = BeamspreadNode.bl_idname
        operator.use_transform = True


register, unregister = all_or_nothing(
    *classes(BEAMSPREAD_OT_toggle_result, BEAMSPREAD_OT_make_plain, BEAMSPREAD_OT_from_principled),
    (lambda: compat.shader_menu().append(_draw_menu), lambda: compat.shader_menu().remove(_draw_menu)),
)
