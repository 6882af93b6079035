"""Light that was computed elsewhere, at coarse grids on the planes that it reaches, by direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native import native
from ..grid import Grid, Vector
from .light_base import Light

# Rings of the hemisphere from the zenith down, by the squared sine of the angle where they end, and their sectors. The
# rings are narrow near the horizon, where media differ most with the angle: the reflectance of even light is right to
# .5 %, for a medium as dark as an albedo of .5 and without coat to 2 %.
RINGS = ((0.25, 4), (0.6, 8), (0.85, 8), (0.96, 8), (1.0, 4))


def _strata() -> np.ndarray:
    parts, begin = [], 0.0
    for end, sectors in RINGS:
        parts += [(begin, end - begin, sector / sectors, 1 / sectors) for sector in range(sectors)]
        begin = end
    return np.array(parts)


STRATA = _strata()
"""(K, 4): parts of the hemisphere.

Directions by the squared sine of their angle and their azimuth / 2 pi, each as where it begins and how far it reaches.
Drawn by the cosine, both are even.
"""

WEIGHTS = STRATA[:, 1] * STRATA[:, 3]
"""(K,): the irradiance of each under even light, as part of all."""


def _directions() -> np.ndarray:
    begin, reach, turn, part = STRATA.T
    cosine = 2 / 3 * ((1 - begin) ** 1.5 - np.maximum(1 - begin - reach, 0) ** 1.5) / reach
    sine, azimuth = np.sqrt(1 - cosine**2), 2 * np.pi * (turn + part / 2)
    return -np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1).astype(np.float32)


DIRECTIONS = _directions()
"""Float32 (K, 3): unit vectors along which the light of each travels, in the plane's frame: the mean cosine."""


@dataclass(frozen=True, eq=False)
class Field:
    """What arrives at one plane.

    Attributes
    ----------
    origin, normal : of the `Grid` that it was computed for; its nodes are evenly spread over that grid.
    radiance : float32 (K, rows, columns, 3), means by the cosine over K parts of the hemisphere, W/(m^2 sr).
    """

    origin: Vector
    normal: Vector
    radiance: np.ndarray

    def is_of(self, grid: Grid) -> bool:
        return np.array_equal(self.origin, grid.origin) and np.array_equal(self.normal, grid.normal)


@dataclass(frozen=True, eq=False)
class _ComputedLight(Light):
    """`strength` is a factor.

    Attributes
    ----------
    fields : one for each plane that it reaches.
    """

    fields: tuple[Field, ...]

    @property
    def is_colored(self):
        return True

    def field_of(self, grid: Grid) -> Field | None:
        return next((field for field in self.fields if field.is_of(grid)), None)

    def is_behind(self, grid):
        field = self.field_of(grid)
        return field is None or not field.radiance.any()

    def _radiance_at(self, grid: Grid) -> np.ndarray:
        """Radiance of the field of a grid that the light reaches."""
        return np.ascontiguousarray(self.field_of(grid).radiance, np.float32)

    def fault(self):
        return self._radiance_fault(*(field.radiance for field in self.fields)) or super().fault()


@dataclass(frozen=True, eq=False)
class FieldLight(_ComputedLight):
    """Light from all over the hemisphere; its fields have the parts `STRATA`."""

    has_one_direction = False

    def at(self, grid):
        return native.FieldLight(self._radiance_at(grid), (np.pi * WEIGHTS).astype(np.float32), DIRECTIONS)


@dataclass(frozen=True, eq=False)
class LampFieldLight(_ComputedLight):
    """Light of a lamp; its fields have one part, the whole hemisphere.

    Attributes
    ----------
    place : world position of the lamp, or for `is_sun` the unit vector along which its light travels.
    """

    place: Vector
    is_sun: bool = False

    def at(self, grid):
        radiance, solid_angles = self._radiance_at(grid), np.full(1, np.pi, np.float32)
        axes = np.array((grid.x_axis, grid.y_axis, grid.normal))
        if self.is_sun:
            return native.FieldLight(radiance, solid_angles, (axes @ self.place)[None].astype(np.float32))
        x, y, height = axes @ np.subtract(self.place, grid.origin)
        # The center of a lamp of a size may lie below a plane that the lamp lights.
        return native.FieldLight(radiance, solid_angles, position=(x, y, max(height, 1e-3 * grid.pitch_x)))
