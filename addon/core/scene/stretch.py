"""Stretch of texels: the solver for meshes that bend divides long ones, and joins narrow ones (bent_samples.cpp)."""

from __future__ import annotations

import numpy as np

from .polygons import Polygons

MAX_STRETCH, MAX_PIECES, MAX_CUT_PIECES = 1.3, 64, 8
"""Length over width of a texel from which it is divided, and into how many pieces at most, also where the end of an
island cuts it; as native/bake has them."""


def pieces_of_texels(
    steps_x: np.ndarray, steps_y: np.ndarray, areas: np.ndarray, coverage: np.ndarray, finer: float = 1.0
) -> float:
    """Mean number of samples of the texels whose area is not 0, by their steps (..., 3) along columns and rows.

    `finer`: times as many texels along each side are baked; so many times fewer of them lie at the end of an island.
    """
    shown = areas > 0
    metric = [
        np.einsum("nc,nc->n", first[shown], second[shown], dtype=float)
        for first, second in ((steps_x, steps_x), (steps_y, steps_y), (steps_x, steps_y))
    ]
    if not shown.any():
        return 1.0
    is_cut = coverage[shown] < 1
    joined = np.where(is_cut, 1, _joined(*metric[:2], np.mean(areas[shown])))
    pieces = _pieces(metric[0] * joined**2, metric[1], metric[2] * joined) / joined
    pieces = np.minimum(pieces, np.where(is_cut, MAX_CUT_PIECES, MAX_PIECES))
    return float(np.average(pieces, weights=np.where(is_cut, 1 / finer, 1.0)))


def pieces_of_faces(polygons: Polygons) -> float:
    """The same of the texels that show some faces in an image whose sides are as `lengths_of_faces`; 1 without UVs."""
    steps = _steps(polygons)
    if steps is None:
        return 1.0
    lengths = lengths_of_faces(polygons)
    along_u, along_v = (step / length for step, length in zip(steps[:2], lengths))
    x, y, xy = [np.einsum("nc,nc->n", a, b) for a, b in ((along_u, along_u), (along_v, along_v), (along_u, along_v))]
    joined = _joined(x, y, np.average(np.sqrt(np.maximum(x * y - xy**2, 0)), weights=steps[2]))
    return float(np.average(_pieces(x * joined**2, y, xy * joined) / joined, weights=steps[2]))


def lengths_of_faces(polygons: Polygons) -> tuple[float, float]:
    """Lengths of the image's sides on some faces, root mean square over their area in it; 1 and 1 without UVs."""
    steps = _steps(polygons)
    if steps is None:
        return 1.0, 1.0
    along, up = (float(np.sqrt(np.average((step**2).sum(axis=1), weights=steps[2]))) for step in steps[:2])
    return along, up


def _steps(polygons: Polygons) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Steps of the surface along u and v (N, 3), by the first three corners of faces, and areas in the map (N,)."""
    if polygons.uvs is None or not polygons.count:
        return None
    first = polygons.starts[:-1]
    sides = [polygons.corners[first + n] - polygons.corners[first] for n in (1, 2)]
    (u_1, v_1), (u_2, v_2) = ((polygons.uvs[first + n] - polygons.uvs[first]).T for n in (1, 2))
    area = u_1 * v_2 - u_2 * v_1
    weights = np.nan_to_num(polygons.uv_areas) * (area != 0)
    if not 0 < weights.sum() < np.inf:
        return None
    shown = weights > 0
    along_u = (sides[0] * v_2[:, None] - sides[1] * v_1[:, None])[shown] / area[shown, None]
    along_v = (sides[1] * u_1[:, None] - sides[0] * u_2[:, None])[shown] / area[shown, None]
    return along_u, along_v, weights[shown]


def _joined(x: np.ndarray, y: np.ndarray, area: float) -> np.ndarray:
    """Numbers of texels of a row that share samples, by the squares of their steps and the mean area."""
    return np.maximum(np.floor(np.sqrt(np.minimum(y, area) / np.maximum(x, 1e-300))), 1.0)


def _pieces(x: np.ndarray, y: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """Numbers of pieces of texels by the products of their steps: x with x, y with y, and x with y."""
    mean, half = (x + y) / 2, np.hypot((x - y) / 2, xy)
    stretch = np.sqrt((mean + half) / np.maximum(mean - half, 1e-12 * np.maximum(mean, 1e-300)))
    return np.where(stretch > MAX_STRETCH, np.minimum(np.ceil(stretch / MAX_STRETCH), MAX_PIECES), 1.0)
