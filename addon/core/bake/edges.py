"""Edges of planes: light leaves through them, or returns as from mirrors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..messages import Message, warning
from ..scene.grid import Grid

OPEN, MIRROR = "OPEN", "MIRROR"

# Coverage of texels inside a rectangle, at least. Smaller: rectangles with small holes count, too.
WHOLE = 0.999


def with_edges(grids: Sequence[Grid], edges: str, name: str) -> tuple[list[Grid], list[Message]]:
    """The grids with these edges, and messages about those that can't have them.

    Only rectangles are mirrored: the images of others would leave gaps or cover each other.
    """
    if edges == OPEN:
        return list(grids), []
    changed = [replace(grid, is_mirrored=_is_rectangle(grid)) for grid in grids]
    others = sum(not grid.is_mirrored for grid in changed)
    if not others:
        return changed, []
    of_all = f"{others} of {len(grids)} planes of '{name}' are" if len(grids) > 1 else f"'{name}' is"
    text = f"{of_all} not rectangular, so light leaves through the edges."
    return changed, [warning(name, text, "Set Edges to Open, or give the plane straight edges along its texels.")]


def _is_rectangle(grid: Grid) -> bool:
    """True if all texels inside the border are covered."""
    return bool((grid.coverage[1:-1, 1:-1] >= WHOLE).all())
