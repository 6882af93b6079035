"""One bake as plain data: everything that `run` needs, nothing that knows the host."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .bake import LIBRARY_WEIGHT, LIGHT_WEIGHT, BakeSettings, bake_texture
from .color import albedo_from_color
from .material import RGB, Material, check_base_color, check_thickness
from .progress import Progress, stages
from .receiver import Receiver
from .scene import Light, Mesh


@dataclass(frozen=True)
class Surface:
    """A node's values.

    Attributes
    ----------
    material : with its mean free path in scene units.
    thickness : scene units, 0 for a half-space.
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

    def resolve(self, quality: str, progress: Progress | None = None) -> Material:
        """The material, its albedo worked out from the base colour if there is one."""
        self.check()
        if self.base_color is None:
            return self.material
        from .._load import native

        channels = zip(self.base_color, self.material.mean_free_path, self.material.channel_anisotropy)
        albedo = []
        for (color, length, g), stage in zip(channels, stages(progress, [1.0] * len(self.base_color))):
            depth = self.thickness / length if self.thickness else math.inf
            medium = native.Medium(g=g, ior=self.material.ior, thickness=depth)
            albedo.append(albedo_from_color(color, medium, quality, stage)[0])
        return replace(self.material, albedo=tuple(albedo))


@dataclass(frozen=True, eq=False)
class BakeJob:
    """A receiver with its light and its surface; `warnings` are sentences for the artist."""

    receiver: Receiver
    lights: Sequence[Light]
    occluders: Mesh
    surface: Surface
    settings: BakeSettings
    warnings: tuple[str, ...] = ()

    def run(self, progress: Progress | None = None) -> np.ndarray:
        """Bake: float32 (height, width, 3) luminance, margin included, row 0 at the bottom."""
        needs_albedo = 0.0 if self.surface.base_color is None else LIBRARY_WEIGHT
        resolving, baking = stages(progress, [needs_albedo, LIBRARY_WEIGHT + LIGHT_WEIGHT * len(self.lights)])
        material = self.surface.resolve(self.settings.quality, resolving)
        return bake_texture(
            self.receiver, self.lights, self.occluders, material, self.surface.thickness, self.settings, baking
        )
