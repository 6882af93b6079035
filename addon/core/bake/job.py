"""One bake as plain data: all that its steps need, and nothing that depends on the host."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BakeError
from ..ldf.library import SIMULATING, is_known, library
from ..messages import Message, warning
from ..progress import Callback, Progress, timed
from ..scene.illumination import Illumination
from ..scene.receiver import Receiver
from ..scene.texture import BaseColor, textured
from .bake_settings import COMBINED, BakeSettings
from .layers import LAYERS, WITHOUT_MEDIUM
from .margin import extend_margin
from .memory import NARROW, SUNS, WIDE, bake_bytes, machine_bytes, pass_bytes
from .surface import Surface


class Step(ABC):
    """One step of a job. Steps are plain data; they run in any thread.

    Attributes
    ----------
    name : for messages.
    finds_light : True if the step may add lights to the job.
    """

    name = ""
    finds_light = False

    @abstractmethod
    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        """The job after the step."""

    def stage(self, _job: BakeJob) -> str:
        """Name of the step's first stage."""
        return self.name

    def weight(self, _job: BakeJob) -> float:
        """Length of the step in a progress bar, relative to other steps; 0 if it takes no time."""
        return 1.0

    def memory_bytes(self, _job: BakeJob) -> float:
        """Memory that the step takes at its peak, about, in bytes."""
        return 0.0


@dataclass(frozen=True)
class Simulate(Step):
    """Simulates the media of the surface, and caches them."""

    name = "Simulating the material"

    def weight(self, job: BakeJob) -> float:
        return 4.0 if to_simulate(job.surface, job.settings) else 0.0

    def stage(self, job: BakeJob) -> str:
        return SIMULATING[job.settings.quality]

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        media, settings = to_simulate(job.surface, job.settings), job.settings
        for medium, part in zip(media, progress.split([1.0] * len(media))):
            library(medium, settings.quality, part, settings.threads)
        return job


@dataclass(frozen=True)
class Solve(Step):
    """Computes the result from the light and the surface."""

    name = "Baking"

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        material, settings = job.surface.material, job.settings
        if needs_medium(settings):
            material = job.surface.resolve(settings.quality, None, settings.threads)
        rest = material, job.surface.thickness, settings
        charts = job.receiver.charts
        values = [
            LAYERS[settings.layer](chart.grid, job.illumination, *rest, part, job.bytes_for_light())
            for chart, part in zip(charts, progress.split([1.0] * len(charts)))
        ]
        if not all(np.isfinite(on_grid).all() for on_grid in values):
            text = "The bake produced values that are not numbers."
            raise BakeError(text, "Check the strengths of the lights.")
        texture = job.receiver.to_texture(values)
        del values  # large
        return replace(job, texture=extend_margin(texture, job.receiver.coverage, settings.margin))

    def memory_bytes(self, job: BakeJob) -> float:
        texels, lights, surface = job.receiver.coverage.size, job.illumination.lights, job.surface
        if not needs_medium(job.settings):
            return pass_bytes(texels)
        is_narrow = not job.finds_light and all(light.has_one_direction for light in lights)
        kind = (SUNS if all(light.is_parallel for light in lights) else NARROW) if is_narrow else WIDE
        is_slab = surface.thickness > 0 and surface.material.ior > 1
        paths = surface.thickness / max(surface.material.mean_free_path) if is_slab else math.inf
        return bake_bytes(texels, job.settings.solver, kind, paths)


