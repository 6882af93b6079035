"""Files of a batch: in its folder, else the file of the node's image, else in the scene's folder."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.bake.bake_settings import COMBINED, DIRECTION
from ...core.bake.layers import LAYERS
from ...core.bake.runner import Bake
from ...core.batch.batch_options import BatchOptions
from ...core.disk import file_stems
from ...core.display import AUTO, auto_exposure
from ...core.errors import ImageError
from ...core.scene.tiles import Tiling
from ...core.target import Target
from ..node.find import find_targets, image_of
from ..node.plain import note_exposure
from ..read.visibility import with_instanced
from . import files, tiled
from .results import Results
from .udim import is_tiled, tile_sizes, tiles_path


class Outputs:
    """The files of a run. Their names depend on the scene, not on the objects that are baked."""

    def __init__(self, scene, options: BatchOptions, is_command: bool = False) -> None:
        """`is_command`: the options come from a command line, and messages name those that help."""
        self._options, self._settings, self._results = options, scene.beamspread, Results()
        self._is_command = is_command
        self._view_of = scene if scene.beamspread.use_view_transform else None
        targets = find_targets(with_instanced(scene.objects))
        self._exposures: dict[tuple[Target, str], float] = {}
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
        file_format, exposure = self._format(), self._exposure(bake, layer, frame)
        if tiling is None:
            files.write_file(path, texture, file_format, frame_attributes, self._view_of, exposure)
        else:
            path = tiles_path(path)
            tiled.write_tiles(path, texture, tiling, frame_attributes, self._view_of, None, file_format, exposure)
        bake.exposure = exposure
        note_exposure(bpy.data.materials.get(bake.target.material_name), exposure)
        self._warn_of_range(bake, path.name, float(texture.max()) * exposure)
        return str(path)

    def _format(self) -> str:
        return self._options.format or self._settings.format

    def _exposure(self, bake: Bake, layer: str, frame: int) -> float:
        """Factor for a bake's file. Frames of a target have that of the first one as long as their values fit."""
        wanted = self._options.exposure
        if wanted is None:
            wanted = AUTO if self._settings.use_exposure else 1.0
        # A view transform brings bright values below 1 by itself.
        fits_anyway = not _is_limited(self._format()) or self._view_of is not None
        if layer == DIRECTION or (wanted == AUTO and fits_anyway):
            return 1.0
        if wanted != AUTO:
            return wanted
        fits, key = auto_exposure(bake.texture), (bake.target, layer)
        former = self._exposures.get(key, fits)
        self._exposures[key] = min(fits, former)
        if fits < former:
            text = f"From frame {frame} on, files of '{bake.target}' have the exposure {fits:g} instead of {former:g}."
            remedy = f"--exposure {fits:g} gives one to all frames." if self._is_command else "EXR files need none."
            bake.warn(str(bake.target), text, remedy)
        return self._exposures[key]

    def _warn_of_range(self, bake: Bake, name: str, largest: float) -> None:
        """Warn if the format does not hold the largest value of a file."""
        file_format = self._format()
        if _is_limited(file_format) and largest > 1 and self._view_of is None:
            scaler = "--exposure auto" if self._is_command else "Fit Exposure"
            bake.warn(name, f"'{name}' clips values above 1.", f"EXR keeps them, and {scaler} scales them.")
        if file_format == "EXR_HALF" and largest > float(np.finfo(np.float16).max):
            bake.warn(name, f"'{name}' has 32 bits, because 16 bits hold no values above 65504.")

    def path(self, target: Target, layer: str, frame: int) -> Path:
        """Path of a layer's file in the folder of outputs; raises ImageError if it can't have one."""
        options = self._options
        file_format, folder = self._format(), options.output or self._settings.output_dir
        if folder.startswith("//") and not bpy.data.filepath:
            raise ImageError(
                "The scene was never saved, so there is no folder to write to.",
                f"Save it, or {'give another folder by --output' if self._is_command else 'choose another folder'}.",
            )
        if layer == DIRECTION and not file_format.startswith("EXR"):
            name = "An HDR file" if file_format == "HDR" else "A PNG"
            raise ImageError(f"{name} can't hold directions, which have negative parts.", "Choose EXR.")
        number = f"_{frame:04d}" if options.frames else ""
        name = f"{self._stems[_names(target, layer)]}{number}{files.EXTENSIONS[file_format]}"
        return Path(bpy.path.abspath(folder)).absolute() / name

    def own_image(self, target: Target, layer: str):
        """The node's image, if a single frame's layer can be written to its file; else None."""
        options = self._options
        if options.output is not None or options.frames is not None or layer != COMBINED:
            return None
        if options.exposure is not None:
            return None  # the node's image holds radiance
        image = image_of(target)
        path = None if image is None or image.source not in ("FILE", "TILED") else files.file_of(image)
        if path is None or options.format not in (None, *_formats_of(path)):
            return None
        return image


def _has_size(image, size: tuple[int, int], tiling: Tiling | None) -> bool:
    """True if an image has the size of a texture, or its tiles have those of the texture's tiles."""
    if tiling is None or not is_tiled(image):
        return tiling is None and not is_tiled(image) and tuple(image.size) == size
    return tile_sizes(image).items() >= tiling.sizes.items()


def _names(target: Target, layer: str) -> tuple[str, ...]:
    return *target.names, *([] if layer == COMBINED else [layer])


def _is_limited(file_format: str) -> bool:
    """True if a format holds no values above 1."""
    return file_format.startswith("PNG")


def _formats_of(path: Path) -> list[str]:
    """Formats whose files have the ending of a path; of half and full EXR files the image's own file keeps its kind."""
    return [name for name, ending in files.EXTENSIONS.items() if path.suffix.lower() == ending]
