"""Images and their files: pixels, encoding, and writing files completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from ...core.disk import is_half, text_of, whole_files
from ...core.display import EXPOSURE, hdr, png, to_srgb
from ...core.errors import ImageError
from ...core.native import native
from .. import compat
from ..read.image_nodes import from_srgb
from . import icons, undo
from .facts import facts_of, file_of
from .udim import check_tiles, files_of, is_tiled

EXTENSIONS = {"EXR": ".exr", "PNG": ".png", "EXR_HALF": ".exr", "PNG16": ".png", "HDR": ".hdr"}
"""Extensions of the formats that bakes are written in; the first with an extension is that of files in general."""

EXTENSIONS_WITH_RANGE = {".exr", ".hdr"}
"""Extensions of the formats that hold values above 1."""

MADE_FOR = "beamspread:madeFor"
"""EXR attribute that names the .blend file and the image that the file belongs to."""


def check_image(image) -> None:
    """Raise ImageError with one sentence if a bake could not be stored in the image."""
    name = f"The image '{image.name}'"
    if image.source == "SEQUENCE" and facts_of(image).frames:
        where = "Render > Beamspread > Animation"
        raise ImageError(f"{name} holds frames.", f"Use Bake Animation, or Show Single Images first ({where}).")
    if image.source not in {"FILE", "GENERATED", "TILED"}:
        raise ImageError(f"{name} is a sequence, movie or viewer.", "Choose a single image in the node.")
    if image.library is not None:
        raise ImageError(f"{name} belongs to another .blend file.", "Make it local, or choose another in the node.")
    if is_tiled(image):
        check_tiles(image)
        paths = files_of(image)
        protected = [file for file in (*paths, *(path.parent for path in paths[:1])) if file.exists()]
        protected = [file for file in protected if is_read_only(file)]
        if protected:
            text = f"{name} cannot be saved because {protected[0]} is read-only."
            raise ImageError(text, "Allow writing, or choose another.")
        return
    path = file_of(image)
    if path is not None:
        if not path.is_file():
            raise ImageError(f"{name} has lost its file {path}.", "Restore it, or clear the image in the node.")
        if is_read_only(path) or is_read_only(path.parent):
            raise ImageError(
                f"{name} cannot be saved because {path} is read-only.", "Allow writing, or choose another."
            )
    if 0 in image.size:
        raise ImageError(f"{name} has no pixels: its file may be damaged.", "Choose another image in the node.")


def fill_image(image, texture: np.ndarray) -> str:
    """Put linear RGB (height, width, 3) into an image and save it; the path of its file, "" if it is packed.

    Raises
    ------
    ImageError
        The image can't be saved. It keeps its pixels.
    """
    check_image(image)
    if tuple(image.size) != texture.shape[1::-1]:
        raise ImageError(f"The image '{image.name}' changed its size during the bake.", "Bake it again.")
    path = file_of(image)
    encoded = to_srgb(texture) if _is_encoded(image) else texture
    if path is None:
        set_pixels(image, encoded)
        image.pack()
        undo.stamp(image)
        return ""
    if path.suffix.lower() == ".exr":
        write_exr(path, texture)
        if not image.colorspace_settings.is_data:
            image.colorspace_settings.name = scene_linear()  # the new file is linear
    else:
        _write_like(image, encoded, path)
    icons.reload(image)
    undo.stamp(image)
    return str(path)


def make_image(name: str, width: int, height: int, is_data: bool = False):
    """Make a float image; Blender gives it the scene-linear color space unless `is_data`."""
    return bpy.data.images.new(name, width, height, alpha=False, float_buffer=True, is_data=is_data)


def scene_linear() -> str:
    """Name of the color space of linear values, which differs between versions and configurations."""
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


def linear_pixels(image) -> np.ndarray:
    """Pixels of an image as linear RGB (height, width, 3)."""
    encoded = pixels_of(image)
    return from_srgb(encoded) if _is_encoded(image) else encoded


def clips(image) -> bool:
    """True if the image or its file holds no values above 1."""
    path = file_of(image)
    return not image.is_float or (path is not None and path.suffix.lower() not in EXTENSIONS_WITH_RANGE)


def is_read_only(path: Path) -> bool:
    """True if a file or folder is write-protected, although an administrator could write to it."""
    return not os.access(path, os.W_OK) or not path.stat().st_mode & 0o222


def check_writable(paths: Iterable[Path]) -> None:
    """Make the folder of files; raises ImageError if they can't be written."""
    for path in paths:
        make_folder(path.parent)
        protected = next((part for part in (path, path.parent) if part.exists() and is_read_only(part)), None)
        if protected is not None:
            raise ImageError(
                f"The output cannot be written because {protected} is read-only.",
                "Allow writing, or choose another folder.",
            )


def write_file(
    path: Path,
    texture: np.ndarray,
    file_format: str,
    attributes: dict[str, str] | None = None,
    view_of=None,
    exposure: float = 1.0,
) -> None:
    """Write linear RGB (height, width, 3), row 0 at the bottom, times the exposure, in a format of `EXTENSIONS`.

    `attributes` are those of an EXR file, which has the exposure, too. `view_of` is the scene whose view transform a
    PNG gets, None for plain sRGB.
    """
    check_writable([path])
    if file_format in ("EXR", "EXR_HALF"):
        noted = {} if exposure == 1 else {EXPOSURE: repr(exposure)}
        scaled = texture if exposure == 1 else texture * np.float32(exposure)
        write_exr(path, scaled, noted | (attributes or {}), half=True if file_format == "EXR_HALF" else None)
    elif file_format == "HDR":
        write_hdr(path, texture, exposure)
    else:
        write_png(path, texture, view_of, bits=16 if file_format == "PNG16" else 8, exposure=exposure)


