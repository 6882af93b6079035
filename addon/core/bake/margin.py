"""Margin: extends baked texels beyond the border of their chart, so that texture filters read no unbaked texels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
STRAIGHT, DIAGONAL = ([step for step in NEIGHBOURS if (0 in step) == is_straight] for is_straight in (True, False))

WHOLE = 0.99
"""Coverage from which a texel counts as completely inside a chart; the rest is rounding."""

BORDER_RINGS = 2
"""Distance (texels) within which every texel that a straight edge cuts has a neighbour completely inside the chart."""


NO_ISLAND = np.iinfo(np.int32).max
"""Label of texels outside of all islands."""


def extend_margin(
    texture: np.ndarray, coverage: np.ndarray, margin: int, labels: np.ndarray | None = None
) -> np.ndarray:
    """Fill up to `margin` rings of texels around each island with the mean of their filled neighbours.

    A texel that the island's edge cuts holds only the light of its part inside. The rings therefore continue the texels
    completely inside, if there are any nearby. Where rings of two islands meet, each ends.

    Parameters
    ----------
    texture : float32 (H, W, C)
    coverage : (H, W), fraction of each texel inside the islands. Texels with a coverage above 0 stay as they are.
    margin : number of rings of texels, >= 0.
    labels : int32 (H, W), the island of each covered texel, below 0 elsewhere; None: all belong to the same.

    Returns
    -------
    float32 (H, W, C), a new array; texels beyond the margin stay as they are.
    """
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    result = texture.astype(np.float32)
    near = _around_charts(coverage, margin)
    result[near] = _extended(texture[near], coverage[near], margin, None if labels is None else labels[near])
    return result


def _around_charts(coverage: np.ndarray, margin: int) -> tuple[slice, slice]:
    """Rows and columns of all texels with a coverage, and of a margin around them; an image may have many surfaces."""
    lines = (np.flatnonzero((coverage > 0).any(axis=axis)) for axis in (1, 0))
    return tuple(slice(max(0, line[0] - margin), line[-1] + 1 + margin) if len(line) else slice(0) for line in lines)


def _extended(texture: np.ndarray, coverage: np.ndarray, margin: int, labels: np.ndarray | None) -> np.ndarray:
    baked, whole = coverage > 0, coverage > WHOLE
    baked_texels = baked[..., None]
    if labels is not None:
        labels = np.where(labels < 0, NO_ISLAND, labels)
    continued = texture
    if not np.array_equal(baked, whole):
        continued = np.where(baked_texels, add_rings(texture, whole, BORDER_RINGS, labels), texture)
    return np.where(baked_texels, texture, add_rings(continued, baked, margin, labels))


def part_in_shared(coverage: np.ndarray, before: np.ndarray, after: np.ndarray, margin: int) -> np.ndarray:
    """Bool (H, W): texels that a surface and its margin fill in an image that it shares with other surfaces.

    A texel belongs to the surface that covers most of it. Margins grow ring by ring from all surfaces at once, so they
    end where they meet. The parts of all surfaces are the same whichever of them is baked, and don't overlap.

    Parameters
    ----------
    coverage : (H, W), fraction of each texel inside the surface.
    before, after : the same of all surfaces that take, and that leave, a texel to which both have the same right.
    margin : number of rings of texels.
    """
    result = np.zeros(coverage.shape, bool)
    near = _around_charts(coverage, 2 * margin)  # rings of neighbours begin outside of the surface's own
    coverage, before, after = coverage[near], before[near], after[near]
    is_own = (coverage > before) & (coverage >= after) & (coverage > 0)
    is_before = ~is_own & (before > 0) & (before >= after)
    is_after = ~is_own & ~is_before & (after > 0)
    for _ in range(margin):
        is_free = ~(is_own | is_before | is_after)
        masks = is_before, is_own, is_after
        for steps in (STRAIGHT, DIAGONAL):
            rings = []
            for mask in masks:
                rings.append(is_free & _beside(mask, steps))
                is_free = is_free & ~rings[-1]
            is_before, is_own, is_after = is_before | rings[0], is_own | rings[1], is_after | rings[2]
    result[near] = is_own
    return result


def _beside(mask: np.ndarray, steps: Sequence[tuple[int, int]]) -> np.ndarray:
    """Bool (H, W): texels that are a step away from one of the mask."""
    padded, (height, width) = np.pad(mask, 1), mask.shape
    return np.any([padded[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + width] for dy, dx in steps], axis=0)


def add_rings(texture: np.ndarray, known: np.ndarray, count: int, labels: np.ndarray | None = None) -> np.ndarray:
    """A copy with `count` rings around the known texels filled; a texel with a label continues that island alone."""
    # A frame of unknown texels makes border checks unnecessary. Texels have numbers, row by row.
    result = np.pad(texture.astype(np.float32, copy=False), ((1, 1), (1, 1), (0, 0)))
    filled = np.pad(known, 1)
    height, width, channels = result.shape
    values, is_filled = result.reshape(-1, channels), filled.reshape(-1)
    label_of = None if labels is None else np.pad(labels, 1, constant_values=NO_ISLAND).reshape(-1)
    texels = np.flatnonzero(_touched(filled))
    is_inner = np.zeros((height, width), bool)
    is_inner[1:-1, 1:-1] = True
    for _ in range(count):
        if not len(texels):
            break
        chosen = None if label_of is None else _chosen(label_of, is_filled, texels, width)
        weight, total = np.zeros((len(texels), 1), np.float32), np.zeros((len(texels), channels), np.float32)
        for step in _numbers(NEIGHBOURS, width):
            beside = texels + step
            counts = is_filled[beside]
            if chosen is not None:
                counts &= label_of[beside] == chosen
            weight += counts[:, None]
            total += np.where(counts[:, None], values.take(beside, axis=0), np.float32(0))
        is_known = weight[:, 0] > 0
        found = texels[is_known]
        values[found] = total[is_known] / weight[is_known]
        is_filled[found] = True
        if chosen is not None:
            label_of[found] = chosen[is_known]
        texels = _around(is_filled, is_inner.reshape(-1), texels, width)
    return result[1:-1, 1:-1]


def _numbers(steps: Sequence[tuple[int, int]], width: int) -> list[int]:
    """Differences of the numbers of texels that are these steps apart."""
    return [dy * width + dx for dy, dx in steps]


def _chosen(label_of: np.ndarray, is_filled: np.ndarray, texels: np.ndarray, width: int) -> np.ndarray:
    """Label of the island that each texel continues: its own, else the lowest straight beside it, else diagonally."""
    chosen = label_of[texels]
    for steps in (STRAIGHT, DIAGONAL):
        lowest = np.full(len(texels), NO_ISLAND, np.int32)
        for step in _numbers(steps, width):
            beside = texels + step
            np.minimum(lowest, label_of[beside], out=lowest, where=is_filled[beside])
        np.copyto(chosen, lowest, where=chosen == NO_ISLAND)
    return chosen


def _touched(filled: np.ndarray) -> np.ndarray:
    """Unknown texels beside known ones, without the frame."""
    near = np.zeros_like(filled)
    near[1:-1, 1:-1] = _beside(filled, NEIGHBOURS)[1:-1, 1:-1]
    return near & ~filled


def _around(is_filled: np.ndarray, is_inner: np.ndarray, texels: np.ndarray, width: int) -> np.ndarray:
    """Numbers of the unknown texels beside the given ones, without the frame, in their order."""
    is_beside = np.zeros(len(is_filled), bool)  # faster than sorting the numbers
    for step in _numbers(NEIGHBOURS, width):
        is_beside[texels + step] = True
    return np.flatnonzero(is_beside & is_inner & ~is_filled)
