"""Pixels and files of UDIM tiles."""

from __future__ import annotations

import itertools
from pathlib import Path

import bpy
import numpy as np

from ...core.bake.runner import Bake
from ...core.disk import stem
from ...core.errors import ImageError
from ...core.messages import Message, warning
from ...core.scene.tiles import Tiling
from . import files, icons, undo
from .facts import file_of
from .new_image import free_name, has_folder, made_for_scene, other_owner, point_to
from .udim import TOKEN, file_of_tile, files_of, is_tiled, planned_sizes, tile_sizes


def check_sizes(image, tiling: Tiling) -> None:
    """Raise ImageError if tiles have other sizes than in the bake; tiles that are missing will be made."""
    sizes = tile_sizes(image)
    if any(sizes.get(number, size) != size for number, size in tiling.tiles):
        raise ImageError(f"The tiles of '{image.name}' changed their sizes during the bake.", "Bake it again.")


def linear_pixels(image, tiling: Tiling) -> np.ndarray:
    """Linear RGB of the tiles in their files, float32 (height, width, 3); 0 for tiles without a file."""
    path, tiles = file_of(image), {}
    for number, (width, height) in tiling.tiles:
        file = None if path is None else file_of_tile(path, number)
        if file is None or not file.is_file():
            tiles[number] = np.zeros((height, width, 3), np.float32)
            continue
        single = bpy.data.images.load(str(file))
        try:
            single.colorspace_settings.name = image.colorspace_settings.name
            tiles[number] = files.linear_pixels(single)
        finally:
            bpy.data.images.remove(single)
    return tiling.joined(tiles)


def fill(image, texture: np.ndarray, tiling: Tiling) -> str:
    """Put linear RGB (height, width, 3) into tiles and save them; the path of the files with the token.

    Raises
    ------
    ImageError
        The files can't be written. They and the image stay as they were.
    """
    if not is_tiled(image):
        raise ImageError(f"The image '{image.name}' has no UDIM tiles.", "Rename it: the bake makes another.")
    files.check_image(image)
    check_sizes(image, tiling)
    path = file_of(image)
    if path is None:
        path = _write_first(image, texture, tiling)
    else:
        write_tiles(path, texture, tiling, like=image)
    _show_files(image, path, tiling)
    if path.suffix.lower() == files.EXTENSIONS["EXR"] and not image.colorspace_settings.is_data:
        image.colorspace_settings.name = files.scene_linear()
    return str(path)


def _write_first(image, texture: np.ndarray, tiling: Tiling) -> Path:
    """Write files for an image that has none, also for its tiles that the texture lacks; their path with the token."""
    check_folder()
    folder, made_for = made_for_scene(image.name)
    path = _free_path(folder, stem([image.name]), made_for)
    rest = [(number, size) for number, size in planned_sizes(image).items() if number not in tiling.sizes]
    write_tiles(path, texture, tiling, {files.MADE_FOR: made_for})
    if rest:
        empty = Tiling(tuple(rest))
        texture = np.tile(np.float32(image.generated_color[:3]), (*empty.size[::-1], 1))
        write_tiles(path, texture, empty, {files.MADE_FOR: made_for})
    return path


def write_tiles(
    path: Path,
    texture: np.ndarray,
    tiling: Tiling,
    attributes: dict[str, str] | None = None,
    view_of=None,
    like=None,
    file_format: str = "",
    exposure: float = 1.0,
) -> None:
    """Write a file for each tile; EXR files are replaced once all are written.

    Parameters
    ----------
    path : with the token.
    attributes, view_of, exposure : as for `files.write_file`.
    file_format : of new files; "" for EXR or PNG, by the path.
    like : image whose format files have that are neither EXR nor new.
    """
    tiles = {file_of_tile(path, number): part for number, part in tiling.split(texture).items()}
    if path.suffix.lower() == files.EXTENSIONS["EXR"] and file_format in ("", "EXR") and exposure == 1:
        files.check_writable(tiles)
        files.write_exrs(tiles, attributes)
        return
    for file, part in tiles.items():
        if like is not None and file.is_file():
            files.write_like(file, part, like)
        else:
            files.write_file(file, part, file_format or "PNG", attributes, view_of, exposure)


def store_new(name: str, texture: np.ndarray, bake: Bake, is_data: bool = False) -> tuple[str, bpy.types.Image]:
    """Store linear RGB (height, width, 3) in a new tiled image; the path of its files with the token, and the image.

    Raises
    ------
    ImageError
        There is no folder for the files, or they can't be written.
    """
    check_folder()
    tiling, (folder, made_for) = bake.job.receiver.tiling, made_for_scene(name)
    path = _free_path(folder, stem([name]), made_for)
    write_tiles(path, texture, tiling, {files.MADE_FOR: made_for})
    for unused in [image for image in bpy.data.images if file_of(image) == path]:
        icons.remove(unused)
    first = tiling.tiles[0][0]
    image = bpy.data.images.load(str(file_of_tile(path, first)))
    image.name = free_name(name)
    image.source = "TILED"
    point_to(image, path)  # Blender has made it absolute
    image.colorspace_settings.is_data = is_data
    _show_files(image, path, tiling)
    return str(path), image


def separate_from_other_scene(image) -> tuple[Message, ...]:
    """Give tiles files of their own if they belong to another .blend file, as after Save As; a warning then.

    Raises
    ------
    ImageError
        The files can't be written.
    """
    owner = next(filter(None, (other_owner(file) for file in files_of(image) if file.is_file())), None)
    if owner is None:
        return ()
    former, (folder, made_for) = file_of(image), made_for_scene(image.name)
    tiling, path = Tiling(tuple(sorted(tile_sizes(image).items()))), _free_path(folder, stem([image.name]), made_for)
    write_tiles(path, linear_pixels(image, tiling), tiling, {files.MADE_FOR: made_for})
    _show_files(image, path, tiling)
    text = f"'{former.name}' belongs to '{owner.name}': the image '{image.name}' now has the files '{path.name}'."
    return (warning(image.name, text),)


def check_folder() -> None:
    """Raise ImageError if new tiles have no folder: Blender can't pack them into a .blend file that was never saved."""
    if not has_folder():
        raise ImageError(
            "UDIM tiles are files beside the .blend file, which was never saved.",
            "Save it first, or set another folder (New Images > Folder).",
        )


def _show_files(image, path: Path, tiling: Tiling) -> None:
    """Have the image show the files of all of its tiles and of these."""
    wanted = {tile.number for tile in image.tiles} | set(tiling.sizes)
    if file_of(image) != path:
        point_to(image, path)
    for number in sorted(wanted - {tile.number for tile in image.tiles}):
        image.tiles.new(tile_number=number)
    icons.reload(image)
    undo.stamp(image)


def _free_path(folder: Path, plain: str, made_for: str) -> Path:
    """First path whose tiles neither an image nor another scene or program uses, see `new_image`."""
    taken = {file_of(image) for image in bpy.data.images if image.users or image.is_dirty}
    for name in itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2))):
        path = folder / f"{name}.{TOKEN}.exr"
        there = folder.glob(f"{name}.[12][0-9][0-9][0-9].exr") if folder.is_dir() else ()
        if path not in taken and all(files.made_for(file) == made_for for file in there):
            return path
    raise AssertionError  # there are endless numbers
