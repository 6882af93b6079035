"""From light on the grids of planes to the texture: rims of planes, islands, margins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..material import Material
from ..scene.bent_grid import BentGrid
from ..scene.chart import Chart
from ..scene.flat_mesh import FlatMesh
from ..scene.receiver import Receiver
from ..scene.sampling import bilinear
from ..scene.seams import find_seams
from .bake_settings import ADJACENT_FACES, COMBINED, BakeSettings
from .margin import BORDER_RINGS, WHOLE, add_rings, fill_margin


def finished_texture(
    receiver: Receiver, values: Sequence[np.ndarray], material: Material, settings: BakeSettings
) -> np.ndarray:
    """Texture, float32 (height, width, 3), with margin, of the charts' grid values (grid height, grid width, 3)."""
    if settings.layer == COMBINED:
        has_seams, pairs = receiver.seams is not None, zip(values, receiver.charts)
        values = [_with_rims(on_grid, chart, material, has_seams) for on_grid, chart in pairs]
    texture = receiver.to_texture(values)
    fill_margin(texture, receiver.coverage, settings.margin, receiver.labels())
    return texture if receiver.seams is None else from_adjacent_faces(texture, receiver, values, settings.margin)


def with_seams(receiver: Receiver, mesh: FlatMesh, settings: BakeSettings) -> Receiver:
    """The receiver of a mesh with the seams that the margin of these settings needs."""
    if settings.margin_type != ADJACENT_FACES or mesh.is_bent:
        return receiver  # the margins of faces that bend continue their islands
    return replace(receiver, seams=find_seams(mesh, receiver.charts, receiver.width, receiver.height))


def from_adjacent_faces(
    texture: np.ndarray, receiver: Receiver, values: Sequence[np.ndarray], margin: int
) -> np.ndarray:
    """The texture with the light beyond seams at texels of the margin, from the charts' grid values.

    Texels beyond an edge without another face, and farther from it than that face reaches, stay as they are.
    """
    rows, columns, edges = _nearest_edges(receiver, margin)
    seams = receiver.seams
    texels = np.stack([columns + 0.5, rows + 0.5, np.ones(len(rows))], axis=1)
    positions = np.einsum("nij,nj->ni", seams.to_grid[edges], texels)
    result, beyond = texture.copy(), seams.charts[edges]
    order = np.argsort(beyond, kind="stable")
    bounds = np.searchsorted(beyond[order], np.arange(len(receiver.charts) + 1))
    for number, (chart, on_grid) in enumerate(zip(receiver.charts, values)):
        chosen = order[bounds[number] : bounds[number + 1]]
        x, y = positions[chosen].T
        is_there = (x >= 0) & (y >= 0) & (x < chart.grid.width) & (y < chart.grid.height)
        chosen, x, y = chosen[is_there], x[is_there], y[is_there]
        is_there = chart.grid.coverage[y.astype(int), x.astype(int)] > 0
        chosen, x, y = chosen[is_there], x[is_there], y[is_there]
        result[rows[chosen], columns[chosen]] = bilinear(on_grid, x, y)
    return result


def _nearest_edges(receiver: Receiver, margin: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns of all texels within `margin` texels around islands, and the nearest edge of each."""
    inside, ends = receiver.inside(), receiver.seams.ends
    shortest, nearest = np.full(inside.shape, margin, np.float32), np.full(inside.shape, -1, np.int32)
    size = np.array([receiver.width, receiver.height])
    lows = np.clip(np.floor(ends.min(axis=1)) - margin, 0, size).astype(int)
    highs = np.clip(np.ceil(ends.max(axis=1)) + margin, 0, size).astype(int)
    for edge, (begin, end) in enumerate(ends):
        (left, bottom), (right, top) = lows[edge], highs[edge]
        part = slice(bottom, top), slice(left, right)
        rows, columns = np.nonzero(~inside[part])
        x, y = columns + (left + 0.5 - begin[0]), rows + (bottom + 0.5 - begin[1])
        dx, dy = end - begin
        along = np.clip((x * dx + y * dy) / max(dx * dx + dy * dy, 1e-30), 0, 1)
        distance = np.hypot(x - along * dx, y - along * dy).astype(np.float32)
        is_nearer = distance < shortest[part][rows, columns]
        rows, columns = rows[is_nearer], columns[is_nearer]
        shortest[part][rows, columns], nearest[part][rows, columns] = distance[is_nearer], edge
    rows, columns = np.nonzero(nearest >= 0)
    return rows, columns, nearest[rows, columns]


def _with_rims(values: np.ndarray, chart: Chart, material: Material, has_seams: bool) -> np.ndarray:
    if isinstance(chart.grid, BentGrid):
        return values  # light arrives on the part of each texel that the mesh covers
    grid, channels = chart.grid, zip(material.mean_free_path, material.channel_anisotropy)
    pitch = math.sqrt(grid.pitch_x * grid.pitch_y)
    paths = [path / (1 - min(forward, 0.999)) / pitch for path, forward in channels]
    lit = lit_rims(values, grid.coverage, paths)
    if lit is values or not (has_seams or any(island.texel_to_grid is not None for island in chart.islands)):
        return lit
    # Seams, and islands of another density, sample the grid up to a texel outside.
    is_inside = grid.coverage > 0
    return np.where(is_inside[..., None], lit, add_rings(lit, is_inside, BORDER_RINGS))


def lit_rims(values: np.ndarray, coverage: np.ndarray, transport_paths: Sequence[float]) -> np.ndarray:
    """Luminance of a plane's grid as its own at texels that the plane's edge cuts.

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
    return result
