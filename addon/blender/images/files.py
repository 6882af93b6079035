"""Images of the scene: what can be baked into, and filling them."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import ImageError
from ..node.tree import FRAMES
from . import icons, undo
from .writing import is_read_only, pixels_of, save_image, scene_linear, set_pixels, write_exr

# Formats of files that keep values above 1.
WITH_RANGE = {".exr", ".hdr"}


def file_of(image) -> Path | None:
    """Absolute path of the image's file, None if its pixels live in the .blend file."""
    if image.source == "GENERATED" or image.packed_file is not None:
        return None
    return Path(os.path.normpath(bpy.path.abspath(image.filepath, library=image.library)))


def check_image(image) -> None:
    """Raise ImageError with one sentence if a bake could not be kept in the image."""
    name = f"The image '{image.name}'"
    if image.source == "TILED":
        raise ImageError(f"{name} has UDIM tiles, which cannot be baked yet: choose a single image in the node.")
    if image.source == "SEQUENCE" and FRAMES in image:
        raise ImageError(f"{name} holds the frames of a batch: Show Single Images (Render > Beamspread > Batch) first.")
    if image.source not in {"FILE", "GENERATED"}:
        raise ImageError(f"{name} is a sequence, movie or viewer: choose a single image in the node.")
    if image.library is not None:
        raise ImageError(f"{name} belongs to another .blend file: make it local or choose another in the node.")
    path = file_of(image)
    if path is not None:
        if not path.is_file():
            raise ImageError(f"{name} has lost its file {path}: restore it or clear the image in the node.")
        if is_read_only(path) or is_read_only(path.parent):
            raise ImageError(f"{name} cannot be saved because {path} is read-only: allow writing or choose another.")
    if 0 in image.size:
        raise ImageError(f"{name} has no pixels: its file may be damaged, so choose another image in the node.")


def fill_image(image, texture: np.ndarray) -> str:
    """Put linear RGB (height, width, 3) into an image and keep it; the path of its file, "" where it is packed.

    Where the file can't be written (ImageError), the old pixels remain.
    """
    check_image(image)
    if tuple(image.size) != texture.shape[1::-1]:
        raise ImageError(f"The image '{image.name}' changed its size during the bake: bake it again.")
    path = file_of(image)
    stored = to_srgb(texture) if _is_encoded(image) else texture
    if path is None:
        set_pixels(image, stored)
        image.pack()
        undo.stamp(image)
        return ""
    if path.suffix.lower() == ".exr":
        write_exr(path, texture)
        if not image.colorspace_settings.is_data:
            image.colorspace_settings.name = scene_linear()  # which it now is, whatever it was
    else:
        _write_like(image, stored, path)
    icons.reload(image)
    undo.stamp(image)
    return str(path)


def _write_like(image, stored: np.ndarray, path: Path) -> None:
    """Write pixels to a file of the image's own format."""
    copy = image.copy()
    try:
        if copy.size[:] != image.size[:]:
            copy.scale(*image.size)  # as the image was since it was loaded
        set_pixels(copy, stored)
        save_image(copy, path)
    finally:
        bpy.data.images.remove(copy)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values with the sRGB transfer function (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)


def linear_pixels(image) -> np.ndarray:
    """What an image shows, linear RGB (height, width, 3)."""
    stored = pixels_of(image)
    return from_srgb(stored) if _is_encoded(image) else stored


def clips(image) -> bool:
    """Whether an image, or its file, holds no values above 1."""
    path = file_of(image)
    return not image.is_float or (path is not None and path.suffix.lower() not in WITH_RANGE)


def _is_encoded(image) -> bool:
    return not image.is_float and not image.colorspace_settings.is_data


def from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Linear values from those of `to_srgb`."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)
