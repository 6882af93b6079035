"""Single-scattering albedo of a medium with a given color."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import float_array
from ..material import MAX_ALBEDO, RGB
from ..native import native
from ..progress import Callback
from .library import library


def albedo_from_color(
    color: ArrayLike, medium: native.Medium, quality: str = "final", progress: Callback | None = None, threads: int = 0
) -> RGB:
    """Single-scattering albedo whose reflectance under uniform diffuse light is `color`.

    The albedo grows with the color, from 0 for black. Colors brighter than the medium can be get `MAX_ALBEDO`
    (0.99999): some light is reflected before it enters, and some leaves a slab on the other side.

    Parameters
    ----------
    color : float or three, linear RGB in [0, 1]; one number stands for grey.
    medium : Medium.
    quality : quality of the LDF, "final" or "preview".

    Returns
    -------
    Three floats in [0, 0.99999].

    Raises
    ------
    ValueError
        The color is not one or three numbers in [0, 1], or the quality is unknown.
    Cancelled
        `progress` returned False.
    """
    channels = _channels(color)
    reflectance = library(medium, quality=quality, progress=progress, threads=threads).diffuse_reflectance
    albedos = {value: albedo_from_reflectance(value, reflectance) for value in set(channels)}
    return tuple(albedos[value] for value in channels)


def _channels(color: ArrayLike) -> list[float]:
    allowed = "one number or three (red, green, blue), each 0 to 1"
    values = float_array("color", color, np.float64, allowed)
    if values.shape not in ((), (3,)) or not ((values >= 0) & (values <= 1)).all():
        raise ValueError(f"argument 'color' is {values.tolist()}; allowed: {allowed}")
    return np.broadcast_to(values, 3).tolist()


def albedo_from_reflectance(value: float, reflectance: Callable[[float], float]) -> float:
    """Single-scattering albedo whose reflectance is `value`; at most `MAX_ALBEDO`, at least 0.

    Parameters
    ----------
    reflectance : increasing function of the albedo, e.g. `LdfLibrary.diffuse_reflectance`.
    """
    # Search in sqrt(1 - albedo), van de Hulst's similarity parameter: the reflectance of bright media is almost linear
    # in it, and a secant converges fast.
    dark, bright = 1.0, (1 - MAX_ALBEDO) ** 0.5
    below, above = reflectance(0.0) - value, reflectance(MAX_ALBEDO) - value
    if below >= 0:
        return 0.0
    if above <= 0:
        return MAX_ALBEDO
    # Illinois variant of regula falsi: an end that stays twice counts half (Dowell, Jarratt 1971,
    # doi:10.1007/BF01934364).
    unchanged_end = 0
    while abs(dark - bright) > 1e-12:
        middle = dark + (bright - dark) * below / (below - above)
        error = reflectance(1 - middle**2) - value
        if abs(error) < 1e-10:
            return 1 - middle**2
        if error < 0:
            dark, below = middle, error
            above, unchanged_end = (above / 2 if unchanged_end == 1 else above), 1
        else:
            bright, above = middle, error
            below, unchanged_end = (below / 2 if unchanged_end == -1 else below), -1
    return 1 - dark**2
