"""Lights -> what arrives on a chart -> luminance."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BakeError
from ..ldf.library import library
from ..ldf.samples import load_source
from ..material.material import Material, check_thickness
from ..native import native
from ..progress import Progress, stages
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light
from .convolve import solve
from .settings import BakeSettings

# Shares of the time that a bake takes, roughly: simulating an LDF not in the cache, gathering a light, solving for all.
LIBRARY_WEIGHT, LIGHT_WEIGHT, SOLVE_WEIGHT = 2.0, 1.0, 3.0

# Of the solvers, see `convolve`: half a per cent in the worst texel is not seen, and below the noise of libraries.
TOLERANCE = 5e-3

# Bytes of irradiance that wait for the solver at once, which bounds the memory for any number of lights: 128 of them on
# 1024 x 1024 texels. Beyond, it solves again.
MOST_WAITING = 512 << 20


def bake(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Progress | None = None,
) -> np.ndarray:
    """Luminance of a translucent plane.

    Parameters
    ----------
    grid : where light arrives, scene units.
    material : with its mean free path in the units of the grid.
    thickness : in the units of the grid, 0 for a half-space.
    progress : called with 0..1, returns False to stop.

    Returns
    -------
    float32 (grid.height, grid.width, 3), exitance / pi in W/(m^2 sr), row 0 at the bottom.

    Raises
    ------
    MaterialError
        A property outside its range.
    BakeError
        Samples that are missing, damaged, or don't reach the albedos and angles of the scene.
    Cancelled
        `progress` returned False.
    """
    lights = illumination.lights
    material.check()
    check_thickness(thickness)
    at_once = max(1, MOST_WAITING // (4 * grid.width * grid.height))
    together = [lights[first : first + at_once] for first in range(0, len(lights), at_once)]
    weights = [LIBRARY_WEIGHT] + [weight for some in together for weight in (LIGHT_WEIGHT * len(some), SOLVE_WEIGHT)]
    media_progress, *steps = stages(progress, weights)
    if settings.distributions == "library":
        sources = _libraries(material, thickness, settings.quality, media_progress)
    else:
        sources = [load_source(settings.sample_folder, settings.distributions)] * 3
    luminance = np.zeros((grid.height, grid.width, 3), np.float32)
    for some, gathering, solving in zip(together, steps[::2], steps[1::2]):
        arriving = _gather(grid, some, illumination.caster(grid), settings, gathering)
        if arriving:
            luminance += _spread(arriving, sources, material, grid, settings, solving)
    return luminance


def _gather(grid: Grid, lights: Sequence[Light], caster, settings: BakeSettings, progress) -> list:
    """What arrives from each light that reaches the chart, as native `PlaneLight`s."""
    arriving = []
    for light, step in zip(lights, stages(progress, [1.0] * len(lights))):
        irradiance, direction = gather_unit(grid, light, caster, settings, step, directions=False)
        color = light.rgb()
        if not (irradiance.any() and color.any()):
            continue
        position = light.position_in(grid)
        if position is None:
            arriving.append(native.PlaneLight(irradiance, direction.astype(np.float32), color.tolist()))
        else:
            arriving.append(native.PlaneLight.from_point(irradiance, position, color.tolist()))
    return arriving


def gather_unit(
    grid: Grid, light: Light, caster, settings: BakeSettings, progress: Progress | None = None, directions: bool = True
) -> tuple[np.ndarray, np.ndarray | None]:
    """Irradiance (H, W) of the light at strength 1 and color 1, W/m^2 with cosine, visibility and coverage.

    And the direction of travel, unit vectors in the plane's frame: (3,) for a sun, else (H, W, 3), or None if no
    `directions` are wanted. `caster` is a native `Occluders` or None.
    """
    irradiance, direction = light.gather(
        grid,
        caster if light.cast_shadow else None,
        samples=settings.samples,
        threads=settings.threads,
        progress=progress,
        clearance=grid.clearance,
        directions=directions,
    )
    irradiance *= grid.coverage
    return irradiance, direction


def light_beams(
    grid: Grid, light: Light, caster, settings: BakeSettings, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance (H, W, 3) of the light as it is, and its direction; see `gather_unit`."""
    irradiance, direction = gather_unit(grid, light, caster, settings, progress)
    return irradiance[..., None] * light.rgb(), direction


def _libraries(material: Material, thickness: float, quality: str, progress: Progress | None) -> list:
    """The LDF library of each channel; channels of the same medium share one."""
    depths = [thickness / length if thickness else math.inf for length in material.mean_free_path]
    channels = list(zip(material.channel_anisotropy, depths))
    distinct = sorted(set(channels))
    by_channel = {}
    for (g, depth), stage in zip(distinct, stages(progress, [1.0] * len(distinct))):
        medium = native.Medium(g=g, ior=material.ior, thickness=depth)
        by_channel[g, depth] = library(medium, quality=quality, progress=stage)
    return [by_channel[channel] for channel in channels]


def _spread(arriving: list, sources: list, material: Material, grid: Grid, settings: BakeSettings, progress):
    try:
        return solve(
            arriving,
            sources,
            material.albedo,
            material.mean_free_path,
            (grid.pitch_x, grid.pitch_y),
            solver=settings.solver,
            tolerance=TOLERANCE,
            threads=settings.threads,
            progress=progress,
        )
    except ValueError as error:
        if settings.distributions == "library":
            raise
        raise BakeError(f"The LDF samples in '{settings.sample_folder}' don't reach this far: {error}.") from error
