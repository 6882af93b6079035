"""Parts of an image that several surfaces share: each surface fills its own texels and the margin nearest to them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import bpy
import numpy as np

from ...core.bake.margin import WHOLE, part_in_shared
from ...core.bake.spread import spread_over_edges
from ...core.errors import BakeError
from ...core.scene.flat_mesh import flatten
from ...core.scene.receiver import Receiver, build_receiver
from ...core.scene.tiles import Tiling
from ...core.target import Target
from ..node.find import node_of
from ..read.geometry import read_polygons

OVERLAP_TOLERANCE = 0.01
"""Fraction of the texels of the smaller of two surfaces that may show both: rounding at a common border is less."""

Parts = tuple[tuple[int, int, np.ndarray], ...]
"""Islands in a texture: column and row of the first texel, and coverage of each texel, float32 (rows, columns)."""

Size = tuple[int, int] | Tiling
"""Width and height of a texture, or the tiles of which it consists."""


def parts_of(receiver: Receiver) -> Parts:
    """Islands of a receiver in its texture."""
    islands = (island for chart in receiver.charts for island in chart.islands)
    return tuple((*island.offset, island.coverage) for island in islands)


def read_parts(target: Target, size: Size) -> Parts | None:
    """Islands of a target in a texture of that size; None if it can't be baked as it is.

    Of a texture of tiles, those in its tiles.
    """
    obj, node = bpy.data.objects.get(target.object_name), node_of(target)
    if obj is None or node is None:
        return None
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    try:
        is_tiled = isinstance(size, Tiling)
        polygons = read_polygons(evaluated, target.material_name, None, node.uv_map, is_tiled)
        mesh = flatten(polygons, spread=spread_over_edges(node.surface()), is_sheet=node.thickness > 0)
        mesh = mesh.within(size) if is_tiled else mesh
        return parts_of(build_receiver(mesh, *(size.size if is_tiled else size))) if mesh.parts else ()
    except BakeError:
        return None


def overlaps(receiver: Receiver, parts: Parts) -> bool:
    """True if the receiver's charts overlap others in the same texture by more than rounding."""
    shown = [part[2] > 2 * (1 - WHOLE) for part in parts]
    wholes = (within(receiver.coverage, *part) > WHOLE for part in parts)
    shared = sum(np.count_nonzero(is_shown & is_whole) for is_shown, is_whole in zip(shown, wholes))
    if not shared:  # counting all texels takes long in large images
        return False
    texels = sum(map(np.count_nonzero, shown))
    return shared > OVERLAP_TOLERANCE * min(texels, np.count_nonzero(receiver.inside()))


def texels_of(target: Target, receiver: Receiver, neighbors: Mapping[Target, Parts], margin: int) -> np.ndarray:
    """Bool (height, width): texels that a bake of the target fills beside its neighbors in the same image."""
    before, after = np.zeros((2, receiver.height, receiver.width), np.float32)
    for neighbor, parts in neighbors.items():
        _add(before if neighbor < target else after, parts)
    return part_in_shared(receiver.coverage, before, after, margin)


def within(texture: np.ndarray, column: int, row: int, coverage: np.ndarray) -> np.ndarray:
    """View of the texels of a texture (height, width) on which an island lies."""
    return texture[row : row + coverage.shape[0], column : column + coverage.shape[1]]


def _add(texture: np.ndarray, parts: Iterable) -> None:
    for part in parts:
        view = within(texture, *part)
        np.maximum(view, part[2], out=view)
