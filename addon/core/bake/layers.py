"""The results that a bake can have: each layer is a name and a function of what arrives on a chart's grid.

A new one is a function and its line in `LAYERS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..material import Material
from ..progress import Progress
from ..scene.grid import Grid
from .arrival import arrive, mean_direction
from .bake_settings import COMBINED, DIRECTION, IRRADIANCE
from .luminance import bake

if TYPE_CHECKING:
    from .job import BakeJob

Layer = Callable[["BakeJob", Grid, Material, "Progress | None"], np.ndarray]
"""Float32 (grid height, grid width, 3), row 0 at the bottom; the material comes with its albedo worked out."""


def luminance(job: BakeJob, grid: Grid, material: Material, progress: Progress | None) -> np.ndarray:
    surface, most = job.surface, job.bytes_for_light()
    return bake(grid, job.illumination, material, surface.thickness, job.settings, progress, most)


def irradiance(job: BakeJob, grid: Grid, _material: Material, progress: Progress | None) -> np.ndarray:
    return arrive(grid, job.illumination, job.settings, progress)[0]


def direction(job: BakeJob, grid: Grid, _material: Material, progress: Progress | None) -> np.ndarray:
    return mean_direction(arrive(grid, job.illumination, job.settings, progress)[1])


LAYERS: dict[str, Layer] = {COMBINED: luminance, IRRADIANCE: irradiance, DIRECTION: direction}

WITHOUT_MEDIUM = {IRRADIANCE, DIRECTION}
"""Layers that only look at the light: what the surface is made of need not be worked out for them."""
