"""Light on surfaces to luminance: it spreads in the medium, from one side of the surface or from both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import BakeError
from ..material import Material
from ..native import native
from ..progress import Callback, Progress
from ..scene.bent_grid import AnyGrid
from .bake_settings import COMBINED, BakeSettings
from .spreading import Spreading
from .textured_bake import corrected, with_factors

# Largest relative error of a texel by the solver, see `convolve`. Larger: faster. Half a per cent is invisible.
TOLERANCE = 5e-3

# Rays from each texel to a light of a size at least, to all of them together at 4 x 4 samples at most, and with any
# number of samples at most. More: less noise, longer bakes. 1024 rays leave .9 % of noise in a texel, 4096 .4 %.
MIN_RAYS, MAX_RAYS, MAX_RAYS_BY_SAMPLES = 8, 1024, 4096

# Bytes of irradiance that are stored until the solver sees all lights, see `bake_luminance`.
MAX_STORED_BYTES = 512 << 20

# Fraction of a bake's time in which light in a texture's albedos is found.
TEXTURED_PART = 0.6


def spread(grids: Sequence[AnyGrid], spreading: Spreading, progress: Callback | None = None) -> list[np.ndarray]:
    """Luminance of light on all lit sides, as of `layers.bake`."""
    grids, material = with_factors(grids, spreading.material, spreading.sources)
    return spread_on(grids, replace(spreading, material=material), progress)


def spread_on(grids: Sequence[AnyGrid], spreading: Spreading, progress: Callback | None = None) -> list[np.ndarray]:
    """`spread` on grids that have the convention's factors."""
    sides = {"reflected": grids, **({"transmitted": backs_of(grids)} if spreading.is_slab else {})}
    # A side without light takes no time.
    lit = {side: there for side, there in sides.items() if spreading.illumination.reaches(there)}
    lit = lit or {"reflected": grids}
    parts = Progress.of(progress).split([1.0] * len(lit))
    results = [_spread_textured(side, there, spreading, part) for (side, there), part in zip(lit.items(), parts)]
    return [sum(on_grid[1:], start=on_grid[0]) for on_grid in zip(*results)]


def has_back(thickness: float, settings: BakeSettings) -> bool:
    """True if light on the face behind a surface counts: in slabs whose LDF is known on both sides."""
    return thickness > 0 and settings.layer == COMBINED and settings.distributions == "library"


def backs_of(grids: Sequence[AnyGrid]) -> list[AnyGrid]:
    """The grids of the faces behind: the same texels."""
    return [grid.flipped() for grid in grids]


def _spread_textured(side: str, grids: Sequence[AnyGrid], spreading: Spreading, progress: Progress) -> list[np.ndarray]:
    """Luminance by light on one side of the grids: on their own (reflected), or on that behind (transmitted)."""
    if all(grid.albedo is None for grid in grids):
        return spread_side(side, grids, spreading, progress)
    solving, correcting = progress.split([1 - TEXTURED_PART, TEXTURED_PART])
    luminances = spread_side(side, grids, spreading, solving)
    parts = correcting.split([float(grid.texels) for grid in grids])
    return [
        corrected(side, grid, luminance, spreading, part) for grid, luminance, part in zip(grids, luminances, parts)
    ]


def spread_side(side: str, grids: Sequence[AnyGrid], spreading: Spreading, progress: Progress) -> list[np.ndarray]:
    """Luminance by light on one side, where textures multiply light."""
    by_rays: dict[int, list[int]] = {}
    for number, grid in enumerate(grids):
        rays = spreading.rays or rays_per_texel(grid, spreading.material, spreading.settings)
        by_rays.setdefault(rays, []).append(number)
    groups = [(count, [grids[number] for number in numbers]) for count, numbers in by_rays.items()]
    parts = progress.split([float(sum(grid.texels for grid in group)) for _, group in groups])
    luminances: list = [None] * len(grids)
    for (count, group), numbers, part in zip(groups, by_rays.values(), parts):
        for number, luminance in zip(numbers, _spread_group(side, group, spreading, count, part)):
            luminances[number] = luminance
    return luminances


def _spread_group(
    side: str, grids: list[AnyGrid], spreading: Spreading, rays: int, progress: Progress
) -> list[np.ndarray]:
    """`spread_side` for grids with as many rays to each texel."""
    material, settings, reports = spreading.material, spreading.settings, spreading.reports

    def report_spread(irradiance: float, variance: float) -> None:
        if reports.noise:
            areas = [grid.area for grid in grids]
            stored = np.average([spreading.illumination.stored_irradiance(grid) for grid in grids], weights=areas)
            reports.noise(sum(areas), irradiance + float(stored), variance / spread_texels(grids[0], material))

    try:
        return native.bake_luminance(
            [grid.surface() for grid in grids],
            spreading.illumination.arriving_lights(grids),
            spreading.sources,
            material.albedo,
            material.mean_free_path,
            settings.solver,
            TOLERANCE,
            samples=settings.samples,
            rays=rays,
            min_rays=MIN_RAYS,
            seed=spreading.seed,
            threads=settings.threads,
            max_stored_bytes=MAX_STORED_BYTES,
            memory_limit=spreading.bytes_for_light,
            progress=progress,
            report_noise=report_spread,
            report_beyond=lambda shares: reports.bend and reports.bend(max(shares)),
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
