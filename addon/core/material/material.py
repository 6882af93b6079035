"""Optical properties of a surface: the Material and its checks."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

from ..errors import MaterialError
from ..native import native

CHANNELS = ("red", "green", "blue")

RGB = tuple[float, float, float]

Media: TypeAlias = "native.Medium | tuple[native.Medium, native.Medium, native.Medium]"
"""One medium for all channels, or one for each."""


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

        Absorption and reduced scattering sigma_s (1 - g) are kept, so that both agree a few mean free paths from where
        the light enters (similarity relation of order 1: Wyman, Patterson & Wilson 1989).
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
        for value in (self.anisotropy, *self.channel_anisotropy):
            if not -1 < value < 1:
                raise MaterialError(f"The anisotropy is {value:g}; it must lie between -1 and 1, both excluded.")
        if not (self.ior >= 1 and math.isfinite(self.ior)):
            raise MaterialError(f"The IOR is {self.ior:g}; it must be 1 or more.")


def check_thickness(thickness: float) -> None:
    """Raise MaterialError unless `thickness` (metres, 0: half-space) can be simulated."""
    if not (thickness >= 0 and math.isfinite(thickness)):
        raise MaterialError(f"The thickness is {thickness:g}; it must be a length above 0, or 0 for endlessly thick.")


def check_base_color(color: RGB) -> None:
    """Raise MaterialError unless every channel is a reflectance."""
    for channel, value in zip(CHANNELS, color):
        if not 0 <= value <= 1:
            raise MaterialError(f"The base colour's {channel} is {value:g}; it must be between 0 and 1.")