@dataclass(frozen=True, eq=False)
class BakeJob:
    """A receiver with its light, its surface, and the steps that are left.

    `pickle` writes a job to a file, which any process that can import this package runs with the same result. The
    steps by Cycles (`blender/cycles`) have to run inside a Blender, on a machine that has their copy of the scene.

    Attributes
    ----------
    name : of the object, for messages.
    texture : result, float32 (height, width, 3) with margin, row 0 at the bottom; None until the last step has run.
    """

    name: str
    receiver: Receiver
    illumination: Illumination
    surface: Surface
    settings: BakeSettings
    steps: tuple[Step, ...] = (Simulate(), Solve())
    texture: np.ndarray | None = None

    def run(self, progress: Callback | None = None) -> BakeJob:
        """The job after all its steps. It may have more messages than before."""
        self.surface.check()
        job = self
        weights = [step.weight(self) for step in self.steps]
        for weight, part in zip(weights, Progress.of(progress).split(weights)):
            if job._surely_dark():  # before a simulation, which takes long
                return replace(job, steps=(), texture=np.zeros((*job.receiver.coverage.shape, 3), np.float32))
            step, *rest = job.steps
            if weight:
                part.begin(step.stage(job))
            with timed(f"'{self.name}': {step.name}"):
                job = replace(step.run(job, part), steps=tuple(rest))
        return job

    def colored(self, color: BaseColor) -> BakeJob:
        """The job with a base color and its messages: the surface has its mean, the receiver the rest."""
        illumination, receiver = self.illumination.with_messages(*color.warnings), self.receiver
        if color.texture is not None:
            receiver = textured(receiver, color.texture.colors, color.texture.blur)
        return replace(self, illumination=illumination, receiver=receiver, surface=self.surface.colored(color))

    @property
    def finds_light(self) -> bool:
        """True if a step that is left may add lights."""
        return any(step.finds_light for step in self.steps)

    def memory_bytes(self) -> float:
        """Peak memory, bytes, about, without the light that is kept, the host and other processes."""
        return max(step.memory_bytes(self) for step in self.steps)

    def check_memory(self) -> None:
        """Raise BakeError if a step would take more memory than the limit of the settings, or than the machine has."""
        limit = self.settings.memory_limit or machine_bytes()
        largest = max(self.steps, key=lambda step: step.memory_bytes(self))
        needed = largest.memory_bytes(self)
        if limit and needed > limit:
            texels = f"{self.receiver.width} x {self.receiver.height} texels"
            raise BakeError(
                f"{largest.name}: {texels} take about {needed / 2**30:.1f} GB of memory, and {limit / 2**30:.1f} GB "
                "are allowed.",
                "Lower the resolution, or raise the memory limit in the add-on's preferences.",
            )

    def bytes_for_light(self) -> int:
        """Memory that is left for the light that the fft solver keeps, bytes; 0: no limit."""
        limit = self.settings.memory_limit or machine_bytes()
        return max(1, int(limit - Solve().memory_bytes(self))) if limit else 0

    def messages(self) -> list[Message]:
        """Messages for the artist before the job runs."""
        return [*self.left_out(), *self._surely_dark()]

    def left_out(self) -> list[Message]:
        """Messages about light that is missing from the job."""
        return [*self.illumination.messages, *self._shining_through()]

    def _shining_through(self) -> list[Message]:
        """The warning about lights behind a slab: they shine through to the side that is baked."""
        if self.settings.layer != COMBINED or not self.surface.thickness:
            return []
        grids = [chart.grid for chart in self.receiver.charts]
        backs = [replace(grid, normal=tuple(-value for value in grid.normal)) for grid in grids]
        lights = [light for light in self.illumination.lights if not all(light.is_behind(back) for back in backs)]
        if not lights:
            return []
        names = ", ".join(f"'{light.name}'" for light in lights)
        text = f"Light that shines through the slab '{self.name}' from behind is not baked yet: that of {names}."
        return [warning(self.name, text)]

    def _surely_dark(self) -> list[Message]:
        return [] if self.finds_light else self._dark_by_lights()

    def _dark_by_lights(self) -> list[Message]:
        """The warning that none of the lights can reach the receiver, even without occluders."""
        lights = self.illumination.lights
        if not lights:
            return [warning("", "The scene has no light that can be baked, so the result is black.")]
        if all(light.is_behind(chart.grid) for light in lights for chart in self.receiver.charts):
            text = f"All lights are behind '{self.name}', so it is black."
            return [warning(self.name, text, "Flip its normals (Mesh > Normals > Flip in Edit Mode).")]
        return []

    def is_dark(self) -> bool:
        """True if the result shows that no light arrived; a surface that absorbs everything is black in any light."""
        if self._surely_dark():
            return True
        color = self.surface.base_color or self.surface.material.albedo
        tells_light = self.settings.layer in WITHOUT_MEDIUM or any(color)
        return tells_light and self.texture is not None and not self.texture.any()

    def messages_after(self) -> list[Message]:
        """Messages that follow from the result."""
        if self._surely_dark() or not self.is_dark():
            return []
        text = f"No light reaches '{self.name}', so it is black."
        return [warning(self.name, text, "Look for objects that block the light.")]


def needs_medium(settings: BakeSettings) -> bool:
    """True if the result depends on the material."""
    return settings.layer not in WITHOUT_MEDIUM


def to_simulate(surface: Surface, settings: BakeSettings) -> list:
    """The media that a bake has to simulate first, which takes long."""
    uses_library = settings.distributions == "library" or surface.base_color is not None
    if not (needs_medium(settings) and uses_library):
        return []
    return [medium for medium in surface.media() if not is_known(medium, settings.quality)]
