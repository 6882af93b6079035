"""Panels: bake settings in the render properties, the node in the material properties and in the Shader Editor."""

from __future__ import annotations

import bpy

from . import bakes, compat, engine, extract, nodes, status, targets
from .core.errors import BakeError

# Objects whose warnings a panel shows; it is drawn often.
MOST_OBJECTS = 8


def warnings_for(obj, visible: set[str]) -> list[str]:
    """What would keep the object from being baked, as far as it is known without baking."""
    messages = []
    try:
        bakes.check_visible(obj.name, visible)
    except BakeError as error:
        messages.append(str(error))
    if obj.type == "MESH" and not obj.data.uv_layers:
        messages.append("The mesh has no UV map: unwrap it first.")
    for material in bakes.materials_of(obj):
        node = nodes.find_node(material)
        try:
            extract.read_surface(node).check()
            if node.image is not None:
                targets.check_image(node.image)
        except BakeError as error:
            messages.append(str(error))
    return messages


# Of a panel beside its text, and of a letter on average, at a user-interface scale of 1.
BORDER_PIXELS, LETTER_PIXELS = 60, 6.4


def draw_warnings(layout, context, messages: list[str]) -> None:
    """Sentences, wrapped to the panel's width, with an icon."""
    pixels = context.region.width / context.preferences.system.ui_scale
    width = max(20, int((pixels - BORDER_PIXELS) / LETTER_PIXELS))
    for message in messages:
        column = layout.column(align=True)
        for number, line in enumerate(_wrap(message, width)):
            column.label(text=line, icon="BLANK1" if number else "ERROR")


def _wrap(text: str, width: int) -> list[str]:
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def draw_bake(layout, context) -> None:
    """Problems of the selected objects, then the Bake buttons or the progress."""
    problem = status.native_problem()
    if problem:
        draw_warnings(layout, context, [problem])
        return
    if status.is_running():
        column = layout.column(align=True)
        for line, icon in zip(status.lines(), ("RENDER_STILL", "BLANK1")):
            column.label(text=line, icon=icon)
        return
    # `context.object` is empty in the render properties.
    chosen = [obj for obj in context.view_layer.objects.selected if bakes.materials_of(obj)]
    visible = extract.render_visible_names(context.view_layer) if chosen else set()
    for obj in chosen[:MOST_OBJECTS]:
        draw_warnings(layout, context, [f"{obj.name}: {message}" for message in warnings_for(obj, visible)])
    row = layout.row(align=True)
    row.scale_y = 1.4
    row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL").objects = "SELECTED"
    row.operator("beamspread.bake", text="Bake All").objects = "ALL"


def _use_columns(layout) -> None:
    layout.use_property_split = True
    layout.use_property_decorate = False


class RenderPanel:
    """Placed in the render properties."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"


class BEAMSPREAD_PT_render(RenderPanel, bpy.types.Panel):
    """Settings of the bake; shown for every engine, since results are looked at in Cycles and EEVEE."""

    bl_label = "Beamspread"

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        draw_bake(layout, context)
        column = layout.column()
        settings = context.scene.beamspread
        for name in ("resolution", "margin", "samples", "solver", "distributions"):
            column.prop(settings, name)
        column.prop(settings, "quality" if settings.distributions == "LIBRARY" else "sample_folder")


class BEAMSPREAD_PT_active_image(RenderPanel, bpy.types.Panel):
    """Blender's own Bake, which fills the active image through the engine."""

    bl_label = "Bake to Active Image"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.engine == engine.BeamspreadEngine.bl_idname

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        draw_warnings(layout, context, engine.last_errors())
        layout.operator("object.bake", text="Bake Active Image", icon="RENDER_STILL")
        layout.prop(context.scene.render.bake, "margin")
        layout.prop(context.scene.render.bake, "use_clear", text="Clear Image")


class BEAMSPREAD_PT_batch(RenderPanel, bpy.types.Panel):
    """Where a batch writes."""

    bl_label = "Batch"
    bl_parent_id = "BEAMSPREAD_PT_render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        layout.prop(context.scene.beamspread, "output_dir")
        layout.prop(context.scene.beamspread, "format")


class MaterialPanel:
    """Shown while the active material has a Beamspread node."""

    bl_label = "Beamspread"

    @classmethod
    def poll(cls, context):
        material = _active_material(context)
        return material is not None and compat.uses_nodes(material) and nodes.find_node(material) is not None

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        nodes.draw_properties(nodes.find_node(_active_material(context)), layout)
        draw_bake(layout, context)


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
    BEAMSPREAD_PT_active_image,
    BEAMSPREAD_PT_batch,
    BEAMSPREAD_PT_material,
    BEAMSPREAD_PT_node_editor,
)
register, unregister = bpy.utils.register_classes_factory(_classes)
