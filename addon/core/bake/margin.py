"""Margin: extends baked texels beyond the border of their chart, so that texture filters read no unbaked texels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..native import native

NEIGHBOURS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
STRAIGHT, DIAGONAL = ([step for step in NEIGHBOURS if (0 in step) == is_straight] for is_straight in (True, False))

WHOLE = 0.99
"""Coverage from which a texel counts as completely inside a chart; the rest is rounding."""

BORDER_RINGS = 2
"""Distance (texels) within which every texel that a straight edge cuts has a neighbour completely inside the chart."""


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
    result = texture.astype(np.float32)
    fill_margin(result, coverage, margin, labels)
    return result


def fill_margin(texture: np.ndarray, coverage: np.ndarray, margin: int, labels: np.ndarray | None = None) -> None:
    """`extend_margin` of a float32 texture in place."""
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    rows, columns = _around_charts(coverage, margin)
    # Whole rows need no copy.
    near = rows, columns if 2 * (columns.stop - (columns.start or 0)) < texture.shape[1] else slice(None)
    part = np.ascontiguousarray(texture[near])
    inside = np.ascontiguousarray(coverage[near], np.float32)
    islands = None if labels is None else np.ascontiguousarray(labels[near], np.int32)
    native.fill_margin(part, inside, margin, WHOLE, BORDER_RINGS, islands)
    if not np.may_share_memory(part, texture):
        texture[near] = part


def _around_charts(coverage: np.ndarray, margin: int) -> tuple[slice, slice]:
    """Rows and columns of all texels with a coverage, and of a margin around them; an image may have many surfaces."""
    is_covered = coverage > 0
    lines = (np.flatnonzero(is_covered.any(axis=axis)) for axis in (1, 0))
    return tuple(slice(max(0, line[0] - margin), line[-1] + 1 + margin) if len(line) else slice(0) for line in lines)


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


def add_rings(texture: np.ndarray, known: np.ndarray, count: int) -> np.ndarray:
    """A copy with `count` rings around the known texels filled, each with the mean of its known neighbours."""
    result = np.array(texture, np.float32, order="C")
    native.fill_rings(result, np.ascontiguousarray(known), count)
    return result
