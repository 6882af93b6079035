"""Chart of a part that bends: its texels in a texture."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..native import native
from .bent_grid import BentGrid
from .bent_part import BentPart
from .chart import EDGE_TOLERANCE, Chart, ChartIsland
from .tiles import Place


def bent_chart(
    part: BentPart, places: Mapping[int, Place], owner: str = "", is_tiled: bool = False
) -> tuple[Chart, np.ndarray]:
    """The chart of a part of the object `owner`, and the coverage of its texels by all faces, above 1 for overlaps.

    Parameters
    ----------
    places : texels of each UDIM tile in the texture, by its number.
    is_tiled : True if the texture consists of tiles.
    """
    texels, ends = [], []
    for island in part.islands:
        column, row, width, height = places[island.tile][:4]
        texels.append(np.clip(island.polygons.uvs, 0, 1) * (width, height) + (column, row))
        ends.append((column + width, row + height))
    texels, end = np.concatenate(texels), np.ceil(np.max(ends, axis=0))
    first = np.clip(np.floor(texels.min(axis=0) + EDGE_TOLERANCE), 0, end - 1).astype(int)
    last = np.clip(np.ceil(texels.max(axis=0) - EDGE_TOLERANCE), first + 1, end).astype(int)
    polygons, shading = [island.polygons for island in part.islands], None
    if polygons[0].corner_normals is not None:
        shading = np.ascontiguousarray(np.concatenate([item.corner_normals for item in polygons]), np.float32)
    positions = np.ascontiguousarray(np.concatenate([item.corners for item in polygons]), float)
    columns, rows = (last - first).tolist()
    shown = native.bent_texels(np.ascontiguousarray(texels - first, float), positions, shading, columns, rows)
    vectors = (shown[name] for name in ("positions", "steps_x", "steps_y", "normals", "tangents"))
    coverage = np.minimum(shown["covered"], 1)
    grid = BentGrid(*vectors, shown["areas"], coverage, owner=owner, bending=part.bending)
    tiles = tuple(sorted(places.values(), key=lambda place: place.row)) if is_tiled else ()
    pieces = _pieces(part, shown["triangles"])
    island = ChartIsland(grid.coverage, tuple(first.tolist()), places=tiles, pieces=pieces)
    return Chart(grid, (island,)), shown["covered"]


def _pieces(part: BentPart, triangles: np.ndarray) -> np.ndarray | None:
    """`pieces` of a `ChartIsland`, from the triangle that each texel shows, -1 for none."""
    numbers, count = [], 0
    for island in part.islands:
        numbers.append(island.pieces + count)
        count += int(island.pieces.max()) + 1
    return None if count == 1 else np.append(np.concatenate(numbers), -1)[triangles].astype(np.int32)
