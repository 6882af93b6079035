"""Light that was computed elsewhere, at coarse grids on the planes that it reaches, by direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..grid import Grid, Vector
from .light import Light

# Sectors of the rings, from the zenith down, into which the hemisphere is split.
SECTORS = (4, 8, 12)


def _strata() -> np.ndarray:
    total, parts, begin = sum(SECTORS), [], 0.0
    for sectors in SECTORS:
        parts += [(begin, sectors / total, sector / sectors, 1 / sectors) for sector in range(sectors)]
        begin += sectors / total
    return np.array(parts)


STRATA = _strata()
"""(K, 4): parts of the hemisphere with the same cosine-weighted solid angle, pi / K.

Directions by r^2 and azimuth / 2 pi of their foot in the unit disk, each as where it begins and how far it reaches.
"""


def _directions() -> np.ndarray:
    squared, reach, turn, part = STRATA.T
    # The centroid of a sector of a ring between two radii.
    inner, outer = np.sqrt(squared), np.sqrt(squared + reach)
    radius = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2) * np.sinc(part)
    azimuth = 2 * np.pi * (turn + part / 2)
    x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
    return -np.stack([x, y, np.sqrt(1 - radius**2)], axis=1)


DIRECTIONS = _directions()
"""(K, 3): unit vectors along which the light of each stratum travels, in the plane's frame.

Their horizontal parts are the means of an even stratum, so that even light flows nowhere and the flow of other light
is right but for what varies within a stratum.
"""

# A texel whose surroundings are dark in all directions for more than this part of them keeps the darkness.
LIT_PART = 0.5


@dataclass(frozen=True, eq=False)
class Field:
    """What arrives at one plane.

    Attributes
    ----------
    origin, normal : of the `Grid` that it was computed for; its nodes are evenly spread over that grid.
    radiance : float32 (K, rows, columns, 3), the mean by the cosine over each of `STRATA`, W/(m^2 sr).
    """

    origin: Vector
    normal: Vector
    radiance: np.ndarray


@dataclass(frozen=True, eq=False)
class FieldLight(Light):
    """Light that Cycles has computed; `strength` is a factor.

    Attributes
    ----------
    fields : one for each plane that it reaches.
    """

    fields: tuple[Field, ...]

    def is_behind(self, grid):
        field = self._field(grid)
        return field is None or not field.radiance.any()

    @property
    def is_colored(self):
        return True

    def layers(self, grid: Grid) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Irradiance float32 (H, W, 3) on the whole of each texel, at strength and color 1, and its direction of travel.

        Together the layers make up the light. Between nodes a cubic B-spline interpolates: smooth, never negative, and
        it averages noise. What light can't reach at all is no darker part of its surroundings: nodes inside of things
        that stand on the plane don't darken texels beside them.
        """
        field = self._field(grid)
        if field is None:
            return
        rows, columns = field.radiance.shape[1:3]
        up, across = spline_weights(grid.height, rows), spline_weights(grid.width, columns)
        lit = field.radiance.any(axis=(0, 3)).astype(np.float32)
        scale = np.pi / len(field.radiance) / np.maximum(up @ lit @ across.T, LIT_PART)
        for radiance, direction in zip(field.radiance, DIRECTIONS):
            if radiance.any():
                channels = [up @ radiance[..., channel] @ across.T for channel in range(3)]
                irradiance = np.stack(channels, axis=2) * scale[..., None]
                yield np.maximum(irradiance, 0, out=irradiance), direction

    def _field(self, grid: Grid) -> Field | None:
        for field in self.fields:
            if np.array_equal(field.origin, grid.origin) and np.array_equal(field.normal, grid.normal):
                return field
        return None

    def fault(self):
        if not all(np.isfinite(field.radiance).all() and (field.radiance >= 0).all() for field in self.fields):
            return "its radiance has values that are negative or not numbers"
        return super().fault()


def spline_weights(texels: int, nodes: int) -> np.ndarray:
    """Float32 (texels, nodes): a uniform cubic B-spline with `nodes` evenly spread coefficients, at texels' centres.

    Beyond the first and the last node it goes on in a straight line: what is linear in the nodes stays so everywhere.
    """
    place = (np.arange(texels) + 0.5) * nodes / texels - 0.5
    first = np.floor(place).astype(int) - 1
    t = place - first - 1
    basis = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6
    weights = np.zeros((texels, nodes + 4))
    for step, values in enumerate(basis):
        weights[np.arange(texels), first + step + 2] = values
    inner = weights[:, 2:-2].copy()
    last = nodes - 1
    neighbour = min(1, last)
    for outside in (1, 2):
        inner[:, 0] += (1 + outside) * weights[:, 2 - outside]
        inner[:, neighbour] -= outside * weights[:, 2 - outside]
        inner[:, last] += (1 + outside) * weights[:, nodes + 1 + outside]
        inner[:, last - neighbour] -= outside * weights[:, nodes + 1 + outside]
    return inner.astype(np.float32)
