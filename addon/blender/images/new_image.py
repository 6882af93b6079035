"""Images that bakes make: float, in a file beside the scene, or packed into it."""

from __future__ import annotations

import itertools
from pathlib import Path

import bpy
import numpy as np

from ...core.bake.runner import Bake, Target
from ...core.batch.names import stem
from ...core.errors import ImageError
from ...core.native import native
from . import files, undo, writing

# What a file of ours says of itself, so that another scene's file of the same name is not taken for it.
MADE_FOR = "beamspread:madeFor"


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
            bake.warnings.append(f"{error} The new image is packed into the .blend file instead.")
    image = writing.make_image(name, *texture.shape[1::-1], is_data=is_data)
    return files.fill_image(image, texture), image


def uses_files() -> bool:
    """Whether new images go to files: the folder may lie beside a scene that was never saved, and so be nowhere."""
    settings = bpy.context.scene.beamspread
    return settings.image_storage == "FILES" and bool(bpy.data.filepath or not settings.image_dir.startswith("//"))


def _in_file(name: str, texture: np.ndarray, is_data: bool) -> tuple[str, bpy.types.Image]:
    folder = Path(bpy.path.abspath(bpy.context.scene.beamspread.image_dir)).absolute()
    made_for = f"{Path(bpy.data.filepath).name}: {name}"
    path = _free_path(folder, stem([name]), made_for)
    writing.write_file(path, texture, "EXR", {MADE_FOR: made_for})
    image = bpy.data.images.load(str(path))
    image.name = _free_name(name)
    image.colorspace_settings.is_data = is_data
    if bpy.data.filepath:
        image.filepath = bpy.path.relpath(str(path))
    undo.stamp(image)
    return str(path), image


def _free_path(folder: Path, plain: str, made_for: str) -> Path:
    """A file that neither an image of this scene nor anything else has; one made before for the same is free."""
    taken = {files.file_of(image) for image in bpy.data.images}
    stems = itertools.chain([plain], (f"{plain}_{number}" for number in itertools.count(2)))
    paths = (folder / f"{one}.exr" for one in stems)
    return next(path for path in paths if path not in taken and (not path.exists() or _says(path) == made_for))


def _free_name(name: str) -> str:
    """As Blender names new images; where one is renamed to what another is called, 3.4 renames the other."""
    numbered = (f"{name}.{number:03d}" for number in itertools.count(1))
    return next(one for one in itertools.chain([name], numbered) if one not in bpy.data.images)


def _says(path: Path) -> str:
    """For what a file was made, as far as it says."""
    try:
        return native.read_exr(str(path))[2].get(MADE_FOR, "")
    except OSError:
        return ""
