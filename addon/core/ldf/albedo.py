"""The albedo that transport needs, from the colour that an artist picks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import float_array
from ..material.material import RGB
from ..native import native
from ..progress import Progress
from .library import library

HIGHEST_ALBEDO = 0.99999
"""What a colour too bright for its medium becomes: simulations follow light for enough scatterings up to here."""


def albedo_from_color(
    color: ArrayLike, medium: native.Medium, quality: str = "final", progress: Progress | None = None, threads: int = 0
) -> RGB:
    """Single-scattering albedo whose reflectance under uniform diffuse light is `color`.

    It grows with the colour, from 0 for black. No medium reflects everything: some light is reflected before it
    enters, some leaves a slab on the other side. A colour brighter than the medium can be becomes `HIGHEST_ALBEDO`
    (0.99999), its brightest.

    Parameters
    ----------
    color : float or three, linear RGB in [0, 1]; one number stands for grey.
    medium : Medium.
    quality : of the LDF used, "final" or "preview".

    Returns
    -------
    Three floats in [0, 0.99999].

    Raises
    ------
    ValueError
        A colour outside [0, 1] or that is not a number, or something else than one or three; unknown quality.
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
    """Single-scattering albedo whose reflectance is `value`, or the nearest of 0 and `HIGHEST_ALBEDO`.

    Parameters
    ----------
    reflectance : of an albedo; grows with it, e.g. `LdfLibrary.diffuse_reflectance`.
    """
    # Over sqrt(1 - albedo) the reflectance of a medium is almost a straight line where it is bright (van de Hulst's
    # similarity parameter), which a secant follows well.
    dark, bright = 1.0, (1 - HIGHEST_ALBEDO) ** 0.5
    below, above = reflectance(0.0) - value, reflectance(HIGHEST_ALBEDO) - value
    if below >= 0:
        return 0.0
    if above <= 0:
        return HIGHEST_ALBEDO
    # Regula falsi; an end that stays twice counts half the next time (Illinois), or it would stay for ever.
    kept = 0
    while abs(dark - bright) > 1e-12:
        middle = dark + (bright - dark) * below / (below - above)
        error = reflectance(1 - middle**2) - value
        if abs(error) < 1e-10:
            return 1 - middle**2
        if error < 0:
            dark, below = middle, error
            above, kept = (above / 2 if kept == 1 else above), 1
        else:
            bright, above = middle, error
            below, kept = (below / 2 if kept == -1 else below), -1
    return 1 - dark**2
