"""Mean irradiance of a grid, from few texels and rays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..native import native
from ..scene.bent_grid import AnyGrid
from ..scene.illumination import Illumination
from ..scene.lights import Light, WorldLight

# Texels along a side, and rays from each, where nothing blocks the light.
OPEN_TEXELS, OPEN_RAYS = 96, 4
# The same with shadows, for means that are right to some percent.
SHADOW_TEXELS, SHADOW_RAYS = 48, 16
# Rows of the world's image for these means, and for paths through textures. More: slower, where planes have different
# normals.
MEAN_WORLD_ROWS = 512


def mean_open_irradiance(grid: AnyGrid, lights: Sequence[Light], texels: int = OPEN_TEXELS) -> float:
    """Mean irradiance of lights that nothing blocks, W/m^2, by so many texels along a side."""
    return _mean_irradiance(grid, Illumination(lights), texels, OPEN_RAYS)


def mean_irradiance(grid: AnyGrid, illumination: Illumination, texels: int = SHADOW_TEXELS) -> float:
    """Mean irradiance with shadows, W/m^2, by so many texels along a side."""
    return _mean_irradiance(grid, illumination, texels, SHADOW_RAYS)


def irradiance_map(
    grid: AnyGrid, illumination: Illumination, light: Light, has_shadows: bool, texels: int
) -> np.ndarray:
    """Irradiance (H, W) of one light, the mean of the channels, by so many texels along a side."""
    coarse = grid.coarse(texels)
    if light.is_behind(coarse):
        return np.zeros((coarse.height, coarse.width), np.float32)
    light = light.coarse(MEAN_WORLD_ROWS) if isinstance(light, WorldLight) else light
    caster = illumination.caster(grid, light) if has_shadows and light.cast_shadow else None
    arriving = [(light.at(coarse), light.rgb().tolist(), caster)]
    return _irradiance(coarse, arriving, SHADOW_RAYS).mean(axis=-1)


def _mean_irradiance(grid: AnyGrid, illumination: Illumination, texels: int, rays: int) -> float:
    coarse = grid.coarse(texels)
    lights = [
        light.coarse(MEAN_WORLD_ROWS) if isinstance(light, WorldLight) else light for light in illumination.lights
    ]
    arriving = [  # the occluders are those of the grid itself, which the bake needs as well
        (light.at(coarse), light.rgb().tolist(), illumination.caster(grid, light) if light.cast_shadow else None)
        for light in lights
        if not light.is_behind(coarse)
    ]
    return coarse.mean(_irradiance(coarse, arriving, rays))


def _irradiance(coarse: AnyGrid, arriving: list, rays: int) -> np.ndarray:
    return native.bake_arrival(coarse.surface(), arriving, samples=1, rays=rays, at_centers=True)[0]
