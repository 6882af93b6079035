"""Pixels of images while pictures are shown in them; they get their own back."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.live.picture import Picture
from ...core.live.subject import Subject
from ...core.target import Target
from ..images import files, icons
from ..images.facts import facts_of
from ..images.files import make_image
from ..images.new_image import name_for
from ..images.previews import MADE_FOR_PREVIEWS, holds_previews_alone, leave
from ..node.find import find_node
from .saved import Saved, can_be_read_again, reread

# Of pixels that went through 8 bits.
ROUNDING = 1 / 255


class Canvas:
    """An image that shows pictures of subjects, each in its own region.

    Nothing is packed, and no file is written: what the image was last saved with stays. `made_for` is the target whose
    node had no image. What others draw into pictures becomes part of the image's own pixels.

    Attributes
    ----------
    said : a sentence once the image keeps what somebody has drawn into its pictures, else "".
    """

    def __init__(self, image, made_for: Target | None = None) -> None:
        self._is_shown = self._is_given_back = False
        self._made_for = made_for
        self.said = ""
        self._know(image)
        self._pixels = _values(image)
        self._region = np.zeros(self.size[::-1], bool)  # of pictures
        self._before, self._saved = None, None
        self._take_own(image, self._pixels)

    def _take_own(self, image, values: np.ndarray) -> None:
        """Note what the image shows as its own pixels."""
        if not can_be_read_again(image):
            # What was never saved is only in these pixels.
            self._before, self._saved = values.copy(), None
            return
        self._before = None
        if self._saved is None or not self._saved.is_current(image):
            self._saved = Saved(image)

    def _know(self, image) -> None:
        self.name, self.size, self._pointer = image.name, tuple(image.size), image.as_pointer()
        self._stamp = facts_of(image).stamp

    def image(self):
        """The image, also where it is called otherwise by now; None where it is gone."""
        same = (image for image in bpy.data.images if image.as_pointer() == self._pointer)
        return next(same, None) or bpy.data.images.get(self.name)

    def fits(self, image) -> bool:
        """Whether it is of this image as it is now."""
        return image == self.image() and tuple(image.size) == self.size

    def covers(self, image) -> bool:
        """Whether the image shows a picture."""
        return self._is_shown and not self._is_given_back and image == self.image()

    def show(self, image, picture: Picture) -> None:
        """Put a picture into the image."""
        self._keep_edits(image)
        texture = picture.texture
        if not image.is_float and not image.colorspace_settings.is_data:
            texture = files.to_srgb(texture)
        channels = min(image.channels, 3)
        pixels = self._pixels.reshape(*texture.shape[:2], -1)
        np.copyto(pixels[..., :channels], texture[..., :channels], where=picture.region[..., None])
        if pixels.shape[2] == 4:
            pixels[picture.region, 3] = 1
        self._region |= picture.region
        self._put(image)

    def _put(self, image) -> None:
        image.pixels.foreach_set(self._pixels)
        image.update()
        self._put_there = self._pixels if image.is_float else _values(image)
        self._is_shown, self._is_given_back = True, False

    def _lay_on(self, own: np.ndarray) -> None:
        """Have the pictures on other pixels than before."""
        texels = self._pixels.reshape(*self._region.shape, -1)
        np.copyto(texels, own.reshape(texels.shape), where=~self._region[..., None])

    def show_again(self) -> None:
        """Put the pictures back that others wanted to see gone for a while."""
        if not self._is_given_back:
            return
        image = self.image()
        if self._made_for is not None and image is None:
            image = image_for(self._made_for, *self.size)
            if image is None or MADE_FOR_PREVIEWS not in image:
                return  # it has one of its own by now
            self._know(image)
        if image is not None and self.fits(image):
            own = _values(image)  # somebody may have drawn meanwhile
            self._take_own(image, own)
            self._lay_on(own)
            self._put(image)

    def is_edited(self, image) -> bool:
        """Whether others have drawn into what it shows."""
        if not self._is_shown or self._is_given_back or not image.is_dirty or not self.fits(image):
            return False
        return not _are_equal(_values(image), self._put_there)

    def _keep_edits(self, image) -> bool:
        """Take the texels that others have drawn for the image's own; whether there are any."""
        if self._made_for is not None or not self.is_edited(image):
            return False
        now, shown = _values(image), self._put_there.copy()
        self._restore(image)
        own = _values(image)
        is_drawn = (now != shown).reshape(-1, image.channels).any(axis=1)
        merged = np.where(is_drawn[:, None], now.reshape(-1, image.channels), own.reshape(-1, image.channels)).ravel()
        if _are_equal(merged, own):
            return False
        self._before, self._saved = merged, None
        self._lay_on(merged)
        self.said = (
            f"The image '{image.name}' was changed while Live showed it: it keeps the change, which is not saved yet."
        )
        return True

    def is_saved(self) -> bool:
        """Whether the image was filled or saved by somebody else since pictures were put into it."""
        image = self.image()
        if image is None:
            return False
        return facts_of(image).stamp != self._stamp or (
            self._is_shown and not self._is_given_back and not image.is_dirty
        )

    def refresh(self, can_be_painted: bool) -> None:
        """Look at the image's pixels again, after undo."""
        image = bpy.data.images.get(self.name)
        if image is not None and tuple(image.size) == self.size:
            self._know(image)
            if self._is_given_back and self._before is None and image.is_dirty and not can_be_painted:
                self._restore(image)  # undo has brought back a picture: seen in Blender 5.2
            image.pixels.foreach_get(self._pixels)
        self._is_shown = False

    def leave_to_painter(self) -> None:
        """Have the image show its own pixels to somebody who can paint on it; one made for previews stays as it is."""
        image = self.image()
        if self._is_given_back or image is None:
            return
        if self._made_for is None:
            self.give_back()
            return
        self._is_given_back = True
        self._leave(image)

    def _leave(self, image) -> None:
        """Leave an image that was made for previews to whoever has made it his own."""
        leave(image)
        self._made_for = None
        self.said = f"The image '{image.name}', which Live has made, stays: it is painted on, saved or used elsewhere."

    def give_back(self) -> None:
        """Give the image the pixels back that it had, until they are shown again."""
        if self._is_given_back:
            return
        image = self.image()
        if image is None:
            self._is_given_back = True
            return
        is_edited, is_kept = self.is_edited(image), self._keep_edits(image)
        self._is_given_back = True
        if self._made_for is not None:
            if holds_previews_alone(image) and not is_edited:
                self.name = image.name
                icons.remove(image)
            else:
                if image.source == "GENERATED" and image.packed_file is None:
                    image.pack()
                self._leave(image)
        elif self.fits(image) and (is_kept or image.is_dirty):
            self._restore(image)
        elif self._is_shown and self.fits(image) and self._is_of_pictures(image):
            # Blender offers to save changed images as it closes a file.
            self._restore_saved(image)

    def _restore(self, image) -> None:
        if self._before is not None:
            image.pixels.foreach_set(self._before)
            image.update()
        else:
            reread(image)

    def _restore_saved(self, image) -> None:
        if self._saved is not None:
            self._saved.put_back(image)
        else:
            self._restore(image)
            image.pack()

    def _is_of_pictures(self, image) -> bool:
        if len(image.pixels) != len(self._pixels):
            return False
        values = _values(image)
        shown = self._pixels if image.is_float else self._pixels.clip(0, 1)
        return np.allclose(values, shown, rtol=1e-3, atol=ROUNDING)


def _values(image) -> np.ndarray:
    """All channels of all pixels, float32, flat."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values


def _are_equal(one: np.ndarray, other: np.ndarray) -> bool:
    """Bit by bit, as some may be no numbers."""
    return np.array_equal(one.view(np.uint32), other.view(np.uint32))


def image_name_of(subject: Subject) -> str:
    """Of the image that shows it; empty without one."""
    node = find_node(bpy.data.materials.get(subject.target.material_name))
    return node.image.name if node is not None and node.image is not None else ""


def image_for(target: Target, width: int, height: int):
    """The image that shows a target; one is made if there is none. None where the node is gone."""
    node = find_node(bpy.data.materials.get(target.material_name))
    if node is None:
        return None
    if node.image is None:
        node.image = make_image(name_for(target), width, height)
        node.image[MADE_FOR_PREVIEWS] = True
    return node.image
