"""What a picture is made of."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..bake.bake_settings import BakeSettings
from ..bake.surface import Surface
from ..scene.illumination import Illumination
from ..scene.texture import Texture
from ..scene.uv_map import Polygons
from ..target import Target

# Arrays of more bytes, as of the world, are kept where they are read: another one was read again.
LOOK_INSIDE = 1 << 20


@dataclass(frozen=True, eq=False)
class Subject:
    """One target as the scene has it now.

    Attributes
    ----------
    polygons : of the receiver, in the world.
    size : width and height of its image; None: `resolution` texels along the longer side.
    texture : what light meets on its way in and out; the surface then has its mean colour.
    """

    target: Target
    polygons: Polygons
    size: tuple[int, int] | None
    resolution: int
    illumination: Illumination
    surface: Surface
    settings: BakeSettings
    texture: Texture | None = None

    @cached_property
    def key(self) -> tuple:
        """Equal for subjects that look the same."""
        lights = tuple(_content(light) for light in self.illumination.lights)
        shadows = self.illumination.shadow_key()
        arrays = self.polygons.corners, self.polygons.uvs, self.polygons.normals
        texture = () if self.texture is None else (self.texture.blur, *map(_value, self.texture.colors))
        return lights, shadows, *map(_value, arrays), self.size or self.resolution, self.surface, self.settings, texture


def _content(light) -> tuple:
    return type(light), *(_value(getattr(light, item.name)) for item in fields(light))


def _value(value):
    if not isinstance(value, np.ndarray):
        return value
    return id(value) if value.nbytes > LOOK_INSIDE else (value.shape, zlib.crc32(np.ascontiguousarray(value)))
