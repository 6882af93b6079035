"""Images on which the user can paint right now: nobody else may put pixels into these."""

from __future__ import annotations

import bpy

from ..node.find import find_node, find_targets
from ..read.visibility import with_instanced


def painted_results(context) -> list:
    """Those among the images of Beamspread nodes in the context's scene."""
    painted = _painted(context)
    if not painted:
        return []
    targets = find_targets(with_instanced(context.scene.objects))
    results = {find_node(bpy.data.materials[target.material_name]).image for target in targets}
    return [image for image in painted if image in results]


def _painted(context) -> list:
    found = [
        area.spaces.active.image
        for window in context.window_manager.windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR" and area.spaces.active.mode == "PAINT"
    ]
    obj, paint = context.view_layer.objects.active, context.scene.tool_settings.image_paint
    if obj is not None and obj.mode == "TEXTURE_PAINT":
        found += [paint.canvas] if paint.mode == "IMAGE" else map(_slot_image, obj.material_slots)
    return [image for image in dict.fromkeys(found) if image is not None]


def _slot_image(slot):
    """What a stroke on the material of an object's slot goes to."""
    material = slot.material
    images = [] if material is None else material.texture_paint_images
    return images[material.paint_active_slot] if len(images) > material.paint_active_slot else None
