"""Luminance of a translucent chart: lights, occluders and a material, baked by native code."""

from __future__ import annotations

import math

import numpy as np

from ..errors import BakeError
from ..ldf.library import library
from ..ldf.samples import load_source
from ..material import Material, check_thickness
from ..native import native
from ..progress import Callback, Progress
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from .bake_settings import BakeSettings
from .surface import channel_media

# Fraction of a bake's time that loading known libraries takes.
LIBRARY_PART = 0.05

# Largest relative error of a texel by the solver, see `convolve`. Larger: faster. Half a per cent is invisible.
TOLERANCE = 5e-3

# Rays from each texel to a light of a size at least, and to all of them together at 4 x 4 samples at most. More: less
# noise, longer bakes.
MIN_RAYS, MAX_RAYS = 8, 1024

# Bytes of irradiance that are stored until the solver sees all lights, see `bake_luminance`.
MAX_STORED_BYTES = 512 << 20


def bake(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
) -> np.ndarray:
    """Luminance of a translucent plane.

    Parameters
    ----------
    grid : the plane that light arrives on, scene units.
    material : its mean free path is in the units of the grid.
    thickness : in the units of the grid, 0 for a half-space.
    progress : called with 0..1, returns False to stop.
    bytes_for_light : largest memory, bytes, of the moments that the fft solver makes of light; 0: any.

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
    return spread(grid, illumination, material, sources, settings, light_progress, bytes_for_light)


def spread(
    grid: Grid,
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    seed: int = 0,
) -> np.ndarray:
    """`bake` with the LDF of each channel given; the material is checked, and `settings.quality` does not count."""
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

    Light from a point fills some 4 pi l^2 texels, l the mean free path, over whose rays its noise is averaged; that of
    n low-discrepancy rays falls about as n^-5/8, from .69 for one (tests/bench/room.py).
    """
    path = min(material.mean_free_path) / max(grid.pitch_x, grid.pitch_y)
    texels = 1.0 + 4.0 * math.pi * path**2
    wanted = (69.0 / math.sqrt(texels)) ** (8.0 / 5.0)
    return round(min(max(wanted, MIN_RAYS), MAX_RAYS) * (settings.samples / 4) ** 2) or 1


def _libraries(material: Material, thickness: float, settings: BakeSettings, progress: Progress) -> list:
    """The LDF library of each channel; channels of the same medium share one."""
    media = channel_media(material, thickness)
    libraries = dict.fromkeys(media)
    for medium, stage in zip(libraries, progress.split([1.0] * len(libraries))):
        libraries[medium] = library(medium, settings.quality, stage, settings.threads)
    return [libraries[medium] for medium in media]
