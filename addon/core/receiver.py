"""From a flat, UV-mapped set of polygons to the texel grid that light is gathered on.

The UV map must be one affine map of the plane: P = p_0 + u p_u + v p_v. When p_u and p_v are orthogonal, the grid
consists of the texels themselves; otherwise it is a rectangular grid of the same density, and `Receiver.to_texels`
resamples it bilinearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import ReceiverError
from .scene import Grid

# Allowed departure from a plane and from an affine map, over the receiver's diagonal: a tenth of a texel at 1024.
FLATNESS_TOLERANCE = 1e-4
# UVs this little outside 0..1 are rounding of float32 coordinates.
UV_TOLERANCE = 1e-4
# Texels that a chart enters by less than this fraction are left out of the grid (rounding of float32 UVs).
EDGE_TOLERANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Polygons:
    """The faces that receive light.

    Attributes
    ----------
    corners : float64 (K, 3), world positions of all face corners.
    uvs : float64 (K, 2), or None if the mesh has no UV map.
    starts : int (N + 1,), face i has the corners starts[i] : starts[i + 1].
    normals : float64 (N, 3), outward unit normals, world.
    """

    corners: np.ndarray
    uvs: np.ndarray | None
    starts: np.ndarray
    normals: np.ndarray

    def split(self, points: np.ndarray) -> list[np.ndarray]:
        """Cut a per-corner array into one array per face."""
        return [points[begin:end] for begin, end in zip(self.starts[:-1], self.starts[1:])]


@dataclass(frozen=True)
class UvMap:
    """P(u, v) = p_0 + u p_u + v p_v on the plane with the outward unit `normal`; corners depart by `deviation`."""

    p_0: np.ndarray
    p_u: np.ndarray
    p_v: np.ndarray
    normal: np.ndarray
    deviation: float

    def is_orthogonal(self) -> bool:
        """Whether texels are rectangles."""
        cosine = self.p_u @ self.p_v / (np.linalg.norm(self.p_u) * np.linalg.norm(self.p_v))
        return abs(cosine) < FLATNESS_TOLERANCE


@dataclass(frozen=True, eq=False)
class Receiver:
    """A grid on the plane and its place in the texture.

    Attributes
    ----------
    grid : where light arrives.
    width, height : size of the texture.
    coverage : float32 (height, width), part of each texel inside the mesh.
    offset : (column, row) of the grid's first texel in the texture, used when `texel_to_grid` is None.
    texel_to_grid : (2, 3), maps (column, row, 1) of a texel's centre to grid coordinates, both in texels with centres
        at half-integers; None when the grid is a part of the texture.
    """

    grid: Grid
    width: int
    height: int
    coverage: np.ndarray
    offset: tuple[int, int] = (0, 0)
    texel_to_grid: np.ndarray | None = None

    def to_texels(self, values: np.ndarray) -> np.ndarray:
        """Bring grid values (grid height, grid width, C) to the texture (height, width, C), 0 outside the chart.

        Where the grid is the texture and the chart covers all of it, these are the values themselves, not a copy.
        """
        covered = self.grid.coverage > 0
        if self.texel_to_grid is None and covered.shape == (self.height, self.width) and covered.all():
            return values
        texture = np.zeros((self.height, self.width, values.shape[2]), np.float32)
        if self.texel_to_grid is None:
            column, row = self.offset
            part = texture[row : row + self.grid.height, column : column + self.grid.width]
            np.copyto(part, values, where=covered[..., None])
            return texture
        rows, columns = np.nonzero(self.coverage > 0)
        x, y = self.texel_to_grid @ np.stack([columns + 0.5, rows + 0.5, np.ones(len(rows))])
        texture[rows, columns] = _bilinear(values, x - 0.5, y - 0.5)
        return texture


def fit_uv_map(polygons: Polygons) -> UvMap:
    """Fit the plane and the affine UV map, and verify both on every corner.

    Raises
    ------
    ReceiverError
        No faces, no area, not flat, faces of both orientations, or UVs that are missing, outside 0..1, degenerate or
        not affine.
    """
    corners, uvs = polygons.corners, polygons.uvs
    if len(polygons.starts) < 2:
        raise ReceiverError("No face uses this material: assign it to the faces that should be baked.")
    if not np.isfinite(corners).all():
        raise ReceiverError("The mesh has vertices at infinity: check its modifiers and scale.")
    centre = corners.mean(axis=0)
    size = np.linalg.norm(np.ptp(corners, axis=0))
    facing = _common_normal(polygons.normals)
    _, extents, axes = np.linalg.svd(corners - centre, full_matrices=False)
    if extents[1] <= 1e-7 * extents[0]:
        raise ReceiverError("The faces have no area: check the object's scale.")
    normal = axes[2] if axes[2] @ facing > 0 else -axes[2]
    deviation = np.abs((corners - centre) @ normal).max()
    if deviation > FLATNESS_TOLERANCE * size:
        raise ReceiverError(
            f"The faces are not flat (they depart from a plane by {deviation:.3g} units): "
            "only flat surfaces can be baked, so flatten them or split the object."
        )
    _check_uvs(uvs)
    return _fit_affine(corners, uvs, normal, size)


def _common_normal(normals: np.ndarray) -> np.ndarray:
    usable = normals[np.isfinite(normals).all(axis=1) & (np.linalg.norm(normals, axis=1) > 0.5)]
    if len(usable) == 0:
        raise ReceiverError("The faces have no area: check the object's scale.")
    if (usable @ usable[0] < 0).any() and (np.abs(usable @ usable[0]) > 0.99).all():
        raise ReceiverError("Some faces point to the opposite side: recalculate the normals (Mesh > Normals).")
    total = usable.sum(axis=0)
    if np.linalg.norm(total) < 1e-6 * len(usable):
        raise ReceiverError("The faces are not flat: only flat surfaces can be baked, so split the object.")
    return total


def _check_uvs(uvs: np.ndarray | None) -> None:
    if uvs is None or len(uvs) == 0:
        raise ReceiverError("The mesh has no UV map: unwrap it first (UV > Unwrap in Edit Mode).")
    if not np.isfinite(uvs).all():
        raise ReceiverError("The UV map has coordinates that are not numbers: unwrap the mesh again.")
    low, high = uvs.min(), uvs.max()
    if low < -UV_TOLERANCE or high > 1 + UV_TOLERANCE:
        raise ReceiverError(
            f"The UV map reaches outside the image (coordinates from {low:.3g} to {high:.3g}): "
            "scale and move it to fit between 0 and 1."
        )


def _fit_affine(corners: np.ndarray, uvs: np.ndarray, normal: np.ndarray, size: float) -> UvMap:
    uv_centre, centre = uvs.mean(axis=0), corners.mean(axis=0)
    if np.linalg.svd(uvs - uv_centre, compute_uv=False)[1] < 1e-6 * np.sqrt(len(uvs)):
        raise ReceiverError("The UV map has no area: unwrap the mesh again.")
    slopes = np.linalg.lstsq(uvs - uv_centre, corners - centre, rcond=None)[0]
    residual = np.abs(centre + (uvs - uv_centre) @ slopes - corners).max()
    if residual > FLATNESS_TOLERANCE * size:
        raise ReceiverError(
            "The UV map bends, cuts or scales faces differently: unwrap the flat surface in one piece "
            "(UV > Project from View in Edit Mode)."
        )
    # Directions in the plane exactly, so that the grid's axes are orthogonal to the normal.
    p_u, p_v = slopes - np.outer(slopes @ normal, normal)
    if np.linalg.norm(np.cross(p_u, p_v)) < 1e-9 * np.linalg.norm(p_u) * np.linalg.norm(p_v):
        raise ReceiverError("The UV map has no area: unwrap the mesh again.")
    deviation = float(np.abs((corners - centre) @ normal).max())
    return UvMap(centre - uv_centre @ slopes, p_u, p_v, normal, deviation)


def texture_size(uv_map: UvMap, resolution: int) -> tuple[int, int]:
    """Width and height of a texture with `resolution` texels along the longer side and nearly square texels."""
    length_u, length_v = np.linalg.norm(uv_map.p_u), np.linalg.norm(uv_map.p_v)
    longest = max(length_u, length_v)
    return tuple(max(1, round(resolution * length / longest)) for length in (length_u, length_v))


def build_receiver(polygons: Polygons, uv_map: UvMap, width: int, height: int) -> Receiver:
    """Lay the grid of a texture of `width` x `height` texels over the polygons.

    Raises
    ------
    ReceiverError
        The chart covers no texel.
    """
    texels = polygons.uvs * [width, height]
    coverage = _coverage(polygons.split(texels), width, height)
    if not (coverage > 0).any():
        raise ReceiverError("The UV map covers no texel of the image: enlarge it or the image.")
    x_axis = uv_map.p_u / np.linalg.norm(uv_map.p_u)
    across = uv_map.p_v - (uv_map.p_v @ x_axis) * x_axis
    y_axis = across / np.linalg.norm(across)
    pitch = np.array([np.linalg.norm(uv_map.p_u) / width, np.linalg.norm(across) / height])
    if uv_map.is_orthogonal():
        return _texel_receiver(uv_map, texels, coverage, (x_axis, y_axis), pitch)
    return _sheared_receiver(polygons, uv_map, coverage, (x_axis, y_axis), pitch)


def _texel_receiver(uv_map: UvMap, texels: np.ndarray, coverage: np.ndarray, axes, pitch: np.ndarray) -> Receiver:
    """The grid is the part of the texture that the chart touches."""
    height, width = coverage.shape
    first = np.clip(np.floor(texels.min(axis=0) + EDGE_TOLERANCE), 0, [width - 1, height - 1]).astype(int)
    last = np.clip(np.ceil(texels.max(axis=0) - EDGE_TOLERANCE), first + 1, [width, height]).astype(int)
    origin = uv_map.p_0 + first[0] / width * uv_map.p_u + first[1] / height * uv_map.p_v
    part = np.ascontiguousarray(coverage[first[1] : last[1], first[0] : last[0]])
    grid = _grid(origin, axes, uv_map, pitch, part)
    return Receiver(grid, width, height, coverage, offset=(int(first[0]), int(first[1])))


def _sheared_receiver(polygons: Polygons, uv_map: UvMap, coverage: np.ndarray, axes, pitch: np.ndarray) -> Receiver:
    """The grid is a rectangle around the polygons with its rows along the texture's."""
    height, width = coverage.shape
    frame = np.stack(axes)
    points = polygons.corners @ frame.T / pitch
    first = points.min(axis=0)
    size = np.maximum(np.ceil(points.max(axis=0) - first - EDGE_TOLERANCE), 1).astype(int)
    grid_coverage = _coverage(polygons.split(points - first), int(size[0]), int(size[1]))
    origin_in_plane = first * pitch
    centre = polygons.corners.mean(axis=0)
    origin = origin_in_plane @ frame + (centre @ uv_map.normal) * uv_map.normal
    grid = _grid(origin, axes, uv_map, pitch, grid_coverage)
    columns = [(frame @ uv_map.p_u) / pitch / width, (frame @ uv_map.p_v) / pitch / height]
    texel_to_grid = np.column_stack([*columns, frame @ uv_map.p_0 / pitch - first])
    return Receiver(grid, width, height, coverage, texel_to_grid=texel_to_grid)


