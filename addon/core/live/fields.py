"""Terms and kernels of a medium on a grid, kept for whatever light comes."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from ..native import native
from ..scene.grid import Grid

# Up to what angle of incidence, degrees, the kernels of a field are right to what part; light from beyond counts as at
# that angle. Where light is refracted, 17 terms do; without, kernels change so much towards grazing that 181 would be
# asked for, and here some 60 are.
REFRACTED, STRAIGHT = (88.0, 0.02), (84.0, 0.1)
LEAST_REFRACTION = 1.2

SURVEY_ANGLES = 256

# Irradiance of the survey, W/m^2: from 1e-12 to 1e7 times as much keeps its digits.
SURVEY_IRRADIANCE = 1e3

# Fields that are kept, those used last.
MOST_FIELDS = 8


class Fields:
    """Native `LightField`s, by medium and grid.

    Attributes
    ----------
    made : how many so far.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict = OrderedDict()
        self.made = 0

    def empty(self, grid: Grid, medium: dict, ior: float, is_colored: bool):
        """A field without light, for light of any directions.

        `medium` has what `convolve` takes of it: ldf, albedo, mean_free_path; `is_colored`: lights differ in color.
        """
        pitch, shape = (grid.pitch_x, grid.pitch_y), (grid.height, grid.width)
        values = tuple(map(float, (*medium["albedo"], *medium["mean_free_path"], *pitch)))
        key = (*map(id, medium["ldf"]), *values, *shape, is_colored)
        if key in self._kept:
            self._kept.move_to_end(key)
            field = self._kept[key]
            field.clear()
            return field
        limit, tolerance = STRAIGHT if is_straight(ior) else REFRACTED
        survey = _all_directions(limit)
        lights = survey.by_channel() if is_colored else [survey]
        field = native.LightField(
            shape, [], (1, SURVEY_ANGLES), lights, **medium, pitch=pitch, tolerance=tolerance, progress=None
        )
        self.made += 1
        self._kept[key] = field
        while len(self._kept) > MOST_FIELDS:
            self._kept.popitem(last=False)
        return field


def is_straight(ior: float) -> bool:
    """Whether light enters almost without refraction, which asks for many terms."""
    return ior < LEAST_REFRACTION


def _all_directions(limit: float):
    """A native `PlaneLight` whose texels have all angles up to `limit` degrees; the azimuth does not matter."""
    half_tangents = np.linspace(0, np.tan(np.radians(limit) / 2), SURVEY_ANGLES)
    angles = 2 * np.arctan(half_tangents)
    travel = np.stack([np.sin(angles), np.zeros_like(angles), -np.cos(angles)], axis=-1)[None]
    irradiance = np.full((1, SURVEY_ANGLES), SURVEY_IRRADIANCE, np.float32)
    return native.PlaneLight(irradiance, np.ascontiguousarray(travel, np.float32), [1.0] * 3)
