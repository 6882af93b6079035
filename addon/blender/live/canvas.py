"""Pixels of images while pictures are shown in them; they get their own back."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from pathlib import Path

import bpy
import numpy as np

from ...core.bake.runner import Target
from ...core.live.picture import Picture
from ...core.live.subject import Subject
from ...core.whole_file import whole_file
from ..images import files, undo
from ..images.new_image import name_for
from ..images.previews import MADE_FOR_PREVIEWS
from ..images.writing import make_image
from ..node.find import find_node

# Of pixels that went through 8 bits.
ROUNDING = 1 / 255


class Canvas:
    """An image that shows pictures of subjects, each in its own region.

    Nothing is packed, and no file is written: what the image was last saved with stays. `made_for` is the target whose
    node had no image.
    """

    def __init__(self, image, made_for: Target | None = None) -> None:
        self._is_shown = self._is_given_back = False
        self._made_for = made_for
        self._know(image)
        self._pixels = np.empty(self.size[0] * self.size[1] * image.channels, np.float32)
        image.pixels.foreach_get(self._pixels)
        # What was never saved is only in these pixels.
        self._before = None if _can_be_read_again(image) else self._pixels.copy()
        self._saved = _Saved(image) if self._before is None else None

    def _know(self, image) -> None:
        self.name, self.size, self._pointer = image.name, tuple(image.size), image.as_pointer()
        self._stamp = image.get(undo.KEY)

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
        texture = picture.texture
        if not image.is_float and not image.colorspace_settings.is_data:
            texture = files.to_srgb(texture)
        channels = min(image.channels, 3)
        pixels = self._pixels.reshape(*texture.shape[:2], -1)
        np.copyto(pixels[..., :channels], texture[..., :channels], where=picture.region[..., None])
        if pixels.shape[2] == 4:
            pixels[picture.region, 3] = 1
        self._put(image)

    def _put(self, image) -> None:
        image.pixels.foreach_set(self._pixels)
        image.update()
        self._is_shown, self._is_given_back = True, False

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
            self._put(image)

    def is_saved(self) -> bool:
        """Whether the image was filled or saved by somebody else since pictures were put into it."""
        image = self.image()
        if image is None:
            return False
        return image.get(undo.KEY) != self._stamp or (self._is_shown and not self._is_given_back and not image.is_dirty)

    def refresh(self) -> None:
        """Look at the image's pixels again."""
        image = bpy.data.images.get(self.name)
        if image is not None and tuple(image.size) == self.size:
            self._know(image)
            image.pixels.foreach_get(self._pixels)
        self._is_shown = False

    def give_back(self) -> None:
        """Give the image the pixels back that it had, until they are shown again."""
        if self._is_given_back:
            return
        self._is_given_back = True
        image = self.image()
        if image is None:
            return
        if self._made_for is not None:
            if MADE_FOR_PREVIEWS in image:
                self.name = image.name
                bpy.data.images.remove(image)
        elif image.is_dirty and self.fits(image):
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
        values = np.empty_like(self._pixels)
        if len(image.pixels) != len(values):
            return False
        image.pixels.foreach_get(values)
        shown = self._pixels if image.is_float else self._pixels.clip(0, 1)
        return np.allclose(values, shown, rtol=1e-3, atol=ROUNDING)


class _Saved:
    """What an image was last saved as: bytes of its packed file, or a copy of its file."""

    def __init__(self, image) -> None:
        self._path = files.file_of(image)
        if self._path is None:
            self._packed = bytes(image.packed_file.data)
        else:
            folder = tempfile.mkdtemp(prefix="beamspread-")
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            self._copy = Path(folder) / self._path.name
            shutil.copyfile(self._path, self._copy)

    def put_back(self, image) -> None:
        if self._path is None:
            image.pack(data=self._packed, data_len=len(self._packed))
        elif files.file_of(image) == self._path:
            with whole_file(self._path) as temporary:
                shutil.copyfile(self._copy, temporary)
        reread(image)


def reread(image) -> None:
    """Show what the image was last saved with."""
    if image.packed_file is None:
        image.reload()
        return
    # Not `reload`: it would pack the image's file anew, where there is one.
    image.buffers_free()
    image.gl_free()
    image.update_tag()


def _can_be_read_again(image) -> bool:
    path = files.file_of(image)
    is_kept = image.packed_file is not None if path is None else path.is_file()
    return is_kept and not image.is_dirty


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