def _grid(origin: np.ndarray, axes, uv_map: UvMap, pitch: np.ndarray, coverage: np.ndarray) -> Grid:
    def vector(values):
        return tuple(float(value) for value in values)

    height, width = coverage.shape
    return Grid(
        origin=vector(origin),
        x_axis=vector(axes[0]),
        y_axis=vector(axes[1]),
        normal=vector(uv_map.normal),
        pitch_x=float(pitch[0]),
        pitch_y=float(pitch[1]),
        width=width,
        height=height,
        coverage=coverage,
        clearance=uv_map.deviation,
    )


def _coverage(faces: list[np.ndarray], width: int, height: int) -> np.ndarray:
    """Part of each texel inside the faces; `faces` hold (x, y) in texels."""
    from .._load import native

    corners = np.ascontiguousarray(np.concatenate(faces), np.float64)
    counts = np.array([len(face) for face in faces], np.uint32)
    return native.coverage(corners, counts, width, height)


def _bilinear(values: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values (H, W, C) at fractional columns x and rows y, held constant beyond the border."""
    height, width = values.shape[:2]
    x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
    column, row = np.minimum(x.astype(int), max(width - 2, 0)), np.minimum(y.astype(int), max(height - 2, 0))
    next_column, next_row = np.minimum(column + 1, width - 1), np.minimum(row + 1, height - 1)
    weight_x, weight_y = (x - column)[:, None], (y - row)[:, None]
    bottom = values[row, column] * (1 - weight_x) + values[row, next_column] * weight_x
    top = values[next_row, column] * (1 - weight_x) + values[next_row, next_column] * weight_x
    return bottom * (1 - weight_y) + top * weight_y
