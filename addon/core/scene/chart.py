"""Charts: planes of a receiver with their islands in a texture.

If a chart has one island, and its axes p_u and p_v are orthogonal, the chart's grid consists of the texture's texels.
Otherwise it is a rectangular grid of the finest density, which the texels of each island sample bilinearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .grid import Grid
from .sampling import bilinear


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
    """

    coverage: np.ndarray
    offset: tuple[int, int]
    texel_to_grid: np.ndarray | None = None

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

    def sampled(self, values: np.ndarray, inside: np.ndarray) -> np.ndarray:
        """Values (N, C) at the texels that `inside` (rows, columns) chooses, from those of the grid (H, W, C)."""
        if self.texel_to_grid is None:
            return values[inside]
        rows, columns = np.nonzero(inside)
        centres = columns + self.offset[0] + 0.5, rows + self.offset[1] + 0.5, np.ones(len(rows))
        return bilinear(values, *(self.texel_to_grid @ np.stack(centres)))


@dataclass(frozen=True, eq=False)
class Chart:
    """Flat part of a receiver.

    Attributes
    ----------
    grid : the grid on which light arrives.
    islands : the texels that show it.
    labels : int32 (grid height, grid width), the island of each texel of the grid; None if there is one.
    coarser : factor by which texels of the grid are longer than the finest of the islands; 1 if none is finer.
    """

    grid: Grid
    islands: tuple[ChartIsland, ...]
    labels: np.ndarray | None = None
    coarser: float = 1.0

    def uvs(self, width: int, height: int, at: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
        """UVs of the grid's texels in a texture of this size, float64 (grid height, grid width, 2), 0..1.

        `at` is the sample position: columns and rows from each texel's corner, its centre by default.
        """
        columns, rows = np.meshgrid(np.arange(self.grid.width) + at[0], np.arange(self.grid.height) + at[1])
        positions = np.stack([columns, rows], -1)
        if self.labels is None:
            texels = self.islands[0].to_texels(positions)
        else:
            texels = np.empty(positions.shape)
            for label, island in enumerate(self.islands):
                chosen = self.labels == label
                texels[chosen] = island.to_texels(positions[chosen])
        return texels / [width, height]

    def read(self, texture: np.ndarray) -> np.ndarray:
        """Values (grid height, grid width, C) on the grid, from a texture (height, width, C)."""
        if self.labels is None and self.islands[0].texel_to_grid is None:
            return self.islands[0].part_of(texture)
        height, width = texture.shape[:2]
        x, y = np.moveaxis(self.uvs(width, height).reshape(-1, 2) * [width, height], -1, 0)
        return bilinear(texture, x, y).reshape(self.grid.height, self.grid.width, -1).astype(np.float32)
