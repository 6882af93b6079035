"""Results that wait for others of the same run and image: a large image is not written after each of many objects."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...core.bake.runner import Bake
from ...core.errors import ImageError
from ...core.scene.tiles import Tiling
from ...core.target import Target
from . import files, tiled
from .facts import facts_of, file_of

PAUSE = 10.0
"""Time between two writes of an image, relative to the time that a write takes. Larger: less time, later display."""


@dataclass(eq=False)
class _Image:
    """An image of the run.

    Attributes
    ----------
    texture : linear RGB (height, width, 3), all of it; None if nobody fills it next.
    filled : texels that results which wait have filled, bool (height, width).
    targets : of these results.
    stamp : of the image when it was written.
    written, seconds : time after the last write, and its duration.
    """

    tiling: Tiling | None
    texture: np.ndarray | None = None
    filled: np.ndarray | None = None
    targets: list[Target] = field(default_factory=list)
    stamp: str = ""
    written: float = -np.inf
    seconds: float = 0.0


class Waiting:
    """Textures of images that several bakes of a run fill, complete or with results that wait to be written.

    Attributes
    ----------
    others_follow : True if bakes that fill the same image follow in the run.
    """

    def __init__(self) -> None:
        self.others_follow = False
        self._images: dict[str, _Image] = {}

    def fill(self, image, bake: Bake, texture: np.ndarray, filled: np.ndarray | None = None) -> str:
        """Fill an image or some of its texels, or wait for other bakes; the path of its file, "" if it is packed.

        Parameters
        ----------
        texture : linear RGB (height, width, 3).
        filled : texels to fill, bool (height, width); None: all.

        Raises
        ------
        ImageError
            The image can't be saved. It keeps its pixels.
        """
        files.check_image(image)
        known = self._images.setdefault(image.name, _Image(bake.job.receiver.tiling))
        if filled is not None:
            texture = _merged(self._texture(image, known), texture, filled)
        known.texture = texture
        can_wait = self.others_follow and time.monotonic() < known.written + PAUSE * known.seconds
        if not can_wait or tuple(image.size) != texture.shape[1::-1]:
            return self._write(image, known)
        if known.filled is None:
            known.filled = np.zeros(texture.shape[:2], bool)
        known.filled |= True if filled is None else filled
        known.targets.append(bake.target)
        return str(file_of(image) or "")

    def write(self) -> list[tuple[Target, ImageError]]:
        """Write the results that wait; those that could not be written, with the reason."""
        lost = []
        for name, known in self._images.items():
            if not known.targets:
                continue
            image = bpy.data.images.get(name)
            try:
                if image is None:
                    raise ImageError(f"The image '{name}' was removed or renamed during the bake.", "Bake again.")
                if image.is_dirty:  # painted meanwhile
                    known.texture = _merged(_pixels_of(image, known.tiling), known.texture, known.filled)
                self._write(image, known)
            except ImageError as error:
                lost += [(target, error) for target in known.targets]
        self._images.clear()
        return lost

    def _texture(self, image, known: _Image) -> np.ndarray:
        """Texture of an image with the results that wait."""
        is_known = known.texture is not None and (known.targets or facts_of(image).stamp == known.stamp)
        if not is_known:
            return _pixels_of(image, known.tiling)
        if not image.is_dirty:
            return known.texture
        if not known.targets:
            return _pixels_of(image, known.tiling)
        return _merged(_pixels_of(image, known.tiling), known.texture, known.filled)

    def _write(self, image, known: _Image) -> str:
        start = time.monotonic()
        try:
            if known.tiling is None:
                path = files.fill_image(image, known.texture)
            else:
                path = tiled.fill(image, known.texture, known.tiling)
        except Exception:
            if not known.targets:
                known.texture = None  # the result is lost
            raise
        known.written = time.monotonic()
        known.seconds, known.stamp = known.written - start, facts_of(image).stamp
        known.filled, known.targets = None, []
        if not self.others_follow:
            known.texture = None  # large
        return path


def _merged(texture: np.ndarray, other: np.ndarray, filled: np.ndarray) -> np.ndarray:
    """The texture, changed in place, with some texels of another one."""
    lines = [np.flatnonzero(filled.any(axis=axis)) for axis in (1, 0)]
    if len(lines[0]):
        near = tuple(slice(line[0], line[-1] + 1) for line in lines)
        texture[near][filled[near]] = other[near][filled[near]]
    return texture


def _pixels_of(image, tiling: Tiling | None) -> np.ndarray:
    pixels = files.linear_pixels(image) if tiling is None else tiled.linear_pixels(image, tiling)
    return np.ascontiguousarray(pixels, np.float32)
