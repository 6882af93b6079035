"""A translucent surface as a node describes it, before its albedo is known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..ldf.albedo import albedo_from_color
from ..material.material import RGB, Material, check_base_color, check_thickness
from ..native import native
from ..progress import Progress, stages


@dataclass(frozen=True)
class Surface:
    """Values in scene units.

    Attributes
    ----------
    material : with its mean free path.
    thickness : 0 for a half-space.
    base_color : reflectance wanted under uniform diffuse light, or None where the material's albedo counts.
    """

    material: Material
    thickness: float = 0.0
    base_color: RGB | None = None

    def check(self) -> None:
        """Raise MaterialError for values outside their range."""
        material = self.material if self.base_color is None else replace(self.material, albedo=(0.0, 0.0, 0.0))
        material.check()
        check_thickness(self.thickness)
        if self.base_color is not None:
            check_base_color(self.base_color)

    def reflectance(self) -> list[float]:
        """Of each channel, the diffuse part under uniform diffuse light, without noise and without a simulation."""
        self.check()
        if self.base_color is not None:
            return list(map(float, self.base_color))
        nodes, weights = np.polynomial.legendre.leggauss(8)
        cosines = (nodes + 1) / 2
        angles = np.degrees(np.arccos(cosines)).tolist()
        values = []
        for albedo, length, g in zip(
            self.material.albedo, self.material.mean_free_path, self.material.channel_anisotropy
        ):
            medium = native.Medium(g=g, ior=self.material.ior, thickness=self._depth(length))
            reflected, _ = native.exact_totals(medium, angles, [albedo])
            values.append(float(weights * cosines @ reflected[:, 0]))
        return values

    def _depth(self, mean_free_path: float) -> float:
        return self.thickness / mean_free_path if self.thickness else math.inf

    def media(self) -> list:
        """The native `Medium`s that its bake needs libraries of, each once."""
        found = []
        for length, g in zip(self.material.mean_free_path, self.material.channel_anisotropy):
            medium = native.Medium(g=g, ior=self.material.ior, thickness=self._depth(length))
            found += [] if medium in found else [medium]
        return found

    def resolve(self, quality: str, progress: Progress | None = None, threads: int = 0) -> Material:
        """The material, its albedo worked out from the base colour if there is one."""
        self.check()
        if self.base_color is None:
            return self.material
        channels = zip(self.base_color, self.material.mean_free_path, self.material.channel_anisotropy)
        albedo = []
        for (color, length, g), stage in zip(channels, stages(progress, [1.0] * len(self.base_color))):
            medium = native.Medium(g=g, ior=self.material.ior, thickness=self._depth(length))
            albedo.append(albedo_from_color(color, medium, quality, stage, threads)[0])
        return replace(self.material, albedo=tuple(albedo))
