"""Images of the scene, and image files."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import ImageError
from ...core.native import native

EXTENSIONS = {"EXR": ".exr", "PNG": ".png"}


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


def is_read_only(path: Path) -> bool:
    """Whether a file or folder is write-protected, also for an administrator, whom the system lets write anyway."""
    return not os.access(path, os.W_OK) or not path.stat().st_mode & 0o222


def make_image(name: str, width: int, height: int, is_data: bool = False):
    """A new float image, of plain numbers or in the colour space that Blender gives it: scene-linear."""
    return bpy.data.images.new(name, width, height, alpha=False, float_buffer=True, is_data=is_data)


def fill_image(image, texture: np.ndarray) -> str:
    """Put linear RGB (height, width, 3) into an image and keep it; the path of its file, "" where it is packed.

    Where the file can't be written (ImageError), the old pixels remain.
    """
    check_image(image)
    if tuple(image.size) != texture.shape[1::-1]:
        raise ImageError(f"The image '{image.name}' changed its size during the bake: bake it again.")
    path = file_of(image)
    if path is not None and path.suffix.lower() == ".exr":
        write_exr(path, texture)
        image.reload()
        return str(path)
    encode = not image.is_float and not image.colorspace_settings.is_data
    set_pixels(image, to_srgb(texture) if encode else texture)
    if path is None:
        image.pack()
        return ""
    try:
        image.save()
    except RuntimeError as error:
        image.reload()
        raise ImageError(f"The image '{image.name}' cannot be saved to {path}: {error}") from error
    return str(path)


def set_pixels(image, texture: np.ndarray) -> None:
    """Replace all pixels; `texture` float (height, width, 3), row 0 at the bottom, in the image's own encoding."""
    pixels = np.ones(texture.shape[:2] + (4,), np.float32)
    pixels[..., :3] = texture
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def write_file(path: Path, texture: np.ndarray, file_format: str) -> None:
    """Write linear RGB (height, width, 3), row 0 at the bottom, as EXR or PNG."""
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ImageError(f"The output folder {folder} cannot be made: {error.strerror}.") from error
    protected = next((part for part in (path, folder) if part.exists() and is_read_only(part)), None)
    if protected is not None:
        raise ImageError(f"The output cannot be written because {protected} is read-only.")
    if file_format == "EXR":
        write_exr(path, texture)
    else:
        write_png(path, texture)


def write_exr(path: Path, texture: np.ndarray) -> None:
    """Linear 32-bit float RGB, not packed, as Blender saves float images by itself."""
    try:
        native.write_exr(str(path), np.ascontiguousarray(texture, np.float32), ["R", "G", "B"], compression="none")
    except OSError as error:
        raise ImageError(f"The file {path} cannot be written: {error}") from error


def write_png(path: Path, texture: np.ndarray) -> None:
    """PNG for looking at; from a float image, Blender itself converts to the colour space of its byte images."""
    height, width = texture.shape[:2]
    image = make_image("Beamspread PNG", width, height)
    try:
        set_pixels(image, texture)
        image.file_format = "PNG"
        image.filepath_raw = str(path)
        image.save()
    except RuntimeError as error:
        raise ImageError(f"The file {path} cannot be written: {error}") from error
    finally:
        bpy.data.images.remove(image)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values with the sRGB transfer function (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)
