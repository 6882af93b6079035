"""Bakes of planes in whose texels light scatters by albedos of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ldf.reflectance_table import ReflectanceTable, reflectance_table
from ..material import Material
from ..messages import Message, note
from ..native import native
from ..progress import Progress
from ..scene.bent_grid import AnyGrid
from ..scene.illumination import Illumination
from ..scene.lights import Light, WorldLight
from ..scene.receiver import Receiver
from ..scene.sampling import resized
from .bake_settings import DIRECTION, IRRADIANCE, BakeSettings
from .directions import Beams, Splitter
from .mean_light import MEAN_WORLD_ROWS
from .spreading import Effort, Spreading
from .textured import Convention, TexturedPlane

# Texels along a side at which directions of light are surveyed. More: slower, finer.
SURVEY_TEXELS = 48

# Texels along a side of mirror images in which paths are followed. More: slower; fewer: less light beyond long paths.
MIRRORED_TEXELS = 64

# Cosine of the mean angle between a light's rays at a texel and their mean, from which they count as one direction.
# Smaller: faster, and light that goes another way.
PARALLEL = 0.99

# Least cosine of light's angle from the normal. Smaller: longer paths along the surface.
GRAZING = 0.05


NOISY = 1.2
"""Noise of a texture, over the wanted one, above which a bake names it."""


def why_multiplied(receiver: Receiver, settings: BakeSettings) -> str:
    """Part of a sentence that says why a texture has to multiply light; "" if light can scatter in it."""
    if settings.layer in (IRRADIANCE, DIRECTION):
        return ""
    if settings.distributions != "library":
        return "LDF samples have one albedo"
    return "it bends" if receiver.is_bent else ""


def multiplied_note(name: str, why: str) -> Message:
    """The note about an object whose texture multiplies light, though it should scatter it."""
    text = f"The texture of '{name}' multiplies light where it enters and leaves, as in other renderers, since {why}."
    return note(name, text)


def noisy_note(name: str, noise: float) -> Message:
    """The note about the noise of an object's texture."""
    text = f"The light in the texture of '{name}' has a noise of {100 * noise:.0f} %, since its colors differ much."
    return note(name, text)


def with_factors(grids: Sequence[AnyGrid], material: Material, sources: Sequence) -> tuple[list[AnyGrid], Material]:
    """Grids with the albedos of their texels and the convention's factors, and the material with its albedo.

    Grids without an albedo or a base color of each texel stay as they are.
    """
    if all(grid.base_color is None and grid.albedo is None for grid in grids):
        return list(grids), material
    channels = []
    for c, source in enumerate(sources):
        table = reflectance_table(source)
        channels.append(_channel(grids, c, table))
    changed = []
    for number, grid in enumerate(grids):
        albedo = np.stack([albedos[number] for albedos, _ in channels], -1).astype(np.float32)
        factor = np.stack([convention.factors[number] for _, convention in channels], -1)
        changed.append(replace(grid, albedo=albedo, base_color=None, color_in=factor, color_out=factor))
    return changed, replace(material, albedo=tuple(convention.albedo for _, convention in channels))


def _channel(grids: Sequence[AnyGrid], c: int, table: ReflectanceTable) -> tuple[list[NDArray], Convention]:
    """Albedos (H, W) of each grid in a channel, and the convention of all."""
    albedos, reflectances = [], []
    for grid in grids:
        values = continued((grid.base_color if grid.albedo is None else grid.albedo)[..., c], grid.coverage > 0)
        albedos.append(table.albedo(values) if grid.albedo is None else values)
        reflectances.append(np.clip(values, *table.ends) if grid.albedo is None else table.reflectance(values))
    return albedos, Convention.of(reflectances, table, [grid.weights for grid in grids])


def continued(values: NDArray, known: NDArray) -> NDArray:
    """Values (H, W) that go on beyond the known texels by means of those nearby."""
    if known.all() or not known.any():
        return values
    height, width = values.shape
    even = ((0, height % 2), (0, width % 2))
    weights = np.pad(known.astype(np.float32), even)
    sums = np.pad(np.where(known, values, 0).astype(np.float32), even)
    shape = (weights.shape[0] // 2, 2, weights.shape[1] // 2, 2)
    weights, sums = (array.reshape(shape).sum(axis=(1, 3)) for array in (weights, sums))
    coarse = continued(np.divide(sums, weights, out=np.zeros_like(sums), where=weights > 0), weights > 0)
    return np.where(known, values, coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width])


