"""Properties that all kinds of light share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields

import numpy as np

from ..receiver import Grid, Vector


@dataclass(frozen=True)
class Light(ABC):
    """A light of a scene.

    Attributes
    ----------
    strength : total strength, in the unit that its kind names.
    color : linear RGB factor.
    cast_shadow : True if objects block it.
    blockers : names of the only objects that cast its shadows; None: all do.
    receivers : names of the only objects that it lights; None: all.
    """

    name: str
    strength: float
    color: Vector
    cast_shadow: bool
    blockers: frozenset[str] | None = field(default=None, kw_only=True)
    receivers: frozenset[str] | None = field(default=None, kw_only=True)

    # True if all light travels along one direction, which may have a kernel of its own.
    is_parallel = False

    # True if several rays reach a point.
    has_size = True

    # True if one direction per texel stands for the light inside a medium.
    has_one_direction = False

    @property
    def is_colored(self) -> bool:
        """True if parts of it differ in color."""
        return False

    def native(self):
        """The native light of strength 1 and without `color`, where it is the same for all grids."""
        raise NotImplementedError

    def at(self, _grid: Grid):
        """The native light of strength 1 and without `color` that reaches a grid."""
        return self.native()

    @abstractmethod
    def is_behind(self, grid: Grid) -> bool:
        """True if none of it can reach the lit side of the grid's plane."""

    def rgb(self) -> np.ndarray:
        return np.asarray(self.color, np.float32) * np.float32(self.strength)

    def fault(self) -> str:
        """The sentence that says why the light cannot be baked; "" if it can."""
        if not np.isfinite(self.strength):
            return f"The power of '{self.name}' is {self.strength:g}."
        if self.strength < 0:
            return f"The power of '{self.name}' is {self.strength:g}, and a bake cannot remove light."
        if not (np.isfinite(self.color).all() and min(self.color) >= 0):
            return f"The color of '{self.name}' is {', '.join(f'{value:g}' for value in self.color)}."
        values = [getattr(self, item.name) for item in fields(self)]
        if not all(np.isfinite(value).all() for value in values if isinstance(value, float | tuple)):
            return f"The position or direction of '{self.name}' is not a number."
        return ""

    def _radiance_fault(self, *radiance: np.ndarray) -> str:
        """The sentence that says why these values are no radiance; "" if they are."""
        if all(np.isfinite(values).all() and (values >= 0).all() for values in radiance):
            return ""
        return f"The radiance of '{self.name}' has negative values, or values that are not numbers."
