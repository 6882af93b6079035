"""Charts: planes of a receiver, or its faces that bend, with their islands in a texture.

If a chart has one island, and its axes p_u and p_v are orthogonal, the chart's grid consists of the texture's texels.
Otherwise it is a rectangular grid of the finest density, which the texels of each island sample bilinearly. The grid of
faces that bend always consists of the texture's texels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .bent_grid import AnyGrid, BentGrid
from .sampling import bilinear
from .tiles import Place

if TYPE_CHECKING:
    from .receiver import Receiver

# Overlap with an island, in texels, below which texels at its border are not part of it: rounding of float32 UVs.
EDGE_TOLERANCE = 1e-3


def in_chart(coverage: np.ndarray) -> np.ndarray:
    """True for texels that belong to a chart: those with any coverage."""
    return coverage > 0


@dataclass(frozen=True, eq=False)
class ChartIsland:
    """The texels of a texture that show a part of a chart.

    Attributes
    ----------
    coverage : float32 (rows, columns), fraction inside the island of each texel of the texture's part around it.
    offset : (column, row) of that part's first texel in the texture.
    texel_to_grid : (2, 3), maps (column, row, 1) in the texture to grid coordinates, both in texels with centres at
        half-integers; None if the grid consists of the part's texels.
    places : texels of the UDIM tiles that it lies in, from the bottom up; () if the texture is one image.
    pieces : int32 (rows, columns), number of the piece of the UV map that each texel shows, -1 for none; None: all show
        the same.
    """

    coverage: np.ndarray
    offset: tuple[int, int]
    texel_to_grid: np.ndarray | None = None
    places: tuple[Place, ...] = ()
    pieces: np.ndarray | None = None

    def part_of(self, texture: np.ndarray) -> np.ndarray:
        """View of the texture's part around the island."""
        (column, row), (rows, columns) = self.offset, self.coverage.shape
        return texture[row : row + rows, column : column + columns]

    def to_texels(self, positions: np.ndarray) -> np.ndarray:
        """Columns and rows (..., 2) in the texture of positions (..., 2) on the grid."""
        if self.texel_to_grid is None:
            return positions + self.offset
        matrix, shift = self.texel_to_grid[:, :2], self.texel_to_grid[:, 2]
        return (positions - shift) @ np.linalg.inv(matrix).T

    def uvs(self, texels: np.ndarray, width: int, height: int) -> np.ndarray:
        """UVs (..., 2) at columns and rows (..., 2) of a texture of this size."""
        places = np.array(self.places or [Place(0, 0, width, height)])
        tile = np.clip(np.searchsorted(places[:, 1], texels[..., 1], "right") - 1, 0, None) if len(places) > 1 else 0
        first, size, corner = places[tile, :2], places[tile, 2:4], places[tile, 4:]
        return (texels - first) / size + corner

    def sampled(self, values: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Values (N, C) at the texels that `inside` (rows, columns) chooses, from those of the grid (H, W, C)."""
        if self.texel_to_grid is None:
            return values[inside]
        rows, columns = np.nonzero(inside)
        centres = columns + self.offset[0] + 0.5, rows + self.offset[1] + 0.5, np.ones(len(rows))
        return bilinear(values, *(self.texel_to_grid @ np.stack(centres)))


@dataclass(frozen=True, eq=False)
class Chart:
    """Part of a receiver: one that is flat, or all of one that bends.

    Attributes
    ----------
    grid : the grid on which light arrives.
    islands : the texels that show it.
    labels : int32 (grid height, grid width), the island of each texel of the grid; None if there is one.
    coarser : factor by which texels of the grid are longer than the finest of the islands; 1 if none is finer.
    """

    grid: AnyGrid
    islands: tuple[ChartIsland, ...]
    labels: np.ndarray | None = None
    coarser: float = 1.0

    def uvs(self, width: int, height: int, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """UVs of the grid's texels in a texture of this size, float64 (grid height, grid width, 2).

        They are from 0 to 1 in one image. `at` is the sample position: columns and rows from each texel's corner, its
        centre by default.
        """
        return self._by_island(lambda island, at: island.uvs(island.to_texels(at), width, height), at)

    def places_of(
        self, target: Chart, at: tuple[float, float], receiver: Receiver, of_target: Receiver
    ) -> tuple[np.ndarray, np.ndarray]:
        """Columns and rows on this chart's grid, flat arrays, of sample positions `at` on that of `target`.

        `target` is the same chart in a receiver with another number of texels, `of_target`; this one's is `receiver`.
        """
        if not isinstance(self.grid, BentGrid):
            return self.grid.columns_and_rows(target.grid.positions(at))
        finer = np.array([receiver.width / of_target.width, receiver.height / of_target.height])
        columns, rows = np.meshgrid(np.arange(target.grid.width) + at[0], np.arange(target.grid.height) + at[1])
        texels = np.stack([columns.ravel(), rows.ravel()], axis=1) + target.islands[0].offset
        return tuple((texels * finer - self.islands[0].offset).T)

    def _by_island(self, function: Callable, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """Result of a function of an island and positions (..., 2) on the grid, by the island of each of its texels."""
        columns, rows = np.meshgrid(np.arange(self.grid.width) + at[0], np.arange(self.grid.height) + at[1])
        positions = np.stack([columns, rows], -1)
        if self.labels is None:
            return function(self.islands[0], positions)
        result = np.empty(positions.shape)
        for label, island in enumerate(self.islands):
            chosen = self.labels == label
            result[chosen] = function(island, positions[chosen])
        return result

    def read(self, texture: np.ndarray) -> np.ndarray:
        """Values (grid height, grid width, C) on the grid, from a texture (height, width, C)."""
        if self.labels is None and self.islands[0].texel_to_grid is None:
            return self.islands[0].part_of(texture)
        texels = self._by_island(lambda island, at: island.to_texels(at))
        x, y = np.moveaxis(texels.reshape(-1, 2), -1, 0)
        return bilinear(texture, x, y).reshape(self.grid.height, self.grid.width, -1).astype(np.float32)
