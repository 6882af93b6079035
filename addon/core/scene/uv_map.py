"""Plane and affine UV map, P = p_0 + u p_u + v p_v, of a flat set of polygons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ReceiverError

# Largest distance from a plane and from an affine map, over the receiver's diagonal: a tenth of a texel at 1024.
FLATNESS_TOLERANCE = 1e-4
# Largest distance of UVs from 0..1: rounding of float32 coordinates.
UV_TOLERANCE = 1e-4


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
        """Split a per-corner array into one array per face."""
        return [points[begin:end] for begin, end in zip(self.starts[:-1], self.starts[1:])]


@dataclass(frozen=True, eq=False)
class UvMap:
    """P(u, v) = p_0 + u p_u + v p_v on a plane with an outward unit `normal`; corners are within `deviation` of it."""

    polygons: Polygons
    p_0: np.ndarray
    p_u: np.ndarray
    p_v: np.ndarray
    normal: np.ndarray
    deviation: float

    def is_orthogonal(self) -> bool:
        """True if texels are rectangles."""
        cosine = self.p_u @ self.p_v / (np.linalg.norm(self.p_u) * np.linalg.norm(self.p_v))
        return abs(cosine) < FLATNESS_TOLERANCE


def fit_uv_maps(polygons: Polygons) -> list[UvMap]:
    """UV maps of the flat parts of a mesh, one per chart. At present all polygons must be one part.

    Raises
    ------
    ReceiverError
        The mesh has no faces or no area, is not flat, has faces of both orientations, or has UVs that are missing,
        outside 0..1, degenerate or not affine. Every corner is checked.
    """
    corners, uvs = polygons.corners, polygons.uvs
    if len(polygons.starts) < 2:
        raise ReceiverError("No face uses this material.", "Assign it to the faces that should be baked.")
    if not np.isfinite(corners).all():
        raise ReceiverError("The mesh has vertices at infinity.", "Check its modifiers and scale.")
    centre = corners.mean(axis=0)
    size = np.linalg.norm(np.ptp(corners, axis=0))
    facing = _common_normal(polygons.normals)
    _, extents, axes = np.linalg.svd(corners - centre, full_matrices=False)
    if extents[1] <= 1e-7 * extents[0]:
        raise ReceiverError("The faces have no area.", "Check the object's scale.")
    normal = axes[2] if axes[2] @ facing > 0 else -axes[2]
    deviation = np.abs((corners - centre) @ normal).max()
    if deviation > FLATNESS_TOLERANCE * size:
        raise ReceiverError(
            f"The faces are not flat: they depart from a plane by {deviation:.3g} units.",
            "Flatten them, or split the object: only flat surfaces can be baked.",
        )
    check_uvs(uvs)
    return [_fit_affine(polygons, normal, size)]


def _common_normal(normals: np.ndarray) -> np.ndarray:
    usable = normals[np.isfinite(normals).all(axis=1) & (np.linalg.norm(normals, axis=1) > 0.5)]
    if len(usable) == 0:
        raise ReceiverError("The faces have no area.", "Check the object's scale.")
    if (usable @ usable[0] < 0).any() and (np.abs(usable @ usable[0]) > 0.99).all():
        raise ReceiverError("Some faces point to the opposite side.", "Recalculate the normals (Mesh > Normals).")
    total = usable.sum(axis=0)
    if np.linalg.norm(total) < 1e-6 * len(usable):
        raise ReceiverError("The faces are not flat.", "Split the object: only flat surfaces can be baked.")
    return total


def check_uvs(uvs: np.ndarray | None) -> None:
    if uvs is None or len(uvs) == 0:
        raise ReceiverError("The mesh has no UV map.", "Unwrap it first (UV > Unwrap in Edit Mode).")
    if not np.isfinite(uvs).all():
        raise ReceiverError("The UV map has coordinates that are not numbers.", "Unwrap the mesh again.")
    low, high = uvs.min(), uvs.max()
    if low < -UV_TOLERANCE or high > 1 + UV_TOLERANCE:
        raise ReceiverError(
            f"The UV map reaches outside the image (coordinates from {low:.3g} to {high:.3g}).",
            "Scale and move it to fit between 0 and 1.",
        )


def _fit_affine(polygons: Polygons, normal: np.ndarray, size: float) -> UvMap:
    corners, uvs = polygons.corners, polygons.uvs
    uv_centre, centre = uvs.mean(axis=0), corners.mean(axis=0)
    if np.linalg.svd(uvs - uv_centre, compute_uv=False)[1] < 1e-6 * np.sqrt(len(uvs)):
        raise ReceiverError("The UV map has no area.", "Unwrap the mesh again.")
    slopes = np.linalg.lstsq(uvs - uv_centre, corners - centre, rcond=None)[0]
    residual = np.abs(centre + (uvs - uv_centre) @ slopes - corners).max()
    if residual > FLATNESS_TOLERANCE * size:
        raise ReceiverError(
            "The UV map bends, cuts or scales faces differently.",
            "Unwrap the flat surface in one piece (UV > Project from View in Edit Mode).",
        )
    # Project the directions into the plane: the grid's axes must be orthogonal to the normal.
    p_u, p_v = slopes - np.outer(slopes @ normal, normal)
    if np.linalg.norm(np.cross(p_u, p_v)) < 1e-9 * np.linalg.norm(p_u) * np.linalg.norm(p_v):
        raise ReceiverError("The UV map has no area.", "Unwrap the mesh again.")
    deviation = float(np.abs((corners - centre) @ normal).max())
    return UvMap(polygons, centre - uv_centre @ slopes, p_u, p_v, normal, deviation)
