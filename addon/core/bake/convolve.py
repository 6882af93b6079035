"""Luminance of beams on a plane."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import float_array
from ..ldf.library import library
from ..material import Material
from ..native import native
from ..progress import Callback, Progress
from .textured import NOISE, Lights, is_map, textured_luminance

Ldf: TypeAlias = (
    "native.LdfSource | native.LdfSample | Sequence[native.LdfSample]"
    " | Sequence[native.LdfSource | native.LdfSample | Sequence[native.LdfSample]]"
)
"""LDFs of all channels: a library or samples, or three of either."""

SOLVE_WEIGHT = 3.0
"""Time that the solver takes, relative to reading one library."""


def luminance(
    irradiance: ArrayLike,
    direction: ArrayLike,
    material: Material,
    pitch: float | Sequence[float],
    thickness: float = math.inf,
    quality: str = "final",
    solver: str = "fft",
    tolerance: float = 1e-3,
    threads: int = 0,
    progress: Callback | None = None,
    side: str = "reflected",
    albedo: ArrayLike | None = None,
) -> NDArray[np.float32]:
    """Luminance that beams on a regular grid cause on a plane of a material.

    This is `convolve` with the LDFs, albedo and mean free path of the material, each color channel with its own
    anisotropy.

    Parameters
    ----------
    irradiance, direction, pitch, solver, tolerance, threads, progress, side
        As for `convolve`.
    material : Material
        From `presets`, or made by hand.
    thickness : float
        Metres; inf for a half-space.
    quality : {"final", "preview"}
        Quality of the LDFs, as for `library`.
    albedo : array_like, shape (H, W) or (H, W, 3), optional
        Albedo of each texel in place of the material's, as for `convolve`.

    Returns
    -------
    float32, shape (H, W, 3)
        Luminance, radiance in W/(m^2 sr).

    Raises
    ------
    ValueError
        Names the argument or the material's property, its value and the allowed values.
    Cancelled
        `progress` returned False.

    Examples
    --------
    >>> milk = beamspread.presets()["regular_milk"]
    >>> beamspread.luminance(np.ones((64, 64)), (0.8, 0, -0.6), milk, pitch=2e-4).shape
    (64, 64, 3)
    """
    if not isinstance(material, Material):
        raise ValueError(f"argument 'material' is {material!r}; allowed: a Material")
    material.check()
    media = material.channel_media(thickness)
    distinct = list(dict.fromkeys(media))
    *reading, solving = Progress.of(progress).split([1.0] * len(distinct) + [SOLVE_WEIGHT])
    ldfs = {medium: library(medium, quality, part, threads) for medium, part in zip(distinct, reading)}
    return convolve(
        irradiance,
        direction,
        [ldfs[medium] for medium in media],
        material.albedo if albedo is None else albedo,
        material.mean_free_path,
        pitch,
        solver,
        tolerance,
        threads,
        solving,
        side=side,
    )


def convolve(
    irradiance: ArrayLike,
    direction: ArrayLike,
    ldf: Ldf,
    albedo: ArrayLike,
    mean_free_path: float | Sequence[float],
    pitch: float | Sequence[float],
    solver: str = "fft",
    tolerance: float = 1e-3,
    threads: int = 0,
    progress: Callback | None = None,
    interpolation: str = "angular",
    side: str = "reflected",
    noise: float = NOISE,
    report_noise: Callable[[float], None] | None = None,
) -> NDArray[np.float32]:
    """Luminance that beams on a regular grid of a plane cause (Manabe et al. 2012, Eq. 2).

    Parameters
    ----------
    irradiance : array_like, shape (H, W) or (H, W, 3)
        W/m^2 on the surface, cosine and visibility included; rows go up the plane.
    direction : array_like, shape (3,) or (H, W, 3)
        Unit vectors along which light travels, in the plane's frame (x along columns, y along rows, z the outward
        normal): z < 0. One for all beams, or one per texel.
    ldf : LdfLibrary, or LdfSamples, or a sequence of three of either
        One per channel if the channels differ in anisotropy or in thickness in mean free paths. Samples (one, or a
        sequence as for `interpolate`) represent the LDFs between them and beams of their diameter; angles and albedos
        outside of them are errors. Their images enter as rings around O with azimuthal harmonics, which keep their
        power but no detail finer than a fifth of the distance from O.
    albedo : float or sequence of three, or array_like, shape (H, W) or (H, W, 3)
        Single-scattering albedo, 0 <= albedo < 1: of the medium, or of each texel. A map goes straight down into the
        medium, and on beyond its border. Paths of light that all texels share correct the convention for textures,
        which the solver computes; needs an LdfLibrary.
    mean_free_path : float or sequence of three
        Metres.
    pitch : float or (float, float)
        Side of a texel in metres, along x and y.
    solver : {"fft", "direct", "adaptive"}
        `direct` visits every pair of texels: exact and slow. `adaptive` replaces evenly lit squares by one beam each
        (section 3.3 of the paper) and resolves small beams more coarsely at a distance.
    tolerance : float
        Largest error of `fft` and `adaptive`, relative to the sum of all texels in the sum, and in a texel to the mean
        of the 17 x 17 texels around it (`fft`, plus rounding) or to the brightest texel (`adaptive`). See
        docs/accuracy.md.
    threads : int
        Number of threads, 0 for all. The result does not depend on it.
    progress : callable, optional
        Called with the finished fraction; returning False stops.
    interpolation : {"angular", "adaptive", "planar"}
        Method of `interpolate` between samples.
    side : {"reflected", "transmitted"}
        Side of the luminance: where light enters, or the far side of a slab, at the texels opposite the lit ones.
        Unscattered light that crosses the slab is included. Rows, columns and directions stay those of the lit side.
        Half-spaces and samples know no far side.
    noise : float
        Wanted root mean square error of texels by the paths through a map of albedos, relative to the root mean square
        of the luminance: errors count where the light is.
    report_noise : callable, optional
        report_noise(error) takes that error as estimated, of the worst channel. It is larger than `noise` where that
        would take more than some seconds, as between black and nearly white.

    Returns
    -------
    float32, shape (H, W, 3)
        Luminance, radiance in W/(m^2 sr).

    Raises
    ------
    ValueError
        Names the argument, its value and the allowed values.
    Cancelled
        `progress` returned False.
    """
    light = irradiance, direction
    return convolve_lights(
        [light],
        ldf,
        albedo,
        mean_free_path,
        pitch,
        solver,
        tolerance,
        threads,
        progress,
        interpolation,
        side,
        noise,
        report_noise,
    )


def convolve_lights(
    lights: Sequence[tuple[ArrayLike, ArrayLike]],
    ldf: Ldf,
    albedo: ArrayLike,
    mean_free_path: float | Sequence[float],
    pitch: float | Sequence[float],
    solver: str = "fft",
    tolerance: float = 1e-3,
    threads: int = 0,
    progress: Callback | None = None,
    interpolation: str = "angular",
    side: str = "reflected",
    noise: float = NOISE,
    report_noise: Callable[[float], None] | None = None,
) -> NDArray[np.float32]:
    """Luminance of several lights together: the sum of the results of `convolve` for each.

    `fft` adds up the moments of all lights first, so the number of transforms hardly grows with the number of lights.

    Parameters
    ----------
    lights : sequence of (irradiance, direction)
        Each as for `convolve`, which describes the other parameters.

    Returns
    -------
    float32, shape (H, W, 3)
        Luminance, radiance in W/(m^2 sr).
    """
    arriving = [(_irradiance(values), float_array("direction", direction)) for values, direction in lights]
    sources, paths = _sources(ldf, interpolation), _rgb("mean_free_path", mean_free_path)

    def solve(
        lights: Lights, albedos: Sequence[float], part: Callback | None, factors: NDArray[np.float32] | None = None
    ) -> NDArray[np.float32]:
        if factors is not None and solver != "fft":
            lights, factors = [(values * factors, direction) for values, direction in lights], None
        return native.convolve(
            [light for values, direction in lights for light in native.PlaneLight.of_channels(values, direction, 3)],
            sources,
            albedos,
            paths,
            _pair("pitch", pitch),
            solver,
            float(tolerance),
            int(threads),
            part,
            side=side,
            entering=factors,
        )

    if not is_map(albedo):
        return solve(arriving, _rgb("albedo", albedo), progress)
    whole = Progress.of(progress)
    rest = side, noise, int(threads), whole, report_noise
    return textured_luminance(arriving, sources, albedo, paths, _pair("pitch", pitch), solve, *rest)


def _irradiance(values: ArrayLike) -> NDArray[np.float32]:
    array = float_array("irradiance", values)
    if array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 3):
        return array
    raise ValueError(f"argument 'irradiance' is of shape {array.shape}; allowed: (H, W) or (H, W, 3)")


BEAM = np.dtype([("row", np.int64), ("column", np.int64), ("size", np.int64), ("power", np.float64)])


def adaptive_beams(
    irradiance: ArrayLike, direction: ArrayLike, pitch: float | Sequence[float] = 1.0, tolerance: float = 1e-3
) -> NDArray[np.void]:
    """Beams by which ``convolve(..., solver="adaptive")`` lights a plane (Manabe et al. 2012, section 3.3, Fig. 5).

    A beam is a square of 2^k texels, the largest one that is completely and evenly lit: its irradiance and its
    direction vary by less than a fraction of the tolerance. The paper searches a mask of lit and dark texels; here,
    light that varies within a square splits the square.

    Parameters
    ----------
    irradiance : array_like, shape (H, W)
        W/m^2; one channel.
    direction, pitch, tolerance
        As for `convolve`.

    Returns
    -------
    structured array, shape (N,)
        `row` and `column` of each square's first texel, its `size` in texels, and its `power` in W.

    Raises
    ------
    ValueError
        Names the argument, its value and the allowed values.
    """
    light = float_array("irradiance", irradiance)
    if light.ndim != 2:
        raise ValueError(f"argument 'irradiance' is of shape {light.shape}; allowed: (H, W)")
    pitch_x, pitch_y = _pair("pitch", pitch)
    beams = native.PlaneLight(light, float_array("direction", direction), (1.0,))
    squares, mean = native.adaptive_beams(beams, float(tolerance))
    beams = np.empty(len(squares), BEAM)
    beams["row"], beams["column"], beams["size"] = squares.T
    beams["power"] = mean * beams["size"] ** 2 * pitch_x * pitch_y
    return beams


def _numbers(name: str, values: float | Sequence[float], count: int) -> list[float]:
    """`count` floats from one number or a sequence of `count`."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if np.isnan(array).any():
        raise ValueError(f"argument {name!r} is {values!r}; allowed: a number or {count} numbers")
    if array.shape not in ((), (count,)):
        raise ValueError(f"argument {name!r} is of shape {array.shape}; allowed: a number or {count} numbers")
    return np.broadcast_to(array, count).tolist()


def _rgb(name: str, values: float | Sequence[float]) -> list[float]:
    return _numbers(name, values, 3)


def _pair(name: str, values: float | Sequence[float]) -> list[float]:
    return _numbers(name, values, 2)


def _sources(ldf: Ldf, interpolation: str) -> list[native.LdfSource]:
    """Native sources of LDFs, one per channel."""
    shared = _source(ldf, interpolation)
    if shared is not None:
        return [shared] * 3
    each = [_source(entry, interpolation) for entry in ldf] if isinstance(ldf, list | tuple) else []
    if len(each) != 3 or None in each:
        raise ValueError(
            f"argument 'ldf' is {ldf!r}; allowed: an LdfLibrary, LdfSamples, or three of either, one per channel"
        )
    return each


def _source(ldf: object, interpolation: str) -> native.LdfSource | None:
    """The library itself, or a source made of samples; None for anything else."""
    if isinstance(ldf, native.LdfSource):
        return ldf
    samples = [ldf] if isinstance(ldf, native.LdfSample) else ldf
    if not isinstance(samples, list | tuple) or not samples:
        return None
    if not all(isinstance(sample, native.LdfSample) for sample in samples):
        return None
    return native.SampleSource(list(samples), interpolation)
