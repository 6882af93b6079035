"""Panels: bake settings in the render properties, the node in the material properties and in the Shader Editor."""

from __future__ import annotations

import bpy

from .. import compat
from ..images.files import clips
from ..images.image_operators import images_in, wanted_size
from ..images.udim import is_tiled
from ..jobs.run.active_image import active_image, refusals, textures_at_risk
from ..jobs.run.engine import BeamspreadEngine
from ..jobs.state import state
from ..node.draw import draw_properties
from ..node.find import find_node, image_of
from ..preferences import draw_help
from ..registration import all_or_nothing, classes
from .bake_panel import draw_animation, draw_bake, draw_lines


def _use_columns(layout) -> None:
    layout.use_property_split = True
    layout.use_property_decorate = False


def draw_image_buttons(layout, context) -> None:
    """Draw Make Float if the node's image clips, and Resize if its size differs from that wanted."""
    images = [image for image in images_in(context) if image.library is None and not is_tiled(image)]
    images = [image for image in images if 0 not in image.size]
    if any(map(clips, images)):
        layout.operator("beamspread.make_float", text="Make Float: image clips values above 1", icon="IMAGE_DATA")
    for image in images:
        side = _wanted_side(image, context.scene.beamspread)
        size = wanted_size(image.size, side)
        if tuple(image.size) != size:
            text = f"Resize {image.size[0]} x {image.size[1]} to {size[0]} x {size[1]}"
            resize = layout.operator("beamspread.resize_image", text=text, icon="FULLSCREEN_ENTER")
            if context.scene.beamspread.use_size:
                resize.side = side
            return  # it resizes all that need it


def _wanted_side(image, settings) -> int:
    """Texels along the longer side that an image should have.

    Where the resolution follows the size of objects, an image keeps its size unless light spreads less than a texel.
    """
    if not settings.use_size:
        return settings.resolution
    announced = (bake for target, bake in state.announced.items() if image_of(target) == image)
    sides = (bake.spread.better_side for bake in announced if bake.spread is not None)
    return max(filter(None, sides), default=max(image.size))


class RenderPanel:
    """ObjectInstance in the render properties."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class BEAMSPREAD_PT_render(RenderPanel, bpy.types.Panel):
    """Settings of the bake. Every engine shows them, since results are seen in Cycles and EEVEE."""

    bl_label = "Beamspread"

    def draw_header_preset(self, _context):
        draw_help(self.layout, "guide")

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        draw_bake(layout, context)
        column = layout.column()
        settings = context.scene.beamspread
        column.prop(settings, "output")
        column.row(heading="Resolution").prop(settings, "use_size", text="From Size")
        column.prop(settings, "texel_density" if settings.use_size else "resolution")
        draw_image_buttons(column, context)  # beside the resolution, which existing images don't follow
        column.prop(settings, "use_indirect")


class BEAMSPREAD_PT_expert(RenderPanel, bpy.types.Panel):
    """Settings that most artists leave as they are."""

    bl_label = "Expert"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, _context):
        draw_help(self.layout, "performance")

    def draw(self, context):
        _use_columns(self.layout)
        column = self.layout.column()
        settings = context.scene.beamspread
        column.prop(settings, "margin_type")
        column.prop(settings, "margin")
        column.prop(settings, "samples")
        if settings.output != "LUMINANCE":
            return  # no medium, no solver
        column.prop(settings, "solver")
        if settings.distributions == "LIBRARY":
            column.prop(settings, "quality")


class BEAMSPREAD_PT_samples(RenderPanel, bpy.types.Panel):
    """Light distributions of one's own, for research."""

    bl_label = "Your Own LDFs"
    bl_parent_id = "BEAMSPREAD_PT_expert"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.beamspread.output == "LUMINANCE"

    def draw_header_preset(self, _context):
        draw_help(self.layout, "python-and-batch")

    def draw(self, context):
        _use_columns(self.layout)
        column = self.layout.column()
        settings = context.scene.beamspread
        column.prop(settings, "distributions")
        if settings.distributions != "LIBRARY":
            column.prop(settings, "sample_folder")


class BEAMSPREAD_PT_active_image(RenderPanel, bpy.types.Panel):
    """Blender's own Bake, which fills the active image through the engine."""

    bl_label = "Bake to Active Image"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.engine == BeamspreadEngine.bl_idname

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        active = context.view_layer.objects.active  # `context.object` is empty in the render properties
        reasons = dict.fromkeys(refusals(context).values())
        if reasons:
            draw_lines(layout, context, reasons, "ERROR")
        else:
            draw_lines(layout, context, [target_of_blender(getattr(active, "active_material", None))], "INFO")
        column = layout.column()
        column.enabled = not reasons
        column.operator("beamspread.bake_active", icon="RENDER_STILL")
        layout.prop(context.scene.render.bake, "margin")
        layout.prop(context.scene.render.bake, "use_clear", text="Clear Image")


