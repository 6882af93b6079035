"""Lights -> what arrives on a chart, all lights together: irradiance, and the way that it travels."""

from __future__ import annotations

import numpy as np

from ..native import native
from ..progress import Progress, stages
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import ExtendedLight, Light
from .settings import BakeSettings

# Rays to a light of a size, for each of a texel's samples: no medium blurs the noise of half-shadows, and nothing else
# takes time.
RAYS_PER_SAMPLE, MOST_RAYS = 4, 4096

# Linear Rec. 709 to luminance (ITU-R BT.709-6), as native `gather_rays` weighs.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def arrive(
    grid: Grid, illumination: Illumination, settings: BakeSettings, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Light of all lights on the whole of each texel, whatever part of it lies inside the mesh.

    Returns
    -------
    irradiance : float32 (H, W, 3), W/m^2 on the surface, cosine and visibility included.
    flow : float32 (H, W, 3), sum over the light of its irradiance, as luminance, times the unit vector along which it
        travels, in the plane's frame. Its direction is the mean one.
    """
    irradiance, flow = np.zeros((2, grid.height, grid.width, 3), np.float32)
    caster = illumination.caster(grid)
    for light, step in zip(illumination.lights, stages(progress, [1.0] * len(illumination.lights))):
        one = _of_one(grid, light, caster if light.cast_shadow else None, settings, step)
        irradiance += one[0]
        flow += one[1]
    return irradiance, flow


def _of_one(grid: Grid, light: Light, caster, settings: BakeSettings, progress: Progress | None):
    """The same of one light."""
    color = light.rgb()
    options = {"threads": settings.threads, "progress": progress, "clearance": grid.clearance}
    if isinstance(light, ExtendedLight):
        rays = min(RAYS_PER_SAMPLE * settings.samples**2, MOST_RAYS)
        irradiance, flow = native.gather_rays(grid.native(), light.native(), caster, rays=rays, **options)
        return irradiance * color, flow * (color @ LUMINANCE)
    irradiance, travel = light.gather(grid, caster, samples=settings.samples, **options)
    return irradiance[..., None] * color, (irradiance * (color @ LUMINANCE))[..., None] * travel


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)
