"""What a surface is made of: the Material, its checks and the measured presets."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .errors import MaterialError

PRESET_FILE = Path(__file__).resolve().parent.parent / "data" / "materials.csv"
METRES_PER_MM = 1e-3
# Jensen's table prints absorption to two decimals per mm; where it says 0, half its last digit is assumed, because an
# albedo of 1 has no solution in an infinite medium.
UNRESOLVED_ABSORPTION_PER_MM = 0.005
CHANNELS = ("red", "green", "blue")

RGB = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """Optical properties of a translucent medium.

    Attributes
    ----------
    albedo : single-scattering albedo per channel, each in [0, 1).
    mean_free_path : per channel, metres (any length unit will do if the grid has the same).
    anisotropy : Henyey-Greenstein g in (-1, 1).
    ior : index of refraction, inside over outside, >= 1.
    source : where the numbers come from.
    """

    albedo: RGB
    mean_free_path: RGB
    anisotropy: float = 0.8
    ior: float = 1.0
    source: str = ""

    def check(self) -> None:
        """Raise MaterialError with one sentence if a value lies outside what light transport allows."""
        for channel, value in zip(CHANNELS, self.albedo):
            if not 0 <= value < 1:
                raise MaterialError(
                    f"The albedo's {channel} is {value:g}; it must be at least 0 and below 1, "
                    "because a medium without any absorption never lets light end (try 0.999)."
                )
        for channel, value in zip(CHANNELS, self.mean_free_path):
            if not (value > 0 and math.isfinite(value)):
                raise MaterialError(
                    f"The mean free path's {channel} is {value:g}; it must be a length above 0 (marble: 0.0004 m)."
                )
        if not -1 < self.anisotropy < 1:
            raise MaterialError(f"The anisotropy is {self.anisotropy:g}; it must lie between -1 and 1, both excluded.")
        if not (self.ior >= 1 and math.isfinite(self.ior)):
            raise MaterialError(f"The IOR is {self.ior:g}; it must be 1 or more.")


def check_thickness(thickness: float) -> None:
    """Raise MaterialError unless `thickness` (metres, 0: half-space) can be simulated."""
    if not (thickness >= 0 and math.isfinite(thickness)):
        raise MaterialError(f"The thickness is {thickness:g}; it must be a length above 0, or 0 for endlessly thick.")


def presets() -> dict[str, Material]:
    """Materials measured by Jensen et al. 2001, by name.

    They measured the reduced scattering coefficient only, so that anisotropy is 0 and
    mean free path = 1 / (sigma_s' + sigma_a), albedo = sigma_s' / (sigma_s' + sigma_a).
    """
    with PRESET_FILE.open(newline="", encoding="utf-8") as file:
        return {row["name"]: _preset(row) for row in csv.DictReader(file)}


def _preset(row: dict[str, str]) -> Material:
    scattering = [float(row[f"sigma_s_prime_{channel}"]) for channel in "rgb"]
    measured = [float(row[f"sigma_a_{channel}"]) for channel in "rgb"]
    absorption = [value if value > 0 else UNRESOLVED_ABSORPTION_PER_MM for value in measured]
    source = f"{row['source']}, diffusion fit: reduced scattering taken as isotropic (anisotropy 0)"
    if absorption != measured:
        source += f"; absorption below the table's digits, {UNRESOLVED_ABSORPTION_PER_MM} per mm assumed"
    extinction = [s + a for s, a in zip(scattering, absorption)]
    return Material(
        albedo=tuple(s / t for s, t in zip(scattering, extinction)),
        mean_free_path=tuple(METRES_PER_MM / t for t in extinction),
        anisotropy=0.0,
        ior=float(row["ior"]),
        source=source,
    )


# Albedos nearer to 1 differ by less than Monte Carlo noise.
HIGHEST_ALBEDO = 0.9999


def albedo_from_reflectance(color: RGB, reflectance: Callable[[float], float]) -> RGB:
    """Single-scattering albedo whose reflectance is `color`, channel by channel.

    Parameters
    ----------
    color : reflectance wanted.
    reflectance : of an albedo; grows with it, e.g. `LdfLibrary.diffuse_reflectance`.

    Raises
    ------
    MaterialError
        A colour brighter than the medium can be.
    """
    brightest = reflectance(HIGHEST_ALBEDO)
    for channel, value in zip(CHANNELS, color):
        if not 0 <= value <= brightest:
            raise MaterialError(
                f"The base colour's {channel} is {value:g}; with this IOR and thickness the medium can reflect "
                f"between 0 and {brightest:.3f}, so darken the colour."
            )
    return tuple(_albedo_of(value, reflectance) for value in color)


def _albedo_of(value: float, reflectance: Callable[[float], float]) -> float:
    """Bisection; 40 halvings reach the last digits of a double."""
    low, high = 0.0, HIGHEST_ALBEDO
    for _ in range(40):
        middle = (low + high) / 2
        if reflectance(middle) < value:
            low = middle
        else:
            high = middle
    return (low + high) / 2
