"""Lamps with an area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from ..grid import Vector
from .light import ExtendedLight


@dataclass(frozen=True)
class AreaLight(ExtendedLight):
    """A rectangle or ellipse that shines from its front, of the radiance `strength` / (4 area).

    That is Cycles' watts in Blender 3.4; in 4.2 and 4.5 a watt gives strength / (pi area), 4 / pi of it.

    Attributes
    ----------
    position : of its centre, world.
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    size_x, size_y : whole lengths along the lamp's own axes.
    is_round : an ellipse instead of a rectangle.
    spread : full angle that light leaves in, radians, 0..pi.
    """

    position: Vector
    frame: tuple[Vector, Vector, Vector]
    size_x: float
    size_y: float
    is_round: bool
    spread: float

    def native(self):
        size = self.size_x, self.size_y, self.is_round
        return native.AreaLight(self.position, self.frame, *size, self.spread)

    def is_behind(self, grid):
        half_x = 0.5 * self.size_x * np.dot(self.frame[0], grid.normal)
        half_y = 0.5 * self.size_y * np.dot(self.frame[1], grid.normal)
        reach = np.hypot(half_x, half_y) if self.is_round else abs(half_x) + abs(half_y)
        if grid.height_of(self.position) + reach <= 0:
            return True
        x, y = np.array([(0, 0), (1, 0), (0, 1), (1, 1)]).T[..., None]
        right = x * grid.width * grid.pitch_x * np.array(grid.x_axis)
        corners = grid.origin + right + y * grid.height * grid.pitch_y * np.array(grid.y_axis)
        return bool(((corners - self.position) @ np.array(self.frame[2]) >= 0).all())