def make_folder(folder: Path) -> None:
    """Make a folder if it does not exist; raises ImageError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ImageError(f"The output folder {folder} cannot be made: {error.strerror}.") from error


def write_exr(
    path: Path,
    texture: np.ndarray,
    attributes: dict[str, str] | None = None,
    like: Path | None = None,
    half: bool | None = None,
) -> None:
    """Write linear RGB without compression, as Blender does.

    The file keeps its `MADE_FOR` attribute. It has 16 bits if `half` is true, or None and the file `like`, by default
    the old file, has 16 bits; in either case only if the values fit.
    """
    with _whole_images([path]) as (temporary,):
        _write_exr(temporary, texture, attributes, path, is_half(like or path) if half is None else half)


def write_exrs(textures: Mapping[Path, np.ndarray], attributes: dict[str, str] | None = None) -> None:
    """`write_exr` for several files. No file is replaced before all are written."""
    with _whole_images(textures) as temporaries:
        for temporary, (path, texture) in zip(temporaries, textures.items()):
            _write_exr(temporary, texture, attributes, path, is_half(path))


def _write_exr(temporary: Path, texture: np.ndarray, attributes: dict[str, str] | None, path: Path, half: bool) -> None:
    texture = np.ascontiguousarray(texture, np.float32)
    half = half and fits_half(texture)
    owner = {MADE_FOR: made_for(path)} if made_for(path) else {}
    native.write_exr(
        str(temporary), texture, ["R", "G", "B"], owner | (attributes or {}), compression="none", half=bool(half)
    )


def fits_half(texture: np.ndarray) -> bool:
    """True if 16-bit floats hold the largest value."""
    return bool(np.abs(texture).max() <= np.finfo(np.float16).max)


def made_for(path: Path) -> str:
    """Text of a file's `MADE_FOR` attribute; "" if it has none."""
    return text_of(path, MADE_FOR)


def write_png(path: Path, texture: np.ndarray, view_of=None, bits: int = 8, exposure: float = 1.0) -> None:
    """Write a PNG: sRGB, or as the scene `view_of` would render it, which Blender computes."""
    height, width = texture.shape[:2]
    if view_of is None:
        with _whole_image(path) as temporary:
            temporary.write_bytes(png(texture, bits, exposure))
            _check_written(temporary, (width, height))
        return
    image = make_image("Beamspread PNG", width, height)
    try:
        set_pixels(image, texture * np.float32(exposure))
        image.file_format = "PNG"
        with _whole_image(path) as temporary, compat.saving_png(view_of, bits):
            image.save_render(str(temporary), scene=view_of)
            _check_written(temporary, (width, height))
    finally:
        bpy.data.images.remove(image)


def write_hdr(path: Path, texture: np.ndarray, exposure: float = 1.0) -> None:
    """Write a Radiance file for engines; its header has the exposure, which readers may take as the format defines it.

    Files for Blender itself are written by Blender, which reads numbers half a digit higher than engines.
    """
    with _whole_image(path) as temporary:
        temporary.write_bytes(hdr(texture, exposure))
        _check_written(temporary, texture.shape[1::-1])


def save_image(image, path: Path) -> None:
    """Write an image of our own making to a file of its format; the image's path changes."""
    with _whole_image(path) as temporary:
        size = tuple(image.size)
        image.filepath_raw = str(temporary)
        image.save()
        _check_written(temporary, size)


def size_of(path: Path) -> tuple[int, int] | None:
    """Width and height of an image file; None if the file is missing or damaged."""
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


def write_like(path: Path, texture: np.ndarray, like) -> None:
    """Replace the linear RGB (height, width, 3) of a file in its format, with the color space of the image `like`."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.name = like.colorspace_settings.name
        _write_like(image, to_srgb(texture) if _is_encoded(image) else texture, path)
    finally:
        bpy.data.images.remove(image)


def _write_like(image, encoded: np.ndarray, path: Path) -> None:
    """Write pixels to a file of the image's own format."""
    copy = image.copy()
    try:
        if copy.size[:] != image.size[:]:
            copy.scale(*image.size)  # the image was scaled after it was loaded
        set_pixels(copy, encoded)
        save_image(copy, path)
    finally:
        bpy.data.images.remove(copy)


def _is_encoded(image) -> bool:
    """True if the image's pixels are sRGB-encoded."""
    return not image.is_float and not image.colorspace_settings.is_data


def _check_written(path: Path, size: tuple[int, int]) -> None:
    """Raise OSError if the file can't be loaded: Blender does not report all errors of writing."""
    if size_of(path) != size:
        raise OSError("not all of it could be written, as on a full disk")


@contextmanager
def _whole_image(path: Path) -> Iterator[Path]:
    """Like `whole_file`, but an ImageError names the file that can't be written."""
    with _whole_images([path]) as (temporary,):
        yield temporary


@contextmanager
def _whole_images(paths: Collection[Path]) -> Iterator[list[Path]]:
    """Like `whole_files`, but an ImageError names the files that can't be written."""
    names = ", ".join(map(str, paths))
    try:
        with whole_files(paths) as temporaries:
            yield temporaries
    except (OSError, RuntimeError) as error:
        files, stay = ("files", "stay as they were") if len(paths) > 1 else ("file", "stays as it was")
        raise ImageError(f"The {files} {names} cannot be written and {stay}: {_reason(error)}.") from error


def _reason(error: Exception) -> str:
    """First line of an error's text, without the name of the temporary file."""
    first = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return getattr(error, "strerror", None) or first.removeprefix("Error: ").rpartition("': ")[2]
