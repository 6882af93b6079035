"""Images of the scene: what can be baked into, and filling them."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import ImageError
from .writing import is_read_only, save_image, set_pixels, write_exr


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
    encode = not image.is_float and not image.colorspace_settings.is_data
    stored = to_srgb(texture) if encode else texture
    if path is None:
        set_pixels(image, stored)
        image.pack()
        return ""
    if path.suffix.lower() == ".exr":
        write_exr(path, texture)
    else:
        _write_like(image, stored, path)
    image.reload()
    return str(path)


def _write_like(image, stored: np.ndarray, path: Path) -> None:
    """Write pixels to a file of the image's own format."""
    copy = image.copy()
    try:
        set_pixels(copy, stored)
        save_image(copy, path)
    finally:
        bpy.data.images.remove(copy)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values with the sRGB transfer function (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)
