"""Images that bakes make: float, in a file beside the scene, or packed into it."""

from __future__ import annotations

import itertools
import os
import shutil
from pathlib import Path

import bpy
import numpy as np

from ...core.bake.runner import Bake
from ...core.batch.names import stem
from ...core.errors import ImageError
from ...core.messages import Message, warning
from ...core.target import Target
from ...core.whole_file import whole_file
from . import files, icons, undo


def name_for(target: Target) -> str:
    """What the scene's settings call an image made for the target."""
    pattern = bpy.context.scene.beamspread.image_name or "{object}_{material}"
    return pattern.replace("{object}", target.object_name).replace("{material}", target.material_name)


def keep_new(name: str, texture: np.ndarray, bake: Bake, is_data: bool = False) -> tuple[str, bpy.types.Image]:
    """A new image of linear RGB (height, width, 3), kept as the scene's settings say; its file's path, "" if packed.

    Where the file can't be written, the image is packed and the bake is warned.
    """
    if uses_files():
        try:
            return _in_file(name, texture, is_data)
        except ImageError as error:
            bake.warn(name, f"{error} The new image is packed into the .blend file instead.")
    image = files.make_image(name, *texture.shape[1::-1], is_data=is_data)
    return files.fill_image(image, texture), image


def uses_files() -> bool:
    """Whether new images go to files: the folder may lie beside a scene that was never saved, and so be nowhere."""
    settings = bpy.context.scene.beamspread
    return settings.image_storage == "FILES" and bool(bpy.data.filepath or not settings.image_dir.startswith("//"))


def _in_file(name: str, texture: np.ndarray, is_data: bool) -> tuple[str, bpy.types.Image]:
    path, made_for = _place(name)
    files.write_file(path, texture, "EXR", {files.MADE_FOR: made_for})
    for unused in [one for one in bpy.data.images if files.file_of(one) == path]:
        icons.remove(unused)
    image = bpy.data.images.load(str(path))
    image.name = _free_name(name)
    image.colorspace_settings.is_data = is_data
    _point_to(image, path)
    undo.stamp(image)
    return str(path), image


def part_from_others(image) -> tuple[Message, ...]:
    """Give the image a file of its own where it shows that of another .blend file, as after Save As; a warning then.

    ImageError where that can't be written.
    """
    path = files.file_of(image)
    other = _scene_of(path) if path is not None and bpy.data.filepath else None
    if other is None or other == Path(bpy.data.filepath).resolve() or not other.exists():
        return ()  # renamed or moved, else
    own, made_for = _place(image.name)
    try:
        own.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(own) as temporary:
            shutil.copyfile(path, temporary)
    except OSError as error:
        raise ImageError(f"The file {own} cannot be written: {error.strerror}.") from error
    size = tuple(image.size)
    _point_to(image, own)
    files.write_exr(own, files.linear_pixels(image), {files.MADE_FOR: made_for})
    icons.reload(image)
    if tuple(image.size) != size:
        icons.scale(image, *size)
    text = f"'{path.name}' belongs to '{other.name}': the image '{image.name}' now has the file '{own.name}'."
    return (warning(image.name, text),)


def _scene_of(path: Path) -> Path | None:
    """The .blend file for which a file was made, from where it lies."""
    scene, separator, _name = files.made_for(path).partition(": ")
    return (path.parent / scene).resolve() if separator else None


def _place(name: str) -> tuple[Path, str]:
    """A file for a new image in the scene's folder, and what it is to say of itself."""
    folder = Path(bpy.path.abspath(bpy.context.scene.beamspread.image_dir)).absolute()
    scene = bpy.data.filepath
    if scene:
        try:
            scene = Path(os.path.relpath(scene, folder)).as_posix()
        except ValueError:  # on another drive
            scene = Path(scene).as_posix()
    made_for = f"{scene}: {name}"
    return _free_path(folder, stem([name]), made_for), made_for


def _point_to(image, path: Path) -> None:
    image.filepath = bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)


def _free_path(folder: Path, plain: str, made_for: str) -> Path:
    """A file that neither an image of this scene nor anything else has; one made before for the same is free.

    So is that of an image that nothing shows any more, as when a node's image was cleared.
    """
    taken = {files.file_of(image) for image in bpy.data.images if image.users or image.is_dirty}
    stems = itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2)))
    paths = (folder / f"{one}.exr" for one in stems)
    free = (path for path in paths if path not in taken)
    return next(path for path in free if not path.exists() or files.made_for(path) == made_for)


def _free_name(name: str) -> str:
    """As Blender names new images; where one is renamed to what another is called, 3.4 renames the other."""
    numbered = (f"{name}.{number:03d}" for number in itertools.count(1))
    return next(one for one in itertools.chain([name], numbered) if one not in bpy.data.images)
