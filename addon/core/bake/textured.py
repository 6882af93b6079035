"""Planes whose albedo differs from texel to texel: the convention for textures, corrected by paths that all share."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import float_array
from ..ldf.reflectance_table import ReflectanceTable, reflectance_table
from ..native import native
from ..progress import Progress

NOISE = 0.01
"""Wanted root mean square error of a texel, relative to the mean. Smaller: longer."""

MAX_WALKS = 4096
"""Largest number of walks for each texel. More: less noise where albedos differ most, and longer."""

LEAST_FACTOR = 0.1
"""Smallest factor by which the convention multiplies light. Smaller: the ratio to the truth has more noise in black."""

NARROW = 2.0
"""Directions within this many degrees count as one. Larger: fewer paths, and light that goes another way."""

RANGE = 0.05
"""Fraction of the light that may lie beyond the outermost directions of paths. Larger: nearer to most of the light."""

SOLVER_PART = 0.3
"""Fraction of the time that the convention takes."""

Lights = Sequence[tuple[NDArray[np.float32], NDArray[np.float32]]]
Solve = Callable[[Lights, Sequence[float], Progress], NDArray[np.float32]]
"""Takes lights, the albedo of each channel and the progress; luminance (H, W, 3)."""


def is_map(albedo: object) -> bool:
    """True for an albedo of each texel, (H, W) or (H, W, 3)."""
    return np.ndim(albedo) >= 2  # type: ignore[arg-type]


def textured_luminance(
    lights: Lights,
    sources: Sequence[native.LdfSource],
    albedo: ArrayLike,
    mean_free_path: Sequence[float],
    pitch: Sequence[float],
    convention: Solve,
    side: str,
    noise: float,
    threads: int,
    progress: Progress,
    report_noise: Callable[[float], None] | None,
) -> NDArray[np.float32]:
    """`convolve_lights` for a map of albedos; `convention` solves for one albedo of each channel."""
    if not lights:
        raise ValueError("argument 'lights' is empty; allowed: at least one light")
    if not noise > 0:
        raise ValueError(f"argument 'noise' is {noise}; allowed: numbers above 0")
    if not all(isinstance(source, native.LdfLibrary) for source in sources):
        raise ValueError("argument 'ldf' is made of samples; allowed with a map of albedos: an LdfLibrary")
    lights = [
        (np.broadcast_to(light[..., None], (*light.shape, 3)) if light.ndim == 2 else light, way)
        for light, way in lights
    ]
    shape = lights[0][0].shape
    albedos = checked_map(albedo, shape)
    solving, correcting = progress.split([SOLVER_PART, 1 - SOLVER_PART])
    channels = [TexturedMedium.of(reflectance_table(source), albedos[..., c]) for c, source in enumerate(sources)]
    factors = np.stack([channel.factor for channel in channels], -1)
    entering = [(np.ascontiguousarray(light * factors), way) for light, way in lights]
    result = convention(entering, [channel.albedo for channel in channels], solving) * factors
    parts, worst = beams_of(lights), 0.0
    for c, (channel, part) in enumerate(zip(channels, correcting.split([1.0] * 3))):
        like = [
            before
            for before in range(c)
            if sources[before] is sources[c]
            and mean_free_path[before] == mean_free_path[c]
            and np.array_equal(albedos[..., before], albedos[..., c])
            and all(np.array_equal(light[..., before], light[..., c]) for light, _ in lights)
        ]
        if like:
            result[..., c] = result[..., like[0]]
        if like or channel.is_even:
            continue
        result[..., c], error, _ = native.textured(
            sources[c].medium,
            tuple(mean_free_path[c] / np.asarray(pitch)),
            np.ascontiguousarray(albedos[..., c]),
            channel.factor,
            channel.albedo,
            np.ascontiguousarray(result[..., c]),
            [(np.ascontiguousarray(light[..., c]), way) for light, way in parts],
            side,
            noise,
            MAX_WALKS,
            threads=threads,
            progress=part,
        )
        worst = max(worst, error)
    if report_noise:
        report_noise(worst)
    return result


def checked_map(albedo: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """The albedo of each texel and channel, float32 (H, W, 3)."""
    values = float_array("albedo", albedo)
    if values.shape not in (shape, shape[:2]):
        raise ValueError(f"argument 'albedo' is of shape {values.shape}; allowed: {shape[:2]} or {shape}")
    if not ((values >= 0) & (values < 1)).all():
        raise ValueError("argument 'albedo' has values that are not in [0, 1); allowed: 0 or more and below 1")
    return np.ascontiguousarray(np.broadcast_to(values if values.ndim == 3 else values[..., None], shape), np.float32)


@dataclass(frozen=True, eq=False)
class TexturedMedium:
    """The usual convention for one channel: one albedo, and a factor for light that enters and for light that leaves.

    Attributes
    ----------
    albedo : of the mean reflectance.
    factor : float32 (H, W), the root of the reflectance over its mean.
    is_even : True if all texels have the same albedo.
    """

    albedo: float
    factor: NDArray[np.float32]
    is_even: bool

    @classmethod
    def of(cls, table: ReflectanceTable, albedo: NDArray[np.float32]) -> TexturedMedium:
        if (albedo == albedo.flat[0]).all():
            return cls(float(albedo.flat[0]), np.ones_like(albedo), True)
        reflectance = table.reflectance(albedo)
        mean = reflectance.mean()
        factor = np.sqrt(np.maximum(reflectance / mean, LEAST_FACTOR**2))
        return cls(float(table.albedo(mean)), factor.astype(np.float32), False)


def beams_of(lights: Lights) -> list[tuple[NDArray[np.float32], NDArray[np.float64]]]:
    """Light of a few directions that stands for all lights: irradiance (H, W, 3) and the direction of travel of each.

    A light of one direction is itself. Others are split between angles from the normal and azimuths by weights that are
    linear in between.
    """
    if len(lights) == 1 and lights[0][1].ndim == 1:
        return [(lights[0][0], lights[0][1].astype(float))]
    powers = [light.sum(-1) for light, _ in lights]
    ways = [np.broadcast_to(way, (*power.shape, 3)) for power, (_, way) in zip(powers, lights)]
    angles = [np.degrees(np.arccos(np.clip(-way[..., 2], 0, 1))) for way in ways]
    azimuths = [np.degrees(np.arctan2(way[..., 1], way[..., 0])) for way in ways]
    power = np.concatenate([values.ravel() for values in powers])
    angle = _nodes(np.concatenate([values.ravel() for values in angles]), power)
    weights = power * np.sin(np.radians(np.concatenate([values.ravel() for values in angles])))
    azimuth, is_whole = _azimuth_nodes(np.concatenate([values.ravel() for values in azimuths]), weights)
    beams = []
    for i, theta in enumerate(angle):
        for j, phi in enumerate(azimuth):
            total = 0.0
            for (light, _), at, around in zip(lights, angles, azimuths):
                part = _weight(at, angle, i) * _around(around, azimuth, j, is_whole)
                total = total + light * part[..., None].astype(np.float32)
            sine, cosine = np.sin(np.radians(theta)), np.cos(np.radians(theta))
            way = np.array([sine * np.cos(np.radians(phi)), sine * np.sin(np.radians(phi)), -cosine])
            if np.any(total):
                beams.append((total, way))
    return beams


def _nodes(values: NDArray, weights: NDArray) -> list[float]:
    """One or two values between which nearly all of the weight lies."""
    low, high = _quantiles(values, weights)
    return [(low + high) / 2] if high - low < NARROW else [low, high]


def _quantiles(values: NDArray, weights: NDArray) -> tuple[float, float]:
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    if not below[-1] > 0:
        return 0.0, 0.0
    at = np.searchsorted(below, below[-1] * np.array([RANGE, 1 - RANGE]))
    low, high = values[order][np.minimum(at, len(values) - 1)]
    return float(low), float(high)


def _azimuth_nodes(values: NDArray, weights: NDArray) -> tuple[list[float], bool]:
    """Azimuths, degrees, ascending; True if they go around."""
    turns = np.exp(1j * np.radians(values))
    middle = np.degrees(np.angle((weights * turns).sum()))
    low, high = _quantiles((values - middle + 180) % 360 - 180, weights)
    if high - low < NARROW:
        return [middle + (low + high) / 2], False
    if high - low <= 180:
        return [middle + low, middle + (low + high) / 2, middle + high], False
    return [middle + turn for turn in (0.0, 90.0, 180.0, 270.0)], True


def _weight(values: NDArray, nodes: list[float], number: int) -> NDArray:
    """Weight of a node: linear between neighbors, and 1 in all beyond the ends."""
    return np.interp(values, nodes, np.eye(len(nodes))[number]) if len(nodes) > 1 else np.ones_like(values)


def _around(values: NDArray, nodes: list[float], number: int, is_whole: bool) -> NDArray:
    if is_whole:
        turn = (values - nodes[number] + 180) % 360 - 180
        return np.maximum(1 - np.abs(turn) / 90, 0)
    middle = nodes[len(nodes) // 2]
    return _weight((values - middle + 180) % 360 - 180, [node - middle for node in nodes], number)
