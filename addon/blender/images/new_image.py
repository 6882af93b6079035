"""New images for bakes: float, in a file beside the scene or packed into it."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import bpy
import numpy as np

from ...core.bake.runner import Bake
from ...core.disk import stem
from ...core.errors import ImageError
from ...core.messages import Message, warning
from ...core.target import BACK, Target
from . import files, icons, undo


def name_for(target: Target) -> str:
    """Name of a new image for the target, by the scene's settings."""
    pattern = bpy.context.scene.beamspread.image_name or "{object}_{material}"
    name = pattern.replace("{object}", target.object_name).replace("{material}", target.material_name)
    return f"{name}_back" if target.side == BACK else name


def store_new(name: str, texture: np.ndarray, bake: Bake, is_data: bool = False) -> tuple[str, bpy.types.Image]:
    """Store linear RGB (height, width, 3) in a new image; the path of its file, "" if it is packed, and the image.

    If the file can't be written, the image is packed and the bake gets a warning.
    """
    if uses_files():
        try:
            return _in_file(name, texture, is_data)
        except ImageError as error:
            bake.warn(name, f"{error.text} The new image is packed into the .blend file instead.", error.remedy)
    image = files.make_image(name, *texture.shape[1::-1], is_data=is_data)
    return files.fill_image(image, texture), image


def uses_files() -> bool:
    """True if new images go to files. A folder beside a scene that was never saved does not exist."""
    return bpy.context.scene.beamspread.image_storage == "FILES" and has_folder()


def has_folder() -> bool:
    """True if there is a folder for files of new images."""
    return bool(bpy.data.filepath or not bpy.context.scene.beamspread.image_dir.startswith("//"))


def _in_file(name: str, texture: np.ndarray, is_data: bool) -> tuple[str, bpy.types.Image]:
    path, made_for = _new_file(name)
    files.write_file(path, texture, "EXR", {files.MADE_FOR: made_for})
    for unused in [image for image in bpy.data.images if files.file_of(image) == path]:
        icons.remove(unused)
    image = bpy.data.images.load(str(path))
    image.name = free_name(name)
    image.colorspace_settings.is_data = is_data
    point_to(image, path)
    undo.stamp(image)
    return str(path), image


def separate_from_other_scene(image) -> tuple[Message, ...]:
    """Give the image its own file if its file belongs to another .blend file, as after Save As; a warning then.

    Raises
    ------
    ImageError
        The file can't be written.
    """
    path = files.file_of(image)
    owner = None if path is None else other_owner(path)
    if owner is None:
        return ()
    new_path, made_for = _new_file(image.name)
    files.make_folder(new_path.parent)
    files.write_exr(new_path, files.linear_pixels(image), {files.MADE_FOR: made_for}, like=path)
    point_to(image, new_path)
    icons.reload(image)
    text = f"'{path.name}' belongs to '{owner.name}': the image '{image.name}' now has the file '{new_path.name}'."
    return (warning(image.name, text),)


def other_owner(path: Path) -> Path | None:
    """The other .blend file that the image file belongs to; None if it belongs to this one, or to none."""
    scene, separator, _name = files.made_for(path).partition(": ")
    owner = (path.parent / scene).resolve() if separator and bpy.data.filepath else None
    # A missing owner was renamed or moved: it is this scene.
    return None if owner is None or owner == Path(bpy.data.filepath).resolve() or not owner.exists() else owner


def _new_file(name: str) -> tuple[Path, str]:
    """Path of a file for a new image in the scene's folder, and the file's `MADE_FOR` attribute."""
    folder, made_for = made_for_scene(name)
    return _free_path(folder, stem([name]), made_for), made_for


def made_for_scene(name: str) -> tuple[Path, str]:
    """Folder of the files of new images, and the `MADE_FOR` attribute of such a file."""
    folder = Path(bpy.path.abspath(bpy.context.scene.beamspread.image_dir)).absolute()
    scene = bpy.data.filepath
    if scene:
        try:
            scene = Path(os.path.relpath(scene, folder)).as_posix()
        except ValueError:  # the folder is on another drive
            scene = Path(scene).as_posix()
    return folder, f"{scene}: {name}"


def point_to(image, path: Path) -> None:
    """Set the path of an image's file, relative to the .blend file if there is one."""
    image.filepath = bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)


def _free_path(folder: Path, plain: str, made_for: str) -> Path:
    """First path that is neither in use by an image nor the path of another scene's or program's file.

    A file with the same `made_for` is free, and so is the file of an unused image, as of a node that was cleared.
    """
    taken = {files.file_of(image) for image in bpy.data.images if image.users or image.is_dirty}
    stems = itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2)))
    paths = (folder / f"{name}.exr" for name in stems)
    free = (path for path in paths if path not in taken)
    return next(path for path in free if not path.exists() or files.made_for(path) == made_for)


def free_name(name: str) -> str:
    """First free name, numbered as by Blender. If a name is taken, Blender 3.4 would rename the image that has it."""
    numbered = (f"{name}.{number:03d}" for number in itertools.count(1))
    return next(free for free in itertools.chain([name], numbered) if free not in bpy.data.images)
