"""The world as a light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from .light import ExtendedLight


@dataclass(frozen=True, eq=False)
class WorldLight(ExtendedLight):
    """Light from everywhere, infinitely far away; `strength` is a factor.

    Attributes
    ----------
    radiance : float32 (H, W, 3), W/(m^2 sr), equirectangular as Blender stores environment images: from row 0 up
        the elevation rises from -pi/2 to pi/2 in even steps; along a row the azimuth falls from pi to -pi, so
        that the image's centre is what lies along +x.
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
        if not (np.isfinite(self.radiance).all() and (self.radiance >= 0).all()):
            return f"The radiance of '{self.name}' has negative values, or values that are not numbers."
        return super().fault()
