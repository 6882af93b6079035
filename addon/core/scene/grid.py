"""Grids of texels on planes, on which light arrives and is solved.

Positions are world positions in scene units. Rows of all arrays run up the plane: row 0 is the bottom.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace

import numpy as np

from ..native import native

Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Grid:
    """The grid. Its frame is the plane's: x along columns, y up the rows, z outward.

    Attributes
    ----------
    origin : world position of the outer corner of texel (0, 0).
    x_axis, y_axis : unit vectors along columns and (upward) rows, orthogonal; a mirrored UV map makes
        (x_axis, y_axis, normal) left-handed, which is fine because LDFs are mirror-symmetric.
    normal : unit vector, outward.
    pitch_x, pitch_y : texel size along the axes, scene units.
    width, height : number of texels.
    coverage : float32 (height, width), fraction of each texel inside the mesh, 0..1.
    clearance : largest distance of the mesh from the plane, scene units; shadow rays start above it.
    owner : name of the object that the plane belongs to; faces of other objects that lie on the plane cover it.
    color_in, color_out : float32 (height, width, 3), factors of entering and leaving light by the surface's texture;
        None without a texture that multiplies light.
    base_color, albedo : float32 (height, width, 3) of each texel in which light scatters, either of them; None: the
        surface has one medium.
    mirrored : distance from the borders, scene units, to which mirror images of the grid return light; 0: it leaves.
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
    color_in: np.ndarray | None = None
    color_out: np.ndarray | None = None
    owner: str = ""
    mirrored: float = 0.0
    base_color: np.ndarray | None = None
    albedo: np.ndarray | None = None

    @property
    def texels(self) -> int:
        return self.width * self.height

    @property
    def area(self) -> float:
        """Area of the grid, square scene units."""
        return self.texels * self.pitch_x * self.pitch_y

    @property
    def centre(self) -> np.ndarray:
        """World position of the grid's centre."""
        across = 0.5 * self.width * self.pitch_x * np.array(self.x_axis)
        return self.origin + across + 0.5 * self.height * self.pitch_y * np.array(self.y_axis)

    def positions(self, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """World positions, float64 (height, width, 3), `at` columns and rows from each texel's corner."""
        columns = (np.arange(self.width) + at[0])[None, :, None] * self.pitch_x * np.array(self.x_axis)
        rows = (np.arange(self.height) + at[1])[:, None, None] * self.pitch_y * np.array(self.y_axis)
        return np.array(self.origin) + columns + rows

    def columns_and_rows(self, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows, flat arrays in texels, of world positions (..., 3)."""
        offsets = positions.reshape(-1, 3) - self.origin
        return offsets @ np.array(self.x_axis) / self.pitch_x, offsets @ np.array(self.y_axis) / self.pitch_y

    @property
    def size(self) -> float:
        """Longest side, scene units."""
        return max(self.width * self.pitch_x, self.height * self.pitch_y)

    @property
    def weights(self) -> np.ndarray:
        """Area inside the mesh of each texel, float32 (height, width), for means."""
        return self.coverage * (self.pitch_x * self.pitch_y)

    def corners(self) -> np.ndarray:
        """World positions (4, 3) of the corners."""
        x, y = np.array([(0, 0), (1, 0), (0, 1), (1, 1)]).T[..., None]
        right = x * self.width * self.pitch_x * np.array(self.x_axis)
        return self.origin + right + y * self.height * self.pitch_y * np.array(self.y_axis)

    def height_of(self, point: Vector) -> float:
        """Distance of a world point from the plane, outward; negative behind it."""
        return float(np.dot(np.subtract(point, self.origin), self.normal))

    def heights_of(self, points: np.ndarray) -> np.ndarray:
        """The same of points (N, 3)."""
        return np.subtract(points, self.origin) @ np.array(self.normal)

    def faces(self, point: Vector, radius: float = 0.0) -> bool:
        """True if a ball around a world point is not wholly behind the plane."""
        return self.height_of(point) > -radius

    def meets(self, direction: Vector, cosine: float = 0.0) -> bool:
        """True if the cosine between a unit vector and the normal is below this."""
        return self.cosine_to(direction) < cosine

    def cosine_to(self, direction: Vector) -> float:
        """Cosine between a unit vector and the normal."""
        return float(np.dot(direction, self.normal))

    def length_across(self, vector: Vector) -> float:
        """Length of a vector along the normal."""
        return abs(float(np.dot(vector, self.normal)))

    def flipped(self) -> Grid:
        """The grid seen from behind."""
        return replace(self, normal=tuple(-value for value in self.normal))

    def coarse(self, texels: int) -> Grid:
        """The grid with at most so many texels along a side, without colors."""
        return self._of_size(min(self.width, texels), min(self.height, texels))

    def gathering(self, texels: int) -> Grid:
        """A coarse grid whose texels are squares of 1, 4, 16 or 64 of this grid's, if its size allows that."""
        for count in (1, 2, 4, 8):
            if self.width % count == 0 == self.height % count and max(self.width, self.height) <= count * texels:
                return self._of_size(self.width // count, self.height // count)
        return self.coarse(texels)

    def _of_size(self, width: int, height: int) -> Grid:
        pitch = {"pitch_x": self.pitch_x * self.width / width, "pitch_y": self.pitch_y * self.height / height}
        whole = np.ones((height, width), np.float32)
        without = dict.fromkeys(("color_in", "color_out", "base_color", "albedo"))
        return replace(self, width=width, height=height, coverage=whole, **without, **pitch)

    def mean(self, values: np.ndarray) -> float:
        """Mean of values (height, width, C) over the grid."""
        return float(values.mean())

    def native(self):
        """The native `ReceiverGrid`."""
        axes = self.x_axis, self.y_axis, self.normal
        size = self.pitch_x, self.pitch_y, self.width, self.height
        return native.ReceiverGrid(self.origin, *axes, *size, owner_number(self.owner))

    def surface(self):
        """The native `Surface`, which views the arrays of the grid."""
        colors = self.color_in, self.color_out
        return native.Surface(self.native(), self.coverage, self.clearance, *colors, self.mirrored)


def owner_number(name: str) -> int:
    """Number that stands for an object in native code."""
    return zlib.crc32(name.encode())
