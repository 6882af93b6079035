"""Panel in the 3D View's side bar: bakes beside the objects that they are of."""

from __future__ import annotations

import bpy

from ..preferences import draw_help
from ..registration import all_or_nothing, classes
from .bake_panel import draw_bake
from .panels import draw_image_buttons


class BEAMSPREAD_PT_sidebar(bpy.types.Panel):
    """Bake, Live, and the status of each object, with the settings that change from bake to bake."""

    bl_label = "Beamspread"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Beamspread"

    def draw_header_preset(self, _context):
        draw_help(self.layout, "guide")

    def draw(self, context):
        layout, settings = self.layout, context.scene.beamspread
        draw_bake(layout, context)
        column = layout.column()
        column.prop(settings, "use_indirect")
        if not settings.use_size:
            column.prop(settings, "resolution")
        draw_image_buttons(column, context)  # beside the resolution, which existing images don't follow


register, unregister = all_or_nothing(*classes(BEAMSPREAD_PT_sidebar))
