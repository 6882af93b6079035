"""The medium that a renderer's Principled BSDF stands for."""

from __future__ import annotations

import math

FIXED_RADIUS, MEAN_FREE_PATH = "fixed", "walk"


def transport_length(radius: float, method: str, color: float, ior: float) -> float:
    """Transport mean free path 1 / (sigma_t (1 - g)) of Cycles' random walk, in the unit of `radius`.

    With a fixed radius Cycles walks radius / (4 pi) between two scatterings. Otherwise the radius is the diffuse mean
    free path 1 / sqrt(3 sigma_a sigma_t'), and with Jensen et al. 2001, eq. 4, the dipole's reflectance gives the
    reduced albedo.

    Parameters
    ----------
    method : "fixed" or "walk".
    color : diffuse reflectance, 0 to 1; used by "walk".
    ior : that of the entry, used by "walk".
    """
    if method == FIXED_RADIUS:
        return radius / (4 * math.pi)
    return radius * math.sqrt(3 * (1 - reduced_albedo(color, ior)))


def reduced_albedo(color: float, ior: float) -> float:
    """alpha' whose dipole has the diffuse reflectance `color`; Cycles stops at .999999."""
    # Egan & Hilgeman 1979, as Jensen has it.
    fresnel = -1.440 / ior**2 + 0.710 / ior + 0.668 + 0.0636 * ior
    slope = 4 / 3 * (1 + fresnel) / (1 - fresnel)
    low, high = 0.0, 0.999999
    for _ in range(40):
        middle = (low + high) / 2
        root = math.sqrt(3 * (1 - middle))
        if middle / 2 * (1 + math.exp(-slope * root)) * math.exp(-root) < color:
            low = middle
        else:
            high = middle
    return (low + high) / 2


def ior_of_reflectance(reflectance: float) -> float:
    """Index of refraction that reflects this much straight on, 0 <= reflectance < 1."""
    root = math.sqrt(reflectance)
    return (1 + root) / (1 - root)


def reflectance_of_ior(ior: float) -> float:
    """Of light that falls in straight."""
    return ((ior - 1) / (ior + 1)) ** 2
