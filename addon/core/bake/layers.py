"""The results that a bake can have. Each is a function of the light on a grid, and a line in `LAYERS`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..material import Material
from ..progress import Progress
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from .arrival import arrive, mean_direction
from .bake_settings import COMBINED, DIRECTION, IRRADIANCE, BakeSettings
from .luminance import bake

Layer = Callable[[Grid, Illumination, Material, float, BakeSettings, Progress, int], np.ndarray]
"""Takes the arguments of `luminance.bake`; float32 (grid height, grid width, 3), row 0 at the bottom."""


def irradiance(grid, illumination, _material, _thickness, settings, progress, _bytes_for_light) -> np.ndarray:
    return arrive(grid, illumination, settings, progress)[0]


def direction(grid, illumination, _material, _thickness, settings, progress, _bytes_for_light) -> np.ndarray:
    return mean_direction(arrive(grid, illumination, settings, progress)[1])


LAYERS: dict[str, Layer] = {COMBINED: bake, IRRADIANCE: irradiance, DIRECTION: direction}

WITHOUT_MEDIUM = {IRRADIANCE, DIRECTION}
"""Layers that do not depend on the material."""
