"""Curvatures, angles and photons with which a medium's curved surfaces are simulated."""

from __future__ import annotations

import math
from collections.abc import Callable

from ..native import native
from ..progress import Callback as ProgressCallback

PHOTONS = {"preview": 10_000, "final": 400_000}
"""Photons per curvature and angle, times a factor by the medium. More: less noise, larger files, more time."""

_LEAST_FACTOR, _LARGEST_FACTOR = 1.5, 2.5
"""Limits of that factor. Larger: less noise of isotropic media, and of those that scatter forward, and more time."""

_CURVATURES = (-1 / 3, -0.2, -0.1, -0.04, 0.05, 0.1, 1 / 6, 0.25, 5 / 14, 0.5, 0.7, 1.0, 2.0)
"""Curvatures times the transport mean free path, without 0."""

_ANGLES = {
    True: (0.0, 36.0, 57.0, 73.0, 88.0),
    False: (0.0, 33.0, 52.0, 67.0, 75.5, 80.0, 84.0, 87.0, 88.5),
}
"""Angles of incidence, degrees, with refraction and without: near grazing a beam crosses a ball on a short chord."""


def transport_length(medium: native.Medium) -> float:
    """Transport mean free path in mean free paths."""
    return 1.0 / (1.0 - max(medium.g, 0.0))


def curvatures_for(medium: native.Medium) -> tuple[float, ...]:
    """Curvatures to simulate, 1/mfp, ascending and without 0; none for a slab.

    The diameters of balls are edges of the bins of chords: the longest chord then ends a bin.
    """
    if not math.isinf(medium.thickness):
        return ()
    length = transport_length(medium)
    hollows = [curvature / length for curvature in _CURVATURES if curvature < 0]
    diameters = [2 * length / curvature for curvature in _CURVATURES if curvature > 0]
    edges = [*(_near_edge(diameter, round) for diameter in diameters[:-1]), _near_edge(diameters[-1], math.floor)]
    return *hollows, *(2 / edge for edge in edges)


def _near_edge(radius: float, rounding: Callable[[float], int]) -> float:
    """The edge of a bin near a radius: four per octave (native/transport/tally/bins.h)."""
    octave = 2.0 ** math.floor(math.log2(radius))
    return octave * rounding(4 * radius / octave) / 4


def curved_angles_for(medium: native.Medium) -> tuple[float, ...]:
    """Angles of incidence to simulate on curved surfaces, degrees."""
    return _ANGLES[medium.ior >= 1.2]


def curved_photons_for(medium: native.Medium, quality: str) -> int:
    """Photons per curvature and angle, for standard errors of totals of about .5 % at most in final quality."""
    factor = transport_length(medium) / 5.0 * medium.ior**2
    return round(PHOTONS[quality] * min(max(factor, _LEAST_FACTOR), _LARGEST_FACTOR))


def with_curvatures(
    plane: native.LdfLibrary, quality: str, progress: ProgressCallback | None = None, kernel: str = "", threads: int = 0
) -> native.LdfLibrary:
    """A medium's library with simulated curvatures."""
    medium = plane.medium
    return plane.with_curved(
        curvatures_for(medium),
        curved_angles_for(medium),
        curved_photons_for(medium, quality),
        progress=progress,
        kernel=kernel,
        threads=threads,
    )
