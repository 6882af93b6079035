"""A job's base colour from what is linked to its node."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import bpy
import numpy as np

from ....core.bake.job import BakeJob, needs_medium
from ....core.bake.surface import Surface
from ....core.errors import BakeError, MissingImageError, NotSupportedError, text_of
from ....core.material import RGB
from ....core.messages import Message, warning
from ....core.progress import Progress
from ....core.scene.receiver import Receiver
from ....core.scene.texture import mean_color, textured
from ....core.target import Target
from ...cycles.colors import colors_by_cycles, seconds_of_colors
from ...cycles.cycles_light import CopyForCycles
from ...node.find import find_node_in_groups
from ...node.tree import BASE_COLOR
from ...read.base_color import is_understood, read_base_color
from ...read.nodes import InputSocket
from ...read.visibility import ObjectInstance

# Rounding, or a little over by interpolation.
BRIGHTEST = 1.001


@dataclass(frozen=True, eq=False)
class BaseColor:
    """What a node's texture brings to a job: its mean colour to the surface, the rest to the receiver.

    Attributes
    ----------
    colors : float32 (grid height, grid width, 3) of each chart, up to 1; none where they are not known.
    blur : part of the texture that light meets on its way in.
    warnings : messages about the colors.
    unknown : sentence that names what only Cycles can evaluate; "" if there is nothing.
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
        """The surface with the mean colour, or as it is."""
        return surface if self.mean is None else replace(surface, base_color=self.mean)

    def in_job(self, job: BakeJob) -> BakeJob:
        """A job on such a surface with the rest."""
        job = replace(job, illumination=job.illumination.with_messages(*self.warnings))
        return replace(job, receiver=textured(job.receiver, self.colors, self.blur)) if self.colors else job


def read_texture(node, groups: tuple, placed: ObjectInstance, receiver: Receiver) -> BaseColor:
    """What is linked to the node, at the places of an object's receiver.

    `groups` are the group nodes around the node.
    """
    try:
        colors = read_base_color(InputSocket(node.inputs[BASE_COLOR], groups), placed, receiver)
    except MissingImageError as error:
        text = f"The Base Color of '{placed.obj.name}' is left out: the node's own color is used. {error.text}"
        return BaseColor(blur=node.texture_blur, warnings=(warning(placed.obj.name, text, error.remedy),))
    except NotSupportedError as error:
        return BaseColor(blur=node.texture_blur, unknown=str(error))
    return BaseColor.of(colors, receiver, node.texture_blur, placed.obj.name)


def needs_cycles(obj, material_name: str) -> bool:
    """Whether a bake of one of an object's materials has Cycles evaluate a texture."""
    place = find_node_in_groups(bpy.data.materials.get(material_name))
    if place is None or not place[0].has_texture():
        return False
    return not is_understood(InputSocket(place[0].inputs[BASE_COLOR], place[1]), obj)


class ColorByCycles:
    """A texture that only Cycles knows, of one target; what was found, or that nothing was, holds for all its jobs."""

    def __init__(self, target: Target, surface: Surface, blur: float, placed: ObjectInstance) -> None:
        self._target, self._surface, self._blur = target, surface, blur
        # Plain, as it goes to a thread.
        self._matrix = np.array(placed.matrix).tolist() if placed.is_instance else None
        self._found: BaseColor | None = None

    def in_job(self, job: BakeJob, copy: CopyForCycles | None) -> BakeJob:
        """The job, which asks Cycles when it runs."""
        if not needs_medium(job.settings):
            return job
        if copy is not None:
            job = replace(job, illumination=job.illumination.with_messages(*copy.scene.warnings))
        elif self._found is None:
            self._found = self._missing("There is no copy of the scene.")
        seconds = seconds_of_colors(job.receiver.width, job.receiver.height) if self._found is None else 0.0
        return replace(job, more_color=partial(self._color, copy), color_seconds=seconds)

    def _color(self, copy: CopyForCycles | None, job: BakeJob, progress: Progress | None) -> BakeJob:
        if self._found is None:
            try:
                colors = colors_by_cycles(copy, self._target, self._matrix, job.receiver, progress)
                self._found = BaseColor.of(colors, job.receiver, self._blur, self._target.object_name)
            except (BakeError, OSError) as error:
                self._found = self._missing(text_of(error))
        return self._found.in_job(replace(job, surface=self._found.on(self._surface)))

    def _missing(self, why: str) -> BaseColor:
        name = self._target.object_name
        text = f"Cycles could not evaluate the Base Color of '{name}': the node's own color is used. {why}"
        return BaseColor(warnings=(warning(name, text),))
