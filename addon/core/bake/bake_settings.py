"""Settings of a bake."""

from __future__ import annotations

from dataclasses import dataclass

COMBINED, IRRADIANCE, DIRECTION = "Combined", "Irradiance", "Direction"
"""Layers: luminance, which materials show; irradiance and direction of the light that arrives, see `arrive`."""

PREVIEW, FINAL = "preview", "final"
"""Qualities of simulated libraries."""

OUTPUTS = {"LUMINANCE": COMBINED, "IRRADIANCE": IRRADIANCE, "DIRECTION": DIRECTION}
"""Layers by their names for users."""

MAX_SAMPLES = 64
"""Largest number of samples, see `BakeSettings.samples`."""

EXTEND, ADJACENT_FACES = "EXTEND", "ADJACENT_FACES"
"""Margins that continue each island, and margins with the light beyond the edges of islands."""


@dataclass(frozen=True)
class BakeSettings:
    """Settings of a scene for its bakes.

    Attributes
    ----------
    solver : "fft", "direct" or "adaptive".
    samples : side of the grid of points per texel at which visibility is sampled.
    margin : texels around the islands that continue the result.
    margin_type : `EXTEND`, or `ADJACENT_FACES`.
    quality : quality of the LDF, "final" or "preview".
    distributions : "library" simulates the material; "angular", "adaptive" and "planar" interpolate the samples in
        `sample_folder`, which then replace anisotropy, index of refraction and thickness of every material.
    threads : number of threads; 0: all.
    memory_limit : bytes that a bake may take, about; 0: all of the machine's memory.
    indirect : True if light counts that other objects return.
    layer : name of the result, see layers.py.
    """

    solver: str = "fft"
    samples: int = 4
    margin: int = 16
    margin_type: str = EXTEND
    quality: str = "final"
    distributions: str = "library"
    sample_folder: str = ""
    threads: int = 0
    memory_limit: int = 0
    indirect: bool = True
    layer: str = COMBINED

    @property
    def output(self) -> str:
        """Name of the layer for users."""
        return next((name for name, layer in OUTPUTS.items() if layer == self.layer), self.layer)
