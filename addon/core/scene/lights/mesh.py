"""Glowing meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from .light import ExtendedLight


@dataclass(frozen=True, eq=False)
class MeshLight(ExtendedLight):
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
        if not (np.isfinite(self.radiance).all() and (self.radiance >= 0).all()):
            return f"The radiance of '{self.name}' has negative values, or values that are not numbers."
        return super().fault()
