"""Lights of any kind -> what reaches a chart's grid, as solvers take it: native `PlaneLight`s, or rays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..native import native
from ..progress import Progress, ask
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light
from ..scene.reach import Reach
from .bake_settings import BakeSettings

# Of a survey, which only has to know what directions there are.
SURVEY_TEXELS, SURVEY_RAYS = 96, 4

# Of light that stands for itself where the solver chooses how exactly to look.
STAND_IN_RAYS = 8

# W/m^2: below, single precision has no direction either.
LEAST_FLOW = 1e-30


class Gatherer:
    """What reaches one grid.

    Attributes
    ----------
    rays : traced from each texel to all lights of a size together, about.
    seed : of these rays.
    """

    seed = 0

    def __init__(self, grid: Grid, illumination: Illumination, settings: BakeSettings, rays: int = 256) -> None:
        self.grid, self.rays = grid, rays
        self._illumination, self._settings = illumination, settings

    def is_colored(self, light: Light) -> bool:
        """Whether the light differs in color from ray to ray, be it by what it shines through or falls on."""
        if self.grid.color_in is not None:
            return True
        return light.is_colored or self._reach(light).is_colored

    def plane_lights(self, light: Light, progress: Progress | None = None) -> list:
        """A light of one direction per texel, as a native `PlaneLight` or one for each color channel."""
        return light.plane_lights(self._reach(light, progress))

    def layers(self, light: Light, progress: Progress | None = None) -> Iterator:
        """Any light as native `PlaneLight`s, which make it up together; one ray per texel each where it has a size."""
        return light.layers(self._reach(light, progress))

    def add_to(self, field, light: Light, rays: int, progress: Progress | None = None) -> None:
        """Add the light to a native `LightField`."""
        light.add_to(field, self._reach(light, progress, rays))

    def totals(self, light: Light, rays: int, progress: Progress | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance and flow of the light, see `Light.totals`."""
        return light.totals(self._reach(light, progress, rays))

    def beams(self, light: Light, progress: Progress | None = None, directions: bool = True):
        """Irradiance and directions of a light of one direction per texel, see `Light.beams`."""
        return light.beams(self._reach(light, progress), directions)

    def stand_in(self, light: Light, progress: Progress | None = None) -> list:
        """The light as far as a `LightField` needs it to look, with the mean direction of each texel.

        Harmonics of all directions together are weaker than those of their mean.
        """
        if light.has_one_direction:
            return light.plane_lights(self._reach(light, progress), directions=True)
        irradiance, flow = self.totals(light, STAND_IN_RAYS, progress)
        ask(progress, 1.0)  # large ones took a second, and will again
        # In double precision: the square of what hardly arrives, as 1e-22 at a border, has no digits in single.
        length = np.sqrt(np.einsum("...i,...i->...", flow, flow, dtype=np.float64))[..., None]
        down = np.full_like(flow, (0, 0, -1))
        direction = np.divide(flow, length, out=down, where=length > LEAST_FLOW, casting="same_kind")
        return native.PlaneLight.of_channels(irradiance * light.rgb(), direction, 3)

    def survey(self) -> tuple[tuple[int, int], list[list], list[float]]:
        """All light without what stands in its way, at few texels.

        Returns
        -------
        The shape of the grid looked at; for each light of the illumination native `PlaneLight`s, one for each channel
        where its rays differ in color; and its mean irradiance, W/m^2.
        """
        grid = self.grid
        width, height = min(grid.width, SURVEY_TEXELS), min(grid.height, SURVEY_TEXELS)
        pitch = {"pitch_x": grid.pitch_x * grid.width / width, "pitch_y": grid.pitch_y * grid.height / height}
        whole = np.ones((height, width), np.float32)
        coarse = replace(grid, width=width, height=height, coverage=whole, color_in=None, **pitch)
        settings = replace(self._settings, samples=1)
        bare = Gatherer(coarse, Illumination(()), settings, SURVEY_RAYS)
        lights, means = [], []
        for light in self._illumination.lights:
            parts = list(bare.layers(light))
            means.append(sum(part.mean() for part in parts))
            if self.is_colored(light):
                parts = [one for part in parts for one in part.by_channel()]
            lights.append(parts)
        return (height, width), lights, means

    def _reach(self, light: Light, progress: Progress | None = None, rays: int | None = None) -> Reach:
        caster = self._illumination.caster(self.grid, light) if light.cast_shadow else None
        rays = self.rays if rays is None else rays
        return Reach(self.grid, caster, self._settings.samples, rays, self.seed, self._settings.threads, progress)
