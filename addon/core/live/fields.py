"""Terms and kernels of a medium on a grid, kept for whatever light comes."""

from __future__ import annotations

import numpy as np

from ..native import native
from ..recent import keep_recent
from ..scene.grid import Grid

# Up to what angle of incidence, degrees, the kernels of a field are right to what part; light from beyond counts as at
# that angle. The first that asks for few terms counts: 17 where light is refracted and no boundary returns it. Without
# refraction kernels change so much towards grazing that 181 would be asked for first, and thin slabs have a thousand.
EXACTNESS = ((88.0, 0.02), (84.0, 0.1), (80.0, 0.3), (70.0, 4.0))
MOST_TERMS = 64

# Slabs of so few mean free paths ask for so many terms at first that only to count them takes seconds.
THIN = 1.0

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
        self._kept: dict = {}
        self._choices: dict = {}  # by media: which exactness
        self.made = 0

    def empty(self, grid: Grid, medium: dict, is_colored: bool):
        """A field without light, for light of any directions.

        `medium` has what `convolve` takes of it: ldf, albedo, mean_free_path; `is_colored`: lights differ in color.
        """
        pitch, shape = (grid.pitch_x, grid.pitch_y), (grid.height, grid.width)
        values = tuple(map(float, (*medium["albedo"], *medium["mean_free_path"], *pitch)))
        key = (*map(id, medium["ldf"]), *values, *shape, is_colored)
        if key in self._kept:
            field, _ = self._kept[key]
            field.clear()
        else:
            field = self._make(shape, medium | {"pitch": pitch}, is_colored)
            self.made += 1
        # With the libraries, so that no others get their numbers.
        return keep_recent(self._kept, key, (field, medium["ldf"]), MOST_FIELDS)[0]

    def _make(self, shape: tuple[int, int], medium: dict, is_colored: bool):
        media = tuple((one.medium.g, one.medium.ior, one.medium.thickness) for one in medium["ldf"])
        is_thin = any(thickness < THIN and ior > 1 for _, ior, thickness in media)
        first = len(EXACTNESS) - 1 if is_thin else 0
        for choice in range(self._choices.get(media, first), len(EXACTNESS)):
            limit, tolerance = EXACTNESS[choice]
            survey = _all_directions(limit)
            lights = survey.by_channel() if is_colored else [survey]
            field = native.LightField(
                shape, [], (1, SURVEY_ANGLES), lights, **medium, tolerance=tolerance, progress=None
            )
            if field.terms <= MOST_TERMS * (3 if is_colored else 1):
                break
        self._choices[media] = choice
        return field


def _all_directions(limit: float):
    """A native `PlaneLight` whose texels have all angles up to `limit` degrees; the azimuth does not matter."""
    half_tangents = np.linspace(0, np.tan(np.radians(limit) / 2), SURVEY_ANGLES)
    angles = 2 * np.arctan(half_tangents)
    travel = np.stack([np.sin(angles), np.zeros_like(angles), -np.cos(angles)], axis=-1)[None]
    irradiance = np.full((1, SURVEY_ANGLES), SURVEY_IRRADIANCE, np.float32)
    return native.PlaneLight(irradiance, np.ascontiguousarray(travel, np.float32), [1.0] * 3)
