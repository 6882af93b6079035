"""Light that arrives on a chart, all lights together: irradiance, and the direction in which it travels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..native import native
from ..progress import Progress
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light
from .bake_settings import BakeSettings

# Rays to a light of a size for each sample of a texel, and for a texel at most. More: less noise in penumbras, which no
# medium blurs.
RAYS_PER_SAMPLE, MAX_RAYS = 4, 4096

# Texels along a side, and rays from each, where nothing blocks the light.
OPEN_TEXELS, OPEN_RAYS = 96, 4


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
    return native.bake_arrival(
        grid.surface(),
        illumination.native_lights(grid),
        samples=settings.samples,
        rays=min(RAYS_PER_SAMPLE * settings.samples**2, MAX_RAYS),
        threads=settings.threads,
        progress=progress,
    )


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)


def mean_open_irradiance(grid: Grid, lights: Sequence[Light]) -> float:
    """Mean irradiance of lights that nothing blocks, W/m^2."""
    width, height = min(grid.width, OPEN_TEXELS), min(grid.height, OPEN_TEXELS)
    pitch = {"pitch_x": grid.pitch_x * grid.width / width, "pitch_y": grid.pitch_y * grid.height / height}
    whole = np.ones((height, width), np.float32)
    coarse = replace(grid, width=width, height=height, coverage=whole, color_in=None, color_out=None, **pitch)
    open_lights = Illumination(lights).native_lights(coarse)
    irradiance, _ = native.bake_arrival(coarse.surface(), open_lights, samples=1, rays=OPEN_RAYS)
    return float(irradiance.mean())
