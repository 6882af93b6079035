"""What the node's buttons do."""

from __future__ import annotations

import bpy

from .. import popup
from ..registration import all_or_nothing, classes
from . import output, principled
from .find import find_node


def active_material(context):
    """The material that the editor or the properties show, or the active object's."""
    material = getattr(context, "material", None)
    if material is None and context.space_data is not None and context.space_data.type == "NODE_EDITOR":
        shown = context.space_data.id
        material = shown if isinstance(shown, bpy.types.Material) else None
    return material or getattr(context.object, "active_material", None)


class NodeOperator:
    """Acts on the Beamspread node of the material that is shown."""

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
    """Swap what the material shows: the baked result, or the shader that was there before. Both stay in the tree"""

    bl_idname = "beamspread.toggle_result"
    bl_label = "Swap Baked Result and Former Shader"

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
    """Show the bake by a group of ordinary nodes (image, emission, coat), which renders where this add-on is not \
installed, as on farms. The node stays, and bakes fill the same image. Again: take the group away"""

    bl_idname = "beamspread.make_plain"
    bl_label = "Make Plain Nodes"

    def change(self, node):
        if output.plain_of(node) is None:
            output.make_plain(node)
        else:
            output.remove_plain(node)
        return {"FINISHED"}


class BEAMSPREAD_OT_from_principled(NodeOperator, bpy.types.Operator):
    """Take over base color, roughness, normal map and IOR of the material's Principled BSDF, and its subsurface \
radius as a mean free path, as Cycles' random walk has it: radius times scale, over 4 pi; for the method that depends \
on the color (Skin, in 3.x Random Walk), times sqrt(3 (1 - reduced albedo)). Lengths stay in scene units"""

    bl_idname = "beamspread.from_principled"
    bl_label = "From Principled"

    _in_window = False

    def invoke(self, context, _event):
        self._in_window = not bpy.app.background
        return self.execute(context)

    def change(self, node):
        source = principled.find_principled(node)
        if source is None:
            self.report({"ERROR"}, "The material has no Principled BSDF: add one, or set the values by hand")
            return {"CANCELLED"}
        lost = principled.take_over(node, source)
        for sentence in lost:
            self.report({"WARNING"}, sentence)
        if lost and self._in_window:
            popup.show_soon(f"Values taken from '{source.name}'", lost)
        else:
            self.report({"INFO"}, f"Values taken from '{source.name}'")
        return {"FINISHED"}


register, unregister = all_or_nothing(
    *classes(BEAMSPREAD_OT_toggle_result, BEAMSPREAD_OT_make_plain, BEAMSPREAD_OT_from_principled)
)
