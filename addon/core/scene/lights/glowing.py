"""The world and meshes that glow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from .light_base import Light


@dataclass(frozen=True, eq=False)
class WorldLight(Light):
    """Light from everywhere, infinitely far away; `strength` is a factor.

    Attributes
    ----------
    radiance : float32 (H, W, 3), W/(m^2 sr), equirectangular as Blender stores environment images: from row 0 up
        the elevation rises from -pi/2 to pi/2 in even steps; along a row the azimuth falls from pi to -pi, so
        that the image's center lies along +x.
    to_world : rows of the 3 x 3 rotation of the image into the world.
    """

    radiance: np.ndarray
    to_world: tuple[tuple[float, float, float], ...]

    def native(self):
        return native.EnvironmentLight(np.ascontiguousarray(self.radiance, np.float32), self.to_world)

    @property
    def is_colored(self):
        return bool((self.radiance != self.radiance[..., :1]).any())

    def is_behind(self, _grid):
        return False

    def fault(self):
        return self._radiance_fault(self.radiance) or super().fault()


@dataclass(frozen=True, eq=False)
class MeshLight(Light):
    """Triangles that glow on both sides; `strength` is a factor.

    Attributes
    ----------
    vertices : float64 (N, 3), world.
    triangles : uint32 (M, 3), indices of vertices.
    radiance : float32 (M, 3), W/(m^2 sr), of each triangle.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    radiance: np.ndarray

    def native(self):
        return native.MeshLight(self.vertices, self.triangles, self.radiance)

    @property
    def is_colored(self):
        return bool((self.radiance != self.radiance[:, :1]).any())

    def is_behind(self, grid):
        return bool((np.subtract(self.vertices[self.triangles.ravel()], grid.origin) @ grid.normal <= 0).all())

    def fault(self):
        if not np.isfinite(self.vertices).all():
            return f"The position of '{self.name}' is not a number."
        return self._radiance_fault(self.radiance) or super().fault()
