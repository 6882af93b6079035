"""The scene as plain frozen data: receiver grid, lights and occluding triangles.

All positions are world positions in scene units; light strengths follow Cycles (see each class).
Rows of every array run up the plane: row 0 is the bottom (v = 0), as Blender stores images.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

Vector = tuple[float, float, float]

# Shadows are traced in single precision relative to an origin, on a lattice this many texels wide or up to twice that:
# vertices near a receiver are off by at most 2^-24 of it, and rays start 16 times 2^-23 of it off the plane, which is a
# 32nd of a texel. Wider, more receivers share a hierarchy.
TEXELS_BETWEEN_ORIGINS = 2**13


@dataclass(frozen=True, eq=False)
class Grid:
    """A rectangular grid of texels on a plane.

    Attributes
    ----------
    origin : world position of the outer corner of texel (0, 0).
    x_axis, y_axis : unit vectors along columns and (upward) rows, orthogonal; a mirrored UV map makes
        (x_axis, y_axis, normal) left-handed, which is fine because LDFs are mirror-symmetric.
    normal : unit vector, outward.
    pitch_x, pitch_y : texel size along the axes, scene units.
    width, height : number of texels.
    coverage : float32 (height, width), part of each texel inside the mesh, 0..1.
    clearance : how far the mesh departs from the plane at most, scene units: shadow rays start above that.
    """

    origin: Vector
    x_axis: Vector
    y_axis: Vector
    normal: Vector
    pitch_x: float
    pitch_y: float
    width: int
    height: int
    coverage: np.ndarray
    clearance: float = 0.0

    def native_grid(self):
        """The native `ReceiverGrid`."""
        from .._load import native

        axes = self.x_axis, self.y_axis, self.normal
        return native.ReceiverGrid(self.origin, *axes, self.pitch_x, self.pitch_y, self.width, self.height)

    @property
    def centre(self) -> np.ndarray:
        """World position."""
        across = 0.5 * self.width * self.pitch_x * np.array(self.x_axis)
        return self.origin + across + 0.5 * self.height * self.pitch_y * np.array(self.y_axis)


@dataclass(frozen=True)
class SunLight:
    """Parallel light.

    Attributes
    ----------
    direction : unit vector of travel, world.
    irradiance : W/m^2 at normal incidence.
    color : linear RGB factor.
    """

    name: str
    direction: Vector
    irradiance: float
    color: Vector
    cast_shadow: bool = True

    @property
    def strength(self) -> float:
        """What the beams of the unit light are multiplied by."""
        return self.irradiance

    def unit_light(self):
        """The native light of strength 1."""
        from .._load import native

        return native.SunLight(self.direction)


@dataclass(frozen=True)
class PointLight:
    """Light from one point into all directions; `power` in Cycles' watts."""

    name: str
    position: Vector
    power: float
    color: Vector
    cast_shadow: bool = True

    @property
    def strength(self) -> float:
        """What the beams of the unit light are multiplied by."""
        return self.power

    def unit_light(self):
        """The native light of strength 1."""
        from .._load import native

        return native.PointLight(self.position)


@dataclass(frozen=True)
class SpotLight:
    """A point light behind a cone.

    Attributes
    ----------
    frame : rows are the lamp's x, y and z axes (light travels along -z), object scale included.
    spot_size : full cone angle, radians.
    blend : soft part of the cone, 0..1.
    falloff : "scaled", or "legacy" for Cycles before Blender 3.5, where the lamp's scale does not shape the cone.
    """

    name: str
    position: Vector
    power: float
    color: Vector
    cast_shadow: bool
    frame: tuple[Vector, Vector, Vector]
    spot_size: float
    blend: float
    falloff: str = "scaled"

    @property
    def strength(self) -> float:
        """What the beams of the unit light are multiplied by."""
        return self.power

    def unit_light(self):
        """The native light of strength 1."""
        from .._load import native

        return native.SpotLight(self.position, self.frame, self.spot_size, self.blend, self.falloff)


Light = SunLight | PointLight | SpotLight


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in world space: vertices float64 (N, 3), triangles uint32 (M, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray
    _casters: list = field(default_factory=list, init=False, repr=False)  # the last one made, with its origin

    def ray_caster(self, grid: Grid):
        """The native `Occluders` with its origin near the receiver; None without triangles.

        The origin follows from the receiver alone, so that a bake does not depend on those before it. The last one made
        serves all receivers with the same origin.
        """
        from .._load import native

        if not len(self.triangles):
            return None
        step = TEXELS_BETWEEN_ORIGINS * 2.0 ** math.ceil(math.log2(min(grid.pitch_x, grid.pitch_y)))
        origin = tuple(step * np.round(grid.centre / step))
        if not self._casters or self._casters[0][0] != origin:
            self._casters.clear()  # before another is made: each may take gigabytes
            vertices = np.ascontiguousarray(self.vertices, float)
            self._casters.append((origin, native.Occluders(vertices, self.triangles, origin)))
        return self._casters[0][1]

    @classmethod
    def empty(cls) -> Mesh:
        """A mesh without triangles."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))

    @classmethod
    def join(cls, parts: list[Mesh]) -> Mesh:
        """One mesh out of many."""
        if not parts:
            return cls.empty()
        offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        return cls(
            np.ascontiguousarray(np.concatenate([part.vertices for part in parts]), float),
            np.ascontiguousarray(
                np.concatenate([part.triangles.astype(np.int64) + offset for part, offset in zip(parts, offsets)]),
                np.uint32,
            ),
        )
