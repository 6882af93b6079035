"""Changes of images while Blender draws icons of materials, with their images, in a thread.

The thread must end before an image is freed. Blender's own operators end it; functions for scripts, such as
`bpy.data.images.remove`, do not, and crash.
"""

from __future__ import annotations

import bpy


def stop_drawing() -> None:
    """End the thread, before an image or its pixels are freed. Call it in the main thread; icons are drawn later."""
    if bpy.app.background:
        return
    # Reloading an unused image ends the thread and changes nothing else.
    image = bpy.data.images.new(".Beamspread", 1, 1)
    try:
        with bpy.context.temp_override(edit_image=image):
            if bpy.ops.image.reload.poll():
                bpy.ops.image.reload()
    finally:
        bpy.data.images.remove(image)


def remove(image) -> None:
    """Remove an image."""
    stop_drawing()
    bpy.data.images.remove(image)


def reload(image) -> None:
    """Load the image's file again."""
    stop_drawing()
    image.reload()


def scale(image, width: int, height: int) -> None:
    """Scale an image to a size in texels."""
    stop_drawing()
    image.scale(width, height)
