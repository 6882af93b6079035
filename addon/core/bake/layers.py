"""Layers: the results that a bake can have, each a function of the light on a grid, and a line in `LAYERS`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..errors import BakeError
from ..ldf.library import library, load_source
from ..material import Material, check_thickness
from ..native import native
from ..progress import Callback, Progress
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light
from .bake_settings import COMBINED, DIRECTION, IRRADIANCE, BakeSettings
from .surface import channel_media

# Fraction of a bake's time that loading known libraries takes.
LIBRARY_PART = 0.05

# Largest relative error of a texel by the solver, see `convolve`. Larger: faster. Half a per cent is invisible.
TOLERANCE = 5e-3

# Rays from each texel to a light of a size at least, to all of them together at 4 x 4 samples at most, and with any
# number of samples at most. More: less noise, longer bakes. 1024 rays leave .9 % of noise in a texel, 4096 .4 %.
MIN_RAYS, MAX_RAYS, MAX_RAYS_BY_SAMPLES = 8, 1024, 4096

# Bytes of irradiance that are stored until the solver sees all lights, see `bake_luminance`.
MAX_STORED_BYTES = 512 << 20

# Rays of irradiance and direction to a light of a size, for each sample of a texel. More: less noise in penumbras,
# which no medium blurs.
RAYS_PER_SAMPLE = 4

# Texels along a side, and rays from each, where nothing blocks the light.
OPEN_TEXELS, OPEN_RAYS = 96, 4
# The same with shadows, for means that are right to some percent.
SHADOW_TEXELS, SHADOW_RAYS = 48, 16

Report = Callable[[float], None]
"""Takes the noise of light, relative to its mean."""


def bake(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    report_noise: Report | None = None,
) -> np.ndarray:
    """Luminance of a translucent plane.

    Parameters
    ----------
    grid : the plane that light arrives on, scene units.
    material : its mean free path is in the units of the grid.
    thickness : in the units of the grid, 0 for a half-space.
    progress : called with 0..1, returns False to stop.
    bytes_for_light : largest memory, bytes, of the moments that the fft solver makes of light; 0: any.
    report_noise : takes the noise of the light, relative to its mean and averaged over the area in which the medium
        spreads it.

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
    media_progress, light_progress = Progress.of(progress).split([LIBRARY_PART, 1.0 - LIBRARY_PART])
    if settings.distributions == "library":
        sources = _libraries(material, thickness, settings, media_progress)
    else:
        sources = [load_source(settings.sample_folder, settings.distributions)] * 3
    return spread(
        grid, illumination, material, sources, settings, light_progress, bytes_for_light, report_noise=report_noise
    )


def spread(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    seed: int = 0,
    report_noise: Report | None = None,
) -> np.ndarray:
    """`bake` with the LDF of each channel given; the material is checked, and `settings.quality` does not count."""

    def report_spread(noise: float) -> None:
        if report_noise:
            report_noise(noise / math.sqrt(spread_texels(grid, material)))

    try:
        return native.bake_luminance(
            grid.surface(),
            illumination.native_lights(grid),
            sources,
            material.albedo,
            material.mean_free_path,
            settings.solver,
            TOLERANCE,
            samples=settings.samples,
            rays=rays_per_texel(grid, material, settings),
            min_rays=MIN_RAYS,
            seed=seed,
            threads=settings.threads,
            max_stored_bytes=MAX_STORED_BYTES,
            memory_limit=bytes_for_light,
            progress=progress,
            report_noise=report_spread,
        )
    except native.MemoryLimit as error:
        raise BakeError(
            f"{grid.width} x {grid.height} texels are too many: {error}.",
            "Lower the resolution, or raise the memory limit in the add-on's preferences.",
        ) from error
    except ValueError as error:
        if settings.distributions == "library":
            raise
        raise BakeError(f"The LDF samples in '{settings.sample_folder}' don't reach this far: {error}.") from error


