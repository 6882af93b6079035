"""How to bake."""

from __future__ import annotations

from dataclasses import dataclass

COMBINED, IRRADIANCE, DIRECTION = "Combined", "Irradiance", "Direction"
"""Layers: the one that materials show, luminance under all lights; and what arrives, see `arrive`."""

PREVIEW, FINAL = "preview", "final"
"""Qualities of simulated libraries."""

OUTPUTS = {"LUMINANCE": COMBINED, "IRRADIANCE": IRRADIANCE, "DIRECTION": DIRECTION}
"""What users choose from, and its layer."""


@dataclass(frozen=True)
class BakeSettings:
    """What a scene's settings ask for.

    Attributes
    ----------
    solver : "fft", "direct" or "adaptive".
    samples : visibility is sampled at samples x samples points per texel.
    margin : texels added around the charts.
    quality : of the LDF, "final" or "preview".
    distributions : "library", simulated from the material, or the method by which the samples in `sample_folder` are
        interpolated: "angular", "adaptive" or "planar". Samples stand for anisotropy, index of refraction and
        thickness of every material.
    threads : 0 for all.
    memory_limit : bytes that a bake may take, about; 0: all of the machine's.
    indirect : whether light counts that other objects return.
    layers : names of results wanted, see layers.py.
    """

    solver: str = "fft"
    samples: int = 4
    margin: int = 16
    quality: str = "final"
    distributions: str = "library"
    sample_folder: str = ""
    threads: int = 0
    memory_limit: int = 0
    indirect: bool = True
    layers: tuple[str, ...] = (COMBINED,)

    @property
    def output(self) -> str:
        """The first layer, by the name that users know."""
        return next((name for name, layer in OUTPUTS.items() if layer == self.layers[0]), self.layers[0])
