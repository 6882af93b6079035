"""A UV map for any mesh: islands cut where faces bend, at one texel density, packed into one image without overlaps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..native import native
from .planes import COPLANAR_COSINE, NO_AREA_BESIDE, SMOOTH_COSINE
from .polygons import Polygons, components, same_faces

# Space around each island, over the side of the image: 8 texels at 1024 on each side, and the least of it where there
# are many islands. More: less color of other islands in the mipmaps of distant surfaces, and fewer texels.
SPACE, MIN_SPACE = 8 / 1024, 4 / 1024

# Part of the side of the image that spaces around islands take about, on one side of each; more islands have MIN_SPACE.
SPACES = 0.05

# Number of edges of an island, the longest, along which its rectangle is tried. More pack islands tighter.
MAX_DIRECTIONS = 16

# Texels per face along the side of a picture of an island, the least and most of them along the side, and part of the
# island that may overlap. More texels find smaller overlaps.
TEXELS_PER_FACE, PROBE_SIDES, MAX_OVERLAP = 8, (32, 1024), 0.002

# Relative difference, and digits of numbers around 1, within which lengths count as equal: those of one shape in
# different versions of Blender differ by rounding.
SAME, SAME_DIGITS = 1e-4, 4

# Number of rounds in which the side of the image and the space around islands find each other.
ROUNDS = 4


def unwrap(polygons: Polygons) -> np.ndarray:
    """UVs of all corners, float64 (K, 2), 0 to 1.

    Flat parts keep their shape. Bent ones are cut into islands whose faces look the same way, and projected. Faces that
    show no light, without area or with corners at no finite position, are all at (0, 0).
    """
    return unwrap_together([polygons])[0]


def unwrap_together(meshes: Sequence[Polygons]) -> list[np.ndarray]:
    """UVs of all corners of each mesh as of `unwrap`; all meshes lie side by side in one square, at one density."""
    shown = [_has_light(polygons) for polygons in meshes]
    laid = [_laid_out(polygons.of_faces(np.flatnonzero(is_shown))) for polygons, is_shown in zip(meshes, shown)]
    sizes_of_all = np.concatenate([sizes for _, _, sizes, _ in laid])
    if not len(sizes_of_all):
        return [np.zeros((len(polygons.corners), 2)) for polygons in meshes]
    offsets, side = _packed(sizes_of_all, np.concatenate([places for *_, places in laid]))
    result, first = [], 0
    for polygons, is_shown, (positions, labels, sizes, _) in zip(meshes, shown, laid):
        uvs = np.zeros((len(polygons.corners), 2))
        uvs[is_shown[polygons.face_of]] = (positions + offsets[first + labels]) / side
        result.append(uvs)
        first += len(sizes)
    return result


def _has_light(polygons: Polygons) -> np.ndarray:
    """Bool (N,): faces that have an area, beside the largest."""
    is_shown = polygons.is_finite.copy()
    areas = polygons.of_faces(np.flatnonzero(is_shown)).areas
    is_shown[is_shown] = areas > NO_AREA_BESIDE * areas.max(initial=0.0)
    return is_shown


def _laid_out(polygons: Polygons) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions (K, 2) of all corners in their islands, each corner's island, and the islands' sizes (M, 2) and places.

    Places (M, 6) are the middle of an island in the world, and the direction that it looks in.
    """
    if not polygons.count:
        return np.zeros((0, 2)), np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 6))
    labels = _islands(polygons)
    order = np.argsort(labels, kind="stable")
    waiting = np.split(order, np.cumsum(np.bincount(labels))[:-1])[::-1]
    positions, sizes, places = np.zeros((len(polygons.corners), 2)), [], []
    corners_of = np.split(np.arange(len(polygons.corners)), polygons.starts[1:-1])
    while waiting:
        faces = waiting.pop()
        corners = np.concatenate([corners_of[face] for face in faces])
        flat = _laid_flat(polygons, faces, corners)
        if len(faces) > 1 and _overlaps(flat, polygons.sizes[faces]):
            waiting += np.split(faces, len(faces))
            continue
        labels[faces] = len(sizes)
        positions[corners] = flat
        sizes.append(flat.max(axis=0))
        points, normal = polygons.corners[corners], polygons.area_vectors[faces].sum(axis=0)
        length = max(float(np.linalg.norm(normal)), 1e-300)
        places.append([*(points.min(axis=0) + points.max(axis=0)) / 2, *normal / length])
    return positions, labels[polygons.face_of], np.array(sizes), np.array(places)


def _overlaps(flat: np.ndarray, counts: np.ndarray) -> bool:
    """True if faces of an island, of `counts` corners each, lie on each other."""
    side = int(np.clip(TEXELS_PER_FACE * np.sqrt(len(counts)), *PROBE_SIDES))
    texels = np.ascontiguousarray(flat * (side / np.maximum(flat.max(axis=0), 1e-300)))
    first = np.repeat(np.cumsum(counts) - counts, counts)
    x, y = (texels - texels[first]).T
    following = np.arange(1, len(flat) + 1)
    following[np.cumsum(counts) - 1] = np.cumsum(counts) - counts
    total = 0.5 * np.abs(np.add.reduceat(x * y[following] - y * x[following], np.cumsum(counts) - counts)).sum()
    return native.coverage(texels, counts.astype(np.uint32), side, side).sum(dtype=float) < (1 - MAX_OVERLAP) * total


