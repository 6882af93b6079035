"""Light that was computed elsewhere, at coarse grids on the planes that it reaches, by direction."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from ...progress import ask
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

# A texel whose surroundings are dark in all directions for more than this part of them keeps the darkness.
LIT_PART = 0.5


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

    def at_texels(self, grid: Grid, parts: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
        """Float32 (H, W, 3) of each of `parts` given at the nodes, (rows, columns, 3).

        Between nodes a cubic B-spline interpolates: smooth, and it averages noise; beyond the outermost nodes it may
        pass zero. What light can't reach at all is no darker part of its surroundings: nodes inside of things that
        stand on the plane don't darken texels beside them.
        """
        rows, columns = self.radiance.shape[1:3]
        up, across = spline_weights(grid.height, rows), spline_weights(grid.width, columns)
        lit = self.radiance.any(axis=(0, 3)).astype(np.float32)
        reached = np.maximum(up @ lit @ across.T, LIT_PART)[..., None]
        for part in parts:
            values = np.stack([up @ part[..., channel] @ across.T for channel in range(3)], axis=2)
            values /= reached
            yield values


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

    def fault(self):
        return self._radiance_fault(*(field.radiance for field in self.fields)) or super().fault()


@dataclass(frozen=True, eq=False)
class FieldLight(_ComputedLight):
    """Light from all over the hemisphere; its fields have the parts `STRATA`."""

    has_one_direction = False

    def parts(self, reach):
        grid = reach.grid
        field = self.field_of(grid)
        if field is None:
            return
        lit = np.flatnonzero(field.radiance.any(axis=(1, 2, 3)))
        parts = zip(field.at_texels(grid, field.radiance[lit]), WEIGHTS[lit], DIRECTIONS[lit])
        for done, (values, weight, direction) in enumerate(parts):
            ask(reach.progress, done / len(lit))
            yield np.maximum(values, 0, out=values) * np.float32(np.pi * weight), direction

    def totals(self, reach):
        irradiance, flow = np.zeros((2, reach.grid.height, reach.grid.width, 3), np.float32)
        for part, direction in self.parts(reach):
            irradiance += part
            flow += part.mean(axis=2, keepdims=True) * direction
        return reach.received(irradiance), reach.covered(flow)


@dataclass(frozen=True, eq=False)
class LampFieldLight(_ComputedLight):
    """Light of a lamp; its fields have one part, the whole hemisphere.

    Attributes
    ----------
    place : world position of the lamp, or for `is_sun` the unit vector along which its light travels.
    """

    place: Vector
    is_sun: bool = False

    def gather(self, grid: Grid, _caster, **_options) -> tuple[np.ndarray, np.ndarray]:
        """The irradiance, (H, W, 3), has its shadows."""
        field = self.field_of(grid)
        axes = np.array((grid.x_axis, grid.y_axis, grid.normal))
        if field is None:
            irradiance = np.zeros((grid.height, grid.width, 3), np.float32)
        else:
            irradiance = np.maximum(next(field.at_texels(grid, field.radiance)), 0) * np.float32(np.pi)
        if self.is_sun:
            return irradiance, axes @ self.place
        x, y, height = axes @ np.subtract(self.place, grid.origin)
        along = (np.arange(grid.width) + 0.5) * grid.pitch_x - x
        up = ((np.arange(grid.height) + 0.5) * grid.pitch_y - y)[:, None]
        # What it lights it stands above; a lamp of a size may do so while its middle is not.
        way = np.stack(np.broadcast_arrays(along, up, -max(height, 1e-3 * grid.pitch_x)), axis=2)
        return irradiance, way / np.linalg.norm(way, axis=2, keepdims=True)


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
