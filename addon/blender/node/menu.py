"""The node's entry in the Shader Editor: Add > Shader > Beamspread."""

import bpy

from ..registration import all_or_nothing
from .node import BeamspreadNode

# Blender 3.4 makes its menus from a list of categories; later versions, by hand.
SHADER_MENUS = ("NODE_MT_category_shader_shader", "NODE_MT_category_SH_NEW_SHADER")


def _menu():
    """The menu of shaders, or all of Add where a version names it otherwise."""
    return next((getattr(bpy.types, name) for name in SHADER_MENUS if hasattr(bpy.types, name)), bpy.types.NODE_MT_add)


def _draw(self, context) -> None:
    if getattr(context.space_data, "tree_type", "") == "ShaderNodeTree":
        self.layout.separator()  # what is last in the menu has no more to do with it than all others
        operator = self.layout.operator("node.add_node", text=BeamspreadNode.bl_label)
        operator.type = BeamspreadNode.bl_idname
        operator.use_transform = True


register, unregister = all_or_nothing((lambda: _menu().append(_draw), lambda: _menu().remove(_draw)))
