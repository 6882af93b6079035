"""Bounced light in quick renderings: luminance at few texels, which stays until its successor is there."""

from __future__ import annotations

import numpy as np

from ..bake.bounced import BouncedLight
from ..bake.job import BakeJob
from ..progress import Progress
from ..recent import keep_recent
from ..scene.illumination import Illumination
from ..scene.receiver import Receiver
from ..target import Target
from .live_target import LiveTarget

BOUNCED_SIDE = 64
"""Texels along the longer side; more are finer and slower."""

QUICK_NODES, QUICK_NOISE, QUICK_SAMPLES = 24, 0.05, 8
"""Nodes, allowed noise and most samples of a quick `BouncedLight`; more nodes, more samples, less noise take longer."""

MAX_LAYERS = 32
"""Number of layers in memory; more helps scenes with more targets."""


def with_bounced(
    target: LiveTarget, receiver: Receiver, progress: Progress | None = None, is_quick: bool = False
) -> Illumination:
    """The illumination of a target on its receiver, with the light that bounces as a bake finds it, or coarsely."""
    if target.max_bounces is None:
        return target.illumination
    effort = (QUICK_NODES, QUICK_NOISE, QUICK_SAMPLES) if is_quick else ()
    name, settings = target.target.object_name, target.settings
    job = BakeJob(name, receiver, target.illumination, target.surface, settings, ())
    return BouncedLight(target.max_bounces, *effort).run(job, progress).illumination


class BouncedLayers:
    """The last known bounced light of each target, as luminance before it leaves a textured surface."""

    def __init__(self) -> None:
        self._layers: dict[Target, np.ndarray] = {}

    def put(self, target: Target, luminance: np.ndarray | None) -> None:
        """Note a layer, float32 (height, width, 3); None: no light bounces."""
        if luminance is None:
            self._layers.pop(target, None)
        else:
            keep_recent(self._layers, target, luminance, MAX_LAYERS)

    def of(self, target: LiveTarget) -> np.ndarray | None:
        """The layer of a target, or None."""
        return None if target.max_bounces is None else self._layers.get(target.target)


def without_direct(illumination: Illumination, target: LiveTarget) -> Illumination | None:
    """The light that an illumination has beyond that of the target; None if it has no more."""
    lights = illumination.lights[len(target.illumination.lights) :]
    return illumination.with_lights(lights) if lights else None
