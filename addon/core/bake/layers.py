"""The results that a bake can have: each layer is a name and a function of what arrives on a chart's grid.

A new one is a function and its line in `LAYERS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..material.material import Material
from ..progress import Progress
from ..scene.grid import Grid
from .luminance import bake
from .settings import COMBINED

if TYPE_CHECKING:
    from .job import BakeJob

Layer = Callable[["BakeJob", Grid, Material, "Progress | None"], np.ndarray]
"""Float32 (grid height, grid width, 3), row 0 at the bottom; the material comes with its albedo worked out."""


def luminance(job: BakeJob, grid: Grid, material: Material, progress: Progress | None) -> np.ndarray:
    return bake(grid, job.illumination, material, job.surface.thickness, job.settings, progress)


LAYERS: dict[str, Layer] = {COMBINED: luminance}
