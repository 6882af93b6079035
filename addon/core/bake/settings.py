"""How to bake."""

from __future__ import annotations

from dataclasses import dataclass

COMBINED = "Combined"
"""The layer that materials show: luminance under all lights."""


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
    layers : names of results wanted, see layers.py.
    """

    solver: str = "fft"
    samples: int = 4
    margin: int = 16
    quality: str = "final"
    distributions: str = "library"
    sample_folder: str = ""
    threads: int = 0
    layers: tuple[str, ...] = (COMBINED,)
