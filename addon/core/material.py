"""Materials: their optical properties, measured presets, and media that stand for a Principled BSDF."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TypeAlias

from .errors import MaterialError
from .native import native

CHANNELS = ("red", "green", "blue")

RGB = tuple[float, float, float]

Media: TypeAlias = "native.Medium | tuple[native.Medium, native.Medium, native.Medium]"
"""One medium for all channels, or one for each."""

PRESET_FILE = Path(__file__).resolve().parents[1] / "data" / "materials.csv"
MAX_ALBEDO = 0.99999
"""Largest albedo that colors may ask for. Simulations follow light for enough scatterings up to it."""

METRES_PER_MM = 1e-3
# Absorption, 1/mm, assumed where Jensen's table prints 0: half its last digit. Without absorption a half-space has no
# solution. Larger: darker presets.
UNRESOLVED_ABSORPTION_PER_MM = 0.005
SOURCES = {
    "Jensen2001": "Jensen et al. 2001, diffusion fit",
    "Narasimhan2006": "Narasimhan et al. 2006, diluted in water and scaled back to the undiluted liquid; ior of water",
}


@dataclass(frozen=True)
class Material:
    """Optical properties of a translucent medium.

    Attributes
    ----------
    albedo : single-scattering albedo per channel, each in [0, 1).
    mean_free_path : per channel, metres (or any length unit that the grid has, too).
    anisotropy : Henyey-Greenstein g in (-1, 1); the mean of the channels if they differ.
    ior : index of refraction, inside over outside, >= 1.
    source : origin of the numbers.
    anisotropy_rgb : g per channel, which replaces `anisotropy` in bakes; None if all channels have `anisotropy`.
    """

    albedo: RGB
    mean_free_path: RGB
    anisotropy: float = 0.8
    ior: float = 1.0
    source: str = ""
    anisotropy_rgb: RGB | None = None

    @property
    def channel_anisotropy(self) -> RGB:
        """Anisotropy of each channel."""
        return self.anisotropy_rgb or (self.anisotropy,) * 3

    def medium(self, thickness: float = math.inf) -> Media:
        """The `Medium` of the material, for `library` and `simulate`; three, one per channel, if the channels differ.

        Parameters
        ----------
        thickness : metres, inf for a half-space. In mean free paths, a slab's thickness differs between channels.
        """
        red, green, blue = self.channel_media(thickness)
        return red if red == green == blue else (red, green, blue)

    def channel_media(self, thickness: float = math.inf) -> tuple[native.Medium, native.Medium, native.Medium]:
        """The `Medium` of each channel, as `medium`."""
        if not thickness > 0:
            raise ValueError(f"argument 'thickness' is {thickness!r}; allowed: metres above 0, inf for a half-space")
        red, green, blue = (
            native.Medium(g, self.ior, thickness / length)
            for g, length in zip(self.channel_anisotropy, self.mean_free_path)
        )
        return red, green, blue

    def with_one_anisotropy(self) -> Material:
        """The similar material with `anisotropy` in every channel.

        It has the same absorption and reduced scattering sigma_s (1 - g), hence both agree at distances of a few mean
        free paths (similarity relation of order 1: Wyman, Patterson & Wilson 1989, doi:10.1364/AO.28.005243).
        """
        if self.anisotropy_rgb is None:
            return self
        albedo, lengths = [], []
        for a, length, g in zip(self.albedo, self.mean_free_path, self.anisotropy_rgb):
            scattering = a / length * (1 - g) / (1 - self.anisotropy)
            extinction = scattering + (1 - a) / length
            albedo.append(scattering / extinction)
            lengths.append(1 / extinction)
        return replace(self, albedo=tuple(albedo), mean_free_path=tuple(lengths), anisotropy_rgb=None)

    def check(self) -> None:
        """Raise MaterialError if a value is outside the range of light transport."""
        for channel, value in zip(CHANNELS, self.albedo):
            if not 0 <= value < 1:
                remedy = "It must be at least 0 and below 1 (try 0.999): without absorption, light never ends."
                raise MaterialError(f"The albedo's {channel} is {value:g}.", remedy)
        for channel, value in zip(CHANNELS, self.mean_free_path):
            if not (value > 0 and math.isfinite(value)):
                raise MaterialError(
                    f"The mean free path's {channel} is {value:g}.", "It must be a length above 0 (marble: 0.0004 m)."
                )
        for value in (self.anisotropy, *self.channel_anisotropy):
            if not -1 < value < 1:
                raise MaterialError(f"The anisotropy is {value:g}.", "It must lie between -1 and 1, both excluded.")
        if not (self.ior >= 1 and math.isfinite(self.ior)):
            raise MaterialError(f"The IOR is {self.ior:g}.", "It must be 1 or more.")


def check_thickness(thickness: float) -> None:
    """Raise MaterialError unless `thickness` (metres, 0: half-space) can be simulated."""
    if not (thickness >= 0 and math.isfinite(thickness)):
        raise MaterialError(f"The thickness is {thickness:g}.", "It must be 0, for infinitely thick, or more.")


def check_base_color(color: RGB) -> None:
    """Raise MaterialError unless every channel is a reflectance."""
    for channel, value in zip(CHANNELS, color):
        if not 0 <= value <= 1:
            raise MaterialError(f"The base color's {channel} is {value:g}.", "It must be between 0 and 1.")


def presets() -> dict[str, Material]:
    """Measured materials by name: mean free path 1 / (sigma_s + sigma_a), albedo sigma_s / (sigma_s + sigma_a).

    Narasimhan et al. 2006 (doi:10.1145/1141911.1141986) measured sigma_s, sigma_a and g of liquids per channel: these
    materials have an `anisotropy_rgb`. Jensen et al. 2001 (doi:10.1145/383259.383319) fitted a diffusion model, which
    gives the reduced scattering coefficient sigma_s (1 - g) alone. It is taken for that of an isotropic medium
    (anisotropy 0), which looks the same from a few mean free paths away. `source` names the paper of each material.
    """
    return {row["name"]: _preset(row) for row in _preset_rows()}


def preset_roughness() -> dict[str, float]:
    """Roughness of the coat that suits each measured material, by name: a look, and no measurement."""
    return {row["name"]: float(row["roughness"]) for row in _preset_rows()}


def _preset_rows() -> list[dict[str, str]]:
    with PRESET_FILE.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def _preset(row: dict[str, str]) -> Material:
    scattering = [float(row[f"sigma_s_{channel}"]) for channel in "rgb"]
    measured = [float(row[f"sigma_a_{channel}"]) for channel in "rgb"]
    absorption = [value if value > 0 else UNRESOLVED_ABSORPTION_PER_MM for value in measured]
    anisotropy = tuple(float(row[f"g_{channel}"]) for channel in "rgb") if row["g_r"] else None
    source = SOURCES[row["source"]]
    if anisotropy is None:
        source += ": reduced scattering taken as isotropic (anisotropy 0), as g is unknown"
    if absorption != measured:
        source += f"; absorption below the table's digits, {UNRESOLVED_ABSORPTION_PER_MM} per mm assumed"
    extinction = [s + a for s, a in zip(scattering, absorption)]
    return Material(
        albedo=tuple(s / t for s, t in zip(scattering, extinction)),
        mean_free_path=tuple(METRES_PER_MM / t for t in extinction),
        anisotropy=0.0 if anisotropy is None else sum(anisotropy) / len(anisotropy),
        ior=float(row["ior"]),
        source=source,
        anisotropy_rgb=anisotropy,
    )


class Walk(Enum):
    """Meaning of a radius in Cycles' random walks.

    FIXED : 4 pi transport mean free paths; also of Burley's profile. Blender 5.2 calls it Legacy.
    SKIN : diffuse mean free path.
    FREE_PATH : mean free path, whatever the anisotropy (Blender 5.2).
    """

    FIXED = 1
    SKIN = 2
    FREE_PATH = 3


def mean_free_path(radius: float, walk: Walk, color: float, ior: float, anisotropy: float) -> float:
    """Mean free path 1 / sigma_t of Cycles' random walk, in the unit of `radius`.

    Cycles' sources: `bssrdf_setup_radius` (kernel/closure/bssrdf.h) and `subsurface_random_walk_remap`
    (kernel/integrator/subsurface_random_walk.h). The diffuse mean free path of SKIN is 1 / sqrt(3 sigma_a sigma_t');
    the reduced albedo follows from the dipole's reflectance (Jensen et al. 2001, Eq. 4).

    Parameters
    ----------
    color : diffuse reflectance, 0 to 1; used by SKIN.
    ior : index of refraction at entry; used by SKIN.
    """
    if walk == Walk.FREE_PATH:
        return radius
    if walk == Walk.FIXED:
        return (1 - anisotropy) * radius / (4 * math.pi)
    return (1 - anisotropy) * radius * math.sqrt(3 * (1 - reduced_albedo(color, ior)))


def reduced_albedo(color: float, ior: float) -> float:
    """Reduced albedo alpha' whose dipole has the diffuse reflectance `color` (Jensen et al. 2001); at most .999999."""
    # Diffuse Fresnel reflectance (Egan & Hilgeman 1979, as in Jensen et al. 2001).
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
    """Index of refraction with this reflectance at normal incidence, 0 <= reflectance < 1."""
    root = math.sqrt(reflectance)
    return (1 + root) / (1 - root)


def reflectance_of_ior(ior: float) -> float:
    """Fresnel reflectance at normal incidence."""
    return ((ior - 1) / (ior + 1)) ** 2
