"""A job's base colour from what is linked to its node."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...core.bake.job import BakeJob
from ...core.bake.surface import Surface
from ...core.material.material import RGB
from ...core.scene.receiver import Receiver
from ...core.scene.texture import mean_color, textured
from ..node.tree import BASE_COLOR
from ..read.base_color import read_base_color
from ..read.image_texture import NotUnderstoodError
from ..read.node_links import Wanted

# Rounding, or a little over by interpolation.
BRIGHTEST = 1.001


@dataclass(frozen=True, eq=False)
class BaseColor:
    """What a node's texture brings to a job: its mean colour to the surface, the rest to the receiver.

    Attributes
    ----------
    colors : float32 (grid height, grid width, 3) of each chart, up to 1; none where the nodes are not understood.
    blur : part of the texture that light meets on its way in.
    warnings : sentences.
    """

    colors: tuple[np.ndarray, ...] = ()
    mean: RGB | None = None
    blur: float = 0.0
    warnings: tuple[str, ...] = ()

    def on(self, surface: Surface) -> Surface:
        """The surface with the mean colour, or as it is."""
        return surface if self.mean is None else replace(surface, base_color=self.mean)

    def in_job(self, job: BakeJob) -> BakeJob:
        """A job on such a surface with the rest."""
        job = replace(job, illumination=job.illumination.warning(*self.warnings))
        return replace(job, receiver=textured(job.receiver, list(self.colors), self.blur)) if self.colors else job


def read_texture(node, groups: tuple, obj, receiver: Receiver) -> BaseColor:
    """What is linked to the node, at the places of a receiver of an evaluated object.

    `groups` are the group nodes around the node. What can't be evaluated is said, and then the colour counts that the
    node has of its own.
    """
    try:
        colors = read_base_color(Wanted(node.inputs[BASE_COLOR], groups), obj, receiver)
    except NotUnderstoodError as reason:
        warning = (
            f"The Base Color of '{obj.name}' can't be evaluated, because {reason} not understood: the colour or albedo "
            "counts that its node shows without a link. Bake the nodes to an image and link that."
        )
        return BaseColor(warnings=(warning,))
    warnings = ()
    if max(color.max(initial=0) for color in colors) > BRIGHTEST:
        what = f"The Base Color of '{obj.name}' is above 1 in places, which reflects more than arrives"
        warnings = (f"{what}: cut to 1.",)
    colors = tuple(color.clip(max=1) for color in colors)
    return BaseColor(colors, mean_color(receiver, list(colors)), node.texture_blur, warnings)
