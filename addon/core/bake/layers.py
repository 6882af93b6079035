"""Layers: the results that a bake can have, each a function of the light on a grid, and a line in `LAYERS`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..errors import BakeError
from ..ldf.library import library, load_source
from ..material import Material, check_thickness
from ..native import native
from ..progress import Callback, Progress
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.illumination import Illumination
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

Report = Callable[[float, float, float], None]
"""Takes an area, the mean irradiance there, W/m^2, and the mean variance of it that is left in the result."""


def bake(
    grids: Sequence[AnyGrid],
    illumination: Illumination,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    report_noise: Report | None = None,
    report_bend: Callable[[float], None] | None = None,
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
    report_noise : takes the noise of the light, averaged over the area in which the medium spreads it.
    report_bend : takes the fraction of a surface that bends more than the libraries know.

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
    reports = {"report_noise": report_noise, "report_bend": report_bend, "is_slab": has_back(thickness, settings)}
    return spread(grids, illumination, material, sources, settings, light_progress, bytes_for_light, **reports)


def spread(
    grids: Sequence[AnyGrid],
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    seed: int = 0,
    report_noise: Report | None = None,
    rays: int = 0,
    report_bend: Callable[[float], None] | None = None,
    is_slab: bool = False,
) -> list[np.ndarray]:
    """`bake` with the LDF of each channel given; the material is checked, and `settings.quality` does not count.

    `rays`: from each texel to all lights of a size together; 0: by the medium, see `rays_per_texel`. `is_slab`: light
    on the face behind counts, see `has_back`.
    """
    sides = {"reflected": list(grids), **({"transmitted": backs_of(grids)} if is_slab else {})}
    # A side without light takes no time.
    lit = {side: there for side, there in sides.items() if illumination.reaches(there)} or {"reflected": list(grids)}
    parts = Progress.of(progress).split([1.0] * len(lit))
    rest = bytes_for_light, seed, report_noise, rays, report_bend
    results = [
        spread_side(side, there, illumination, material, sources, settings, part, *rest)
        for (side, there), part in zip(lit.items(), parts)
    ]
    return [sum(on_grid[1:], start=on_grid[0]) for on_grid in zip(*results)]


def has_back(thickness: float, settings: BakeSettings) -> bool:
    """True if light on the face behind a surface counts: in slabs whose LDF is known on both sides."""
    return thickness > 0 and settings.layer == COMBINED and settings.distributions == "library"


def backs_of(grids: Sequence[AnyGrid]) -> list[AnyGrid]:
    """The grids of the faces behind: the same texels."""
    return [grid.flipped() for grid in grids]


def spread_side(
    side: str,
    grids: Sequence[AnyGrid],
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    progress: Callback | None = None,
    bytes_for_light: int = 0,
    seed: int = 0,
    report_noise: Report | None = None,
    rays: int = 0,
    report_bend: Callable[[float], None] | None = None,
) -> list[np.ndarray]:
    """Luminance by light on one side of the grids: on their own (reflected), or on that behind (transmitted)."""
    by_rays: dict[int, list[int]] = {}
    for number, grid in enumerate(grids):
        by_rays.setdefault(rays or rays_per_texel(grid, material, settings), []).append(number)
    groups = [(count, [grids[number] for number in numbers]) for count, numbers in by_rays.items()]
    parts = Progress.of(progress).split([float(sum(grid.texels for grid in group)) for _, group in groups])
    rest = illumination, material, sources, settings
    luminances: list = [None] * len(grids)
    for (count, group), numbers, part in zip(groups, by_rays.values(), parts):
        of_group = _spread_group(side, group, *rest, count, part, bytes_for_light, seed, report_noise, report_bend)
        for number, luminance in zip(numbers, of_group):
            luminances[number] = luminance
    return luminances


def _spread_group(
    side: str,
    grids: list[AnyGrid],
    illumination: Illumination,
    material: Material,
    sources: list,
    settings: BakeSettings,
    rays: int,
    progress: Progress,
    bytes_for_light: int,
    seed: int,
    report_noise: Report | None,
    report_bend: Callable[[float], None] | None,
) -> list[np.ndarray]:
    """`spread_side` for grids with as many rays to each texel."""

    def report_spread(irradiance: float, variance: float) -> None:
        if report_noise:
            area = sum(grid.area for grid in grids)
            report_noise(area, irradiance, variance / spread_texels(grids[0], material))

    try:
        return native.bake_luminance(
            [grid.surface() for grid in grids],
            illumination.arriving_lights(grids),
            sources,
            material.albedo,
            material.mean_free_path,
            settings.solver,
            TOLERANCE,
            samples=settings.samples,
            rays=rays,
            min_rays=MIN_RAYS,
            seed=seed,
            threads=settings.threads,
            max_stored_bytes=MAX_STORED_BYTES,
            memory_limit=bytes_for_light,
            progress=progress,
            report_noise=report_spread,
            report_beyond=lambda shares: report_bend and report_bend(max(shares)),
            side=side,
        )
    except native.MemoryLimit as error:
        largest = max(grids, key=lambda grid: grid.texels)
        raise BakeError(
            f"{largest.width} x {largest.height} texels are too many: {error}.",
            "Lower the resolution, or raise the memory limit in the add-on's preferences.",
        ) from error
    except ValueError as error:
        if settings.distributions == "library":
            raise
        raise BakeError(f"The LDF samples in '{settings.sample_folder}' don't reach this far: {error}.") from error


def rays_per_texel(grid: AnyGrid, material: Material, settings: BakeSettings) -> int:
    """How many rays of each texel leave noise of a hundredth, in a penumbra, of what the medium spreads.

    The noise of n low-discrepancy rays falls about as n^-5/8, from .69 for one (tests/bench/room.py). It is averaged
    over `spread_texels`.
    """
    wanted = (69.0 / math.sqrt(spread_texels(grid, material))) ** (8.0 / 5.0)
    at_four = min(max(wanted, MIN_RAYS), MAX_RAYS)
    return min(round(at_four * (settings.samples / 4) ** 2) or 1, MAX_RAYS_BY_SAMPLES)


def spread_texels(grid: AnyGrid, material: Material) -> float:
    """Number of texels that the light from a point fills, about: 4 pi l^2, l the mean free path, and its own."""
    path = min(material.mean_free_path) / max(grid.pitch_x, grid.pitch_y)
    return 1.0 + 4.0 * math.pi * path**2


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
            report_noise(grid.area, irradiance, variance)

    irradiance, flow = native.bake_arrival(
        grid.surface(),
        illumination.native_lights(grid),
        samples=settings.samples,
        rays=min(RAYS_PER_SAMPLE * settings.samples**2, MAX_RAYS_BY_SAMPLES),
        threads=settings.threads,
        progress=progress,
        report_noise=report,
    )
    return irradiance, flow * grid.handedness if isinstance(grid, BentGrid) else flow


def mean_direction(flow: np.ndarray) -> np.ndarray:
    """Unit vectors (H, W, 3) along the flow, 0 where there is none."""
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    return np.divide(flow, length, out=np.zeros_like(flow), where=length > 0)


Layer = Callable[
    [Sequence[AnyGrid], Illumination, Material, float, BakeSettings, Progress, int, Report, Callable], list[np.ndarray]
]
"""Takes the arguments of `bake`; float32 (height, width, 3) of each grid, row 0 at the bottom."""


def irradiance(
    grids, illumination, _material, _thickness, settings, progress, _bytes_for_light, report, _bend=None
) -> list:
    return [irradiance for irradiance, _ in _arrive_on_all(grids, illumination, settings, progress, report)]


def direction(
    grids, illumination, _material, _thickness, settings, progress, _bytes_for_light, report, _bend=None
) -> list:
    return [mean_direction(flow) for _, flow in _arrive_on_all(grids, illumination, settings, progress, report)]


def _arrive_on_all(grids, illumination, settings, progress, report) -> list[tuple[np.ndarray, np.ndarray]]:
    parts = progress.split([float(grid.texels) for grid in grids])
    return [arrive(grid, illumination, settings, part, report) for grid, part in zip(grids, parts)]


LAYERS: dict[str, Layer] = {COMBINED: bake, IRRADIANCE: irradiance, DIRECTION: direction}

WITHOUT_MEDIUM = {IRRADIANCE, DIRECTION}
"""Layers that do not depend on the material."""
