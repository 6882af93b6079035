"""The base color of a job, if it is linked to the node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....core.bake.job import BakeJob, Step
from ....core.bake.surface import Surface
from ....core.errors import BakeError, MissingImageError, NotSupportedError, text_of
from ....core.material import RGB
from ....core.messages import Message, warning
from ....core.progress import Progress
from ....core.scene.receiver import Receiver
from ....core.scene.texture import mean_color, textured
from ....core.target import Target
from ...cycles.colors import bytes_of_colors, colors_by_cycles
from ...cycles.cycles_light import CopyForCycles
from ...node.tree import BASE_COLOR
from ...read.base_color import read_base_color
from ...read.nodes import InputSocket
from ...read.visibility import ObjectInstance

# Largest base color without a warning; rounding and interpolation may exceed 1 a little.
BRIGHTEST = 1.001


@dataclass(frozen=True, eq=False)
class BaseColor:
    """Base color of each texel. Its mean goes to the surface of a job, the rest to the receiver.

    Attributes
    ----------
    colors : float32 (grid height, grid width, 3) of each chart, at most 1; empty if unknown.
    blur : fraction of the texture that light passes on its way in.
    warnings : messages about the colors.
    unknown : sentence that names the node that only Cycles can evaluate; "" if there is none.
    """

    colors: tuple[np.ndarray, ...] = ()
    mean: RGB | None = None
    blur: float = 0.0
    warnings: tuple[Message, ...] = ()
    unknown: str = ""

    @classmethod
    def of(cls, colors: Sequence[np.ndarray], receiver: Receiver, blur: float, object_name: str) -> BaseColor:
        warnings = ()
        if max(color.max(initial=0) for color in colors) > BRIGHTEST:
            text = f"The Base Color of '{object_name}' is above 1 in places, which reflects more light than arrives."
            warnings = (warning(object_name, text, "It is cut to 1."),)
        colors = tuple(color.clip(0, 1) for color in colors)
        return cls(colors, mean_color(receiver, colors), blur, warnings)

    def on(self, surface: Surface) -> Surface:
        """The surface with the mean color, or unchanged if that is unknown."""
        return surface if self.mean is None else replace(surface, base_color=self.mean)

    def in_job(self, job: BakeJob) -> BakeJob:
        """The job with the texture and the messages; its surface has the mean color already."""
        job = replace(job, illumination=job.illumination.with_messages(*self.warnings))
        return replace(job, receiver=textured(job.receiver, self.colors, self.blur)) if self.colors else job


def read_texture(node, groups: tuple, placed: ObjectInstance, receiver: Receiver) -> BaseColor:
    """Base color that is linked to the node, on the texels of a receiver. `groups` are the groups around the node."""
    try:
        colors = read_base_color(InputSocket(node.inputs[BASE_COLOR], groups), placed, receiver)
    except MissingImageError as error:
        text = f"The Base Color of '{placed.obj.name}' is left out: the node's own color is used. {error.text}"
        return BaseColor(blur=node.texture_blur, warnings=(warning(placed.obj.name, text, error.remedy),))
    except NotSupportedError as error:
        return BaseColor(blur=node.texture_blur, unknown=str(error))
    return BaseColor.of(colors, receiver, node.texture_blur, placed.obj.name)


@dataclass(frozen=True, eq=False)
class BaseColorByCycles(Step):
    """Evaluates a base color that only Cycles knows. The result, or the failure, holds for all jobs of the target.

    Attributes
    ----------
    surface : of the node, without the base color.
    blur : fraction of the texture that light passes on its way in.
    matrix : rows of the matrix of the instance that is baked; None if the object itself is.
    """

    copy: CopyForCycles
    target: Target
    surface: Surface
    blur: float
    matrix: list | None

    name = "Evaluating the base color"

    def weight(self, _job: BakeJob) -> float:
        return 0.0 if self.target in self.copy.base_colors else 1.0

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        known = self.copy.base_colors
        if self.target not in known:
            known[self.target] = self._evaluate(job.receiver, progress)
        return known[self.target].in_job(replace(job, surface=known[self.target].on(self.surface)))

    def memory_bytes(self, job: BakeJob) -> float:
        known = self.target in self.copy.base_colors
        return 0.0 if known else bytes_of_colors(job.receiver.width, job.receiver.height)

    def _evaluate(self, receiver: Receiver, progress: Progress) -> BaseColor:
        try:
            colors = colors_by_cycles(self.copy, self.target, self.matrix, receiver, progress)
        except (BakeError, OSError) as error:
            return not_evaluated(self.target, text_of(error))
        return BaseColor.of(colors, receiver, self.blur, self.target.object_name)


def not_evaluated(target: Target, why: str) -> BaseColor:
    """The base color if Cycles could not evaluate it: only a warning."""
    text = f"Cycles could not evaluate the Base Color of '{target.object_name}': the node's own color is used. {why}"
    return BaseColor(warnings=(warning(target.object_name, text),))
