"""Pixels of images while pictures are shown in them; they get their own back."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.live.picture import Picture
from ...core.live.subject import Subject
from ..images import files
from ..images.new_image import name_for
from ..images.writing import make_image
from ..node.find import find_node


class Canvas:
    """An image that shows pictures of subjects, each in its own region.

    Nothing is packed, and no file is written: what the image was last saved with stays.
    """

    def __init__(self, image) -> None:
        self._is_shown = False
        self.name, self.size = image.name, tuple(image.size)
        self._pixels = np.empty(self.size[0] * self.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(self._pixels)
        # What was never saved is only in these pixels.
        self._before = None if _can_be_read_again(image) else self._pixels.copy()

    def fits(self, image) -> bool:
        """Whether it is of this image as it is now."""
        return image.name == self.name and tuple(image.size) == self.size

    def show(self, image, picture: Picture) -> None:
        """Put a picture into the image."""
        texture = picture.texture
        if not image.is_float and not image.colorspace_settings.is_data:
            texture = files.to_srgb(texture)
        channels = min(image.channels, 3)
        pixels = self._pixels.reshape(*texture.shape[:2], -1)
        np.copyto(pixels[..., :channels], texture[..., :channels], where=picture.region[..., None])
        if pixels.shape[2] == 4:
            pixels[picture.region, 3] = 1
        image.pixels.foreach_set(self._pixels)
        image.update()
        self._is_shown = True

    def is_saved(self) -> bool:
        """Whether the image was filled or saved by somebody else since pictures were put into it."""
        image = bpy.data.images.get(self.name)
        return image is not None and self._is_shown and not image.is_dirty

    def refresh(self) -> None:
        """Look at the image's pixels again."""
        image = bpy.data.images.get(self.name)
        if image is not None and self.fits(image):
            image.pixels.foreach_get(self._pixels)
        self._is_shown = False

    def restore(self) -> None:
        """Give the image the pixels back that it had."""
        image = bpy.data.images.get(self.name)
        if image is None or not self.fits(image) or not image.is_dirty:
            return
        if self._before is None:
            image.reload()
        else:
            image.pixels.foreach_set(self._before)
            image.update()


def _can_be_read_again(image) -> bool:
    return not image.is_dirty and (image.packed_file is not None or image.source == "FILE")


def image_name_of(subject: Subject) -> str:
    """Of the image that shows it; empty without one."""
    node = find_node(bpy.data.materials.get(subject.target.material_name))
    return node.image.name if node is not None and node.image is not None else ""


def image_of(picture: Picture):
    """The image that shows a picture's subject; one is made if there is none. None where the node is gone."""
    target = picture.subject.target
    node = find_node(bpy.data.materials.get(target.material_name))
    if node is None:
        return None
    if node.image is None:
        height, width = picture.texture.shape[:2]
        node.image = make_image(name_for(target), width, height)
    return node.image
