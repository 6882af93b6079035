"""Panel in the 3D View's side bar: bakes beside the objects that they are of."""

from __future__ import annotations

import bpy

from ..images.image_operators import images_in
from ..node.find import find_node
from ..preferences import draw_help
from ..registration import all_or_nothing, classes
from .bake_panel import draw_bake


class BEAMSPREAD_PT_sidebar(bpy.types.Panel):
    """Bake, Live, and the status of each object, with the settings that change from bake to bake."""

    bl_label = "Beamspread"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Beamspread"

    def draw_header_preset(self, _context):
        draw_help(self.layout, "guide")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_bake(layout, context)
        settings = context.scene.beamspread
        column = layout.column()
        column.prop(settings, "use_indirect")
        column.prop(settings, "use_size")
        column.prop(settings, "texel_density" if settings.use_size else "resolution")
        material = getattr(context.object, "active_material", None)
        if material is None or find_node(material) is None:
            draw_start(layout)
        else:
            for image in images_in(context):
                layout.label(text=image.name, icon="IMAGE_DATA")


def draw_start(layout) -> None:
    """Tell where to begin on an object without a Beamspread node."""
    column = layout.column(align=True)
    column.label(text="No Beamspread node here.", icon="INFO")
    column.label(text="Shader Editor: Add > Shader", icon="BLANK1")


register, unregister = all_or_nothing(*classes(BEAMSPREAD_PT_sidebar))
