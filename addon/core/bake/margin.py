"""Extends baked texels beyond the border of their chart, so that filtering never meets unbaked texels."""

from __future__ import annotations

import numpy as np

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
# Coverage of a texel wholly inside a chart, but for rounding.
WHOLE = 0.99
# A straight edge leaves no texel inside the chart farther than this from one wholly inside it.
BORDER_RINGS = 2


def extend_margin(texture: np.ndarray, coverage: np.ndarray, margin: int) -> np.ndarray:
    """Fill up to `margin` rings of texels around a chart with the mean of their filled neighbours.

    A texel across the chart's edge holds the light of its part inside only, down to none: what the rings continue
    is what surrounds the texels wholly inside, where there are any nearby.

    Parameters
    ----------
    texture : float32 (H, W, C)
    coverage : (H, W), part of each texel inside the chart; where it is not 0, texels are kept as they are.
    margin : rings of texels, >= 0.

    Returns
    -------
    float32 (H, W, C), a new array; texels beyond the margin are those of `texture`.
    """
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    baked, whole = coverage > 0, coverage > WHOLE
    kept = baked[..., None]
    continued = texture
    if not np.array_equal(baked, whole):
        continued = np.where(kept, _add_rings(texture, whole, BORDER_RINGS), texture)
    return np.where(kept, texture, _add_rings(continued, baked, margin)).astype(np.float32, copy=False)


def _add_rings(texture: np.ndarray, known: np.ndarray, count: int) -> np.ndarray:
    """A copy with `count` rings around the known texels filled."""
    result, filled = texture.astype(np.float32, copy=True), known.copy()
    for _ in range(count):
        if filled.all() or not filled.any():
            break
        weight = _neighbour_sum(filled.astype(np.float32)[..., None])[..., 0]
        ring = (weight > 0) & ~filled
        total = _neighbour_sum(np.where(filled[..., None], result, 0))
        result[ring] = total[ring] / weight[ring, None]
        filled |= ring
    return result


def _neighbour_sum(values: np.ndarray) -> np.ndarray:
    """Sum over the eight neighbours of each texel, those outside the texture counting 0."""
    height, width = values.shape[:2]
    padded = np.pad(values, ((1, 1), (1, 1), (0, 0)))
    return sum(padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width] for dy, dx in NEIGHBOURS)
