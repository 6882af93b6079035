"""Lights -> what arrives on a chart, all lights together: irradiance, and the way that it travels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..progress import Progress, stages
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from .bake_settings import BakeSettings
from .gather import Gatherer

# Rays to a light of a size, for each of a texel's samples: no medium blurs the noise of half-shadows. At most 4096.
RAYS_PER_SAMPLE, MOST_RAYS = 4, 4096


def arrive(
    grid: Grid, illumination: Illumination, settings: BakeSettings, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Light of all lights on the whole of each texel, whatever part of it lies inside the mesh.

    Returns
    -------
    irradiance : float32 (H, W, 3), W/m^2 on the surface, cosine and visibility included.
    flow : float32 (H, W, 3), sum over the light of its irradiance, the mean of the channels, times the unit vector
        along which it travels, in the plane's frame. Its direction is the mean one.
    """
    rays = min(RAYS_PER_SAMPLE * settings.samples**2, MOST_RAYS)
    whole = replace(grid, coverage=np.ones_like(grid.coverage), color_in=None)
    gatherer = Gatherer(whole, illumination, settings)
    irradiance, flow = np.zeros((2, grid.height, grid.width, 3), np.float32)
    for light, step in zip(illumination.lights, stages(progress, [1.0] * len(illumination.lights))):
        if light.is_behind(grid):
            continue
        white, white_flow = gatherer.totals(light, rays, step)
        irradiance += white * light.rgb()
        flow += white_flow * light.rgb().mean()
    return irradiance, flow


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)
