"""A job's base colour from what is linked to its node."""

from __future__ import annotations

from dataclasses import replace

from ...core.bake.job import BakeJob
from ...core.scene.texture import mean_color, textured
from ..node.tree import BASE_COLOR
from ..read.base_color import read_base_color
from ..read.image_texture import NotUnderstoodError
from ..read.node_links import Wanted

# Rounding, or a little over by interpolation.
BRIGHTEST = 1.001


def with_texture(job: BakeJob, node, groups: tuple, obj) -> BakeJob:
    """The job with the mean colour of the node's texture in its surface, and the rest on its receiver.

    `groups` are the group nodes around the node.

    What can't be evaluated is said, and then the colour counts that the node has of its own.
    """
    try:
        colors = read_base_color(Wanted(node.inputs[BASE_COLOR], groups), obj, job.receiver)
    except NotUnderstoodError as reason:
        warning = (
            f"The Base Color of '{job.name}' can't be evaluated, because {reason} not understood: the colour or albedo "
            "counts that its node shows without a link. Bake the nodes to an image and link that."
        )
        return replace(job, illumination=job.illumination.warning(warning))
    if max(color.max(initial=0) for color in colors) > BRIGHTEST:
        warning = f"The Base Color of '{job.name}' is above 1 in places, which reflects more than arrives: cut to 1."
        job = replace(job, illumination=job.illumination.warning(warning))
    colors = [color.clip(max=1) for color in colors]
    mean = mean_color(job.receiver, colors)
    receiver = textured(job.receiver, colors, node.texture_blur)
    return replace(job, receiver=receiver, surface=replace(job.surface, base_color=mean))
