"""The kinds of light that can be baked; strengths follow Cycles (see each class).

A new kind is one class here, and its reader in blender/read/lights.py.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields

import numpy as np

from ..native import native
from .grid import Grid, Vector


@dataclass(frozen=True)
class Light(ABC):
    """What all kinds have.

    Attributes
    ----------
    strength : of the whole light, in the unit that its kind says.
    color : linear RGB factor.
    """

    name: str
    strength: float
    color: Vector
    cast_shadow: bool

    @abstractmethod
    def gather(self, grid: Grid, caster, **options) -> tuple[np.ndarray, np.ndarray | None]:
        """Irradiance (H, W) of a white light of strength 1, and its direction of travel in the plane's frame.

        The direction is (3,), or (H, W, 3) where it changes, or None if no `directions` are wanted of a light from a
        point; `caster` a native `Occluders`, or None; `options` what native `gather_beams` takes.
        """

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
        values = [getattr(self, field.name) for field in fields(self)]
        if not all(np.isfinite(value).all() for value in values if isinstance(value, float | tuple)):
            return "its place or direction is not a number"
        return ""


class TracedLight(Light):
    """A light that native code knows."""

    @abstractmethod
    def native(self):
        """The native light, white and of strength 1."""

    def gather(self, grid, caster, **options):
        return native.gather_beams(grid.native(), self.native(), caster, **options)

    def position_in(self, grid):
        return self.native().position_in(grid.native())


@dataclass(frozen=True)
class SunLight(TracedLight):
    """Parallel light; `strength` is the irradiance at normal incidence, W/m^2.

    Attributes
    ----------
    direction : unit vector of travel, world.
    """

    direction: Vector

    def native(self):
        return native.SunLight(self.direction)

    def is_behind(self, grid):
        return bool(np.dot(self.direction, grid.normal) >= 0)


@dataclass(frozen=True)
class PointLight(TracedLight):
    """Light from one point into all directions; `strength` is Cycles' watts."""

    position: Vector

    def native(self):
        return native.PointLight(self.position)

    def is_behind(self, grid):
        return grid.height_of(self.position) <= 0


@dataclass(frozen=True)
class SpotLight(PointLight):
    """A point light behind a cone.

    Attributes
    ----------
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    spot_size : full cone angle, radians.
    blend : soft part of the cone, 0..1.
    falloff : "scaled", or "legacy" for Cycles before Blender 3.5, where the lamp's scale does not shape the cone.
    """

    frame: tuple[Vector, Vector, Vector]
    spot_size: float
    blend: float
    falloff: str = "scaled"

    def native(self):
        return native.SpotLight(self.position, self.frame, self.spot_size, self.blend, self.falloff)
