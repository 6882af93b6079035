"""Files of a batch: in its folder, else the file of the node's image, else in the scene's folder."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...core.bake.bake_settings import COMBINED, DIRECTION
from ...core.bake.layers import LAYERS
from ...core.bake.runner import Bake
from ...core.batch.batch_options import BatchOptions
from ...core.disk import file_stems
from ...core.errors import ImageError
from ...core.scene.tiles import Tiling
from ...core.target import Target
from ..node.find import find_targets, image_of
from ..read.visibility import with_instanced
from . import files, tiled
from .results import Results
from .udim import is_tiled, tile_sizes, tiles_path


class Outputs:
    """The files of a run. Their names depend on the scene, not on the objects that are baked."""

    def __init__(self, scene, options: BatchOptions) -> None:
        self._options, self._settings, self._results = options, scene.beamspread, Results()
        self._view_of = scene if scene.beamspread.use_view_transform else None
        targets = find_targets(with_instanced(scene.objects))
        self._stems = file_stems(_names(target, layer) for target in targets for layer in LAYERS)

    def write(self, bake: Bake, frame: int, attributes: dict[str, str]) -> str:
        """Write the result of a bake; EXR files of frames get the attributes. The path of the file."""
        layer, texture = bake.job.settings.layer, bake.texture
        image, tiling = self.own_image(bake.target, layer), bake.job.receiver.tiling
        if image is not None and _has_size(image, texture.shape[1::-1], tiling):
            filled = self._results.fill_shown(image, bake, texture)
            if filled is not None:
                return filled
            text = f"The image '{image.name}' belongs to another object: '{bake.target}' has a file of its own."
            bake.warn(image.name, text)
        path = self.path(bake.target, layer, frame)
        frame_attributes = attributes if self._options.frames else None
        if tiling is None:
            files.write_file(path, texture, _format_of(path), frame_attributes, view_of=self._view_of)
        else:
            path = tiles_path(path)
            tiled.write_tiles(path, texture, tiling, frame_attributes, self._view_of)
        if path.suffix == files.EXTENSIONS["PNG"] and texture.max() > 1 and self._view_of is None:
            bake.warn(path.name, f"'{path.name}' clips values above 1.", "EXR keeps them.")
        return str(path)

    def path(self, target: Target, layer: str, frame: int) -> Path:
        """Path of a layer's file in the folder of outputs; raises ImageError if it can't have one."""
        options = self._options
        file_format, folder = options.format or self._settings.format, options.output or self._settings.output_dir
        if folder.startswith("//") and not bpy.data.filepath:
            raise ImageError("The scene was never saved, so there is no folder to write to.", "Give one with --output.")
        if layer == DIRECTION and file_format == "PNG":
            raise ImageError("A PNG can't hold directions, which have negative parts.", "Choose EXR.")
        number = f"_{frame:04d}" if options.frames else ""
        name = f"{self._stems[_names(target, layer)]}{number}{files.EXTENSIONS[file_format]}"
        return Path(bpy.path.abspath(folder)).absolute() / name

    def own_image(self, target: Target, layer: str):
        """The node's image, if a single frame's layer can be written to its file; else None."""
        options = self._options
        if options.output is not None or options.frames is not None or layer != COMBINED:
            return None
        image = image_of(target)
        path = None if image is None or image.source not in ("FILE", "TILED") else files.file_of(image)
        if path is None or options.format not in (None, _format_of(path)):
            return None
        return image


def _has_size(image, size: tuple[int, int], tiling: Tiling | None) -> bool:
    """True if an image has the size of a texture, or its tiles have those of the texture's tiles."""
    if tiling is None or not is_tiled(image):
        return tiling is None and not is_tiled(image) and tuple(image.size) == size
    return tile_sizes(image).items() >= tiling.sizes.items()


def _names(target: Target, layer: str) -> tuple[str, ...]:
    return target.object_name, target.material_name, *([] if layer == COMBINED else [layer])


def _format_of(path: Path) -> str | None:
    return next((name for name, ending in files.EXTENSIONS.items() if path.suffix.lower() == ending), None)
