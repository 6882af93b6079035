"""Light that crosses a sheet without being scattered, where solvers know scattered light alone."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from ..native import native
from ..scene.bent_grid import AnyGrid
from ..scene.illumination import Illumination

# Cosines of the angle of incidence between which fractions are interpolated. More: more exact for thin sheets.
COSINES = np.linspace(0.02, 1.0, 50)

# Fraction of light straight on below which it is left out. Larger: less light in thick sheets, shorter bakes.
NEGLIGIBLE = 1e-4


def straight_through(
    grid: AnyGrid, illumination: Illumination, sources: list, samples: int, rays: int, threads: int = 0
) -> np.ndarray:
    """Luminance of light that leaves the face behind a grid where it has entered, float32 (height, width, 3).

    Each light counts by its mean direction at each texel. Light that crosses at an angle is not moved along.
    """
    parts = [_fractions(source.medium) for source in sources]
    luminance = np.zeros((grid.height, grid.width, 3), np.float32)
    if max(part[-1] for part in parts) < NEGLIGIBLE:
        return luminance
    for light in illumination.lights:
        arriving = illumination.with_lights([light]).native_lights(grid)
        if not arriving:
            continue
        irradiance, flow = native.bake_arrival(grid.surface(), arriving, samples=samples, rays=rays, threads=threads)
        mean = irradiance.mean(axis=-1)
        cosine = np.divide(-flow[..., 2], mean, out=np.ones_like(mean), where=mean > 0)
        for channel, part in enumerate(parts):
            luminance[..., channel] += irradiance[..., channel] * np.interp(cosine, COSINES, part) / math.pi
    for factor in (grid.color_in, grid.color_out):
        if factor is not None:
            luminance *= factor
    return luminance


@lru_cache(maxsize=16)
def _fractions(medium) -> np.ndarray:
    """Fraction of light at each of `COSINES` that a slab lets by without scattering it: all that a black one does."""
    _, transmitted = native.exact_totals(medium, np.degrees(np.arccos(COSINES)).tolist(), [0.0])
    return np.asarray(transmitted)[:, 0]
