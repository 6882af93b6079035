"""Luminance of beams on a plane."""

import numpy as np

from ..arrays import float_array
from ..native import native


def convolve(
    irradiance,
    direction,
    ldf,
    albedo,
    mean_free_path,
    pitch,
    solver="fft",
    tolerance=1e-3,
    threads=0,
    progress=None,
    interpolation="angular",
):
    """Luminance that beams on a regular grid of a plane cause (Manabe et al. 2012, Eq. 2).

    Parameters
    ----------
    irradiance : array_like, shape (H, W) or (H, W, 3)
        W/m^2 on the surface, cosine and visibility included; rows go up the plane.
    direction : array_like, shape (3,) or (H, W, 3)
        Unit vectors along which light travels, in the plane's frame (x along columns, y along rows, z the outward
        normal): z < 0. One for all beams, or one per texel.
    ldf : LdfLibrary, or LdfSamples, or a sequence of three of either
        One per channel where anisotropy or thickness in mean free paths differ. Samples (one, or a sequence as for
        `interpolate`) stand for the LDFs between them, and each texel for a beam of their diameter; angles and albedos
        outside of them are errors. Their images enter as rings around O with azimuthal harmonics: power is
        kept, detail finer than a fifth of the distance from O is not.
    albedo : float or sequence of three
        Single-scattering albedo, 0 <= albedo < 1.
    mean_free_path : float or sequence of three
        Metres.
    pitch : float or (float, float)
        Side of a texel in metres, along x and y.
    solver : {"fft", "direct", "adaptive"}
        `direct` visits every pair of texels: exact and slow. `adaptive` lights evenly lit squares by one beam each
        (section 3.3 of the paper) and looks at small beams more coarsely from farther away.
    tolerance : float
        `fft`: the sum over all texels of the absolute error stays below `tolerance` times the sum of the luminance,
        and the error of each texel below `tolerance` times the mean of the 17 x 17 texels around. Whatever the
        tolerance, `fft` is besides off by some 1e-5 of the brightest texel: by 4e-5 at most, by 7e-5 beyond 80 degrees
        with ior 1, and for thin slabs with an ior above 1 by up to 1e-3, beyond 80 degrees 2e-3. Beyond 192 x 192
        texels the bound rests on a look at 1000 to 1500 texels, and of more than four lights at the four brightest,
        which may use up .25 of it; over lights, shadows and media that are hard for it the worst of all texels uses up
        .2 to .6 (tests/bench/terms.py). `adaptive`: the sum as for `fft`, for which
        what each beam's kernel is off by is integrated and added up in full; the error of each texel stays below
        `tolerance` times the brightest one, which is measured: the worst used up .1 of it.
    threads : int
        0: all. The result does not depend on it.
    progress : callable, optional
        Called with the finished fraction; returning False stops.
    interpolation : {"angular", "adaptive", "planar"}
        Method of `interpolate` between samples.

    Returns
    -------
    float32, shape (H, W, 3)
        Luminance, radiance in W/(m^2 sr).

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    Cancelled
        `progress` returned False.
    """
    light = irradiance, direction
    return convolve_lights(
        [light], ldf, albedo, mean_free_path, pitch, solver, tolerance, threads, progress, interpolation
    )


def convolve_lights(
    lights,
    ldf,
    albedo,
    mean_free_path,
    pitch,
    solver="fft",
    tolerance=1e-3,
    threads=0,
    progress=None,
    interpolation="angular",
):
    """Luminance of several lights together.

    The sum of what `convolve` gives for each; but `fft` adds all lights up to the same moments of the direction, and
    transforms hardly more for many lights than for one.

    Parameters
    ----------
    lights : sequence of (irradiance, direction)
        Each as for `convolve`, which describes the other parameters, too.

    Returns
    -------
    float32, shape (H, W, 3)
        Luminance, radiance in W/(m^2 sr).
    """
    arriving = [
        light
        for irradiance, direction in lights
        for light in native.PlaneLight.of_channels(_irradiance(irradiance), float_array("direction", direction), 3)
    ]
    return solve(arriving, ldf, albedo, mean_free_path, pitch, solver, tolerance, threads, progress, interpolation)


def solve(
    lights, ldf, albedo, mean_free_path, pitch, solver, tolerance, threads=0, progress=None, interpolation="angular"
):
    """`convolve_lights` of native `PlaneLight`s, which know their color and what is known of their directions."""
    return native.convolve(
        lights,
        _sources(ldf, interpolation),
        _rgb("albedo", albedo),
        _rgb("mean_free_path", mean_free_path),
        _pair("pitch", pitch),
        solver,
        float(tolerance),
        int(threads),
        progress,
    )


def _irradiance(values):
    array = float_array("irradiance", values)
    if array.ndim == 2 or (array.ndim == 3 and array.shape[2] == 3):
        return array
    raise ValueError(f"argument 'irradiance' is of shape {array.shape}; allowed: (H, W) or (H, W, 3)")


BEAM = np.dtype([("row", np.int64), ("column", np.int64), ("size", np.int64), ("power", np.float64)])


def adaptive_beams(irradiance, direction, pitch=1.0, tolerance=1e-3):
    """Beams by which ``convolve(..., solver="adaptive")`` lights a plane (Manabe et al. 2012, section 3.3, Fig. 5).

    A beam is a square of 2^k texels, the largest that is wholly and evenly lit: its irradiance and its direction
    vary by less than a share of the tolerance. The paper searches a mask of lit and dark texels; light that varies
    within a square splits it.

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
        Names the argument, its value and what is allowed.
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


def _numbers(name, values, count):
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


def _rgb(name, values):
    return _numbers(name, values, 3)


def _pair(name, values):
    return _numbers(name, values, 2)


def _sources(ldf, interpolation):
    """Native sources of LDFs, one per channel."""
    one = _source(ldf, interpolation)
    if one is not None:
        return [one] * 3
    each = [_source(entry, interpolation) for entry in ldf] if isinstance(ldf, list | tuple) else []
    if len(each) != 3 or None in each:
        raise ValueError(
            f"argument 'ldf' is {ldf!r}; allowed: an LdfLibrary, LdfSamples, or three of either, one per channel"
        )
    return each


def _source(ldf, interpolation):
    """A library as it is, or samples as a source; None for anything else."""
    if isinstance(ldf, native.LdfSource):
        return ldf
    samples = [ldf] if isinstance(ldf, native.LdfSample) else ldf
    if not isinstance(samples, list | tuple) or not samples:
        return None
    if not all(isinstance(sample, native.LdfSample) for sample in samples):
        return None
    return native.SampleSource(list(samples), interpolation)
