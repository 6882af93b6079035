"""One bake as plain data: all that its steps need, and nothing that depends on the host."""

from __future__ import annotations

import os
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import BakeError
from ..messages import Message, warning
from ..progress import Callback, Progress, log, timed
from ..scene.bent_grid import AnyGrid
from ..scene.illumination import Illumination
from ..scene.receiver import Receiver
from ..scene.texture import BaseColor
from .bake_settings import COMBINED, BakeSettings
from .edges import with_edges
from .estimate import OF_WORLD, Workload, workloads_of
from .layers import WITHOUT_MEDIUM
from .pace import Estimate
from .spread import Spread
from .spread_light import backs_of, has_back
from .surface import Surface
from .surroundings import Surroundings, surroundings_of
from .textured_bake import multiplied_note, why_multiplied


class Step(ABC):
    """One step of a job. Steps are plain data; they run in any thread.

    Attributes
    ----------
    name : for messages.
    finds_light : True if the step may add lights to the job.
    finds_world : True if the step adds the light of the world.
    finds_albedos : True if the step gives the texels albedos of their own.
    """

    name = ""
    finds_light = False
    finds_world = False
    finds_albedos = False

    @abstractmethod
    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        """The job after the step."""

    def stage(self, _job: BakeJob) -> str:
        """Name of the step's first stage."""
        return self.name

    def seconds(self, _job: BakeJob) -> float:
        """Estimate of the seconds that the step takes; 0 if it takes no time."""
        return 1.0

    def kind(self, _job: BakeJob) -> str:
        """Name of the steps whose estimates are as right or wrong as that of this step, see `Pace`."""
        return self.name

    def memory_bytes(self, _job: BakeJob) -> float:
        """Memory that the step takes at its peak, about, in bytes."""
        return 0.0


