"""The bakes of one run, each made when it is its turn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from ....core.bake.bake_settings import FINAL, PREVIEW
from ....core.bake.estimate import simulation_seconds
from ....core.bake.runner import Bake
from ....core.target import Target
from ...cycles.cycles_light import seconds_estimate
from ...node.find import find_node
from .prepare import Preparation

# Of a bake, beside what is known to take long.
OTHER_SECONDS = 0.5


@dataclass(frozen=True)
class BakeStep:
    """One bake of a target; `is_first`: it is a first look, `is_again`: the bake that follows one."""

    target: Target
    quality: str
    seconds: float
    is_first: bool = False
    is_again: bool = False


class BakeQueue:
    """Turns in their order, and how far they are.

    With `preview_first` nobody waits for a medium that is not simulated yet: its targets get a first look, by a quick
    simulation and direct light alone, and are baked once all targets have something to show. So are those that share
    an image with them, since a run fills each image as a whole.
    """

    def __init__(self, preparation: Preparation, targets: list[Target], preview_first: bool) -> None:
        self._preparation = preparation
        self._turns = _turns(preparation, targets, preview_first)
        self._next = 0

    def __len__(self) -> int:
        return len(self._turns)

    @property
    def turn(self) -> BakeStep:
        """The last one given out."""
        return self._turns[self._next - 1]

    def next(self) -> Bake | None:
        """The next bake, in the main thread; None after the last."""
        if self._next == len(self._turns):
            return None
        turn = self._turns[self._next]
        self._next += 1
        changes = {"quality": turn.quality} | ({"indirect": False} if turn.is_first else {})
        return self._preparation.bake(turn.target, replace(self._preparation.settings, **changes))

    def starts_again(self) -> bool:
        """Whether the bake given out last is the first of those made again."""
        return self.turn.is_again and not self._turns[self._next - 2].is_again

    def fraction(self, own: float) -> float:
        """Of the run, from that of the bake given out last."""
        done = sum(turn.seconds for turn in self._turns[: self._next - 1]) + own * self.turn.seconds
        return done / sum(turn.seconds for turn in self._turns)


def _turns(preparation: Preparation, targets: list[Target], preview_first: bool) -> list[BakeStep]:
    quality = preparation.settings.quality
    unknown = {target: preparation.to_simulate(target, quality) for target in targets}
    quick = [target for target in targets if preview_first and quality == FINAL and unknown[target]]
    keys = {_image_key(target) for target in quick}
    again = [target for target in targets if _image_key(target) in keys]
    met: list = []
    colored: set[Target] = set()

    def seconds(target: Target, quality: str) -> float:
        found = [medium for medium in preparation.to_simulate(target, quality) if (quality, medium) not in met]
        met.extend((quality, medium) for medium in found)
        coloring = 0.0 if target in colored else preparation.color_seconds(target)
        colored.add(target)
        return OTHER_SECONDS + coloring + simulation_seconds(quality, preparation.settings.threads) * len(found)

    turns = []
    for target in targets:
        if target in again:
            chosen = PREVIEW if target in quick else quality
            turns.append(BakeStep(target, chosen, seconds(target, chosen), is_first=True))
        else:
            turns.append(BakeStep(target, quality, seconds(target, quality) + _indirect_seconds(preparation, target)))
    for target in again:
        took = seconds(target, quality) + _indirect_seconds(preparation, target)
        turns.append(BakeStep(target, quality, took, is_again=True))
    return turns


def _indirect_seconds(preparation: Preparation, target: Target) -> float:
    size = preparation.size(target)
    return seconds_estimate(*size) if preparation.settings.indirect and size else 0.0


def _image_key(target: Target) -> str:
    """The same for targets that go into the same image."""
    node = find_node(bpy.data.materials.get(target.material_name))
    return f"image {node.image.name}" if node is not None and node.image else f"material {target.material_name}"
