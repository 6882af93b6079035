"""Layers: the results that a bake can have, each a function of the light on a grid, and a line in `LAYERS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..ldf.library import library, load_source
from ..material import Material, check_thickness
from ..native import native
from ..progress import Callback, Progress
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.illumination import Illumination
from .bake_settings import COMBINED, DIRECTION, IRRADIANCE, BakeSettings
from .spread_light import MAX_RAYS_BY_SAMPLES, has_back, spread
from .spreading import Report, Reports, Spreading
from .surface import channel_media

# Fraction of a bake's time that loading known libraries takes.
LIBRARY_PART = 0.05

# Rays of irradiance and direction to a light of a size, for each sample of a texel. More: less noise in penumbras,
# which no medium blurs.
RAYS_PER_SAMPLE = 4

NO_REPORTS = Reports()


def bake(
    grids: Sequence[AnyGrid],
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    reports: Reports = NO_REPORTS,
) -> list[np.ndarray]:
    """Luminance of translucent planes, between which no light passes, or of a surface that bends.

    Slabs show the light on both of their faces: that of the face behind the grids is transmitted.

    Parameters
    ----------
    grids : the planes that light arrives on, or one of faces that bend, scene units.
    material : its mean free path is in the units of the grids.
    thickness : in the units of the grids, 0 for a half-space.
    progress : called with 0..1, returns False to stop.
    bytes_for_light : largest memory, bytes, of the moments that the fft solver makes of light; 0: any.

    Returns
    -------
    float32 (grid.height, grid.width, 3) of each grid, exitance / pi in W/(m^2 sr), row 0 at the bottom.

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
        curved = any(isinstance(grid, BentGrid) for grid in grids)
        sources = _libraries(material, thickness, settings, media_progress, curved)
    else:
        sources = [load_source(settings.sample_folder, settings.distributions)] * 3
    is_slab = has_back(thickness, settings)
    rest = {"is_slab": is_slab, "bytes_for_light": bytes_for_light, "reports": reports}
    return spread(grids, Spreading(illumination, material, sources, settings, **rest), light_progress)


def _libraries(material: Material, thickness: float, settings: BakeSettings, progress: Progress, curved: bool) -> list:
    """The LDF library of each channel; channels of the same medium share one. `curved`: as for `library`."""
    media = channel_media(material, thickness)
    libraries = dict.fromkeys(media)
    for medium, stage in zip(libraries, progress.split([1.0] * len(libraries))):
        libraries[medium] = library(medium, settings.quality, stage, settings.threads, curved)
    return [libraries[medium] for medium in media]


def arrive(
    grid: AnyGrid,
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
        along which it travels, in the plane's frame. Its direction is the mean one. On faces that bend, y runs up the
        rows and is at right angles to the columns.
    """

    def report(irradiance: float, variance: float) -> None:
        if report_noise:
            report_noise(grid.area, irradiance + illumination.stored_irradiance(grid), variance)

    irradiance, flow = native.bake_arrival(
        grid.surface(),
        illumination.native_lights(grid),
        samples=settings.samples,
        rays=rays_without_medium(settings),
        threads=settings.threads,
        progress=progress,
        report_noise=report,
    )
    return irradiance, flow * grid.handedness if isinstance(grid, BentGrid) else flow


def rays_without_medium(settings: BakeSettings) -> int:
    """How many rays of each texel irradiance and direction take to each light of a size."""
    return min(RAYS_PER_SAMPLE * settings.samples**2, MAX_RAYS_BY_SAMPLES)


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)


Layer = Callable[
    [Sequence[AnyGrid], Illumination, Material, float, BakeSettings, Progress, int, Reports], list[np.ndarray]
]
"""Takes the arguments of `bake`; float32 (height, width, 3) of each grid, row 0 at the bottom."""


def irradiance(grids, illumination, _material, _thickness, settings, progress, _bytes_for_light, reports) -> list:
    return [irradiance for irradiance, _ in _arrive_on_all(grids, illumination, settings, progress, reports.noise)]


def direction(grids, illumination, _material, _thickness, settings, progress, _bytes_for_light, reports) -> list:
    flows = _arrive_on_all(grids, illumination, settings, progress, reports.noise)
    return [mean_direction(flow) for _, flow in flows]


def _arrive_on_all(grids, illumination, settings, progress, report) -> list[tuple[np.ndarray, np.ndarray]]:
    parts = progress.split([float(grid.texels) for grid in grids])
    return [arrive(grid, illumination, settings, part, report) for grid, part in zip(grids, parts)]


LAYERS: dict[str, Layer] = {COMBINED: bake, IRRADIANCE: irradiance, DIRECTION: direction}

WITHOUT_MEDIUM = {IRRADIANCE, DIRECTION}
"""Layers that do not depend on the material."""