@dataclass(frozen=True, eq=False)
class BakeJob:
    """A receiver with its light, its surface, and the steps that are left.

    `pickle` writes a job to a file, which any process that can import this package runs with the same result. The
    steps by Cycles (`blender/cycles`) have to run inside a Blender, on a machine that has their copy of the scene.

    Attributes
    ----------
    name : of the object, for messages.
    texture : result, float32 (height, width, 3) with margin, row 0 at the bottom; None until the last step has run.
    spread : how far light spreads in the texture; None if the result is not luminance.
    around : surroundings of the receiver, if they are known beforehand.
    """

    name: str
    receiver: Receiver
    illumination: Illumination
    surface: Surface
    settings: BakeSettings
    steps: tuple[Step, ...]
    texture: np.ndarray | None = None
    spread: Spread | None = None
    around: Surroundings | None = None

    def run(self, progress: Callback | None = None) -> BakeJob:
        """The job after all its steps. It may have more messages than before."""
        self.surface.check()
        job, expected = self, self.expected()
        parts = Progress.of(progress).split([step.corrected() for step in expected])
        for estimate, part in zip(expected, parts):
            part.expect(estimate.corrected)
        for estimate, part in zip(expected, parts):
            if job._surely_dark():  # before a simulation, which takes long
                return replace(job, steps=(), texture=np.zeros((*job.receiver.coverage.shape, 3), np.float32))
            step, *rest = job.steps
            if estimate.seconds:
                part.begin(step.stage(job))
            began = time.monotonic()
            with timed(f"'{self.name}': {step.stage(job)}", estimate.corrected()):
                done = step.run(job, part)
            estimate.compare(time.monotonic() - began)
            _log_new_lights(done, job)
            job = replace(done, steps=tuple(rest))
        return job

    def expected(self) -> list[Estimate]:
        """Estimate of the seconds of each step."""
        return [Estimate(step.kind(self), self.name, step.seconds(self)) for step in self.steps]

    def seconds(self) -> float:
        """Estimate of the seconds that the job takes, at the pace of this session."""
        return sum(step.corrected() for step in self.expected())

    def colored(self, color: BaseColor) -> BakeJob:
        """The job with a base color and its messages: the surface has its mean, the receiver the rest."""
        illumination, receiver = self.illumination.with_messages(*color.warnings), self.receiver
        if color.texture is not None and color.texture.use.is_scattered:
            why = why_multiplied(self.settings)
            if why:
                color = replace(color, texture=self.surface.multiplied(color.texture))
                illumination = illumination.with_messages(multiplied_note(self.name, why))
        if color.texture is not None:
            receiver = replace(color.texture, receiver=receiver).on(receiver)
        return replace(self, illumination=illumination, receiver=receiver, surface=self.surface.colored(color))

    @property
    def finds_light(self) -> bool:
        """True if a step that is left may add lights."""
        return any(step.finds_light for step in self.steps)

    @property
    def grids(self) -> list[AnyGrid]:
        """Grids of the receiver."""
        return [chart.grid for chart in self.receiver.charts]

    @property
    def lit_grids(self) -> list[AnyGrid]:
        """Grids on which light counts: those of the receiver and, of slabs, those of the faces behind."""
        grids = self.grids
        return [*grids, *backs_of(grids)] if has_back(self.surface.thickness, self.settings) else grids

    @cached_property
    def workloads(self) -> list[Workload]:
        """Facts that decide how long the solution takes, for each side from which light comes."""
        grids, _ = with_edges(self.grids, self.surface, self.name)
        light = self.illumination
        unknown = OF_WORLD * any(step.finds_world for step in self.steps)
        shares = [self.surroundings.shares_on(side) for side in range(2)]
        known = {"lights": light.lights, "triangles": light.triangle_count, "bounced": self.finds_light}
        return workloads_of(grids, self.surface, self.settings, shares, unknown=unknown, **known)

    @cached_property
    def surroundings(self) -> Surroundings:
        """Surroundings of the receiver: those that are known, or by few rays."""
        has_unknown_sky = any(step.finds_world for step in self.steps)
        return self.around or surroundings_of(self.grids, self.illumination, has_unknown_sky)

    @property
    def memory_limit(self) -> int:
        """Memory that a step may take, bytes: the limit of the settings, or all of the machine's; 0 if unknown."""
        return self.settings.memory_limit or machine_bytes()

    def memory_bytes(self) -> float:
        """Peak memory, bytes, about, without the light that is kept, the host and other processes."""
        return max(step.memory_bytes(self) for step in self.steps)

    def check_memory(self) -> None:
        """Raise BakeError if a step would take more memory than the limit of the settings, or than the machine has."""
        limit = self.memory_limit
        largest = max(self.steps, key=lambda step: step.memory_bytes(self))
        needed = largest.memory_bytes(self)
        if limit and needed > limit:
            texels = f"{self.receiver.width} x {self.receiver.height} texels"
            raise BakeError(
                f"{largest.name}: {texels} take about {needed / 2**30:.1f} GB of memory, and {limit / 2**30:.1f} GB "
                "are allowed.",
                "Lower the resolution, or raise the memory limit in the add-on's preferences.",
            )

    def messages(self) -> list[Message]:
        """Messages for the artist before the job runs."""
        return [*self.left_out(), *self._surely_dark()]

    def left_out(self) -> list[Message]:
        """Messages about light that is missing from the job."""
        return [*self.illumination.messages, *self._shining_through()]

    def _shining_through(self) -> list[Message]:
        """The warning about lights behind a slab whose light is left out."""
        is_slab = self.settings.layer == COMBINED and self.surface.thickness > 0
        if not is_slab or has_back(self.surface.thickness, self.settings):
            return []
        backs = backs_of(self.grids)
        lights = [light for light in self.illumination.lights if not all(light.is_behind(back) for back in backs)]
        if not lights:
            return []
        names = ", ".join(dict.fromkeys(f"'{light.name}'" for light in lights))  # a world's sun has its name
        text = f"Light that reaches the back of '{self.name}' is left out, since LDF samples know one side: {names}."
        return [warning(self.name, text, "Set Distributions to Library.")]

    def _surely_dark(self) -> list[Message]:
        return [] if self.finds_light else self._dark_by_lights()

    def _dark_by_lights(self) -> list[Message]:
        """The warning that none of the lights can reach the receiver, even without occluders."""
        lights = self.illumination.lights
        if not lights:
            return [warning("", "The scene has no light that can be baked, so the result is black.")]
        if self.illumination.reaches(self.lit_grids):
            return []
        text, remedy = f"All lights are behind '{self.name}', so it is black.", "Choose another Side in its node."
        if not self.surface.thickness:
            remedy = "Flip its normals (Mesh > Normals > Flip in Edit Mode)."
        return [warning(self.name, text, remedy)]

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
        remedy = "Look for objects that block the light, and for normals that point inward."
        return [warning(self.name, text, remedy)]


def _log_new_lights(job: BakeJob, before: BakeJob) -> None:
    """Log the lights that a step has added (`batch.py --verbose` shows them)."""
    known = {id(light) for light in before.illumination.lights}
    for light in job.illumination.lights:
        if id(light) not in known:
            log(f"'{job.name}': {light.line()}")


def machine_bytes() -> int:
    """Memory of the machine, bytes; 0 if it can't be asked."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 0
