"""Suns with an angle, point and spot lamps with a radius."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...native import native
from ..grid import Vector
from .light import ExtendedLight

# Of a sun up to so wide, radians, all light counts as coming from its middle but for its shadows: that leaves out what
# grows with the square of the angle, of the luminance 6e-4 at 80 degrees of incidence and 5e-3 at 85.
WIDEST_SUN = math.radians(2.0)


@dataclass(frozen=True)
class SunDiskLight(ExtendedLight):
    """Light from a disk infinitely far away; `strength` is the irradiance at normal incidence, W/m^2.

    Attributes
    ----------
    direction : unit vector of travel from the disk's centre, world.
    angle : full angle of the disk, radians.
    disk : "even"; or "flat" as in Blender 3.4, see native `SunDiskLight`.
    """

    direction: Vector
    angle: float
    disk: str = "even"

    def native(self):
        return native.SunDiskLight(self.direction, self.angle, self.disk)

    @property
    def has_one_direction(self):
        return self.angle <= WIDEST_SUN

    @property
    def is_parallel(self):
        return self.has_one_direction

    def beams(self, reach, _directions=True):
        irradiance, _ = self.totals(reach)
        is_colored = reach.is_colored or reach.grid.color_in is not None
        return irradiance if is_colored else irradiance[..., 0], reach.in_plane(self.direction)

    def is_behind(self, grid):
        return bool(np.dot(self.direction, grid.normal) >= math.sin(min(0.5 * self.angle, 0.5 * math.pi)))


@dataclass(frozen=True)
class SphereLight(ExtendedLight):
    """A point lamp with a radius; `strength` is Cycles' watts.

    Attributes
    ----------
    position : of its centre, world.
    radius : scene units.
    model : "sphere"; or "disk", which faces each point that it lights, as Cycles has it before Blender 4.0 and for
        lamps of a soft falloff.
    """

    position: Vector
    radius: float
    model: str

    def native(self):
        return native.SphereLight(self.position, self.radius, self.model)

    def is_behind(self, grid):
        return grid.height_of(self.position) <= -self.radius


@dataclass(frozen=True)
class SphereSpotLight(ExtendedLight):
    """A spot lamp with a radius: fields as those of `SpotLight` and `SphereLight`."""

    position: Vector
    frame: tuple[Vector, Vector, Vector]
    spot_size: float
    blend: float
    falloff: str
    radius: float
    model: str

    def native(self):
        cone = self.frame, self.spot_size, self.blend, self.falloff
        return native.SphereSpotLight(self.position, *cone, self.radius, self.model)

    def is_behind(self, grid):
        return grid.height_of(self.position) <= -self.radius
