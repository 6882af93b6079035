"""From light on the grids of planes to the texture: rims of planes, islands, margins."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..material import Material
from ..scene.grid import Grid
from ..scene.receiver import Receiver
from .bake_settings import COMBINED, BakeSettings
from .margin import BORDER_RINGS, WHOLE, add_rings, extend_margin


def finished_texture(
    receiver: Receiver, values: Sequence[np.ndarray], material: Material, settings: BakeSettings
) -> np.ndarray:
    """Texture, float32 (height, width, 3), with margin, of the charts' grid values (grid height, grid width, 3)."""
    if settings.layer == COMBINED:
        values = [_with_rims(on_grid, chart.grid, material) for on_grid, chart in zip(values, receiver.charts)]
    texture = receiver.to_texture(values)
    return extend_margin(texture, receiver.coverage, settings.margin, receiver.labels())


def _with_rims(values: np.ndarray, grid: Grid, material: Material) -> np.ndarray:
    pitch = math.sqrt(grid.pitch_x * grid.pitch_y)
    channels = zip(material.mean_free_path, material.channel_anisotropy)
    return lit_rims(values, grid.coverage, [path / (1 - min(forward, 0.999)) / pitch for path, forward in channels])


def lit_rims(values: np.ndarray, coverage: np.ndarray, transport_paths: Sequence[float]) -> np.ndarray:
    """Luminance of a plane's grid as its own at texels that the plane's edge cuts, and just beyond.

    Light arrives on the part c of such a texel, and the luminance that was solved is the mean L over the whole texel,
    so that rims are dark. Let A be the luminance of the texels beside it. That of the part inside is A, at most L / c,
    where the medium spreads light over much less than the rest of the texel, and L + (A - L) (1 - c) / 2 where it
    spreads light over many texels: L is the luminance at the texel's center, (1 - c) / 2 texels from that of the part.
    Between both, (1 - c) / (1 - c + transport mean free path) has mean errors of 2 % of the brightest texel
    (tests/unit/test_finish.py).

    Parameters
    ----------
    values : float32 (H, W, C)
    coverage : float32 (H, W)
    transport_paths : transport mean free path of each channel, texels.
    """
    is_whole, is_inside = coverage > WHOLE, coverage > 0
    if is_whole.all() or not is_whole.any():
        return values
    beside = add_rings(values, is_whole, BORDER_RINGS)
    rows, columns = np.nonzero(is_inside & ~is_whole)
    part, solved = coverage[rows, columns, None], values[rows, columns]
    rest = 1 - part
    local = rest / (rest + np.asarray(transport_paths, np.float32))
    inside = solved + (beside[rows, columns] - solved) * (local + (1 - local) * rest / 2)
    result = values.copy()
    result[rows, columns] = np.minimum(np.maximum(inside, solved), np.maximum(solved, solved / part))
    # Islands of another density sample the grid up to a texel outside.
    return np.where(is_inside[..., None], result, add_rings(result, is_inside, BORDER_RINGS))
