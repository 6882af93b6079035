"""Buttons that change the image of a node: to float, and to the scene's resolution."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...core.bake.runner import Bake
from ...core.target import Target
from ..node.find import find_node
from ..registration import all_or_nothing, classes
from . import files, icons
from .facts import facts_of, set_facts
from .new_image import store_new


def image_in(context):
    """The image of the active material's Beamspread node, or None."""
    # `context.object` is empty in the render properties.
    material = getattr(context, "material", None) or getattr(context.view_layer.objects.active, "active_material", None)
    node = find_node(material)
    return None if node is None or material.library is not None else node.image


def wanted_size(image, resolution: int) -> tuple[int, int]:
    """Size of an image of the same shape with `resolution` texels along its longer side."""
    return tuple(max(1, round(resolution * side / max(image.size))) for side in image.size)


class ImageOperator:
    """Operator on the image of the active material's node."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        image = image_in(context)
        if image is None:
            return False
        return 0 not in image.size and image.library is None and cls.needed(context, image)


class BEAMSPREAD_OT_make_float(ImageOperator, bpy.types.Operator):
    """Replace this image, which clips values above 1, by a float image with the same pixels. Its file stays"""

    bl_idname = "beamspread.make_float"
    bl_label = "Make Float"

    @classmethod
    def needed(cls, _context, image) -> bool:
        return files.clips(image)

    def execute(self, context):
        image = image_in(context)
        name, bakes = image.name, facts_of(image).bakes
        bake = Bake(Target(""))
        _path, new = store_new(name, files.linear_pixels(image), bake, image.colorspace_settings.is_data)
        image.user_remap(new)
        image.name, new.name = f"{name} (8 bit)", name
        set_facts(new, replace(facts_of(new), bakes=bakes))
        for material in bpy.data.materials:
            node = find_node(material)
            if node is not None and node.image == new:
                node.image = new  # the inner tree shows it
        for message in bake.messages:
            self.report({message.level.value}, str(message))
        return {"FINISHED"}


class BEAMSPREAD_OT_resize_image(ImageOperator, bpy.types.Operator):
    """Scale the image to the scene's resolution. The next bake fills it"""

    bl_idname = "beamspread.resize_image"
    bl_label = "Resize Image"

    @classmethod
    def needed(cls, context, image) -> bool:
        return tuple(image.size) != wanted_size(image, context.scene.beamspread.resolution)

    def execute(self, context):
        image = image_in(context)
        icons.scale(image, *wanted_size(image, context.scene.beamspread.resolution))
        image.update_tag()  # Blender sends no update for a new size
        return {"FINISHED"}


register, unregister = all_or_nothing(*classes(BEAMSPREAD_OT_make_float, BEAMSPREAD_OT_resize_image))
