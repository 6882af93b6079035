"""One bake as plain data: everything that `run` needs, nothing that knows the host."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BakeError
from ..progress import Progress, stages
from ..scene.illumination import Illumination
from ..scene.receiver import Receiver
from .layers import LAYERS
from .luminance import LIBRARY_WEIGHT, LIGHT_WEIGHT, SOLVE_WEIGHT
from .margin import extend_margin
from .settings import COMBINED, BakeSettings
from .surface import Surface


@dataclass(frozen=True, eq=False)
class BakeJob:
    """A receiver with its light and its surface; `name` is what to call the receiver in messages."""

    name: str
    receiver: Receiver
    illumination: Illumination
    surface: Surface
    settings: BakeSettings

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """The layers: name -> float32 (height, width, 3), margin included, row 0 at the bottom."""
        needs_albedo = 0.0 if self.surface.base_color is None else LIBRARY_WEIGHT
        one = LIBRARY_WEIGHT + SOLVE_WEIGHT + LIGHT_WEIGHT * len(self.illumination.lights)
        parts = len(self.settings.layers) * len(self.receiver.charts)
        resolving, *baking = stages(progress, [needs_albedo] + [one] * parts)
        material, steps = self.surface.resolve(self.settings.quality, resolving), iter(baking)
        layers = {}
        for name in self.settings.layers:
            values = [LAYERS[name](self, chart.grid, material, next(steps)) for chart in self.receiver.charts]
            if not all(np.isfinite(on_grid).all() for on_grid in values):
                raise BakeError("The bake produced values that are not numbers: check the strengths of the lights.")
            texture = self.receiver.to_texture(values)
            del values  # large
            layers[name] = extend_margin(texture, self.receiver.coverage, self.settings.margin)
        return layers

    def warnings(self) -> list[str]:
        """What the artist should know before it runs."""
        return [*self.illumination.warnings, *filter(None, [self._surely_dark()])]

    def _surely_dark(self) -> str:
        lights = self.illumination.lights
        if not lights:
            return "No light of the scene can be baked: it is black."
        if all(light.is_behind(chart.grid) for light in lights for chart in self.receiver.charts):
            return (
                f"All lights are behind '{self.name}', where its normals don't point, so it is black: "
                "flip them (Mesh > Normals > Flip in Edit Mode)."
            )
        return ""

    def warnings_after(self, layers: dict[str, np.ndarray]) -> list[str]:
        """What only its result shows."""
        combined, color = layers.get(COMBINED), self.surface.base_color or self.surface.material.albedo
        if combined is None or combined.any() or not any(color) or self._surely_dark():
            return []
        return [f"No light reaches '{self.name}', so it is black: look for what stands in its way."]
