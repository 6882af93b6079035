"""What F12 does while the render engine is Beamspread."""

from __future__ import annotations

import bpy

from ..jobs.run.engine import BeamspreadEngine
from ..registration import all_or_nothing, classes


class BEAMSPREAD_PT_picture(bpy.types.Panel):
    """The engine that renders pictures."""

    bl_label = "Pictures"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    bl_parent_id = "BEAMSPREAD_PT_render"

    @classmethod
    def poll(cls, context):
        return context.engine == BeamspreadEngine.bl_idname

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(context.scene.beamspread, "render_engine")
        layout.label(text="Viewports show Material Preview", icon="INFO")


register, unregister = all_or_nothing(*classes(BEAMSPREAD_PT_picture))
