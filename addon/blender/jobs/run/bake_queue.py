"""The bakes of one run, each made when its turn comes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

from ....core.bake.bake_settings import FINAL, PREVIEW
from ....core.bake.runner import Bake
from ....core.target import Target
from ...node.find import node_of
from .prepare import Preparation


class Pass(Enum):
    """Purpose of a bake in its run: the only one of its target, its quick preview, or the bake after that preview."""

    SINGLE = 1
    PREVIEW = 2
    FINAL = 3


@dataclass(frozen=True)
class BakeStep:
    """One bake of a target in a run."""

    target: Target
    quality: str
    purpose: Pass = Pass.SINGLE


class BakeQueue:
    """The steps of a run in their order.

    With `preview_first`, targets whose medium is not simulated yet get a quick preview: a quick simulation and direct
    light alone. They are baked once all targets have something to show. Targets that share an image with them take
    part in this, since a run fills each image as a whole.

    Attributes
    ----------
    step, number : step of the bake that was made last, and its number from 1 on.
    """

    def __init__(self, preparation: Preparation, targets: list[Target], preview_first: bool) -> None:
        self._preparation = preparation
        self._steps = _steps(preparation, targets, preview_first)
        self.step: BakeStep | None = None
        self.number = 0

    def __len__(self) -> int:
        return len(self._steps)

    def __iter__(self) -> Iterator[Bake]:
        """Make the bakes, in the main thread."""
        for number, step in enumerate(self._steps, 1):
            self.number, self.step = number, step
            changes = {"quality": step.quality} | ({"indirect": False} if step.purpose == Pass.PREVIEW else {})
            yield self._preparation.bake(step.target, replace(self._preparation.settings, **changes))


def _steps(preparation: Preparation, targets: list[Target], preview_first: bool) -> list[BakeStep]:
    quality = preparation.settings.quality
    is_unknown = {target: bool(preparation.to_simulate(target, quality)) for target in targets}
    quick = [target for target in targets if preview_first and quality == FINAL and is_unknown[target]]
    keys = {_image_key(target) for target in quick}
    twice = [target for target in targets if _image_key(target) in keys]
    first = [
        BakeStep(target, PREVIEW if target in quick else quality, Pass.PREVIEW if target in twice else Pass.SINGLE)
        for target in targets
    ]
    return first + [BakeStep(target, quality, Pass.FINAL) for target in twice]


def _image_key(target: Target) -> str:
    """Equal for targets that fill the same image."""
    node = node_of(target)
    return f"image {node.image.name}" if node is not None and node.image else f"material {target.material_name}"
