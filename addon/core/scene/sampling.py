"""Interpolation of images between the centres of their texels.

Positions are in texels from the image's corner, so the centre of the first texel is at 0.5. Extensions have Blender's
names: EXTEND repeats the texels at the border, REPEAT and MIRROR repeat the image, CLIP is 0 outside.
"""

from __future__ import annotations

import numpy as np

# Distance from a center, in texels, within which a position is that center. Larger: values of neighbors get lost.
MAX_ROUNDING = 1e-6


def sample_positions(count: int) -> list[tuple[float, float]]:
    """Centers of the `count` x `count` equal parts of a texel, across and up, in texels."""
    centers = ((np.arange(count) + 0.5) / count).tolist()
    return [(across, up) for across in centers for up in centers]


def bilinear(
    values: np.ndarray, columns: np.ndarray, rows: np.ndarray, across: str = "EXTEND", along: str = "EXTEND"
) -> np.ndarray:
    """Values (N, C) of an image (H, W, C) at positions (N,); `across` and `along` extend its columns and rows."""
    if _are_centers(columns) and _are_centers(rows):  # as of a panorama in its image's frame, in a third of the time
        return nearest(values, columns, rows, across, along)
    sides = _neighbors(columns, values.shape[1], across)
    lines = (
        sum(values[row, column] * part[:, None] for column, part in sides) * weight[:, None]
        for row, weight in _neighbors(rows, values.shape[0], along)
    )
    return sum(lines)


def nearest(
    values: np.ndarray, columns: np.ndarray, rows: np.ndarray, across: str = "EXTEND", along: str = "EXTEND"
) -> np.ndarray:
    """Values (N, C) of the texels (H, W, C) that contain positions (N,); the extensions are those of `bilinear`."""
    column, row = np.floor(columns), np.floor(rows)
    inside = _is_inside(column, values.shape[1], across) & _is_inside(row, values.shape[0], along)
    return values[_index(row, values.shape[0], along), _index(column, values.shape[1], across)] * inside[:, None]


def resized(
    values: np.ndarray, height: int, width: int, extension: str = "EXTEND", is_smooth: bool = True
) -> np.ndarray:
    """An image (height, width, C) that looks as another one (H, W, C), by the nearest texels unless `is_smooth`."""
    for axis, count in enumerate((height, width)):
        known = values.shape[axis]
        if known == count:
            continue
        positions = (np.arange(count) + 0.5) * known / count
        if not is_smooth:
            values = np.take(values, _index(np.floor(positions), known, extension), axis)
            continue
        shape = (-1, 1, 1) if axis == 0 else (1, -1, 1)
        (lower, below), (upper, above) = _neighbors(positions, known, extension)
        # In place: images of the full size may have hundreds of megabytes.
        total = np.take(values, lower, axis)
        total *= below.astype(values.dtype).reshape(shape)
        rest = np.take(values, upper, axis)
        rest *= above.astype(values.dtype).reshape(shape)
        total += rest
        values = total
    return values


def _neighbors(positions: np.ndarray, count: int, extension: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Indices and weights of the two texels around each position along one axis of `count` texels."""
    first = np.floor(positions - 0.5)
    part = positions - 0.5 - first
    pairs = (first, 1 - part), (first + 1, part)
    return [
        (_index(texels, count, extension), weights * _is_inside(texels, count, extension)) for texels, weights in pairs
    ]


def _are_centers(positions: np.ndarray) -> bool:
    """True if all positions are centers of texels, but for rounding."""
    return bool((np.abs(positions - np.floor(positions) - 0.5) < MAX_ROUNDING).all())


def _is_inside(texels: np.ndarray, count: int, extension: str) -> np.ndarray:
    """True where the image has a value: everywhere unless it is clipped."""
    return (texels >= 0) & (texels < count) if extension == "CLIP" else np.ones(len(texels), bool)


def _index(texels: np.ndarray, count: int, extension: str) -> np.ndarray:
    """Indices of texels whose numbers may lie outside of the image."""
    if extension == "REPEAT":
        texels = np.mod(texels, count)
    elif extension == "MIRROR":
        texels = np.mod(texels, 2 * count)
        texels = np.minimum(texels, 2 * count - 1 - texels)
    return np.clip(texels, 0, count - 1).astype(int)
