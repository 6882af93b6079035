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
from .directions import NEAR_PART, Beams, beams_of, is_near, survey_of

NOISE = 0.01
"""Wanted root mean square error of texels, relative to that of the luminance. Smaller: longer."""

MAX_WALKS = 4096
"""Largest number of walks for each texel. More: less noise where albedos differ most, and longer."""

SURVIVAL_POWER, LONG_WALK, MOST_SHORT = 1.5, 30.0, 8.0
"""Walks go on with this power of the brightest albedo. Those of fewer scatterings than the second number may be more,
by up to the third: dark textures return few of them. Larger: less noise there, longer."""

MOST_SHARED = 6.0
"""Most walks of light of many azimuths over those of one, in the same time. Larger: less noise in few texels."""

LEAST_FACTOR = 0.1
"""Smallest factor by which the convention multiplies light. Smaller: the ratio to the truth has more noise in black."""

GATHERED_TEXELS = 512
"""Least texels along the longer side at which light is split between directions. More: memory, and sharper shadows in
the correction."""

SOLVER_PART = 0.3
"""Fraction of the time that the convention takes."""

Lights = Sequence[tuple[NDArray[np.float32], NDArray[np.float32]]]
Solve = Callable[[Lights, Sequence[float], Progress, NDArray[np.float32]], NDArray[np.float32]]
"""Luminance (H, W, 3) by lights, the albedo of each channel, the progress, and factors (H, W, 3) of entering light."""


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
    albedos = checked_map(albedo, lights[0][0].shape)
    solving, correcting = progress.split([SOLVER_PART, 1 - SOLVER_PART])
    tables = [reflectance_table(source) for source in sources]
    factors, means = np.empty_like(albedos), []
    for c, table in enumerate(tables):
        channel = Convention.of([table.reflectance(albedos[..., c])], table)
        factors[..., c] = channel.factors[0]
        means.append(channel.albedo)
    result = convention(lights, means, solving, factors)
    result *= factors
    plane = TexturedPlane(sources, albedos, factors, means, mean_free_path, pitch)
    worst = plane.correct(result, plane.beams(lights), side, noise, MAX_WALKS, threads, correcting)
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


def spread_length(albedo: Sequence[float], mean_free_path: Sequence[float], sources: Sequence) -> float:
    """Distance that light goes, of the channel where it goes farthest: see `spread_lengths`."""
    lengths = []
    for alpha, path, source in zip(albedo, mean_free_path, sources):
        transport = path / (1 - alpha * source.medium.g)
        lengths.append(max(transport, float(np.sqrt(path * transport / (3 * (1 - alpha))))))
    return max(lengths)


def gathered(light: tuple[NDArray, NDArray], texels: int = GATHERED_TEXELS) -> tuple[NDArray, NDArray]:
    """Irradiance (H, W, 3) and directions of means of texels, at least so many along the longer side."""
    irradiance, way = light
    height, width = irradiance.shape[:2]
    for count in (8, 4, 2):
        if height % count == 0 == width % count and max(height, width) >= count * texels:
            irradiance, way = (_means(values, count) if values.ndim == 3 else values for values in light)
            return irradiance, way / np.linalg.norm(way, axis=-1, keepdims=True)
    return light


