"""Bakes of planes in whose texels light scatters by albedos of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ldf.reflectance_table import ReflectanceTable, reflectance_table
from ..material import Material
from ..messages import Message, note
from ..progress import Progress
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.sampling import resized
from .bake_settings import DIRECTION, IRRADIANCE, BakeSettings
from .beams import arriving_beams
from .bent_textured import ratio_on_planes
from .directions import Beams
from .spreading import Spreading
from .textured import Convention, TexturedPlane, continued, spread_length

# Texels along a side of mirror images in which paths are followed. More: slower; fewer: less light beyond long paths.
MIRRORED_TEXELS = 128


def why_multiplied(settings: BakeSettings) -> str:
    """Part of a sentence that says why a texture has to multiply light; "" if light can scatter in it."""
    if settings.layer in (IRRADIANCE, DIRECTION):
        return ""
    if settings.distributions != "library":
        return "LDF samples have one albedo"
    return ""


def multiplied_note(name: str, why: str) -> Message:
    """The note about an object whose texture multiplies light, though it should scatter it."""
    text = f"The texture of '{name}' multiplies light where it enters and leaves, as in other renderers, since {why}."
    return note(name, text)


def noisy_note(name: str, noise: float) -> Message:
    """The note about the noise of an object's texture."""
    text = f"The light in the texture of '{name}' has a noise of {100 * noise:.1f} %, since its colors differ much."
    return note(name, text)


def with_factors(grids: Sequence[AnyGrid], material: Material, sources: Sequence) -> tuple[list[AnyGrid], Material]:
    """Grids with the albedos of their texels and the convention's factors, and the material with its albedo.

    Grids without an albedo or a base color of each texel stay as they are.
    """
    if all(grid.base_color is None and grid.albedo is None for grid in grids):
        return list(grids), material
    # Made before the arrays of each channel, whose memory would otherwise stay below them.
    factors = [np.empty((*grid.coverage.shape, 3), np.float32) for grid in grids]
    albedos = [grid.albedo if _is_known(grid) else np.empty_like(factor) for grid, factor in zip(grids, factors)]
    means = []
    for c, source in enumerate(sources):
        found, convention = _channel(grids, c, reflectance_table(source))
        for number, values in found.items():
            albedos[number][..., c] = values
        for factor, values in zip(factors, convention.factors):
            factor[..., c] = values
        means.append(convention.albedo)
    changed = [
        replace(grid, albedo=albedo, base_color=None, color_in=factor, color_out=factor)
        for grid, albedo, factor in zip(grids, albedos, factors)
    ]
    return changed, replace(material, albedo=tuple(means))


def _is_known(grid: AnyGrid) -> bool:
    """True if all texels have an albedo."""
    return grid.albedo is not None and bool((grid.coverage > 0).all())


def _channel(grids: Sequence[AnyGrid], c: int, table: ReflectanceTable) -> tuple[dict[int, NDArray], Convention]:
    """Albedos (H, W) in a channel of the grids, by number, that do not know all; and the convention of all grids."""
    albedos, reflectances = {}, []
    for number, grid in enumerate(grids):
        values = continued((grid.base_color if grid.albedo is None else grid.albedo)[..., c], grid.coverage > 0)
        if not _is_known(grid):
            albedos[number] = np.float32(table.albedo(values) if grid.albedo is None else values)
        reflectances.append(np.clip(values, *table.ends) if grid.albedo is None else table.reflectance(values))
    return albedos, Convention.of(reflectances, table, [grid.weights for grid in grids])


def corrected(side: str, grid: AnyGrid, luminance: NDArray, spreading: Spreading, progress: Progress) -> NDArray:
    """Luminance (H, W, 3) of light on one side of a grid as its texels scatter it, from that of the convention.

    The array of the latter may be that of the result.
    """
    if isinstance(grid, BentGrid):
        return luminance * ratio_on_planes(side, grid, luminance, spreading, progress)
    effort, settings, material = spreading.effort.of_plane(grid.texels), spreading.settings, spreading.material
    spread = spread_length(material.albedo, material.mean_free_path, spreading.sources)
    beams = arriving_beams(grid, spreading.illumination, settings, effort, spread)
    albedo, factor, result, coverage = grid.albedo, grid.color_in, luminance, grid.coverage
    pad = _mirrored_texels(grid)
    if any(pad):
        whole = [(resized(light, grid.height, grid.width, is_smooth=False), way) for light, way in beams]
        beams = _mirrored_beams(whole, pad)
        albedo, factor, result, coverage = (_mirrored(values, pad) for values in (albedo, factor, result, coverage))
    pitch = grid.pitch_x, grid.pitch_y
    plane = TexturedPlane(spreading.sources, albedo, factor, material.albedo, material.mean_free_path, pitch, coverage)
    noise = plane.correct(result, beams, side, effort.noise, effort.max_walks, settings.threads, progress)
    if spreading.reports.texture:
        spreading.reports.texture(noise)
    rows, columns = (slice(count, -count or None) for count in pad)
    return np.ascontiguousarray(result[rows, columns])


def _mirrored_texels(grid: AnyGrid) -> tuple[int, int]:
    """Rows and columns of mirror images beyond each border."""
    return tuple(min(int(grid.mirrored / pitch), MIRRORED_TEXELS) for pitch in (grid.pitch_y, grid.pitch_x))


def _mirrored(values: NDArray, pad: tuple[int, int]) -> NDArray:
    """A copy of values (H, W) or (H, W, 3) with mirror images beyond the borders."""
    rows, columns = pad
    return np.pad(values, ((rows, rows), (columns, columns), (0, 0))[: values.ndim], mode="symmetric")


def _mirrored_beams(beams: Beams, pad: tuple[int, int]) -> Beams:
    """The beams with their mirror images, whose directions are mirrored, too."""
    if not any(pad):
        return beams
    rows, columns = pad
    mirrored = []
    for light, way in beams:
        whole = _mirrored(light, pad)
        is_below, is_beside = (
            (np.arange(-pad, size + pad) // size % 2).astype(bool)
            for pad, size in zip((rows, columns), light.shape[:2])
        )
        for flips_x in (False, True):
            for flips_y in (False, True):
                there = (is_below == flips_y)[:, None] & (is_beside == flips_x)
                if there.any():
                    turned = np.array(way) * (-1 if flips_x else 1, -1 if flips_y else 1, 1)
                    mirrored.append((whole * there[..., None], turned))
    return mirrored
