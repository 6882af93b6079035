"""Buttons for the image of the active material's node, shown where there is something to mend."""

from __future__ import annotations

from ..images.files import clips
from ..images.image_operators import image_in, wanted_size
from ..images.previews import holds_previews_alone


def draw_image_buttons(layout, context) -> None:
    """Make Float where it clips, Resize where the scene's resolution is another."""
    image = image_in(context)
    if image is None or holds_previews_alone(image) or 0 in image.size or image.library is not None:
        return
    if clips(image):
        layout.operator("beamspread.make_float", text="Make Float: it clips values above 1", icon="IMAGE_DATA")
    size = wanted_size(image, context.scene.beamspread.resolution)
    if tuple(image.size) != size:
        text = f"Resize {image.size[0]} x {image.size[1]} to {size[0]} x {size[1]}"
        layout.operator("beamspread.resize_image", text=text, icon="FULLSCREEN_ENTER")
