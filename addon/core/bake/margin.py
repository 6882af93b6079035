"""Margin: extends baked texels beyond the border of their chart, so that texture filters read no unbaked texels."""

from __future__ import annotations

import numpy as np

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]

WHOLE = 0.99
"""Coverage from which a texel counts as completely inside a chart; the rest is rounding."""

BORDER_RINGS = 2
"""Distance (texels) within which every texel that a straight edge cuts has a neighbour completely inside the chart."""


def extend_margin(texture: np.ndarray, coverage: np.ndarray, margin: int) -> np.ndarray:
    """Fill up to `margin` rings of texels around a chart with the mean of their filled neighbours.

    A texel that the chart's edge cuts holds only the light of its part inside. The rings therefore continue the texels
    completely inside, if there are any nearby.

    Parameters
    ----------
    texture : float32 (H, W, C)
    coverage : (H, W), fraction of each texel inside the chart. Texels with a coverage above 0 stay as they are.
    margin : number of rings of texels, >= 0.

    Returns
    -------
    float32 (H, W, C), a new array; texels beyond the margin stay as they are.
    """
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    baked, whole = coverage > 0, coverage > WHOLE
    baked_texels = baked[..., None]
    continued = texture
    if not np.array_equal(baked, whole):
        continued = np.where(baked_texels, _add_rings(texture, whole, BORDER_RINGS), texture)
    return np.where(baked_texels, texture, _add_rings(continued, baked, margin)).astype(np.float32, copy=False)


def _add_rings(texture: np.ndarray, known: np.ndarray, count: int) -> np.ndarray:
    """A copy with `count` rings around the known texels filled."""
    # A frame of unknown texels makes border checks unnecessary.
    result = np.pad(texture.astype(np.float32, copy=False), ((1, 1), (1, 1), (0, 0)))
    filled = np.pad(known, 1)
    rows, columns = np.nonzero(_touched(filled))
    for _ in range(count):
        if not len(rows):
            break
        weight, total = np.zeros((len(rows), 1), np.float32), np.zeros((len(rows), result.shape[2]), np.float32)
        for dy, dx in NEIGHBOURS:
            counts = filled[rows + dy, columns + dx, None]
            weight += counts
            total += np.where(counts, result[rows + dy, columns + dx], 0)
        result[rows, columns] = total / weight
        filled[rows, columns] = True
        rows, columns = _around(filled, rows, columns)
    return result[1:-1, 1:-1]


def _touched(filled: np.ndarray) -> np.ndarray:
    """Unknown texels beside known ones, without the frame."""
    height, width = filled.shape[0] - 2, filled.shape[1] - 2
    near = np.zeros_like(filled)
    for dy, dx in NEIGHBOURS:
        near[1:-1, 1:-1] |= filled[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width]
    return near & ~filled


def _around(filled: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The unknown texels beside the given ones, without the frame."""
    height, width = filled.shape
    numbers = np.unique(np.concatenate([(rows + dy) * width + columns + dx for dy, dx in NEIGHBOURS]))
    rows, columns = np.divmod(numbers, width)
    inside = (rows > 0) & (rows < height - 1) & (columns > 0) & (columns < width - 1)
    wanted = inside & ~filled[rows, columns]
    return rows[wanted], columns[wanted]