def _islands(polygons: Polygons) -> np.ndarray:
    """Number of the island of each face, int (N,): faces that join smoothly and look along the same axis."""
    normals = polygons.area_vectors / np.maximum(polygons.areas, 1e-300)[:, None]
    faces = polygons.face_of
    first, second = (faces[corners] for corners in polygons.shared_edges)
    cosines = np.einsum("ij,ij->i", normals[first], normals[second])
    # Parts that are flat look along one axis as a whole.
    layers = _layers(polygons, normals)
    is_beside = layers[first] == layers[second]
    is_flat = is_beside & (cosines > COPLANAR_COSINE)
    flat = components(polygons.count, first[is_flat], second[is_flat])
    means = np.stack([np.bincount(flat, polygons.area_vectors[:, axis]) for axis in range(3)], axis=1)[flat]
    axis = np.abs(means).argmax(axis=1)
    looks = 2 * axis + (np.take_along_axis(means, axis[:, None], 1)[:, 0] > 0)
    is_joined = is_flat | (is_beside & (cosines > SMOOTH_COSINE) & (looks[first] == looks[second]))
    return components(polygons.count, first[is_joined], second[is_joined])


def _layers(polygons: Polygons, normals: np.ndarray) -> np.ndarray:
    """Number of faces before each one that have the same corners and look the same way, int (N,)."""
    sides = np.take_along_axis(normals, np.abs(normals).argmax(axis=1)[:, None], 1)[:, 0] > 0
    same = np.unique(np.stack([same_faces(polygons), sides]), axis=1, return_inverse=True)[1].ravel()
    order = np.argsort(same, kind="stable")
    counts = np.bincount(same)
    layers = np.empty(polygons.count, int)
    layers[order] = np.arange(polygons.count) - np.repeat(np.cumsum(counts) - counts, counts)
    return layers


def _laid_flat(polygons: Polygons, faces: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Positions (C, 2) of an island's corners, projected along its mean normal, in the smallest rectangle from 0."""
    normal = polygons.area_vectors[faces].sum(axis=0)
    length = np.linalg.norm(normal)
    normal = normal / length if length > 0 else np.array([0.0, 0.0, 1.0])
    x_axis = np.cross(normal, np.eye(3)[np.abs(normal).round(SAME_DIGITS).argmin()])
    x_axis /= np.linalg.norm(x_axis)
    points = polygons.corners[corners] @ np.stack([x_axis, np.cross(normal, x_axis)], axis=1)
    edges = polygons.corners[polygons.next_corners[corners]] - polygons.corners[corners]
    edges = edges @ np.stack([x_axis, np.cross(normal, x_axis)], axis=1)
    lengths = np.linalg.norm(edges, axis=1)
    longest = np.argsort(-lengths, kind="stable")[:MAX_DIRECTIONS]
    # Edges of corners at the same place have no direction.
    longest = longest[lengths[longest] > 1e-3 * lengths.max()]
    directions = edges[longest] / lengths[longest][:, None]
    # Equal rectangles are ranked by their angle, so that maps don't depend on the order of edges.
    angles = (np.arctan2(directions[:, 1], directions[:, 0]) % (2 * np.pi)).round(SAME_DIGITS)
    directions = directions[np.argsort(angles % round(2 * np.pi, SAME_DIGITS), kind="stable")]
    best, smallest = points, np.inf
    for direction in directions:
        turned = _turned(points, *direction)
        area = np.ptp(turned, axis=0).prod()
        if area < smallest * (1 - SAME):
            best, smallest = turned, area
    if np.ptp(best[:, 0]) < np.ptp(best[:, 1]) * (1 - SAME):
        best = _turned(best, 0.0, 1.0)
    return best - best.min(axis=0)


def _turned(points: np.ndarray, cosine: float, sine: float) -> np.ndarray:
    """Points in a frame whose x axis has this direction."""
    return points @ np.array([(cosine, -sine), (sine, cosine)])


def _packed(sizes: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, float]:
    """Offsets (M, 2) of rectangles (M, 2) that don't overlap, and the side of the square around them.

    Rectangles stand in rows, the highest first; the places of their islands (M, 6) sort those of one size.
    """
    middles, normals = np.split(places, 2, axis=1)
    extent = max(float(np.ptp(middles, axis=0).max()), float(sizes.max()), 1e-30)
    keys = np.column_stack([-sizes[:, ::-1] / extent, middles / extent, normals])
    order = np.lexsort(keys.round(SAME_DIGITS).T[::-1])
    least = float(np.clip(SPACES / np.sqrt(len(sizes)), MIN_SPACE, SPACE))
    side = max(float(np.sqrt((sizes[:, 0] * sizes[:, 1]).sum())), float(sizes.max()), 1e-30)
    best = None
    for stretch in (1.0, 1.05, 1.1, 1.2, 1.35, 1.5):
        width = stretch * side
        for _ in range(ROUNDS):
            space = least * width
            offsets, extent = _in_rows(sizes + 2 * space, order, width)
            width = max(extent, width * (1.0 if extent <= width else 0.0))
        if best is None or width < best[1]:
            best = offsets + space, width
    return best


def _in_rows(sizes: np.ndarray, order: np.ndarray, width: float) -> tuple[np.ndarray, float]:
    """Offsets of rectangles in rows of at most this width, and the side of the square that they need."""
    offsets = np.zeros(sizes.shape)
    x = y = height = widest = 0.0
    for number in order.tolist():
        across, up = sizes[number]
        if x > 0 and x + across > width:
            x, y, height = 0.0, y + height, 0.0
        offsets[number] = x, y
        x, height = x + across, max(height, up)
        widest = max(widest, x)
    return offsets, max(widest, y + height)
