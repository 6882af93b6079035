"""Panels: bake settings in the render properties, the node in the material properties and in the Shader Editor."""

from __future__ import annotations

import bpy

from ...core import native
from ...core.errors import BakeError
from .. import compat
from ..images.files import check_image
from ..jobs.engine import BeamspreadEngine
from ..jobs.prepare import check_visible
from ..jobs.state import state
from ..live import session
from ..node.find import find_misplaced, find_node, materials_of
from ..node.node import draw_properties
from ..read.visible import render_visible_names

INDIRECT_COST = "Indirect light takes seconds to a minute per object: Cycles finds it first."

# Objects whose warnings, and messages of bakes, that a panel shows; it is drawn often.
MOST_OBJECTS = 8


def warnings_for(obj, visible: set[str]) -> list[str]:
    """What would keep the object from being baked, as far as it is known without baking."""
    # A collection instance may show thousands of objects.
    messages = [bake.error for bake in find_misplaced([obj] if obj.instance_type == "NONE" else [])]
    materials = materials_of(obj)
    if not materials:
        return messages
    if not obj.data.uv_layers:
        messages.append("The mesh has no UV map: unwrap it first.")
    checks = [lambda: check_visible(obj.name, visible)]
    for node in map(find_node, materials):
        checks.append(lambda node=node: node.surface().check())
        if node.image is not None:
            checks.append(lambda node=node: check_image(node.image))
    for check in checks:
        try:
            check()
        except BakeError as error:
            messages.append(str(error))
    return messages


# Of a panel beside its text, and of a letter on average, at a user-interface scale of 1.
BORDER_PIXELS, LETTER_PIXELS = 60, 6.4


def draw_warnings(layout, context, messages: list[str]) -> None:
    draw_sentences(layout, context, messages, "ERROR")


def draw_sentences(layout, context, messages: list[str], icon: str) -> None:
    """Wrapped to the panel's width, each after an icon."""
    pixels = context.region.width / context.preferences.system.ui_scale
    width = max(20, int((pixels - BORDER_PIXELS) / LETTER_PIXELS))
    for message in messages:
        column = layout.column(align=True)
        for number, line in enumerate(_wrap(message, width)):
            column.label(text=line, icon="BLANK1" if number else icon)


def _wrap(text: str, width: int) -> list[str]:
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def draw_bake(layout, context) -> None:
    """The progress, or problems of the selected objects and the Bake buttons; then what the last bakes said."""
    if native.problem:
        draw_warnings(layout, context, [native.problem])
        return
    shown = []
    if state.is_running():
        column = layout.column(align=True)
        for line, icon in zip(state.progress(), ("RENDER_STILL", "BLANK1")):
            column.label(text=line, icon=icon)
    else:
        # `context.object` is empty in the render properties.
        chosen, visible = list(context.view_layer.objects.selected), render_visible_names(context.view_layer)
        for obj in chosen[:MOST_OBJECTS]:
            warnings = warnings_for(obj, visible)
            draw_warnings(layout, context, [f"{obj.name}: {message}" for message in warnings])
            shown += warnings
        row = layout.row(align=True)
        row.scale_y = 1.4
        row.operator("beamspread.bake", text="Bake", icon="RENDER_STILL").objects = "SELECTED"
        row.operator("beamspread.bake", text="Bake All").objects = "ALL"
        layout.prop(context.scene.beamspread, "use_live", toggle=True)
        draw_sentences(layout, context, session.sentences(), "INFO")
    # A bake that failed for a reason that still stands has said the same.
    news = [message for message in state.messages() if not message.endswith(tuple(shown))]
    draw_warnings(layout, context, news[:MOST_OBJECTS])


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
        for name in ("output", "resolution", "margin", "samples"):
            column.prop(settings, name)
        column.prop(settings, "use_indirect")
        if settings.use_indirect:
            draw_sentences(column, context, [INDIRECT_COST], "INFO")
        if settings.output != "LUMINANCE":
            return  # no medium, no solver
        column.prop(settings, "solver")
        column.prop(settings, "distributions")
        column.prop(settings, "quality" if settings.distributions == "LIBRARY" else "sample_folder")


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
        return material is not None and compat.uses_nodes(material) and find_node(material) is not None

    def draw(self, context):
        layout = self.layout
        _use_columns(layout)
        draw_properties(find_node(_active_material(context)), layout)
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
