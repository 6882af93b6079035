"""Writes image files, whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import ImageError
from ...core.exr_header import is_half, text_of
from ...core.native import native
from ...core.whole_file import whole_file
from .. import compat

EXTENSIONS = {"EXR": ".exr", "PNG": ".png"}

# What a file of ours says of itself, so that another scene's file of the same name is not taken for it.
MADE_FOR = "beamspread:madeFor"

# How whole files end: Blender shows a JPEG that breaks off, and a PNG without its last bytes, as if they were whole.
ENDS = {"PNG": b"IEND\xae\x42\x60\x82", "JPEG": b"\xff\xd9"}

# Formats whose damage shows in their pixels alone. What they round is less than this.
WITHOUT_LOSS = {"BMP", "HDR", "IRIS", "TARGA", "TARGA_RAW", "TIFF"}
ROUNDING = 0.02


def is_read_only(path: Path) -> bool:
    """Whether a file or folder is write-protected, also for an administrator, whom the system lets write anyway."""
    return not os.access(path, os.W_OK) or not path.stat().st_mode & 0o222


def make_image(name: str, width: int, height: int, is_data: bool = False):
    """A new float image, of plain numbers or in the colour space that Blender gives it: scene-linear."""
    return bpy.data.images.new(name, width, height, alpha=False, float_buffer=True, is_data=is_data)


def scene_linear() -> str:
    """Name of the colour space of linear values, which differs between versions and configurations."""
    image = make_image("Beamspread", 1, 1)
    try:
        return image.colorspace_settings.name
    finally:
        bpy.data.images.remove(image)


def set_pixels(image, texture: np.ndarray) -> None:
    """Replace all pixels; `texture` float (height, width, 3), row 0 at the bottom, in the image's own encoding."""
    pixels = np.ones(texture.shape[:2] + (4,), np.float32)
    pixels[..., :3] = texture
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def pixels_of(image) -> np.ndarray:
    """Float32 (height, width, 3), row 0 at the bottom, in the image's own encoding."""
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[..., :3]


def write_file(
    path: Path, texture: np.ndarray, file_format: str, attributes: dict[str, str] | None = None, view_of=None
) -> None:
    """Write linear RGB (height, width, 3), row 0 at the bottom, as EXR, which may have attributes, or PNG.

    `view_of` is the scene whose view transform a PNG gets, None for plain sRGB.
    """
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ImageError(f"The output folder {folder} cannot be made: {error.strerror}.") from error
    protected = next((part for part in (path, folder) if part.exists() and is_read_only(part)), None)
    if protected is not None:
        raise ImageError(f"The output cannot be written because {protected} is read-only.")
    if file_format == "EXR":
        write_exr(path, texture, attributes)
    else:
        write_png(path, texture, view_of)


def write_exr(path: Path, texture: np.ndarray, attributes: dict[str, str] | None = None) -> None:
    """Linear RGB, not packed, as Blender saves float images by itself: 32 bits, or 16 where the file has had these.

    For whom the file was made stays.
    """
    said = {MADE_FOR: made_for(path)} if made_for(path) else {}
    texture = np.ascontiguousarray(texture, np.float32)
    half = is_half(path) and np.abs(texture).max() <= np.finfo(np.float16).max
    kept = texture.astype(np.float16) if half else texture
    with _kept(path) as temporary:
        native.write_exr(
            str(temporary), texture, ["R", "G", "B"], said | (attributes or {}), compression="none", half=bool(half)
        )
        if not np.array_equal(native.read_exr(str(temporary))[0], kept):
            raise OSError("it can't be read back")


def made_for(path: Path) -> str:
    """What a file says of itself, as far as it does."""
    return text_of(path, MADE_FOR)


def write_png(path: Path, texture: np.ndarray, view_of=None) -> None:
    """PNG for looking at; from a float image, Blender itself converts to the colour space of its byte images."""
    height, width = texture.shape[:2]
    image = make_image("Beamspread PNG", width, height)
    try:
        set_pixels(image, texture)
        image.file_format = "PNG"
        if view_of is None:
            save_image(image, path)
            return
        with _kept(path) as temporary, compat.saving_png(view_of):
            image.save_render(str(temporary), scene=view_of)
            _check_whole(temporary, "PNG", texture, image.colorspace_settings.name)
    finally:
        bpy.data.images.remove(image)


def save_image(image, path: Path) -> None:
    """Write an image of our own making to a file of its format; the image's path changes."""
    file_format, expected, colorspace = image.file_format, pixels_of(image), image.colorspace_settings.name
    with _kept(path) as temporary:
        image.filepath_raw = str(temporary)
        image.save()  # which may load it anew
        _check_whole(temporary, file_format, expected, colorspace)


def size_of(path: Path) -> tuple[int, int] | None:
    """Width and height of an image file; None where there is none that is whole."""
    if not path.is_file():
        return None
    if path.suffix.lower() == EXTENSIONS["EXR"]:
        try:
            height, width = native.read_exr(str(path))[0].shape[:2]
        except OSError:
            return None
        return width, height
    image = bpy.data.images.load(str(path))
    try:
        return None if 0 in image.size else tuple(image.size)
    finally:
        bpy.data.images.remove(image)


@contextmanager
def _kept(path: Path) -> Iterator[Path]:
    """Where to write what will have `path`; ImageError, naming it, where that fails."""
    try:
        with whole_file(path) as temporary:
            yield temporary
    except (OSError, RuntimeError) as error:
        raise ImageError(f"The file {path} cannot be written and stays as it was: {_reason(error)}.") from error


def _reason(error: Exception) -> str:
    """What went wrong, without the name of a file that is gone by then."""
    first = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return getattr(error, "strerror", None) or first.removeprefix("Error: ").rpartition("': ")[2]


def _check_whole(path: Path, file_format: str, expected: np.ndarray, colorspace: str) -> None:
    """Raise OSError unless the file shows the pixels: Blender does not look whether what it writes arrives."""
    end = ENDS.get(file_format, b"")
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(end)))
        is_whole = file.read() == end if end else True
    written = bpy.data.images.load(str(path))
    try:
        written.colorspace_settings.name = colorspace
        is_whole = is_whole and tuple(written.size) == expected.shape[1::-1]
        if is_whole and file_format in WITHOUT_LOSS:
            is_whole = np.allclose(np.clip(pixels_of(written), 0, 1), np.clip(expected, 0, 1), rtol=0, atol=ROUNDING)
    finally:
        bpy.data.images.remove(written)
    if not is_whole:
        raise OSError("not all of it arrived, as on a full disk")
