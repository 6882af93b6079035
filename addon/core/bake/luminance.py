"""Lights -> what arrives on a chart -> luminance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from ..errors import BakeError
from ..ldf.library import library
from ..ldf.samples import load_source
from ..material import Material, check_thickness
from ..native import native
from ..progress import Progress, stages
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light
from .bake_settings import BakeSettings
from .convolve import solve as convolve_plane_lights
from .estimate import ray_seconds, solver_seconds
from .gather import Gatherer
from .surface import channel_media

# Shares of the time that a bake takes, roughly: reading an LDF that is known, gathering a light, solving for all.
LIBRARY_WEIGHT, LIGHT_WEIGHT, SOLVE_WEIGHT = 0.2, 1.0, 3.0

# Of the solvers, see `convolve`: half a per cent in the worst texel is not seen, and below the noise of libraries.
TOLERANCE = 5e-3

# Bytes of irradiance that may wait for the solver, which then looks at all of it: 128 lights on 1024 x 1024 texels.
# Beyond, light is added up as it comes, and some stands for all where the solver chooses how exactly to look.
MOST_WAITING = 512 << 20
MOST_STAND_INS = 4

# Suns that have kernels of their own then; see `LightField`.
MOST_KEPT = 4

# From each texel to all lights of a size together, at 4 x 4 samples, and at least to each of them.
MOST_RAYS, FEWEST_RAYS = 1024, 8


def bake(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Progress | None = None,
    bytes_for_light: int = 0,
) -> np.ndarray:
    """Luminance of a translucent plane.

    Parameters
    ----------
    grid : where light arrives, scene units.
    material : with its mean free path in the units of the grid.
    thickness : in the units of the grid, 0 for a half-space.
    progress : called with 0..1, returns False to stop.
    bytes_for_light : of memory, that what the fft solver keeps of light may take; 0: any.

    Returns
    -------
    float32 (grid.height, grid.width, 3), exitance / pi in W/(m^2 sr), row 0 at the bottom.

    Raises
    ------
    MaterialError
        A property outside its range.
    BakeError
        Samples that are missing, damaged, or don't reach the albedos and angles of the scene; light that takes more
        memory.
    Cancelled
        `progress` returned False.
    """
    material.check()
    check_thickness(thickness)
    light_work = LIGHT_WEIGHT * len(illumination.lights) + _solve_weight(grid, settings.solver)
    media_progress, light_progress = stages(progress, [LIBRARY_WEIGHT, light_work])
    if settings.distributions == "library":
        sources = _libraries(material, thickness, settings, media_progress)
    else:
        sources = [load_source(settings.sample_folder, settings.distributions)] * 3
    return spread(grid, illumination, material, sources, settings, light_progress, bytes_for_light)


def spread(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    progress: Progress | None = None,
    bytes_for_light: int = 0,
) -> np.ndarray:
    """`bake` with the LDF of each channel given; the material is checked, and `settings.quality` does not count."""
    lights = illumination.lights
    gatherer = Gatherer(grid, illumination, settings, rays_per_texel(grid, material, settings))
    bytes_waiting = 4 * grid.width * grid.height * len(lights)
    if all(light.has_one_direction for light in lights) and bytes_waiting <= MOST_WAITING:
        solve = _spread_together
    elif settings.solver == "fft":
        solve = partial(_spread_field, bytes_for_light)
    else:
        solve = _spread_apart
    medium = {
        "ldf": sources,
        "albedo": material.albedo,
        "mean_free_path": material.mean_free_path,
        "pitch": (grid.pitch_x, grid.pitch_y),
        "tolerance": TOLERANCE,
        "threads": settings.threads,
    }
    try:
        luminance = solve(gatherer, lights, medium, settings.solver, progress)
    except native.MemoryLimit as error:
        raise BakeError(
            f"{grid.width} x {grid.height} texels are too many: {error}. Lower the resolution, or raise the memory "
            "limit in the add-on's preferences."
        ) from error
    except ValueError as error:
        if settings.distributions == "library":
            raise
        raise BakeError(f"The LDF samples in '{settings.sample_folder}' don't reach this far: {error}.") from error
    return luminance if grid.color_out is None else luminance * grid.color_out


def rays_per_texel(grid: Grid, material: Material, settings: BakeSettings) -> int:
    """How many rays of each texel leave noise of a hundredth, in a penumbra, of what the medium spreads.

    Light from a point fills some 4 pi l^2 texels, l the mean free path, over whose rays its noise is averaged; that of
    n low-discrepancy rays falls about as n^-5/8, from .69 for one (tests/bench/room.py).
    """
    path = min(material.mean_free_path) / max(grid.pitch_x, grid.pitch_y)
    texels = 1.0 + 4.0 * math.pi * path**2
    wanted = (69.0 / math.sqrt(texels)) ** (8.0 / 5.0)
    return round(min(max(wanted, FEWEST_RAYS), MOST_RAYS) * (settings.samples / 4) ** 2) or 1


def _solve_weight(grid: Grid, solver: str) -> float:
    """Of all lights together."""
    size = grid.width, grid.height
    return SOLVE_WEIGHT * max(1.0, solver_seconds(*size, 0, 1, solver) / solver_seconds(*size, 0, 1, "fft"))


def _ray_weight(grid: Grid, rays: int) -> float:
    """Of so many rays from each texel."""
    texels = grid.width * grid.height
    return LIGHT_WEIGHT * ray_seconds(texels, rays) / solver_seconds(grid.width, grid.height, 0, 0, "fft")


def _spread_together(gatherer: Gatherer, lights: Sequence[Light], medium: dict, solver: str, progress) -> np.ndarray:
    """All lights first, then the solver: for few lights of one direction per texel."""
    gathering, solving = stages(progress, [LIGHT_WEIGHT * len(lights), _solve_weight(gatherer.grid, solver)])
    arriving = []
    for light, step in zip(lights, stages(gathering, [1.0] * len(lights))):
        arriving += [part for part in gatherer.plane_lights(light, step) if part.mean() > 0]
    if not arriving:
        return _dark(gatherer.grid)
    return convolve_plane_lights(arriving, solver=solver, progress=solving, **medium)


def _spread_apart(gatherer: Gatherer, lights: Sequence[Light], medium: dict, solver: str, progress) -> np.ndarray:
    """Light after light, and ray after ray where one has a size: for the solvers that share no work among them."""
    luminance = _dark(gatherer.grid)
    for light, step in zip(lights, stages(progress, [1.0] * len(lights))):
        gathering, solving = stages(step, [LIGHT_WEIGHT, _solve_weight(gatherer.grid, solver)])
        parts = [part for part in gatherer.layers(light, gathering) if part.mean() > 0]
        for part, part_step in zip(parts, stages(solving, [1.0] * len(parts))):
            luminance += convolve_plane_lights([part], solver=solver, progress=part_step, **medium)
    return luminance


def _spread_field(
    most_bytes: int, gatherer: Gatherer, lights: Sequence[Light], medium: dict, _solver: str, progress
) -> np.ndarray:
    """Lights of any number and size, added up as they come, in so much memory."""
    grid = gatherer.grid
    shape, survey, means = gatherer.survey()
    brightest = sorted(range(len(lights)), key=lambda i: means[i], reverse=True)
    lit = [i for i in brightest if not lights[i].is_behind(grid)]
    suns = [i for i in lit if lights[i].is_parallel]
    kept = suns if len(suns) <= MOST_KEPT else []
    later = [i for i in lit if i not in kept]
    rays = {i: max(FEWEST_RAYS, round(gatherer.rays * means[i] / (sum(means) or 1.0))) for i in later}
    to_add = [LIGHT_WEIGHT + (0.0 if lights[i].has_one_direction else _ray_weight(grid, rays[i])) for i in later]
    looking, choosing, *adding, solving = stages(progress, [LIGHT_WEIGHT, SOLVE_WEIGHT, *to_add, SOLVE_WEIGHT])
    # What a survey has missed shines on few texels, and is looked at as it is.
    look_at = [*later[:MOST_STAND_INS], *(i for i in later[MOST_STAND_INS:] if means[i] == 0)]
    parts = []
    for i, step in zip([*kept, *look_at], stages(looking, [1.0] * len(kept + look_at))):
        parts += gatherer.plane_lights(lights[i], step) if i in kept else gatherer.stand_in(lights[i], step)
    parts = [part for part in parts if part.mean() > 0]
    expected = [part for i in lit for part in survey[i]]
    if not parts and not any(means):
        return _dark(grid)
    limits = {"memory_limit": most_bytes, "progress": choosing}
    field = native.LightField((grid.height, grid.width), parts, shape, expected, **limits, **medium)
    for i, step in zip(later, adding):
        gatherer.add_to(field, lights[i], rays[i], step)
    return field.solve(solving)


def _dark(grid: Grid) -> np.ndarray:
    return np.zeros((grid.height, grid.width, 3), np.float32)


def _libraries(material: Material, thickness: float, settings: BakeSettings, progress: Progress | None) -> list:
    """The LDF library of each channel; channels of the same medium share one."""
    media = channel_media(material, thickness)
    libraries = dict.fromkeys(media)
    for medium, stage in zip(libraries, stages(progress, [1.0] * len(libraries))):
        libraries[medium] = library(medium, settings.quality, stage, settings.threads)
    return [libraries[medium] for medium in media]
