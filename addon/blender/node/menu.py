"""The node's entry in the Shader Editor: Add > Shader > Beamspread."""

from .. import compat
from ..registration import all_or_nothing
from .node import BeamspreadNode


def _draw(self, context) -> None:
    if getattr(context.space_data, "tree_type", "") == "ShaderNodeTree":
        self.layout.separator()
        operator = self.layout.operator("node.add_node", text=BeamspreadNode.bl_label)
        operator.type = BeamspreadNode.bl_idname
        operator.use_transform = True


register, unregister = all_or_nothing(
    (lambda: compat.shader_menu().append(_draw), lambda: compat.shader_menu().remove(_draw))
)
