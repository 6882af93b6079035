"""Light of a few directions that stands for all lights on a grid."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..native import native
from ..scene.bent_grid import AnyGrid
from ..scene.illumination import Illumination
from ..scene.lights import Light, WorldLight
from .bake_settings import BakeSettings
from .directions import FAR_LIGHT, NEAR_LIGHT, NEAR_PART, SURVEY_TEXELS, Beams, Splitter, is_near
from .mean_light import MEAN_WORLD_ROWS
from .spreading import Effort

# Cosine of the mean angle between a light's rays at a texel and their mean, from which they count as one direction.
# Smaller: faster, and light that goes another way.
PARALLEL = 0.99

# Least cosine of light's angle from the normal. Smaller: longer paths along the surface.
GRAZING = 0.05


def arriving_beams(
    grid: AnyGrid, illumination: Illumination, settings: BakeSettings, effort: Effort, spread: float = 0.0
) -> Beams:
    """Light of a few directions on a grid that stands for all lights, at fewer texels where the grid has many.

    `spread`: length that light spreads in the medium, in the unit of the grid.
    """
    lights = lights_before(grid, illumination)
    coarse = grid.coarse(SURVEY_TEXELS)
    surveys = surveyed(coarse, lights, settings, effort)
    shape, size = (-1, coarse.height, coarse.width), (grid.height * grid.pitch_y, grid.width * grid.pitch_x)
    maps = [(power.reshape(shape), way.reshape(*shape, 3)) for power, way in surveys]
    near = effort.is_split and is_near(maps, size, spread)
    target = grid.gathering(effort.texels // NEAR_PART if near else effort.texels)
    splitter = Splitter.of(surveys, effort.max_own, effort.is_split, NEAR_LIGHT if near else FAR_LIGHT)
    for number, light in enumerate(lights.lights):
        for part, way in rays_of(target, light, lights, settings, effort):
            splitter.add(number, part, way)
    return splitter.beams


def lights_before(grid: AnyGrid, illumination: Illumination) -> Illumination:
    """The illumination with the lights in front of a grid; worlds have fewer pixels."""
    return illumination.with_lights(
        [
            light.coarse(MEAN_WORLD_ROWS) if isinstance(light, WorldLight) else light
            for light in illumination.lights
            if not light.is_behind(grid)
        ]
    )


def surveyed(
    survey: AnyGrid, illumination: Illumination, settings: BakeSettings, effort: Effort
) -> list[tuple[NDArray, NDArray]]:
    """Powers (N,) and directions (N, 3) of the rays of each light at the texels of a coarse grid, set by set."""
    surveys = []
    for light in illumination.lights:
        rays = list(rays_of(survey, light, illumination, settings, effort))
        powers = np.concatenate([part.sum(-1).ravel() for part, _ in rays])
        surveys.append((powers, np.concatenate([way.reshape(-1, 3) for _, way in rays])))
    return surveys


def rays_of(
    grid: AnyGrid, light: Light, illumination: Illumination, settings: BakeSettings, effort: Effort
) -> Iterator[tuple[NDArray, NDArray]]:
    """Irradiance (H, W, 3) and directions (H, W, 3) that stand for a light: one at each texel, or four around it.

    The angle between the four and their mean is that of the light's own mean direction.
    """
    caster = illumination.caster(grid, light) if light.cast_shadow else None
    irradiance, flow = native.bake_arrival(
        grid.surface(),
        [(light.at(grid), light.rgb().tolist(), caster)],
        samples=2,
        rays=effort.rays,
        threads=settings.threads,
    )
    power, length = irradiance.mean(-1), np.linalg.norm(flow, axis=-1)
    mean = np.divide(flow, length[..., None], out=np.zeros_like(flow), where=length[..., None] > 0)
    mean[length <= 0] = (0, 0, -1)
    if length.sum(dtype=float) >= PARALLEL * power.sum(dtype=float):
        yield irradiance, _downward(mean)
        return
    cosine = np.clip(np.divide(length, power, out=np.ones_like(length), where=power > 0), 0, 1)[..., None]
    sine = np.sqrt(1 - cosine**2)
    across = np.cross(mean, np.where(np.abs(mean[..., :1]) < 0.6, np.float32([1, 0, 0]), np.float32([0, 1, 0])))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    up = np.cross(mean, across)
    for side in (across, up, -across, -up):
        yield irradiance / 4, _downward(cosine * mean + sine * side)


def _downward(way: NDArray) -> NDArray:
    """Unit vectors that travel into the surface."""
    way = way.copy()
    way[..., 2] = np.minimum(way[..., 2], -GRAZING)
    return way / np.linalg.norm(way, axis=-1, keepdims=True)
