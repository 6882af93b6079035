"""Kinds of light: lamps (one without a size is a lamp of size 0), the world, and meshes that glow."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ...native import native
from ...recent import keep_with
from ..bent_grid import AnyGrid
from ..grid import Vector
from .sky_sun import without_suns


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

    def at(self, _grid: AnyGrid):
        """The native light of strength 1 and without `color` that reaches a grid."""
        return self.native()

    @abstractmethod
    def is_behind(self, grid: AnyGrid) -> bool:
        """True if none of it can reach the lit side of the grid."""

    def rgb(self) -> np.ndarray:
        return np.asarray(self.color, np.float32) * np.float32(self.strength)

    def line(self) -> str:
        """The light in a line: kind, name, strength, color and shadow."""
        kind = type(self).__name__.removesuffix("Light")
        color = " ".join(f"{value:.4g}" for value in self.color)
        shadow = "" if self.cast_shadow else ", throws no shadow"
        return f"{kind} '{self.name}': strength {self.strength:.6g}, color {color}{shadow}"

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


@dataclass(frozen=True)
class SunLight(Light):
    """Light from a disk infinitely far away; `strength` is the irradiance at normal incidence, W/m^2.

    Attributes
    ----------
    direction : unit vector of travel from the disk's center, world.
    angle : full angle of the disk, radians, 0..pi.
    disk : "even"; or "flat" as in Blender 3.4, see native `SunLight`.
    """

    direction: Vector
    angle: float = 0.0
    disk: str = "even"

    def native(self):
        return native.SunLight(self.direction, self.angle, self.disk)

    @property
    def has_size(self):
        return self.angle > 0

    @property
    def is_parallel(self):
        return self.angle <= native.SunLight.max_parallel_angle

    has_one_direction = is_parallel

    def is_behind(self, grid):
        return not grid.meets(self.direction, math.sin(min(0.5 * self.angle, 0.5 * math.pi)))


@dataclass(frozen=True)
class PointLight(Light):
    """Light of a ball into all directions; `strength` is Cycles' watts.

    Attributes
    ----------
    position : world position of its center.
    radius : scene units, 0 or more.
    shape : "sphere"; or "disk", which faces each point that it lights, as Cycles has it before Blender 4.0 and for
        lamps of a soft falloff.
    """

    position: Vector
    radius: float = 0.0
    shape: str = "sphere"

    def native(self):
        return native.PointLight(self.position, self.radius, self.shape)

    @property
    def has_size(self):
        return self.radius > 0

    @property
    def has_one_direction(self):
        return not self.has_size

    def is_behind(self, grid):
        return not grid.faces(self.position, self.radius)


@dataclass(frozen=True)
class SpotLight(Light):
    """A point light behind a cone; `strength` is Cycles' watts, of the whole ball.

    Attributes
    ----------
    position, radius, shape : as for `PointLight`.
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    spot_size : full cone angle, radians.
    blend : soft part of the cone, 0..1.
    falloff : "scaled", or "legacy" for Cycles before Blender 3.5, where the lamp's scale does not shape the cone.
    """

    position: Vector
    frame: tuple[Vector, Vector, Vector]
    spot_size: float
    blend: float
    falloff: str = "scaled"
    radius: float = 0.0
    shape: str = "sphere"

    def native(self):
        cone = self.frame, self.spot_size, self.blend, self.falloff
        return native.SpotLight(self.position, *cone, self.radius, self.shape)

    has_size, has_one_direction, is_behind = PointLight.has_size, PointLight.has_one_direction, PointLight.is_behind


@dataclass(frozen=True)
class AreaLight(Light):
    """A rectangle or ellipse that shines from its front, of the radiance `strength` / (4 area).

    That is Cycles' watts in Blender 3.4; in 4.2 and 4.5 a watt gives strength / (pi area), 4 / pi of it.

    Attributes
    ----------
    position : world position of its center.
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    size_x, size_y : whole lengths along the lamp's own axes.
    is_round : True for an ellipse, False for a rectangle.
    spread : full angle in which light leaves, radians, 0..pi.
    """

    position: Vector
    frame: tuple[Vector, Vector, Vector]
    size_x: float
    size_y: float
    is_round: bool
    spread: float

    def native(self):
        size = self.size_x, self.size_y, self.is_round
        return native.AreaLight(self.position, self.frame, *size, self.spread)

    def is_behind(self, grid):
        half_x = 0.5 * self.size_x * grid.length_across(self.frame[0])
        half_y = 0.5 * self.size_y * grid.length_across(self.frame[1])
        reach = np.hypot(half_x, half_y) if self.is_round else half_x + half_y
        if not grid.faces(self.position, reach):
            return True
        return bool(((grid.corners() - self.position) @ np.array(self.frame[2]) >= 0).all())


@dataclass(frozen=True, eq=False)
class WorldLight(Light):
    """Light from everywhere, infinitely far away; `strength` is a factor.

    Attributes
    ----------
    radiance : float32 (H, W, 3), W/(m^2 sr), equirectangular as Blender stores environment images: from row 0 up
        the elevation rises from -pi/2 to pi/2 in even steps; along a row the azimuth falls from pi to -pi, so
        that the image's center lies along +x.
    to_world : rows of the 3 x 3 rotation of the image into the world.
    """

    radiance: np.ndarray
    to_world: tuple[tuple[float, float, float], ...]

    def native(self):
        def make():
            return native.EnvironmentLight(np.ascontiguousarray(self.radiance, np.float32), self.to_world)

        return keep_with(self.radiance, self.to_world, make)

    @property
    def is_colored(self):
        return keep_with(self.radiance, "color", lambda: bool((self.radiance != self.radiance[..., :1]).any()))

    def is_behind(self, _grid):
        return False

    def fault(self):
        return self._radiance_fault(self.radiance) or super().fault()

    def parts(self) -> tuple[Light, ...]:
        """The light without the suns in its image, if that is not dark, and these; itself if there are none.

        A sun has few directions, and shadows far sharper than the sky's. As a light of its own it takes fewer rays, and
        one kernel.
        """
        divided = keep_with(self.radiance, "suns", lambda: without_suns(self.radiance))
        if divided is None:
            return (self,)
        shared = {"blockers": self.blockers, "receivers": self.receivers}
        suns = []
        for spot in divided[1]:
            strength = float(spot.irradiance.max())
            color = tuple((spot.irradiance / strength * self.color).tolist())
            travel = tuple((-(np.array(self.to_world) @ spot.toward)).tolist())
            suns.append(
                SunLight(self.name, self.strength * strength, color, self.cast_shadow, travel, spot.angle, **shared)
            )
        rest = (replace(self, radiance=divided[0]),) if divided[0].any() else ()
        return (*rest, *suns)

    def coarse(self, max_rows: int) -> WorldLight:
        """The light with means of texels, so that its image has at most this many rows."""
        step = -(-len(self.radiance) // max_rows)
        if step == 1:
            return self

        def means() -> np.ndarray:
            radiance = np.ascontiguousarray(self.radiance, np.float32)
            if radiance.shape[0] % step == radiance.shape[1] % step == 0:  # sums of slices take a tenth of the time
                slices = (radiance[row::step, column::step] for row in range(step) for column in range(step))
                return sum(slices) / np.float32(step**2)
            for axis in (0, 1):
                edges = np.arange(0, radiance.shape[axis], step)
                counts = np.diff([*edges, radiance.shape[axis]]).astype(np.float32)
                radiance = np.add.reduceat(radiance, edges, axis) / np.expand_dims(counts, (1 - axis, 2))
            return radiance

        return replace(self, radiance=keep_with(self.radiance, max_rows, means))


@dataclass(frozen=True, eq=False)
class MeshLight(Light):
    """Triangles that glow on both sides; `strength` is a factor.

    Attributes
    ----------
    vertices : float64 (N, 3), world; those of no triangle belong to the bounding box of a closed mesh.
    triangles : uint32 (M, 3), indices of vertices.
    radiance : float32 (M, 3), W/(m^2 sr), of each triangle.
    is_closed : True if fronts hide all backs from outside of that box, as of `native.MeshLight`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    radiance: np.ndarray
    is_closed: bool = False

    def native(self):
        return native.MeshLight(self.vertices, self.triangles, self.radiance, is_closed=self.is_closed)

    @property
    def is_colored(self):
        return bool((self.radiance != self.radiance[:, :1]).any())

    def is_behind(self, grid):
        return bool((grid.heights_of(self.vertices[self.triangles.ravel()]) <= 0).all())

    def fault(self):
        if not np.isfinite(self.vertices).all():
            return f"The position of '{self.name}' is not a number."
        return self._radiance_fault(self.radiance) or super().fault()
