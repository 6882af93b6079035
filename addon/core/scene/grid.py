"""A rectangular grid of texels on a plane, which light arrives on and is solved on.

All positions are world positions in scene units. Rows of every array run up the plane: row 0 is the bottom (v = 0), as
Blender stores images.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Grid:
    """The grid; its frame is the plane's: x along columns, y up the rows, z outward.

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
        return np.array([self.x_axis, self.y_axis, self.normal], dtype=float) @ np.asarray(direction, dtype=float)

    def height_of(self, point: Vector) -> float:
        """How far a world point lies outward of the plane; negative behind it."""
        return float(np.dot(np.subtract(point, self.origin), self.normal))

    def numbers(self) -> tuple:
        """What the native functions take of a grid, in their order."""
        pitch = self.pitch_x, self.pitch_y
        return self.origin, self.x_axis, self.y_axis, self.normal, *pitch, self.width, self.height