def corrected(side: str, grid: AnyGrid, luminance: NDArray, spreading: Spreading, progress: Progress) -> NDArray:
    """Luminance (H, W, 3) of light on one side of a grid as its texels scatter it, from that of the convention."""
    effort, settings, material = spreading.effort, spreading.settings, spreading.material
    beams = arriving_beams(grid, spreading.illumination, settings, effort)
    beams = [(light * grid.coverage[..., None], way) for light, way in beams]
    pad = _mirrored_texels(grid)
    rows, columns = (slice(count, -count or None) for count in pad)
    arrays = [_mirrored(values, pad) for values in (grid.albedo, grid.color_in, luminance)]
    albedo, factor, result = arrays
    pitch = grid.pitch_x, grid.pitch_y
    plane = TexturedPlane(spreading.sources, albedo, factor, material.albedo, material.mean_free_path, pitch)
    beams = _mirrored_beams(beams, pad)
    noise = plane.correct(result, beams, side, effort.noise, effort.max_walks, settings.threads, progress)
    if spreading.reports.texture:
        spreading.reports.texture(noise)
    return np.ascontiguousarray(result[rows, columns])


def _mirrored_texels(grid: AnyGrid) -> tuple[int, int]:
    """Rows and columns of mirror images beyond each border."""
    pitches, sizes = (grid.pitch_y, grid.pitch_x), (grid.height, grid.width)
    return tuple(min(int(grid.mirrored / pitch), MIRRORED_TEXELS, size) for pitch, size in zip(pitches, sizes))


def _mirrored(values: NDArray, pad: tuple[int, int]) -> NDArray:
    """A copy of values (H, W, 3) with mirror images beyond the borders."""
    rows, columns = pad
    return np.pad(values, ((rows, rows), (columns, columns), (0, 0)), mode="symmetric")


def _mirrored_beams(beams: Beams, pad: tuple[int, int]) -> Beams:
    """The beams with their mirror images, whose directions are mirrored, too."""
    if not any(pad):
        return beams
    rows, columns = pad
    mirrored = []
    for light, way in beams:
        whole = _mirrored(light, pad)
        height, width, _ = whole.shape
        is_below = (np.arange(height) < rows) | (np.arange(height) >= height - rows)
        is_beside = (np.arange(width) < columns) | (np.arange(width) >= width - columns)
        for flips_x in (False, True):
            for flips_y in (False, True):
                there = (is_below == flips_y)[:, None] & (is_beside == flips_x)
                if there.any():
                    turned = np.array(way) * (-1 if flips_x else 1, -1 if flips_y else 1, 1)
                    mirrored.append((whole * there[..., None], turned))
    return mirrored


def arriving_beams(grid: AnyGrid, illumination: Illumination, settings: BakeSettings, effort: Effort) -> Beams:
    """Light of a few directions on a grid that stands for all lights, gathered at fewer texels where it has many."""
    coarse = [
        light.coarse(MEAN_WORLD_ROWS) if isinstance(light, WorldLight) else light
        for light in illumination.lights
        if not light.is_behind(grid)
    ]
    lights = illumination.with_lights(coarse)
    survey, target = grid.coarse(SURVEY_TEXELS), grid.coarse(effort.texels)
    surveys = []
    for light in coarse:
        rays = list(_rays(survey, light, lights, settings, effort.rays))
        surveys.append(
            (
                np.concatenate([part.sum(-1).ravel() for part, _ in rays]),
                np.concatenate([way.reshape(-1, 3) for _, way in rays]),
            )
        )
    splitter = Splitter.of(surveys, effort.max_own, effort.is_split)
    for number, light in enumerate(coarse):
        for part, way in _rays(target, light, lights, settings, effort.rays):
            splitter.add(number, part, way)
    return [(resized(light, grid.height, grid.width, is_smooth=False), way) for light, way in splitter.beams]


def _rays(grid: AnyGrid, light: Light, illumination: Illumination, settings: BakeSettings, rays: int):
    """Irradiance (H, W, 3) and directions (H, W, 3) that stand for a light: one at each texel, or four around it.

    The angle between the four and their mean is that of the light's own mean direction.
    """
    caster = illumination.caster(grid, light) if light.cast_shadow else None
    irradiance, flow = native.bake_arrival(
        grid.surface(),
        [(light.at(grid), light.rgb().tolist(), caster)],
        samples=2,
        rays=rays,
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