def target_of_blender(material) -> str:
    """A sentence that names the image that Blender's own Bake fills."""
    image = active_image(material)
    if image is None:
        return "Select an Image Texture node with an image in the Shader Editor: Blender's Bake fills that."
    return f"Fills '{image.name}', the image of the selected Image Texture node."


class BEAMSPREAD_PT_images(RenderPanel, bpy.types.Panel):
    """Storage of new images."""

    bl_label = "New Images"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, _context):
        draw_help(self.layout, "guide")

    def draw(self, context):
        layout, settings = self.layout, context.scene.beamspread
        _use_columns(layout)
        layout.prop(settings, "image_storage")
        if settings.image_storage == "FILES":
            layout.prop(settings, "image_dir")
        layout.prop(settings, "image_name")
        layout.prop(settings, "use_udim")
        layout.operator("beamspread.make_atlas", icon="UV_ISLANDSEL")


class BEAMSPREAD_PT_batch(RenderPanel, bpy.types.Panel):
    """Folder of a batch, and the frames in it."""

    bl_label = "Animation"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, _context):
        draw_help(self.layout, "python-and-batch")

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        draw_animation(layout, context)
        layout.prop(context.scene.beamspread, "output_dir")
        layout.prop(context.scene.beamspread, "format")
        if context.scene.beamspread.format.startswith("PNG"):
            layout.prop(context.scene.beamspread, "use_exposure")
            layout.prop(context.scene.beamspread, "use_view_transform")
        column = layout.column(align=True)
        column.operator("beamspread.show_frames", icon="RENDER_ANIMATION")
        column.operator("beamspread.show_single", icon="IMAGE_DATA")
        column = layout.column(align=True)
        column.operator("beamspread.bake_files", icon="FILE_IMAGE")
        column.operator("beamspread.copy_command", icon="COPYDOWN")


class BEAMSPREAD_PT_render_with(RenderPanel, bpy.types.Panel):
    """Engine that renders images while the render engine is Beamspread."""

    bl_label = "Render With"
    bl_parent_id = "BEAMSPREAD_PT_render"

    @classmethod
    def poll(cls, context):
        return context.engine == BeamspreadEngine.bl_idname

    def draw(self, context):
        layout, scene = self.layout, context.scene
        _use_columns(layout)
        layout.prop(scene.beamspread, "render_engine")
        if scene.beamspread.render_engine == "EEVEE":
            layout.prop(scene.eevee, "taa_render_samples", text="Samples")
        elif hasattr(scene, "cycles"):
            layout.prop(scene.cycles, "samples")
            layout.prop(scene.cycles, "use_denoising", text="Denoise")
            if scene.cycles.use_denoising and not compat.has_denoiser():
                draw_lines(layout, context, ["This Blender has no denoiser: pictures come without."], "INFO")
        draw_lines(layout, context, ["EEVEE draws the viewport."], "INFO")


class MaterialPanel:
    """Shown while the active material has a Beamspread node."""

    bl_label = "Beamspread"

    @classmethod
    def poll(cls, context):
        material = _active_material(context)
        return material is not None and compat.uses_nodes(material) and find_node(material) is not None

    def draw_header_preset(self, _context):
        draw_help(self.layout, "guide")

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        material = _active_material(context)
        # The state of the bake comes first: the properties are in the node and in Blender's Surface panel, too.
        draw_bake(layout, context, material.name)
        draw_properties(find_node(material), layout)
        draw_image_buttons(layout, context)


def _warn_of_cycles(panel, context) -> None:
    """Name textures that the Bake of Cycles would replace, which this add-on can't stop."""
    draw_lines(panel.layout, context, textures_at_risk(context), "ERROR")


def _warn_in_cycles() -> None:
    if panel := getattr(bpy.types, "CYCLES_RENDER_PT_bake", None):  # none without the add-on Cycles
        panel.prepend(_warn_of_cycles)


def _end_warnings() -> None:
    if panel := getattr(bpy.types, "CYCLES_RENDER_PT_bake", None):
        panel.remove(_warn_of_cycles)


def _active_material(context):
    return getattr(context, "material", None) or getattr(context.object, "active_material", None)


class BEAMSPREAD_PT_material(MaterialPanel, bpy.types.Panel):
    """The node of the active material, in the material properties."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"


class BEAMSPREAD_PT_node_editor(MaterialPanel, bpy.types.Panel):
    """The node of the active material, in the Shader Editor's side bar."""

    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Beamspread"


_classes = (
    BEAMSPREAD_PT_render,
    BEAMSPREAD_PT_expert,
    BEAMSPREAD_PT_samples,
    BEAMSPREAD_PT_active_image,
    BEAMSPREAD_PT_images,
    BEAMSPREAD_PT_batch,
    BEAMSPREAD_PT_render_with,
    BEAMSPREAD_PT_material,
    BEAMSPREAD_PT_node_editor,
)
register, unregister = all_or_nothing(*classes(*_classes), (_warn_in_cycles, _end_warnings))
