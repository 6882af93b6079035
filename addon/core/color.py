"""Colours: from the one an artist picks to the albedo that transport needs, and from linear values to a screen."""

from __future__ import annotations

import numpy as np

from .material import RGB, albedo_from_reflectance
from .progress import Progress


def albedo_from_color(color: RGB, medium, quality: str = "final", progress: Progress | None = None) -> RGB:
    """Single-scattering albedo whose reflectance under uniform diffuse light is `color`.

    Parameters
    ----------
    color : linear RGB, each at least 0 and at most what the medium can reflect.
    medium : Medium.
    quality : of the LDF used, "final" or "preview".

    Raises
    ------
    ValueError
        A colour brighter than the medium can be.
    """
    from .library import library

    return albedo_from_reflectance(color, library(medium, quality=quality, progress=progress).diffuse_reflectance)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values with the sRGB transfer function (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)
