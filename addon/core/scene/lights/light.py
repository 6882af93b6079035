"""What all kinds of light have."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields

import numpy as np

from ...native import native
from ..grid import Grid, Vector


@dataclass(frozen=True)
class Light(ABC):
    """What all kinds have.

    Attributes
    ----------
    strength : of the whole light, in the unit that its kind says.
    color : linear RGB factor.
    blockers : names of the objects that alone cast its shadows; None: all.
    receivers : names of the objects that it alone lights; None: all.
    """

    name: str
    strength: float
    color: Vector
    cast_shadow: bool
    blockers: frozenset[str] | None = field(default=None, kw_only=True)
    receivers: frozenset[str] | None = field(default=None, kw_only=True)

    def position_in(self, _grid: Grid) -> tuple[float, float, float] | None:
        """Where all of it comes from, metres from the outer corner of texel (0, 0) in the plane's frame, if it does."""
        return None

    @abstractmethod
    def is_behind(self, grid: Grid) -> bool:
        """Whether none of it can reach the lit side of the grid's plane, whatever stands in between."""

    def rgb(self) -> np.ndarray:
        return np.asarray(self.color, np.float32) * np.float32(self.strength)

    def fault(self) -> str:
        """Why it can't be baked, as the end of a sentence about it; empty when all is well."""
        if not np.isfinite(self.strength):
            return f"its power is {self.strength:g}"
        if self.strength < 0:
            return f"its power is {self.strength:g}, and a bake can't take light away"
        if not (np.isfinite(self.color).all() and min(self.color) >= 0):
            return f"its color is {', '.join(f'{value:g}' for value in self.color)}"
        values = [getattr(self, item.name) for item in fields(self)]
        if not all(np.isfinite(value).all() for value in values if isinstance(value, float | tuple)):
            return "its place or direction is not a number"
        return ""


class TracedLight(Light):
    """A light without size that native code knows."""

    @abstractmethod
    def native(self):
        """The native light, white and of strength 1."""

    def gather(self, grid: Grid, caster, **options) -> tuple[np.ndarray, np.ndarray | None]:
        """Irradiance (H, W) of a white light of strength 1, and its direction of travel in the plane's frame.

        The direction is (3,), or (H, W, 3) where it changes, or None if no `directions` are wanted of a light from a
        point; `caster` a native `Occluders`, or None; `options` what native `gather_beams` takes.
        """
        return native.gather_beams(grid.native(), self.native(), caster, **options)

    def position_in(self, grid):
        return self.native().position_in(grid.native())


class ExtendedLight(Light):
    """A light of a size: it reaches a point from many directions, by rays (native `gather_rays`)."""

    @abstractmethod
    def native(self):
        """The native extended light, of strength 1 and without `color`."""

    @property
    def is_colored(self) -> bool:
        """Whether its rays differ in colour."""
        return False
