"""Blender draws icons of materials in a thread, with the images that these show: before one goes, the thread has to.

Blender's own operators see to that, and what scripts call, as `bpy.data.images.remove`, does not: it crashed.
"""

from __future__ import annotations

import bpy


def stop_drawing() -> None:
    """Before an image, or its pixels, are freed; in the main thread. Icons that are still shown are drawn later."""
    if bpy.app.background:
        return
    # Nothing else that ends these threads changes as little.
    image = bpy.data.images.new(".Beamspread", 1, 1)
    try:
        with bpy.context.temp_override(edit_image=image):
            if bpy.ops.image.reload.poll():
                bpy.ops.image.reload()
    finally:
        bpy.data.images.remove(image)


def remove(image) -> None:
    """Remove an image that may be shown."""
    stop_drawing()
    bpy.data.images.remove(image)


def reload(image) -> None:
    """Have an image show its file anew."""
    stop_drawing()
    image.reload()


def scale(image, width: int, height: int) -> None:
    stop_drawing()
    image.scale(width, height)
