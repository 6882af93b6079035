"""Light that was computed elsewhere, at coarse nodes of the planes and meshes that it reaches, by direction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...native import native
from ..bent_grid import AnyGrid
from ..grid import Grid, Vector
from .light_kinds import Light

# Rings of the hemisphere from the zenith down: squared sine of the angle at the lower border, and number of sectors.
# More are more exact, above all near the horizon: here the reflectance of even light is right to .5 %, and to 2 % for
# an albedo of .5 without a coat.
RINGS = ((0.25, 4), (0.6, 8), (0.85, 8), (0.96, 8), (1.0, 4))


def _strata() -> np.ndarray:
    parts, begin = [], 0.0
    for end, sectors in RINGS:
        parts += [(begin, end - begin, sector / sectors, 1 / sectors) for sector in range(sectors)]
        begin = end
    return np.array(parts)


STRATA = _strata()
"""(K, 4): parts of the hemisphere, the begin and the extent of squared sine and of azimuth / 2 pi.

Directions drawn by the cosine are even in both.
"""

WEIGHTS = STRATA[:, 1] * STRATA[:, 3]
"""(K,): fraction of the irradiance of even light that each part gives."""


def _directions() -> np.ndarray:
    begin, reach, turn, part = STRATA.T
    cosine = 2 / 3 * ((1 - begin) ** 1.5 - np.maximum(1 - begin - reach, 0) ** 1.5) / reach
    sine, azimuth = np.sqrt(1 - cosine**2), 2 * np.pi * (turn + part / 2)
    return -np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine], axis=1).astype(np.float32)


DIRECTIONS = _directions()
"""Float32 (K, 3): unit vectors of travel of each part, in the plane's frame, at its mean cosine."""


@dataclass(frozen=True, eq=False)
class Field:
    """Radiance at one plane.

    Attributes
    ----------
    origin, normal : those of its `Grid`, over which its nodes are evenly spread.
    radiance : float32 (K, rows, columns, 3), means by the cosine over K parts of the hemisphere, W/(m^2 sr).
    """

    origin: Vector
    normal: Vector
    radiance: np.ndarray


@dataclass(frozen=True, eq=False)
class BentField:
    """Radiance at nodes of a mesh that bends.

    Attributes
    ----------
    positions, normals : float64 (N, 3), world positions and unit normals of the nodes.
    spacing : distance of neighbors, about, scene units.
    radiance : float32 (K, N, 3), means by the cosine over K parts of the hemisphere, in the frames of
        `native.BentNodes`, W/(m^2 sr).
    is_back : as of the nodes' `BentGrid`.
    """

    positions: np.ndarray
    normals: np.ndarray
    spacing: float
    radiance: np.ndarray
    is_back: bool = False


@dataclass(frozen=True, eq=False)
class FieldLight(Light):
    """Light that was computed elsewhere; `strength` is a factor.

    Its fields have the parts `STRATA`, and with a `position` or `direction` one part, the whole hemisphere.

    Attributes
    ----------
    fields : one for each plane that the light reaches, and for each side of a mesh that bends.
    position : world position of the lamp that all light comes from, or None.
    direction : unit vector along which all light travels, world, or None.
    """

    fields: tuple[Field | BentField, ...]
    position: Vector | None = None
    direction: Vector | None = None

    has_size = False

    @property
    def is_colored(self):
        return True

    @property
    def has_one_direction(self):
        return self.position is not None or self.direction is not None

    @cached_property
    def _fields(self) -> dict[tuple, Field]:
        return {(tuple(field.origin), tuple(field.normal)): field for field in self.fields if isinstance(field, Field)}

    def field_of(self, grid: AnyGrid) -> Field | BentField | None:
        if isinstance(grid, Grid):
            return self._fields.get((tuple(grid.origin), tuple(grid.normal)))
        bent = (field for field in self.fields if isinstance(field, BentField))
        return next((field for field in bent if field.is_back == grid.is_back), None)

    def is_behind(self, grid):
        field = self.field_of(grid)
        return field is None or not field.radiance.any()

    def mean_irradiance(self, grid: AnyGrid) -> float:
        """Mean over the nodes of a grid and the channels, W/m^2."""
        field = self.field_of(grid)
        if field is None:
            return 0.0
        weights = WEIGHTS if len(field.radiance) == len(WEIGHTS) else np.ones(1)
        of_parts = field.radiance.reshape(len(field.radiance), -1, 3).mean(axis=1)
        return float(np.pi * (weights @ of_parts * self.rgb()).mean())

    def at(self, grid):
        field = self.field_of(grid)
        radiance = np.ascontiguousarray(field.radiance, np.float32)
        solid_angles = (np.pi * WEIGHTS).astype(np.float32)
        if isinstance(field, BentField):
            nodes = field.positions, field.normals, field.spacing
            return native.FieldLight.on_mesh(radiance, solid_angles, DIRECTIONS, *nodes)
        whole = np.full(1, np.pi, np.float32)
        axes = np.array((grid.x_axis, grid.y_axis, grid.normal))
        if self.direction is not None:
            return native.FieldLight(radiance, whole, (axes @ self.direction)[None].astype(np.float32))
        if self.position is not None:
            x, y, height = axes @ np.subtract(self.position, grid.origin)
            # The center of a lamp of a size may lie below a plane that the lamp lights.
            return native.FieldLight(radiance, whole, position=(x, y, max(height, 1e-3 * grid.pitch_x)))
        return native.FieldLight(radiance, solid_angles, DIRECTIONS)
