"""Extends baked texels beyond the border of their chart, so that filtering never meets unbaked texels."""

from __future__ import annotations

import numpy as np

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]


def extend_margin(texture: np.ndarray, baked: np.ndarray, margin: int) -> np.ndarray:
    """Fill up to `margin` rings of texels around the baked ones with the mean of their filled neighbours.

    Parameters
    ----------
    texture : float32 (H, W, C)
    baked : bool (H, W), texels to keep as they are.
    margin : rings of texels, >= 0.

    Returns
    -------
    float32 (H, W, C), a new array; texels beyond the margin are those of `texture`.
    """
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    result, filled = texture.astype(np.float32, copy=True), baked.copy()
    for _ in range(margin):
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
