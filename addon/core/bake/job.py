"""One bake as plain data: everything that `run` needs, nothing that knows the host."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BakeError
from ..ldf.library import is_known, library
from ..messages import Message, warning
from ..progress import Progress, say, stages, timed
from ..scene.illumination import Illumination
from ..scene.receiver import Receiver
from .bake_settings import COMBINED, BakeSettings
from .estimate import (
    NARROW,
    SUNS,
    WIDE,
    bake_bytes,
    machine_bytes,
    pass_bytes,
    ray_seconds,
    simulation_seconds,
    solver_seconds,
)
from .layers import LAYERS, WITHOUT_MEDIUM
from .luminance import rays_per_texel
from .margin import extend_margin
from .surface import Surface


@dataclass(frozen=True, eq=False)
class BakeJob:
    """A receiver with its light and its surface; `name` is what to call the receiver in messages.

    `more_color` makes another job of it, with the surface and the texture that it lacks, `more_light` one with what its
    illumination lacks, as bounced light, in whatever thread; they take about `color_seconds` and `more_seconds`.
    """

    name: str
    receiver: Receiver
    illumination: Illumination
    surface: Surface
    settings: BakeSettings
    more_light: Callable[[BakeJob, Progress | None], BakeJob] | None = None
    more_seconds: float = 0.0
    more_color: Callable[[BakeJob, Progress | None], BakeJob] | None = None
    color_seconds: float = 0.0

    def colored(self, progress: Progress | None = None) -> tuple[BakeJob, Progress | None]:
        """The job with its colours, which may have more to warn of, and the progress that is left for `run`."""
        if self.more_color is None or self._surely_dark():
            return self, progress
        self.surface.check()
        coloring, rest = stages(progress, [self.color_seconds, self._finding_seconds() + self._baking_seconds()])
        say(coloring, "Evaluating the base color")
        with timed(f"base color of '{self.name}'"):
            return replace(self.more_color(self, coloring), more_color=None), rest

    def lit(self, progress: Progress | None = None) -> tuple[BakeJob, Progress | None]:
        """The `colored` job with all its light, which may have more to warn of, and the progress left for `run`."""
        if self.more_light is None:
            return self, progress
        self.surface.check()
        finding, rest = stages(progress, [self._finding_seconds(), self._baking_seconds()])
        say(finding, "Finding indirect light")
        with timed(f"bounced light of '{self.name}'"):
            return replace(self.more_light(self, finding), more_light=None), rest

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """The layers of a `lit` job: name -> float32 (height, width, 3), with margin, row 0 at the bottom."""
        self.surface.check()
        if self._surely_dark():  # at once: to simulate the medium may take half a minute
            return {name: np.zeros((*self.receiver.coverage.shape, 3), np.float32) for name in self.settings.layers}
        parts = len(self.settings.layers) * len(self.receiver.charts)
        simulating, *solving = stages(progress, [self._simulation_seconds()] + [self._solver_seconds() / parts] * parts)
        self._simulate(simulating)
        say(progress, "Baking")
        material, steps = self.surface.material, iter(solving)
        if needs_medium(self.settings):
            with timed(f"albedo of '{self.name}'"):
                material = self.surface.resolve(self.settings.quality, None, self.settings.threads)
        layers = {}
        for name in self.settings.layers:
            with timed(f"{name} of '{self.name}'"):
                values = [LAYERS[name](self, chart.grid, material, next(steps)) for chart in self.receiver.charts]
            if not all(np.isfinite(on_grid).all() for on_grid in values):
                raise BakeError("The bake produced values that are not numbers: check the strengths of the lights.")
            texture = self.receiver.to_texture(values)
            del values  # large
            layers[name] = extend_margin(texture, self.receiver.coverage, self.settings.margin)
        return layers

    def _simulate(self, progress: Progress | None) -> None:
        media = to_simulate(self.surface, self.settings)
        for medium, step in zip(media, stages(progress, [1.0] * len(media))):
            library(medium, self.settings.quality, step, self.settings.threads)

    def _finding_seconds(self) -> float:
        return self.more_seconds if self.more_light else 0.0

    def _baking_seconds(self) -> float:
        return self._simulation_seconds() + self._solver_seconds()

    def _simulation_seconds(self) -> float:
        return simulation_seconds(self.settings.quality, self.settings.threads) * len(
            to_simulate(self.surface, self.settings)
        )

    def _solver_seconds(self) -> float:
        shape, settings = self.receiver.coverage.shape, self.settings
        suns = sum(light.is_parallel for light in self.illumination.lights)
        others = len(self.illumination.lights) - suns
        seconds = solver_seconds(*shape, suns, others, settings.solver, settings.threads)
        if not all(light.has_one_direction for light in self.illumination.lights):
            rays = max(rays_per_texel(chart.grid, self.surface.material, settings) for chart in self.receiver.charts)
            seconds += ray_seconds(shape[0] * shape[1], rays, settings.threads)
        return 0.1 + seconds * len(settings.layers)

    def memory_bytes(self) -> float:
        """The most memory that it takes, about, but for what is kept of light, and for the host and other processes."""
        texels, lights, surface = self.receiver.coverage.size, self.illumination.lights, self.surface
        if not needs_medium(self.settings):
            return pass_bytes(texels)
        is_narrow = self.more_light is None and all(light.has_one_direction for light in lights)
        kind = (SUNS if all(light.is_parallel for light in lights) else NARROW) if is_narrow else WIDE
        is_slab = surface.thickness > 0 and surface.material.ior > 1
        paths = surface.thickness / max(surface.material.mean_free_path) if is_slab else math.inf
        return bake_bytes(texels, self.settings.solver, kind, paths)

    def bytes_for_light(self) -> int:
        """What its limit leaves for what is kept of light; 0: any."""
        limit = self.settings.memory_limit or machine_bytes()
        return max(1, int(limit - self.memory_bytes())) if limit else 0

    def messages(self) -> list[Message]:
        """What the artist should know before the job runs."""
        return [*self.left_out(), *self._surely_dark()]

    def left_out(self) -> list[Message]:
        """Messages about light that is missing from the job."""
        return [*self.illumination.messages, *self._shining_through()]

    def _shining_through(self) -> list[Message]:
        """The warning about lights behind a slab: they shine through to the side that is baked."""
        if COMBINED not in self.settings.layers or not self.surface.thickness:
            return []
        backs = [replace(one.grid, normal=tuple(-value for value in one.grid.normal)) for one in self.receiver.charts]
        lights = [light for light in self.illumination.lights if not all(light.is_behind(back) for back in backs)]
        if not lights:
            return []
        names = ", ".join(f"'{light.name}'" for light in lights)
        text = f"Light that shines through the slab '{self.name}' from behind is not baked yet: that of {names}."
        return [warning(self.name, text)]

    def _surely_dark(self) -> list[Message]:
        return [] if self.more_light is not None else self._dark_by_lights()

    def _dark_by_lights(self) -> list[Message]:
        """The warning that none of the lights can reach the receiver, whatever the occluders."""
        lights = self.illumination.lights
        if not lights:
            return [warning("", "The scene has no light that can be baked, so the result is black.")]
        if all(light.is_behind(chart.grid) for light in lights for chart in self.receiver.charts):
            text = f"All lights are behind '{self.name}', so it is black."
            return [warning(self.name, text, "Flip its normals (Mesh > Normals > Flip in Edit Mode).")]
        return []

    def is_dark(self, layers: dict[str, np.ndarray]) -> bool:
        """Whether its result shows that no light arrived; what absorbs everything is black in any light."""
        if self._surely_dark():
            return True
        color = self.surface.base_color or self.surface.material.albedo
        telling = [texture for name, texture in layers.items() if name in WITHOUT_MEDIUM or any(color)]
        return bool(telling) and not any(texture.any() for texture in telling)

    def messages_after(self, layers: dict[str, np.ndarray]) -> list[Message]:
        """The messages that follow from the result."""
        if self._surely_dark() or not self.is_dark(layers):
            return []
        text = f"No light reaches '{self.name}', so it is black."
        return self._dark_by_lights() or [warning(self.name, text, "Look for objects that block the light.")]


def needs_medium(settings: BakeSettings) -> bool:
    """Whether what the surface is made of matters to a bake."""
    return not WITHOUT_MEDIUM.issuperset(settings.layers)


def to_simulate(surface: Surface, settings: BakeSettings) -> list:
    """The media that a bake has to simulate first, which takes long."""
    uses_library = settings.distributions == "library" or surface.base_color is not None
    if not (needs_medium(settings) and uses_library):
        return []
    return [medium for medium in surface.media() if not is_known(medium, settings.quality)]
