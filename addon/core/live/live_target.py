"""One target as the scene has it now: everything that a rendering for Live needs."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..bake.bake_settings import BakeSettings
from ..bake.surface import Surface
from ..scene.illumination import Illumination
from ..scene.polygons import Polygons
from ..scene.texture import Texture
from ..target import Target

LARGE_ARRAY_BYTES = 1 << 20
"""Size in bytes above which arrays are compared by identity, not by content; readers keep arrays that are unchanged."""


@dataclass(frozen=True, eq=False)
class LiveTarget:
    """A target with its geometry, its light and its medium.

    Attributes
    ----------
    polygons : faces of the receiver, in the world.
    size : width and height of the image in texels; None: `resolution` texels along the longer side.
    texture : colors that light meets on its way in and out; the surface then has their mean.
    spread : see `flatten`.
    max_bounces : see `BouncedLight`; None: no light bounces.
    is_final : False while better light is on its way, so that an exact rendering would be in vain.
    """

    target: Target
    polygons: Polygons
    size: tuple[int, int] | None
    resolution: int
    illumination: Illumination
    surface: Surface
    settings: BakeSettings
    texture: Texture | None = None
    spread: float = 0.0
    max_bounces: tuple[int, int, int] | None = None
    is_final: bool = True

    @cached_property
    def key(self) -> tuple:
        """Values that are equal for targets with the same rendering."""
        lights = tuple(_light_key(light) for light in self.illumination.lights)
        shadows = self.illumination.shadow_key()
        arrays = self.polygons.corners, self.polygons.uvs, self.polygons.normals, self.polygons.corner_normals
        texture = () if self.texture is None else (self.texture.use, *map(_key, self.texture.colors))
        rest = (
            self.target.side,
            self.size or self.resolution,
            self.surface,
            self.settings,
            texture,
            self.spread,
            self.max_bounces,
        )
        return lights, shadows, *map(_key, arrays), *rest


def _light_key(light) -> tuple:
    return type(light), *(_key(getattr(light, field.name)) for field in fields(light))


def _key(value):
    """The value itself; of an array its shape and checksum, or its identity if it is large."""
    if not isinstance(value, np.ndarray):
        return value
    if value.nbytes > LARGE_ARRAY_BYTES:
        return id(value)
    return value.shape, zlib.crc32(np.ascontiguousarray(value))