def _means(values: NDArray, count: int) -> NDArray:
    """Means of values (H, W, C) over `count` x `count` texels."""
    height, width, channels = values.shape
    return values.reshape(height // count, count, width // count, count, channels).mean(axis=(1, 3))


def continued(values: NDArray, known: NDArray) -> NDArray:
    """Values (H, W) or (H, W, C) that go on beyond the known texels (H, W) by means of those nearby."""
    if known.all() or not known.any():
        return values
    height, width = known.shape
    even = [(0, height % 2), (0, width % 2)] + [(0, 0)] * (values.ndim - 2)
    is_known = known.reshape(*known.shape, *[1] * (values.ndim - 2))
    weights, sums = (np.pad(array, even) for array in (np.float32(is_known), np.float32(np.where(is_known, values, 0))))
    weights, sums = (
        array.reshape(len(array) // 2, 2, array.shape[1] // 2, 2, *array.shape[2:]).sum(axis=(1, 3))
        for array in (weights, sums)
    )
    coarse = np.divide(sums, weights, out=np.zeros_like(sums), where=weights > 0)
    coarse = continued(coarse, weights.reshape(*weights.shape[:2], -1)[..., 0] > 0)
    return np.where(is_known, values, coarse.repeat(2, axis=0).repeat(2, axis=1)[:height, :width])


@dataclass(frozen=True, eq=False)
class Convention:
    """The usual convention for one channel: one albedo, and a factor for light that enters and for light that leaves.

    Attributes
    ----------
    albedo : of the mean reflectance.
    factors : float32 (H, W) of each plane, the root of the reflectance over its mean.
    """

    albedo: float
    factors: list[NDArray[np.float32]]

    @classmethod
    def of(
        cls, reflectances: Sequence[NDArray], table: ReflectanceTable, weights: Sequence[NDArray] | None = None
    ) -> Convention:
        """From reflectances (H, W) of planes that share a medium, and weights of their texels."""
        weights = weights or [np.ones(1)] * len(reflectances)
        shares = [np.broadcast_to(weight, values.shape) for weight, values in zip(weights, reflectances)]
        total = sum(float(share.sum(dtype=float)) for share in shares)
        mean = sum(float((share * values).sum(dtype=float)) for share, values in zip(shares, reflectances)) / total
        floor = LEAST_FACTOR**2
        relative = [np.maximum(values / mean, floor) if mean > 0 else np.ones_like(values) for values in reflectances]
        return cls(float(table.albedo(mean)), [np.sqrt(values).astype(np.float32) for values in relative])


@dataclass(frozen=True, eq=False)
class TexturedPlane:
    """A plane of texels in which light scatters by albedos of their own.

    Attributes
    ----------
    sources : library of each channel.
    albedo, factor : float32 (H, W, 3); the second is the convention's.
    mean_albedo : the convention's, of each channel.
    mean_free_path : of each channel, in the unit of `pitch`.
    coverage : fraction of each texel that light enters, float32 (H, W); None: 1.
    """

    sources: Sequence[native.LdfLibrary]
    albedo: NDArray[np.float32]
    factor: NDArray[np.float32]
    mean_albedo: Sequence[float]
    mean_free_path: Sequence[float]
    pitch: Sequence[float]
    coverage: NDArray[np.float32] | None = None

    def beams(self, lights: Lights) -> Beams:
        """Light of a few directions that stands for all lights: irradiance (H, W, 3), directions (3,) or (H, W, 3)."""
        size = [count * step for count, step in zip(self.albedo.shape[:2], self.pitch[::-1])]
        spread = spread_length(self.mean_albedo, self.mean_free_path, self.sources)
        near = is_near([survey_of(*light) for light in lights], size, spread)
        texels = GATHERED_TEXELS // NEAR_PART if near else GATHERED_TEXELS
        return beams_of([gathered(light, texels) for light in lights], near)

    def correct(
        self,
        luminance: NDArray[np.float32],
        beams: Beams,
        side: str,
        noise: float,
        max_walks: int,
        threads: int,
        progress: Progress,
    ) -> float:
        """Correct the convention's luminance (H, W, 3) in place; the estimated noise, as `NOISE`."""
        worst = 0.0
        is_covered = self.coverage is None or bool((self.coverage == 1).all())
        albedo, factor = (np.ascontiguousarray(values, np.float32) for values in (self.albedo, self.factor))
        for c, part in enumerate(progress.split([1.0] * 3)):
            like = [before for before in range(c) if self._is_like(before, c, beams)]
            if like:
                luminance[..., c] = luminance[..., like[0]]
            if like or self._is_even(c) or not beams:
                continue
            _, error, _ = native.textured(
                self.sources[c].medium,
                tuple(self.mean_free_path[c] / np.asarray(self.pitch)),
                albedo,
                factor,
                self.mean_albedo[c],
                luminance,
                beams,
                side,
                noise,
                round(max_walks * self._shortness(c)),
                threads=threads,
                progress=part,
                channel=c,
                coverage=None if is_covered else self.coverage,
                result=luminance,
                max_more=MOST_SHARED,
            )
            worst = max(worst, error)
        return worst

    def _shortness(self, c: int) -> float:
        """Multiple of walks that a channel may have, since its walks are shorter than bright ones."""
        length = 1 / (1 - float(self.albedo[..., c].max()) ** SURVIVAL_POWER)
        return min(max(LONG_WALK / length, 1.0), MOST_SHORT)

    def _is_even(self, c: int) -> bool:
        """True if the convention is the truth: all texels have its albedo."""
        albedo = self.albedo[..., c]
        return bool((albedo == albedo.flat[0]).all() and (self.factor[..., c] == 1).all())

    def _is_like(self, c: int, other: int, beams: Beams) -> bool:
        """True if two channels have the same light in the same medium."""
        return (
            self.sources[c] is self.sources[other]
            and self.mean_free_path[c] == self.mean_free_path[other]
            and self.mean_albedo[c] == self.mean_albedo[other]
            and np.array_equal(self.albedo[..., c], self.albedo[..., other])
            and all(np.array_equal(light[..., c], light[..., other]) for light, _ in beams)
        )
