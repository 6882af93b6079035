"""The scene as plain frozen data: receiver grid, lights and occluding triangles.

All positions are world positions in scene units; light strengths follow Cycles (see each class).
Rows of every array run up the plane: row 0 is the bottom (v = 0), as Blender stores images.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

Vector = tuple[float, float, float]


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

    def to_plane_frame(self, direction: Vector) -> np.ndarray:
        """Turn a world direction into the plane frame (x along columns, y up the rows, z outward)."""
        return np.array([self.x_axis, self.y_axis, self.normal], dtype=float) @ np.asarray(direction, dtype=float)


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


@dataclass(frozen=True)
class PointLight:
    """Light from one point into all directions; `power` in Cycles' watts."""

    name: str
    position: Vector
    power: float
    color: Vector
    cast_shadow: bool = True


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


Light = SunLight | PointLight | SpotLight


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in world space: vertices float32 (N, 3), triangles uint32 (M, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray

    @cached_property
    def ray_caster(self):
        """The native `Occluders`, None without triangles; made once for all bakes under the same light."""
        from .._load import native

        return native.Occluders(self.vertices, self.triangles) if len(self.triangles) else None

    @classmethod
    def empty(cls) -> Mesh:
        """A mesh without triangles."""
        return cls(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))

    @classmethod
    def join(cls, parts: list[Mesh]) -> Mesh:
        """One mesh out of many."""
        if not parts:
            return cls.empty()
        offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        return cls(
            np.ascontiguousarray(np.concatenate([part.vertices for part in parts]), np.float32),
            np.ascontiguousarray(
                np.concatenate([part.triangles.astype(np.int64) + offset for part, offset in zip(parts, offsets)]),
                np.uint32,
            ),
        )
