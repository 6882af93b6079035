"""Lights of any kind -> what reaches a chart's grid, as solvers take it: native `PlaneLight`s, or rays."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..native import native
from ..progress import Progress, stages
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import ExtendedLight, FieldLight, Light, SunDiskLight
from .settings import BakeSettings

# Of a sun up to so wide, radians, all light counts as coming from its middle but for its shadows: that leaves out what
# grows with the square of the angle, of the luminance 6e-4 at 80 degrees of incidence and 5e-3 at 85.
WIDEST_SUN = math.radians(2.0)

# Of a survey, which only has to know what directions there are.
SURVEY_TEXELS, SURVEY_RAYS = 96, 4

# Of the rays of a texel, where nothing stands in their way or everything does: there only their directions matter.
EVEN_PART, FEWEST_EVEN, MOST_EVEN = 8, 4, 16

# Of light that stands for itself where the solver chooses how exactly to look.
STAND_IN_RAYS = 8


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

    @staticmethod
    def has_one_direction(light: Light) -> bool:
        """Whether light reaches each texel from one direction only, as far as the medium can tell."""
        if isinstance(light, ExtendedLight):
            return isinstance(light, SunDiskLight) and light.angle <= WIDEST_SUN
        return not isinstance(light, FieldLight)

    def is_colored(self, light: Light) -> bool:
        """Whether the light differs in color from ray to ray, be it by what it shines through or falls on."""
        if self.grid.color_in is not None:
            return True
        caster = self._caster(light)
        return getattr(light, "is_colored", False) or (caster is not None and caster.is_colored)

    def plane_lights(self, light: Light, progress: Progress | None = None, directions: bool = False) -> list:
        """A light of one direction per texel, as a native `PlaneLight` or one for each color channel.

        With `directions` as arrays, even where one direction or one point says it all.
        """
        if isinstance(light, ExtendedLight):
            irradiance, _ = self.totals(light, self.rays, progress)
            direction = self._in_plane(light.direction)
            if not self.is_colored(light):
                irradiance = irradiance[..., 0]
        else:
            position = None if directions else light.position_in(self.grid)
            irradiance, direction = self.beams(light, progress, directions=position is None)
            if position is not None and irradiance.ndim == 2:
                return [native.PlaneLight.from_point(irradiance, position, light.rgb().tolist())]
            if position is not None:
                _, direction = self.beams(light)
        direction = np.ascontiguousarray(direction, np.float32)
        if directions and direction.ndim == 1:
            direction = np.tile(direction, (*irradiance.shape[:2], 1))
        if irradiance.ndim == 2:
            return [native.PlaneLight(irradiance, direction, light.rgb().tolist())]
        return native.PlaneLight.of_channels(irradiance * light.rgb(), direction, 3)

    def layers(self, light: Light, progress: Progress | None = None) -> Iterator:
        """Any light as native `PlaneLight`s, which make it up together; one ray per texel each where it has a size."""
        if self.has_one_direction(light):
            yield from self.plane_lights(light, progress)
            return
        if isinstance(light, FieldLight):
            arriving = light.layers(self.grid)
        else:
            arriving = native.ray_layers(*self._traced(light), **self._options(self.rays, progress))
        for irradiance, direction in arriving:
            yield from native.PlaneLight.of_channels(self._received(irradiance) * light.rgb(), direction, 3)

    def add_to(self, field, light: Light, rays: int, progress: Progress | None = None) -> None:
        """Add the light to a native `LightField`."""
        if self.has_one_direction(light) or isinstance(light, FieldLight):
            for part in self.layers(light, progress):
                field.add(part)
            return
        grid, shape, caster = self._traced(light)
        options = self._options(rays, progress) | self._even_rays(rays)
        parts = self._channels_received(light.rgb())
        for (color, received), options["progress"] in zip(parts, stages(progress, [1.0] * len(parts))):
            field.add_rays(grid, shape, color, received, caster, **options)

    def totals(self, light: Light, rays: int, progress: Progress | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance (H, W, 3) of the light at strength 1 and color 1, W/m^2 on the covered part of each texel.

        And its flow (H, W, 3): the sum of the irradiance, the mean of the channels, times the unit vector of travel in
        the plane's frame.
        """
        if isinstance(light, ExtendedLight):
            options = self._options(rays, progress) | self._even_rays(rays)
            irradiance, flow = native.gather_rays(*self._traced(light), **options)
            return self._received(irradiance), self._covered(flow)
        if isinstance(light, FieldLight):
            irradiance, flow = np.zeros((2, self.grid.height, self.grid.width, 3), np.float32)
            for part, direction in light.layers(self.grid):
                irradiance += part
                flow += part.mean(axis=2, keepdims=True) * direction
            return self._received(irradiance), self._covered(flow)
        irradiance, direction = self.beams(light, progress)
        if irradiance.ndim == 2:
            irradiance = np.repeat(irradiance[..., None], 3, axis=2)
        return irradiance, irradiance.mean(axis=2, keepdims=True) * np.asarray(direction, np.float32)

    def beams(self, light: Light, progress: Progress | None = None, directions: bool = True):
        """Irradiance of a light without size at strength 1 and color 1, and its direction; see `Light.gather`.

        (H, W), or (H, W, 3) behind what colors light or on a texture; W/m^2 with cosine, visibility and coverage.
        """
        irradiance, direction = light.gather(
            self.grid,
            self._caster(light),
            samples=self._settings.samples,
            threads=self._settings.threads,
            progress=progress,
            clearance=self.grid.clearance,
            directions=directions,
        )
        return self._received(irradiance), direction

    def stand_in(self, light: Light, progress: Progress | None = None) -> list:
        """The light as far as a `LightField` needs it to look, with the mean direction of each texel.

        Harmonics of all directions together are weaker than those of their mean.
        """
        if self.has_one_direction(light):
            return self.plane_lights(light, progress, directions=True)
        irradiance, flow = self.totals(light, STAND_IN_RAYS, progress)
        length = np.linalg.norm(flow, axis=-1, keepdims=True)
        direction = np.divide(flow, length, out=np.full_like(flow, (0, 0, -1)), where=length > 0)
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

    def _caster(self, light: Light):
        return self._illumination.caster(self.grid, light) if light.cast_shadow else None

    def _traced(self, light: ExtendedLight) -> tuple:
        return self.grid.native(), light.native(), self._caster(light)

    @staticmethod
    def _even_rays(rays: int) -> dict:
        return {"even_rays": min(max(rays // EVEN_PART, FEWEST_EVEN), MOST_EVEN)}

    def _options(self, rays: int, progress: Progress | None) -> dict:
        return {
            "rays": rays,
            "seed": self.seed,
            "threads": self._settings.threads,
            "progress": progress,
            "clearance": self.grid.clearance,
        }

    def _in_plane(self, direction) -> np.ndarray:
        return np.array([np.dot(direction, axis) for axis in (self.grid.x_axis, self.grid.y_axis, self.grid.normal)])

    def _received(self, irradiance: np.ndarray) -> np.ndarray:
        """Of (H, W) or (H, W, 3), what the covered part of each texel lets in by its color."""
        covered, color = self._covered(irradiance), self.grid.color_in
        if color is None:
            return covered
        return covered[..., None] * color if covered.ndim == 2 else covered * color

    def _channels_received(self, rgb: np.ndarray) -> list[tuple[list[float], np.ndarray]]:
        """Colors of light, and the part (H, W) of it that each texel receives; together they are all."""
        color, coverage = self.grid.color_in, self.grid.coverage
        if color is None:
            return [(rgb.tolist(), coverage)]
        if (color[..., :1] == color).all():
            return [(rgb.tolist(), coverage * color[..., 0])]
        return [((rgb * np.eye(3)[i]).tolist(), np.ascontiguousarray(coverage * color[..., i])) for i in range(3)]

    def _covered(self, values: np.ndarray) -> np.ndarray:
        values *= self.grid.coverage if values.ndim == 2 else self.grid.coverage[..., None]
        return values
