"""Lights without size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from ..grid import Vector
from .light import TracedLight


@dataclass(frozen=True)
class SunLight(TracedLight):
    """Parallel light; `strength` is the irradiance at normal incidence, W/m^2.

    Attributes
    ----------
    direction : unit vector of travel, world.
    """

    direction: Vector
    is_parallel = True

    def native(self):
        return native.SunLight(self.direction)

    def is_behind(self, grid):
        return bool(np.dot(self.direction, grid.normal) >= 0)


@dataclass(frozen=True)
class PointLight(TracedLight):
    """Light from one point into all directions; `strength` is Cycles' watts."""

    position: Vector

    def native(self):
        return native.PointLight(self.position)

    def is_behind(self, grid):
        return grid.height_of(self.position) <= 0


@dataclass(frozen=True)
class SpotLight(PointLight):
    """A point light behind a cone.

    Attributes
    ----------
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    spot_size : full cone angle, radians.
    blend : soft part of the cone, 0..1.
    falloff : "scaled", or "legacy" for Cycles before Blender 3.5, where the lamp's scale does not shape the cone.
    """

    frame: tuple[Vector, Vector, Vector]
    spot_size: float
    blend: float
    falloff: str = "scaled"

    def native(self):
        return native.SpotLight(self.position, self.frame, self.spot_size, self.blend, self.falloff)
