"""Triangles of a polygon, which may have notches, by clipping ears (Meisters 1975, doi:10.2307/2319703)."""

from __future__ import annotations

import numpy as np

from .polygons import Polygons

# Number of corners above which a polygon with notches becomes a fan. Time is in proportion to its cube at worst.
MAX_CORNERS = 1000


def with_triangles(polygons: Polygons, chosen: np.ndarray) -> Polygons:
    """Polygons with the triangles of the chosen faces (an index), as renderers show them, after the other faces."""
    is_chosen = np.zeros(polygons.count, bool)
    is_chosen[chosen] = True
    rest = polygons.of_faces(np.flatnonzero(~is_chosen))
    corners, owners = triangle_corners(polygons, np.flatnonzero(is_chosen))
    corners = corners.ravel()
    points = np.concatenate([rest.corners, polygons.corners[corners]])
    uvs = None if polygons.uvs is None else np.concatenate([rest.uvs, polygons.uvs[corners]])
    starts = np.concatenate([rest.starts, rest.starts[-1] + 3 * np.arange(1, len(owners) + 1)])
    numbers = np.arange(polygons.count) if polygons.numbers is None else polygons.numbers
    numbers = np.concatenate([rest.numbers, numbers[owners]])
    normals = np.concatenate([rest.normals, polygons.normals[owners]])
    tiles = None if polygons.tiles is None else np.concatenate([rest.tiles, polygons.tiles[owners]])
    shading = polygons.corner_normals
    shading = None if shading is None else np.concatenate([rest.corner_normals, shading[corners]])
    return Polygons(points, uvs, starts, normals, polygons.uv_map, numbers, tiles, shading)


def triangle_corners(polygons: Polygons, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Corners (M, 3) of the triangles of faces (an index without repeats), as renderers show them, and each's face.

    Those of a face follow each other, in the order of the faces.
    """
    sizes, firsts = polygons.sizes[faces], polygons.starts[:-1][faces]
    triangles, quads = np.flatnonzero(sizes == 3), np.flatnonzero(sizes == 4)
    is_convex = _is_convex(polygons.corners[firsts[quads, None] + np.arange(4)])
    parts = [firsts[triangles, None] + np.arange(3)]
    owners = [triangles]
    parts.append((firsts[quads[is_convex], None, None] + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3))
    owners.append(np.repeat(quads[is_convex], 2))
    for face in np.flatnonzero(~np.isin(np.arange(len(faces)), np.concatenate(owners)) & (sizes > 2)).tolist():
        corners = np.arange(firsts[face], firsts[face] + sizes[face])
        normal = polygons.area_vectors[faces[face]]
        parts.append(corners[triangles_of_face(polygons.corners[corners], normal)])
        owners.append(np.full(len(parts[-1]), face))
    owner_of = np.concatenate(owners)
    order = np.argsort(owner_of, kind="stable")
    return np.concatenate(parts)[order], faces[owner_of[order]]


def _is_convex(quads: np.ndarray) -> np.ndarray:
    """True for each quadrilateral (N, 4, 3) whose corners all turn the same way, as seen along its mean normal."""
    sides = np.roll(quads, -1, axis=1) - quads
    turns = np.cross(np.roll(sides, 1, axis=1), sides)
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    return (np.einsum("nij,nj->ni", turns, normals) >= 0).all(axis=1)


def triangles_of_face(corners: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Corners of the triangles, int (M, 3), of a face (N, 3), as seen along a normal of any length."""
    x_axis = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    return triangulated((corners - corners[0]) @ np.stack([x_axis, np.cross(normal, x_axis)], axis=1))


def triangulated(points: np.ndarray) -> np.ndarray:
    """Corners of the triangles, int (N - 2 or fewer, 3), of a simple polygon (N, 2)."""
    count = len(points)
    fan = np.column_stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)])
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    x, y = (points - points[0]).T
    sign = np.sign(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    if count > MAX_CORNERS or not (sign * turns < 0).any():
        return fan
    points, left, triangles = points * [1, sign], list(range(count)), []
    while len(left) > 3:
        ear = next((place for place in range(len(left)) if _is_ear(points, left, place)), None)
        if ear is None:  # the polygon crosses itself
            break
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    rest = [(left[0], left[place], left[place + 1]) for place in range(1, len(left) - 1)]
    return np.array(triangles + rest)


def _is_ear(points: np.ndarray, left: list[int], place: int) -> bool:
    """True if the triangle of a corner of the rest of a polygon, anticlockwise, and its neighbors is inside of it."""
    a, b, c = points[left[place - 1]], points[left[place]], points[left[(place + 1) % len(left)]]
    if _side(a, b, c) <= 0:
        return False
    rest = points[left]
    is_inside = (_side(a, b, rest) >= 0) & (_side(b, c, rest) >= 0) & (_side(c, a, rest) >= 0)
    is_corner = (rest == a).all(axis=1) | (rest == b).all(axis=1) | (rest == c).all(axis=1)
    return not (is_inside & ~is_corner).any()


def _side(a: np.ndarray, b: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Twice the signed area of a triangle: positive to the left of the line from a to b."""
    return (b[0] - a[0]) * (point[..., 1] - a[1]) - (b[1] - a[1]) * (point[..., 0] - a[0])
