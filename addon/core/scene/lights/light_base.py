"""Properties that all kinds of light share, and the ways in which light arrives at a grid.

A light of one direction per texel has `gather`; other lights have `parts` and `totals`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ...native import native
from ...progress import stages
from ..grid import Grid, Vector
from ..reach import Reach


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
    has_size = False

    # True if one direction per texel stands for the light inside a medium.
    has_one_direction = True

    @property
    def is_colored(self) -> bool:
        """True if parts of it differ in color."""
        return False

    def position_in(self, _grid: Grid) -> tuple[float, float, float] | None:
        """The point that all light comes from, or None.

        In the plane's frame, metres from the outer corner of texel (0, 0).
        """
        return None

    def gather(self, grid: Grid, caster, **options) -> tuple[np.ndarray, np.ndarray | None]:
        """Irradiance of a light of one direction per texel, of strength 1 and color 1, and its way of travel.

        (H, W), or (H, W, 3) behind what colors light; W/m^2 on the whole of each texel, with cosine and visibility. The
        direction is in the plane's frame, (3,), or (H, W, 3) where it changes, or None if no `directions` are wanted of
        a light from a point; `caster` a native `Occluders`, or None; `options` what native `gather_beams` takes.
        """
        raise NotImplementedError

    def beams(self, reach: Reach, directions: bool = True) -> tuple[np.ndarray, np.ndarray | None]:
        """As `gather`, of what the covered part of each texel receives."""
        irradiance, direction = self.gather(reach.grid, reach.caster, **reach.beam_options(directions))
        return reach.received(irradiance), direction

    def parts(self, reach: Reach) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Of any other light, what makes it up together.

        Irradiance float32 (H, W, 3) at strength 1 and color 1, not yet received, and where it travels, (3,) or
        (H, W, 3), in the plane's frame.
        """
        raise NotImplementedError

    def totals(self, reach: Reach) -> tuple[np.ndarray, np.ndarray]:
        """Irradiance (H, W, 3) of the light at strength 1 and color 1, W/m^2 on the covered part of each texel.

        And its flow (H, W, 3): the sum of the irradiance, the mean of the channels, times the unit vector of travel in
        the plane's frame.
        """
        irradiance, direction = self.beams(reach)
        if irradiance.ndim == 2:
            irradiance = np.repeat(irradiance[..., None], 3, axis=2)
        return irradiance, irradiance.mean(axis=2, keepdims=True) * np.asarray(direction, np.float32)

    def plane_lights(self, reach: Reach, directions: bool = False) -> list:
        """A light of one direction per texel, as a native `PlaneLight` or one for each color channel.

        With `directions` as arrays, even where one direction or one point says it all.
        """
        position = None if directions else self.position_in(reach.grid)
        irradiance, direction = self.beams(reach, position is None)
        if position is not None and irradiance.ndim == 2:
            return [native.PlaneLight.from_point(irradiance, position, self.rgb().tolist())]
        if position is not None:
            _, direction = self.beams(replace(reach, progress=None))
        direction = np.ascontiguousarray(direction, np.float32)
        if directions and direction.ndim == 1:
            direction = np.tile(direction, (*irradiance.shape[:2], 1))
        if irradiance.ndim == 2:
            return [native.PlaneLight(irradiance, direction, self.rgb().tolist())]
        return native.PlaneLight.of_channels(irradiance * self.rgb(), direction, 3)

    def layers(self, reach: Reach) -> Iterator:
        """As native `PlaneLight`s, which make it up together; one ray per texel each where it has a size."""
        if self.has_one_direction:
            yield from self.plane_lights(reach)
            return
        for irradiance, direction in self.parts(reach):
            yield from native.PlaneLight.of_channels(reach.received(irradiance) * self.rgb(), direction, 3)

    def add_to(self, light_field, reach: Reach) -> None:
        """Add it to a native `LightField`."""
        for part in self.layers(reach):
            light_field.add(part)

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


class TracedLight(Light):
    """A light whose rays native code traces."""

    has_size, has_one_direction = True, False

    @abstractmethod
    def native(self):
        """The native `Light`, of strength 1 and without `color`."""

    def gather(self, grid, caster, **options):
        return native.gather_beams(grid.native(), self.native(), caster, **options)

    def position_in(self, grid):
        return self.native().position_in(grid.native())

    def parts(self, reach):
        return native.ray_layers(*self._traced(reach), **reach.ray_options())

    def totals(self, reach):
        if not self.has_size:
            return super().totals(reach)
        irradiance, flow = native.gather_rays(*self._traced(reach), **reach.even_ray_options())
        return reach.received(irradiance), reach.covered(flow)

    def add_to(self, light_field, reach):
        if self.has_one_direction:
            super().add_to(light_field, reach)
            return
        grid, shape, caster = self._traced(reach)
        channels = reach.channels_received(self.rgb())
        for (color, received), step in zip(channels, stages(reach.progress, [1.0] * len(channels))):
            options = replace(reach, progress=step).even_ray_options()
            light_field.add_rays(grid, shape, color, received, caster, **options)

    def _traced(self, reach: Reach) -> tuple:
        return reach.grid.native(), self.native(), reach.caster
