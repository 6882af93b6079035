"""Suns in images of a world: small spots with much of its light, as lights of their own."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

# Radius of the largest spot, radians. Larger suns than native `SunLight.max_parallel_angle`, twice this, have more than
# one kernel.
REACH = math.radians(1.0)

# Steps from the brightest texel to the middle of a spot. More: larger spots are found whole.
STEPS = 8

# Share of the world's light that makes a spot a sun. Smaller: more lights, less noise of each.
SHARE = 0.1

# Light beside a spot, up to twice its angle and relative to its own, above which it is a part of a larger light.
# Larger: parts of lights with soft shadows become suns.
BESIDE = 0.5


@dataclass(frozen=True)
class Spot:
    """A small part of an equirectangular image.

    Attributes
    ----------
    toward : float64 (3,), unit vector to its center, in the image's space.
    irradiance : float64 (3,), of a surface that faces it, W/m^2.
    angle : full angle of an even disk as wide as it, by the mean square, radians.
    """

    toward: np.ndarray
    irradiance: np.ndarray
    angle: float


def directions(width: int, height: int, rows: slice) -> np.ndarray:
    """Unit vectors (N, 3) to the texel centers of some rows of an equirectangular image; see `WorldLight`."""
    azimuth = np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    elevation = np.pi * ((np.arange(height)[rows] + 0.5) / height - 0.5)
    towards = np.empty((len(elevation), width, 3))
    towards[..., 0] = np.cos(elevation)[:, None] * np.cos(azimuth)
    towards[..., 1] = np.cos(elevation)[:, None] * np.sin(azimuth)
    towards[..., 2] = np.sin(elevation)[:, None]
    return towards.reshape(-1, 3)


def without_suns(radiance: np.ndarray) -> tuple[np.ndarray, list[Spot]] | None:
    """An image (H, W, 3) with zeros in place of its suns, and these, the brightest first; None if it has none."""
    rest, suns = radiance, []
    while (found := _brightest(rest)) is not None:
        spot, (rows, columns) = found
        rest = rest if suns else radiance.copy()
        rest[rows, columns] = 0.0
        suns.append(spot)
    return (rest, suns) if suns else None


def _brightest(radiance: np.ndarray) -> tuple[Spot, tuple[np.ndarray, np.ndarray]] | None:
    """The spot around the brightest texel, and its rows and columns; None if that is no sun."""
    height, width = radiance.shape[:2]
    texel_x, texel_y = 2 * math.pi / width, math.pi / height
    reach = REACH - 0.5 * math.hypot(texel_x, texel_y)
    brightness = radiance.sum(2)
    row, column = np.unravel_index(brightness.argmax(), brightness.shape)
    if reach <= 0 or not 0 < brightness[row, column] < math.inf:
        return None
    borders = np.sin(math.pi * (np.arange(height + 1) / height - 0.5))
    solid_angles = texel_x * np.diff(borders)
    total = brightness.sum(1, dtype=float) @ solid_angles

    # All texels of a spot around the brightest, and of twice its angle around it, lie in these rows.
    margin = math.ceil(4 * REACH / texel_y)
    rows = slice(max(row - margin, 0), row + margin + 1)
    towards = directions(width, height, rows).reshape(-1, width, 3)
    light = radiance[rows] * solid_angles[rows, None, None]
    center = towards[row - rows.start, column]
    for _ in range(STEPS):
        distance = np.arccos(np.clip(towards @ center, -1.0, 1.0))
        inside = np.nonzero(distance <= reach)
        flow = light[inside].sum(1) @ towards[inside]
        center = flow / np.linalg.norm(flow)
    of_spot = light[inside].sum(dtype=float)
    beside = light[distance <= 2 * REACH].sum(dtype=float) - of_spot
    if of_spot < SHARE * total or beside > BESIDE * of_spot:
        return None
    offsets = np.arccos(np.clip(towards[inside] @ center, -1.0, 1.0))
    of_texel = ((texel_x * math.hypot(center[0], center[1])) ** 2 + texel_y**2) / 12
    mean_square = np.average(offsets**2, weights=light[inside].sum(1)) + of_texel
    angle = min(2 * math.sqrt(2 * mean_square), 2 * REACH)
    irradiance = np.einsum("ij,i->j", light[inside], towards[inside] @ center)
    return Spot(center, irradiance, angle), (inside[0] + rows.start, inside[1])
