"""A translucent surface as a node describes it, before its albedo is known."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..ldf.albedo import albedo_from_color, albedo_from_reflectance
from ..ldf.reflectance_table import exact_reflectances, exact_table
from ..material import RGB, Material, check_base_color, check_thickness
from ..progress import Callback, Progress
from ..recent import keep_with
from ..scene.texture import MULTIPLIED, BaseColor, Texture, TextureUse, mean_color

OPEN, MIRROR = "OPEN", "MIRROR"
"""Edges of a plane: light leaves through them, or returns as from mirrors."""


def channel_media(material: Material, thickness: float) -> list:
    """The native `Medium` of each channel; the thickness has the unit of the mean free path, 0 for a half-space."""
    return list(material.channel_media(thickness or math.inf))


@dataclass(frozen=True)
class Surface:
    """Values in scene units.

    Attributes
    ----------
    material : its lengths are in scene units.
    thickness : thickness of the slab; 0 for a half-space.
    base_color : reflectance under uniform diffuse light; None if the material's albedo counts.
    edges : OPEN or MIRROR.
    """

    material: Material
    thickness: float = 0.0
    base_color: RGB | None = None
    edges: str = field(default=OPEN, repr=False)  # digests of former bakes hold no edges

    def colored(self, color: BaseColor) -> Surface:
        """The surface with the mean of a base color, or unchanged if the color is unknown."""
        texture = color.texture
        if texture is None:
            return self
        if not texture.use.is_albedo:
            return replace(self, base_color=color.mean)
        mean = keep_with(texture.colors[0], tuple(self.media()), lambda: self._mean_reflectance(texture))
        return replace(self, base_color=mean)

    def _mean_reflectance(self, texture: Texture) -> RGB:
        return mean_color(texture.receiver, self.base_colors(texture))

    def base_colors(self, texture: Texture) -> tuple[np.ndarray, ...]:
        """Base colors of a texture on each chart, float32 (H, W, 3): of albedos the colors that these give."""
        if not texture.use.is_albedo:
            return texture.colors
        tables = [exact_table(medium) for medium in channel_media(self.material, self.thickness)]
        return tuple(
            np.stack([table.reflectance(values[..., c]) for c, table in enumerate(tables)], -1).astype(np.float32)
            for values in texture.colors
        )

    def multiplied(self, texture: Texture) -> Texture:
        """The texture as one that multiplies light."""
        return replace(texture, colors=self.base_colors(texture), use=TextureUse(MULTIPLIED))

    def check(self) -> None:
        """Raise MaterialError for values outside their range."""
        material = self.material if self.base_color is None else replace(self.material, albedo=(0.0, 0.0, 0.0))
        material.check()
        check_thickness(self.thickness)
        if self.base_color is not None:
            check_base_color(self.base_color)

    def reflectance(self) -> list[float]:
        """Diffuse reflectance of each channel under uniform diffuse light, exact and without a simulation."""
        self.check()
        if self.base_color is not None:
            return list(map(float, self.base_color))
        channels = zip(self.material.albedo, channel_media(self.material, self.thickness))
        return [float(exact_reflectances(medium, [albedo])[0]) for albedo, medium in channels]

    def exact_albedo(self) -> list[float]:
        """Albedo of each channel that has the base color, exact and without a simulation; the inverse of `reflectance`.

        Colors brighter than the medium can be get `MAX_ALBEDO`.
        """
        self.check()
        if self.base_color is None:
            return list(map(float, self.material.albedo))
        channels = list(zip(self.base_color, channel_media(self.material, self.thickness)))
        albedos = {
            (color, medium): albedo_from_reflectance(
                color, lambda albedo, medium=medium: float(exact_reflectances(medium, [albedo])[0])
            )
            for color, medium in dict.fromkeys(channels)
        }
        return [albedos[channel] for channel in channels]

    def media(self) -> list:
        """Native `Medium`s that a bake needs libraries of, each once."""
        return list(dict.fromkeys(channel_media(self.material, self.thickness)))

    def resolve(self, quality: str, progress: Callback | None = None, threads: int = 0) -> Material:
        """The material, with the albedo that gives the base color if there is one."""
        self.check()
        if self.base_color is None:
            return self.material
        channels = zip(self.base_color, channel_media(self.material, self.thickness))
        albedo = []
        for (color, medium), stage in zip(channels, Progress.of(progress).split([1.0] * len(self.base_color))):
            albedo.append(albedo_from_color(color, medium, quality, stage, threads)[0])
        return replace(self.material, albedo=tuple(albedo))
