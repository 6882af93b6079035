"""UDIM tiles: squares of the UV plane with an image each, and one texture that holds the texels of several tiles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..errors import ReceiverError
from .polygons import Polygons

FIRST, COLUMNS, LAST = 1001, 10, 2000
"""Number of the tile from 0 to 1, number of tiles in a row, and largest number that Blender allows."""

BORDER = 1e-4
"""Distance (UV) by which faces may reach beyond the border of their tile: rounding of float32 coordinates."""


def corner_of(number: int) -> tuple[int, int]:
    """UV of a tile's lower left corner."""
    row, column = divmod(number - FIRST, COLUMNS)
    return column, row


def in_tiles(polygons: Polygons, name: str) -> Polygons:
    """The faces of the object `name` with the tile of each, and with UVs from 0 to 1 in it.

    Raises
    ------
    ReceiverError
        A face crosses the border of a tile, or lies where no tile can be.
    """
    if polygons.uvs is None or not polygons.count or not np.isfinite(polygons.uvs).all():
        return polygons  # other checks name that
    starts = polygons.starts[:-1]
    low, high = np.minimum.reduceat(polygons.uvs, starts), np.maximum.reduceat(polygons.uvs, starts)
    corners = np.floor(0.5 * (low + high)).astype(int)
    numbers = FIRST + corners[:, 0] + COLUMNS * corners[:, 1]
    is_outside = (corners < 0).any(axis=1) | (corners[:, 0] >= COLUMNS) | (numbers > LAST)
    if is_outside.any():
        text = f"The UV map of '{name}' reaches where no UDIM tile can be, in {is_outside.sum()} of {len(low)} faces."
        raise ReceiverError(text, f"Move them into tiles: {FIRST} (U and V from 0 to 1), and those right and above.")
    crosses = (low < corners - BORDER).any(axis=1) | (high > corners + 1 + BORDER).any(axis=1)
    if crosses.any():
        tiles = " and ".join(map(str, np.unique(numbers[crosses])[:3].tolist()))
        text = f"UV islands of '{name}' cross the border of the UDIM tile {tiles}: {crosses.sum()} of {len(low)} faces."
        raise ReceiverError(text, "Move each island into one tile, or cut it at the border.")
    return replace(polygons, uvs=polygons.uvs - corners[polygons.face_of], tiles=numbers)


class Place(NamedTuple):
    """Texels of a tile, or of a whole texture, in a texture; `u` and `v` are the corner of the tile."""

    column: int
    row: int
    width: int
    height: int
    u: int = 0
    v: int = 0


@dataclass(frozen=True)
class Tiling:
    """Tiles on top of each other in one texture.

    Attributes
    ----------
    tiles : number of each tile, and its width and height.
    gap : rows of texels between two tiles, which margins of both may fill.
    """

    tiles: tuple[tuple[int, tuple[int, int]], ...]
    gap: int = 0

    @property
    def sizes(self) -> dict[int, tuple[int, int]]:
        """Width and height of each tile, by its number."""
        return dict(self.tiles)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the texture."""
        widths, heights = zip(*(size for _, size in self.tiles))
        return max(widths), sum(heights) + self.gap * (len(heights) - 1)

    @cached_property
    def places(self) -> dict[int, Place]:
        """Places of the tiles, by their numbers."""
        places, row = {}, 0
        for number, (width, height) in self.tiles:
            places[number] = Place(0, row, width, height, *corner_of(number))
            row += height + self.gap
        return places

    def split(self, texture: np.ndarray) -> dict[int, np.ndarray]:
        """Views of the texels of each tile in a texture (height, width, ...), by its number."""
        places = self.places.items()
        return {number: texture[place.row : place.row + place.height, : place.width] for number, place in places}

    def joined(self, tiles: Mapping[int, np.ndarray]) -> np.ndarray:
        """Texture, float32 (height, width, 3), with the texels of each tile; 0 between them."""
        width, height = self.size
        texture = np.zeros((height, width, 3), np.float32)
        for number, part in self.split(texture).items():
            part[...] = tiles[number]
        return texture