def rays_per_texel(grid: Grid, material: Material, settings: BakeSettings) -> int:
    """How many rays of each texel leave noise of a hundredth, in a penumbra, of what the medium spreads.

    The noise of n low-discrepancy rays falls about as n^-5/8, from .69 for one (tests/bench/room.py). It is averaged
    over `spread_texels`.
    """
    wanted = (69.0 / math.sqrt(spread_texels(grid, material))) ** (8.0 / 5.0)
    at_four = min(max(wanted, MIN_RAYS), MAX_RAYS)
    return min(round(at_four * (settings.samples / 4) ** 2) or 1, MAX_RAYS_BY_SAMPLES)


def spread_texels(grid: Grid, material: Material) -> float:
    """Number of texels that the light from a point fills, about: 4 pi l^2, l the mean free path, and its own."""
    path = min(material.mean_free_path) / max(grid.pitch_x, grid.pitch_y)
    return 1.0 + 4.0 * math.pi * path**2


def _libraries(material: Material, thickness: float, settings: BakeSettings, progress: Progress) -> list:
    """The LDF library of each channel; channels of the same medium share one."""
    media = channel_media(material, thickness)
    libraries = dict.fromkeys(media)
    for medium, stage in zip(libraries, progress.split([1.0] * len(libraries))):
        libraries[medium] = library(medium, settings.quality, stage, settings.threads)
    return [libraries[medium] for medium in media]


def arrive(
    grid: Grid,
    illumination: Illumination,
    settings: BakeSettings,
    progress: Progress | None = None,
    report_noise: Report | None = None,
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
        rays=min(RAYS_PER_SAMPLE * settings.samples**2, MAX_RAYS_BY_SAMPLES),
        threads=settings.threads,
        progress=progress,
        report_noise=report_noise,
    )


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)


def mean_open_irradiance(grid: Grid, lights: Sequence[Light], texels: int = OPEN_TEXELS) -> float:
    """Mean irradiance of lights that nothing blocks, W/m^2, by so many texels along a side."""
    return _mean_irradiance(grid, Illumination(lights), texels, OPEN_RAYS)


def mean_irradiance(grid: Grid, illumination: Illumination) -> float:
    """Mean irradiance with shadows, W/m^2."""
    return _mean_irradiance(grid, illumination, SHADOW_TEXELS, SHADOW_RAYS)


def _mean_irradiance(grid: Grid, illumination: Illumination, texels: int, rays: int) -> float:
    width, height = min(grid.width, texels), min(grid.height, texels)
    pitch = {"pitch_x": grid.pitch_x * grid.width / width, "pitch_y": grid.pitch_y * grid.height / height}
    whole = np.ones((height, width), np.float32)
    coarse = replace(grid, width=width, height=height, coverage=whole, color_in=None, color_out=None, **pitch)
    arriving = [  # the occluders are those of the grid itself, which the bake needs as well
        (light.at(coarse), light.rgb().tolist(), illumination.caster(grid, light) if light.cast_shadow else None)
        for light in illumination.lights
        if not light.is_behind(coarse)
    ]
    irradiance, _ = native.bake_arrival(coarse.surface(), arriving, samples=1, rays=rays)
    return float(irradiance.mean())


Layer = Callable[[Grid, Illumination, Material, float, BakeSettings, Progress, int, Report], np.ndarray]
"""Takes the arguments of `luminance.bake`; float32 (grid height, grid width, 3), row 0 at the bottom."""


def irradiance(grid, illumination, _material, _thickness, settings, progress, _bytes_for_light, report) -> np.ndarray:
    return arrive(grid, illumination, settings, progress, report)[0]


def direction(grid, illumination, _material, _thickness, settings, progress, _bytes_for_light, report) -> np.ndarray:
    return mean_direction(arrive(grid, illumination, settings, progress, report)[1])


LAYERS: dict[str, Layer] = {COMBINED: bake, IRRADIANCE: irradiance, DIRECTION: direction}

WITHOUT_MEDIUM = {IRRADIANCE, DIRECTION}
"""Layers that do not depend on the material."""
