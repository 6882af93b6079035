"""Curvatures, angles and photons with which a medium's curved surfaces are simulated."""

from __future__ import annotations

import math

from ..native import native
from ..progress import Callback

PHOTONS = {"preview": 20_000, "final": 300_000}
"""Photons per curvature and angle for a medium with g .8 and ior 1. More: less noise, more time."""

_CURVATURES = (-1 / 3, -0.18, -0.08, -0.03, 0.03, 0.08, 0.15, 0.25, 0.4, 0.625, 1.0)
"""Curvatures times the transport mean free path, without 0."""

_ANGLES = {True: (0.0, 36.0, 57.0, 73.0, 88.0), False: (0.0, 22.0, 43.0, 60.0, 73.0, 82.0, 88.5)}
"""Angles of incidence, degrees, with refraction and without."""


def transport_length(medium: native.Medium) -> float:
    """Transport mean free path in mean free paths."""
    return 1.0 / (1.0 - max(medium.g, 0.0))


def curvatures_for(medium: native.Medium) -> tuple[float, ...]:
    """Curvatures to simulate, 1/mfp, ascending and without 0; none for a slab."""
    if not math.isinf(medium.thickness):
        return ()
    return tuple(curvature / transport_length(medium) for curvature in _CURVATURES)


def curved_angles_for(medium: native.Medium) -> tuple[float, ...]:
    """Angles of incidence to simulate on curved surfaces, degrees."""
    return _ANGLES[medium.ior >= 1.2]


def curved_photons_for(medium: native.Medium, quality: str) -> int:
    """Photons per curvature and angle that take about the same time in every medium."""
    return round(PHOTONS[quality] * 5.0 / transport_length(medium) / medium.ior**2)


def with_curvatures(
    plane: native.LdfLibrary, quality: str, progress: Callback | None = None, kernel: str = "", threads: int = 0
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
