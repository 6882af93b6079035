"""Noise of light at coarse nodes, as the luminance shows it: splines between nodes and the medium average it."""

from __future__ import annotations

import math

import numpy as np

from ..ldf.library import is_known, library
from ..scene.receiver import Receiver
from .bake_settings import BakeSettings
from .layers import WITHOUT_MEDIUM
from .surface import Surface

SPLINE_VARIANCE = 1 / 3
"""Variance of a cubic B-spline along an axis, in squared distances of its nodes."""

# Nodes along each side of the image of the medium, and the angle in degrees at which light enters. Light beyond the
# image counts as spread completely. Noise is the same within 5 % with 65 nodes, and from 0 to 60 degrees.
SPREAD_NODES, SPREAD_ANGLE = 33, 45.0


def smoothing_variance(receiver: Receiver, surface: Surface, settings: BakeSettings, nodes: int) -> float:
    """Variance along an axis of the Gaussian that reduces uncorrelated noise of nodes as much as what follows them.

    A Gaussian of the variance v leaves 1 / (4 pi v) of the noise's variance. The spline follows, and if the result is
    luminance, the medium's spread, of the channel that spreads least; in squared distances of nodes, of which `nodes`
    lie along the longest side.
    """
    if settings.layer in WITHOUT_MEDIUM or not all(is_known(medium, settings.quality) for medium in surface.media()):
        return SPLINE_VARIANCE
    material = surface.resolve(settings.quality, None, settings.threads)
    pitch = max(max(c.grid.width * c.grid.pitch_x, c.grid.height * c.grid.pitch_y) for c in receiver.charts) / nodes
    variances = [SPLINE_VARIANCE]
    for medium, albedo, path in zip(surface.media(), material.albedo, material.mean_free_path):
        ldf = library(medium, settings.quality, None, settings.threads)
        reflectance = ldf.reflectance(SPREAD_ANGLE, albedo)
        if not reflectance > 0:
            continue  # a black channel shows no noise
        image = np.asarray(ldf.image(SPREAD_ANGLE, albedo, SPREAD_NODES, pitch / path), float)
        weights = _spline(_spline(image * (pitch / path) ** 2 / reflectance).T)
        variances.append(1 / (4 * math.pi * max(float((weights**2).sum()), 1e-6)))
    return max(min(variances[1:], default=SPLINE_VARIANCE), SPLINE_VARIANCE)


def _spline(weights: np.ndarray) -> np.ndarray:
    """Mean by the spline's weights at its nodes, along the rows."""
    padded = np.pad(weights, ((1, 1), (0, 0)))
    return (padded[:-2] + 4 * padded[1:-1] + padded[2:]) / 6
