"""Texels on faces that bend, on which light arrives and is solved: each has a position and a direction of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..native import native
from .bending import BALL, Bending
from .grid import Grid, Vector, owner_number
from .stretch import pieces_of_texels

# Root of the number of texels that are asked first, and among which hollows are looked for; and the depth of a hollow
# over the surface's size. More texels, less depth: smaller hollows count, and more meshes are asked for bounced light.
HOLLOW_SIDE, HOLLOW_DEPTH = 24, 0.02

# Root of the number of texels whose pieces are counted. More: better estimates, which take longer.
PIECES_SIDE = 64

MAX_REACH = 0.02
"""Most of a surface's size that it reaches beyond the middles of its texels. Larger: near objects return no light."""


@dataclass(frozen=True, eq=False)
class BentGrid:
    """The texels of a part of a texture, with the attributes of a `Grid`.

    Arrays have the shape (height, width) or (height, width, 3). Vectors are 0 at texels that show no part of the mesh.

    Attributes
    ----------
    middles : float64, world positions of the middle of the surface that each texel shows.
    steps_x, steps_y : float32, change of position along columns and rows, scene units per texel; of a texel at the
        end of an island, the sides of the part that it shows.
    normals : float32, unit shading normals, outward.
    tangents : float32, unit vectors along the columns, at right angles to the normals.
    areas : float32, area of the surface that each texel shows, square scene units.
    coverage : float32, fraction of each texel inside the mesh, 0..1.
    finer : texels of the baked grid along a side for each of these; 1 but in an outline.
    owner, color_in, color_out, base_color, albedo : as of a `Grid`.
    is_back : True if the normals are those of the mesh's other side.
    bending : that of the mesh.
    """

    middles: np.ndarray
    steps_x: np.ndarray
    steps_y: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray
    areas: np.ndarray
    coverage: np.ndarray
    finer: float = 1.0
    color_in: np.ndarray | None = None
    color_out: np.ndarray | None = None
    owner: str = ""
    is_back: bool = False
    base_color: np.ndarray | None = None
    albedo: np.ndarray | None = None
    bending: Bending = BALL

    # Shadow rays start where texels are.
    clearance = 0.0
    # Light that leaves at an edge is lost.
    mirrored = 0.0

    @property
    def width(self) -> int:
        return self.areas.shape[1]

    @property
    def height(self) -> int:
        return self.areas.shape[0]

    @cached_property
    def texels(self) -> int:
        """Number of texels that show the mesh."""
        return round(np.count_nonzero(self.areas) * self.finer**2)

    @cached_property
    def area(self) -> float:
        """Area of the surface, square scene units."""
        return float(self.areas.sum(dtype=float))

    @property
    def pitch_x(self) -> float:
        """Root of the mean area of a texel, scene units."""
        return float(np.sqrt(self.area / max(self.texels, 1)))

    pitch_y = pitch_x

    @cached_property
    def pieces(self) -> float:
        """Mean number of pieces into which the solver divides a texel, about: that of some texels."""
        few = self.coarse(PIECES_SIDE)
        return pieces_of_texels(few.steps_x, few.steps_y, few.areas, few.coverage, self.finer)

    @property
    def reach(self) -> float:
        """How far the surface reaches beyond the middles of its texels, scene units, about."""
        steps = np.abs(self.steps_x) + np.abs(self.steps_y)
        half = 0.5 * float(np.linalg.norm(steps[self.areas > 0], axis=-1).max())
        return min(half, MAX_REACH * self.size)  # steps of faces that are slivers in the map are long

    @property
    def weights(self) -> np.ndarray:
        """Area of each texel, float32 (height, width), for means."""
        return self.areas

    @property
    def centre(self) -> np.ndarray:
        """Middle of the box around the surface."""
        return self._box.mean(axis=0)

    @property
    def size(self) -> float:
        """Longest side of the box around the surface."""
        return float(np.ptp(self._box, axis=0).max())

    def corners(self) -> np.ndarray:
        """World positions (8, 3) of the corners of the box around the middles of all texels."""
        return self._box.copy()

    @cached_property
    def _box(self) -> np.ndarray:
        columns = self.middles[self.areas > 0].T
        x, y, z = np.meshgrid(*((column.min(), column.max()) for column in columns), indexing="ij")
        return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)

    def positions(self, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """World positions, float64 (height, width, 3), `at` columns and rows from each texel's corner."""
        return self.middles + (at[0] - 0.5) * self.steps_x + (at[1] - 0.5) * self.steps_y

    def height_of(self, point: Vector) -> float:
        """Largest distance of a world point from the tangent planes of all texels, outward; negative if behind all."""
        heights = np.einsum("yxc,yxc->yx", point - self.middles, self.normals)
        return float(heights[self.areas > 0].max())

    def heights_of(self, points: np.ndarray) -> np.ndarray:
        """The same of points (N, 3), at most: their distance from the middle, and half the surface's diagonal."""
        corners = self.corners()
        reach = 0.5 * np.linalg.norm(np.ptp(corners, axis=0))
        return np.linalg.norm(points - self.centre, axis=1) + reach

    def is_hollow(self) -> bool:
        """True if parts of the surface see each other: points of it lie above tangent planes of others."""
        return see_each_other(self._few.middles.reshape(-1, 3), self._few.normals.reshape(-1, 3), self.size)

    @cached_property
    def _few(self) -> BentGrid:
        """Some of the texels, which answer most questions about all."""
        return self.coarse(HOLLOW_SIDE)

    def faces(self, point: Vector, radius: float = 0.0) -> bool:
        """True if a ball around a world point is not wholly behind the tangent planes of all texels."""
        return any(grid.height_of(point) > -radius for grid in (self._few, self))

    def meets(self, direction: Vector, cosine: float = 0.0) -> bool:
        """True if the cosine between a unit vector and some normals is below this."""
        return any(grid.cosine_to(direction) < cosine for grid in (self._few, self))

    def cosine_to(self, direction: Vector) -> float:
        """Least cosine between a unit vector and the normals."""
        return float((self.normals[self.areas > 0] @ np.asarray(direction, np.float32)).min())

    def length_across(self, vector: Vector) -> float:
        """Largest length of a vector along a normal, at most."""
        return float(np.linalg.norm(vector))

    @property
    def handedness(self) -> np.ndarray:
        """Float32 (height, width, 3): signs that make y of right-handed frames run up the rows."""
        bitangents = np.cross(self.normals, self.tangents)
        is_mirrored = np.einsum("hwc,hwc->hw", bitangents, self.steps_y) < 0
        signs = np.ones(self.normals.shape, np.float32)
        signs[is_mirrored, 1] = -1
        return signs

    def flipped(self) -> BentGrid:
        """The grid seen from behind."""
        return replace(self, normals=-self.normals, is_back=not self.is_back)

    def coarse(self, texels: int) -> BentGrid:
        """At most about `texels` x `texels` of the texels that show the mesh, evenly chosen, without colors."""
        shown = np.flatnonzero(self.areas)
        chosen = shown[np.linspace(0, len(shown) - 1, min(len(shown), texels**2)).astype(int)]

        def pick(values: np.ndarray) -> np.ndarray:
            return np.ascontiguousarray(values.reshape(self.areas.size, -1)[chosen].reshape(1, -1, *values.shape[2:]))

        vectors = (self.middles, self.steps_x, self.steps_y, self.normals, self.tangents)
        return BentGrid(*map(pick, (*vectors, self.areas, self.coverage)), owner=self.owner, is_back=self.is_back)

    def mean(self, values: np.ndarray) -> float:
        """Mean of values (height, width, C) over the surface."""
        return float(np.einsum("hw,hwc->c", self.areas, values, dtype=float).mean() / max(self.area, 1e-300))

    def native(self):
        """The native `ReceiverGrid`."""
        vectors = self.middles, self.steps_x, self.steps_y, self.normals, self.tangents
        return native.ReceiverGrid.bent(*vectors, self.areas, owner_number(self.owner))

    def surface(self):
        """The native `Surface`, which views the arrays of the grid."""
        return native.Surface(self.native(), self.coverage, self.clearance, self.color_in, self.color_out)


def see_each_other(points: np.ndarray, normals: np.ndarray, size: float) -> bool:
    """True if some points (N, 3) of a surface lie above the tangent planes of others; `size`: that of the surface."""
    heights = np.einsum("nc,mnc->mn", normals, points[:, None] - points)
    return bool((heights > HOLLOW_DEPTH * size).any())


AnyGrid = Grid | BentGrid
"""A grid on a plane, or on faces that bend."""
