"""Receivers: grids of texels on planes, on which light arrives and is solved, and their positions in a texture.

Positions are world positions in scene units. Rows of all arrays run up the plane: row 0 is the bottom (v = 0), as
Blender stores images. If the axes p_u and p_v of a chart's UV map are orthogonal, the chart's grid consists of the
texture's texels. Otherwise it is a rectangular grid of the same density, and `Chart.write` resamples it bilinearly.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ReceiverError
from ..native import native
from .sampling import bilinear
from .uv_map import UvMap

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
        None without a texture.
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

    def height_of(self, point: Vector) -> float:
        """Distance of a world point from the plane, outward; negative behind it."""
        return float(np.dot(np.subtract(point, self.origin), self.normal))

    def native(self):
        """The native `ReceiverGrid`."""
        axes = self.x_axis, self.y_axis, self.normal
        size = self.pitch_x, self.pitch_y, self.width, self.height
        return native.ReceiverGrid(self.origin, *axes, *size, owner_number(self.owner))

    def surface(self):
        """The native `Surface`, which views the arrays of the grid."""
        return native.Surface(self.native(), self.coverage, self.clearance, self.color_in, self.color_out)


def owner_number(name: str) -> int:
    """Number that stands for an object in native code."""
    return zlib.crc32(name.encode())


# Overlap with a chart, in texels, below which texels at its border are not part of the grid: rounding of float32 UVs.
EDGE_TOLERANCE = 1e-3


def in_chart(coverage: np.ndarray) -> np.ndarray:
    """True for texels that belong to a chart: those with any coverage."""
    return coverage > 0


@dataclass(frozen=True, eq=False)
class Chart:
    """Flat part of a receiver: a grid on its plane, and the texels that it fills in a texture.

    Attributes
    ----------
    grid : the grid on which light arrives.
    coverage : float32 (rows, columns), fraction inside the chart of each texel of the texture's part around the chart.
    offset : (column, row) of that part's first texel in the texture.
    texel_to_grid : (2, 3), maps (column, row, 1) of a texel's centre to grid coordinates, both in texels with centres
        at half-integers; None if the grid consists of the part's texels.
    """

    grid: Grid
    coverage: np.ndarray
    offset: tuple[int, int] = (0, 0)
    texel_to_grid: np.ndarray | None = None

    def uvs(self, width: int, height: int, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """UVs of the grid's texels in a texture of this size, float64 (grid height, grid width, 2), 0..1.

        `at` is the sample position: columns and rows from each texel's corner, its centre by default.
        """
        columns, rows = np.meshgrid(np.arange(self.grid.width) + at[0], np.arange(self.grid.height) + at[1])
        if self.texel_to_grid is None:
            columns, rows = columns + self.offset[0], rows + self.offset[1]
        else:
            matrix, shift = self.texel_to_grid[:, :2], self.texel_to_grid[:, 2]
            columns, rows = np.moveaxis((np.stack([columns, rows], -1) - shift) @ np.linalg.inv(matrix).T, -1, 0)
        return np.stack([columns / width, rows / height], axis=-1)

    def grid_positions(self, uvs: np.ndarray, receiver: Receiver) -> tuple[np.ndarray, np.ndarray]:
        """Grid columns and rows (flat, texel centres at half-integers) of UVs (..., 2) in the receiver's texture."""
        texels = uvs.reshape(-1, 2) * [receiver.width, receiver.height]
        if self.texel_to_grid is None:
            return tuple((texels - self.offset).T)
        return tuple(self.texel_to_grid @ np.column_stack([texels, np.ones(len(texels))]).T)

    def part_of(self, texture: np.ndarray) -> np.ndarray:
        """View of the texture's part around the chart."""
        (column, row), (rows, columns) = self.offset, self.coverage.shape
        return texture[row : row + rows, column : column + columns]

    def write(self, texture: np.ndarray, values: np.ndarray) -> None:
        """Write grid values (grid height, grid width, C) to the chart's texels of a texture (height, width, C)."""
        part, inside = self.part_of(texture), in_chart(self.coverage)
        if self.texel_to_grid is None:
            np.copyto(part, values, where=inside[..., None])
            return
        rows, columns = np.nonzero(inside)
        centres = columns + self.offset[0] + 0.5, rows + self.offset[1] + 0.5, np.ones(len(rows))
        x, y = self.texel_to_grid @ np.stack(centres)
        part[rows, columns] = bilinear(values, x, y)

    def read(self, texture: np.ndarray) -> np.ndarray:
        """Values (grid height, grid width, C) on the grid, from a texture (height, width, C)."""
        if self.texel_to_grid is None:
            return self.part_of(texture)
        height, width = texture.shape[:2]
        x, y = np.moveaxis(self.uvs(width, height).reshape(-1, 2) * [width, height], -1, 0)
        return bilinear(texture, x, y).reshape(self.grid.height, self.grid.width, -1).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Receiver:
    """The texels of a texture that one bake fills.

    Attributes
    ----------
    coverage : float32 (height, width), fraction of each texel inside the charts.
    charts : flat parts; one at present.
    """

    coverage: np.ndarray
    charts: tuple[Chart, ...]

    @property
    def height(self) -> int:
        return self.coverage.shape[0]

    @property
    def width(self) -> int:
        return self.coverage.shape[1]

    def inside(self) -> np.ndarray:
        """Bool (height, width): texels that belong to a chart."""
        return in_chart(self.coverage)

    def to_texture(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Texture, float32 (height, width, C), with the charts' grid values (grid height, grid width, C); 0 outside."""
        texture = np.zeros((self.height, self.width, values[0].shape[2]), np.float32)
        for chart, on_grid in zip(self.charts, values):
            chart.write(texture, on_grid)
        return texture


def texture_size(maps: Sequence[UvMap], resolution: int) -> tuple[int, int]:
    """Width and height of a texture with `resolution` texels along the longer side; texels are nearly square."""
    lengths = np.max([(np.linalg.norm(uv_map.p_u), np.linalg.norm(uv_map.p_v)) for uv_map in maps], axis=0).tolist()
    return tuple(max(1, round(resolution * length / max(lengths))) for length in lengths)


def build_receiver(maps: Sequence[UvMap], width: int, height: int, owner: str = "") -> Receiver:
    """Make the charts of flat parts of an object, `owner`, for a texture of `width` x `height` texels.

    Raises
    ------
    ReceiverError
        The parts cover no texel.
    """
    charts = (_chart(uv_map, width, height) for uv_map in maps)
    charts = tuple(replace(chart, grid=replace(chart.grid, owner=owner)) for chart in charts)
    coverage = charts[0].coverage
    if len(charts) > 1 or coverage.shape != (height, width):
        coverage = np.zeros((height, width), np.float32)
        for chart in charts:
            covered = chart.part_of(coverage)
            np.minimum(covered + chart.coverage, 1, out=covered)
    if not in_chart(coverage).any():
        raise ReceiverError("The UV map covers no texel of the image.", "Enlarge it, or the image.")
    return Receiver(coverage, charts)


def outline(uv_map: UvMap, width: int, height: int) -> Grid:
    """About the grid of a flat part of an object, in a texture of that size, as a rectangle; quickly made."""
    uvs = np.clip(uv_map.polygons.uvs, 0, 1)
    first, size = uvs.min(axis=0), np.ptp(uvs, axis=0)
    lengths = [np.linalg.norm(vector) for vector in (uv_map.p_u, uv_map.p_v)]
    frame = np.stack([uv_map.p_u / lengths[0], uv_map.p_v / lengths[1]])
    columns, rows = np.maximum(np.rint(size * [width, height]), 1).astype(int).tolist()
    origin = uv_map.p_0 + first[0] * uv_map.p_u + first[1] * uv_map.p_v
    whole = np.broadcast_to(np.float32(1), (rows, columns))
    return _grid(origin, frame, uv_map, np.array(lengths) / [width, height], whole)


def _chart(uv_map: UvMap, width: int, height: int) -> Chart:
    p_u, p_v, polygons = uv_map.p_u, uv_map.p_v, uv_map.polygons
    x_axis = p_u / np.linalg.norm(p_u)
    across = p_v - (p_v @ x_axis) * x_axis
    frame = np.stack([x_axis, across / np.linalg.norm(across)])
    pitch = np.array([np.linalg.norm(p_u) / width, np.linalg.norm(across) / height])
    texels = polygons.uvs * [width, height]
    first = np.clip(np.floor(texels.min(axis=0) + EDGE_TOLERANCE), 0, [width - 1, height - 1]).astype(int)
    last = np.clip(np.ceil(texels.max(axis=0) - EDGE_TOLERANCE), first + 1, [width, height]).astype(int)
    coverage = _coverage(polygons.split(texels), width, height)
    chart_coverage = np.ascontiguousarray(coverage[first[1] : last[1], first[0] : last[0]])
    offset = int(first[0]), int(first[1])
    if uv_map.is_orthogonal():
        origin = uv_map.p_0 + first[0] / width * p_u + first[1] / height * p_v
        return Chart(_grid(origin, frame, uv_map, pitch, chart_coverage), chart_coverage, offset)
    # Compute the rectangle around the polygons whose rows are parallel to the texture's.
    points = polygons.corners @ frame.T / pitch
    corner = points.min(axis=0)
    columns, rows = np.maximum(np.ceil(points.max(axis=0) - corner - EDGE_TOLERANCE), 1).astype(int).tolist()
    origin = (corner * pitch) @ frame + (polygons.corners.mean(axis=0) @ uv_map.normal) * uv_map.normal
    grid = _grid(origin, frame, uv_map, pitch, _coverage(polygons.split(points - corner), columns, rows))
    slopes = [(frame @ p_u) / pitch / width, (frame @ p_v) / pitch / height]
    return Chart(grid, chart_coverage, offset, np.column_stack([*slopes, frame @ uv_map.p_0 / pitch - corner]))


def _grid(origin: np.ndarray, frame: np.ndarray, uv_map: UvMap, pitch: np.ndarray, coverage: np.ndarray) -> Grid:
    origin, x_axis, y_axis, normal = (tuple(vector.tolist()) for vector in (origin, *frame, uv_map.normal))
    pitches, (height, width) = map(float, pitch), coverage.shape
    return Grid(origin, x_axis, y_axis, normal, *pitches, width, height, coverage, clearance=uv_map.deviation)


def _coverage(faces: list[np.ndarray], width: int, height: int) -> np.ndarray:
    """Fraction of each texel inside the faces; `faces` have (x, y) in texels."""
    corners = np.ascontiguousarray(np.concatenate(faces), np.float64)
    counts = np.array([len(face) for face in faces], np.uint32)
    return native.coverage(corners, counts, width, height)
