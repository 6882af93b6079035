"""Edges of planes: light leaves through them, or returns as from mirrors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..messages import Message, note, warning
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.grid import Grid
from .spread import spread_lengths
from .surface import OPEN, Surface

# Coverage of texels inside a rectangle, at least. Smaller: rectangles with small holes count, too.
WHOLE = 0.999

# Distance to which light is mirrored, in diffuse mean free paths and in mean free paths: light falls below 1e-4 there.
# Larger: slower, more exact.
SPREADS, PATHS = 12.0, 9.2

# Texels of a plane with its mirror images, at most, and the same relative to the plane. More: images farther away.
MAX_TEXELS, MAX_RATIO = 2**24, 2.25


def with_edges(grids: Sequence[AnyGrid], surface: Surface, name: str) -> tuple[list[AnyGrid], list[Message]]:
    """The grids with the edges of their surface, and messages about those that can't have them.

    Only rectangles are mirrored: the images of others would leave gaps or cover each other.
    """
    if surface.edges == OPEN:
        return list(grids), []
    if any(isinstance(grid, BentGrid) for grid in grids):
        text = f"'{name}' bends, so light leaves through its edges: only planes can mirror it."
        return list(grids), [warning(name, text, "Set Edges to Open.")]
    wanted = max(SPREADS * max(spread_lengths(surface)), PATHS * max(surface.material.mean_free_path))
    changed = [replace(grid, mirrored=min(wanted, _most(grid)) if _is_rectangle(grid) else 0.0) for grid in grids]
    messages = []
    open_ones = sum(not grid.mirrored for grid in changed)
    if open_ones:
        are = f"{open_ones} of {len(grids)} planes of '{name}' are" if len(grids) > 1 else f"'{name}' is"
        text = f"{are} not rectangular, so light leaves through the edges."
        remedy = "Set Edges to Open, or give the plane straight edges along its texels."
        messages.append(warning(name, text, remedy))
    nearest = min((grid.mirrored for grid in changed if grid.mirrored), default=wanted)
    if nearest < wanted:
        text = (
            f"Mirrored light of '{name}' ends {nearest:.3g} units beyond the edges, and the material spreads light up "
            f"to {wanted:.3g} units."
        )
        messages.append(note(name, text, "A lower resolution mirrors it farther."))
    return changed, messages


def texels_with_images(grid: AnyGrid) -> int:
    """Texels that a grid and its mirror images fill."""
    if not grid.mirrored:
        return grid.texels
    across, up = (2 * math.ceil(grid.mirrored / pitch) for pitch in (grid.pitch_x, grid.pitch_y))
    return (grid.width + across) * (grid.height + up)


def _most(grid: Grid) -> float:
    """Distance of mirror images, scene units, at which they fill as many texels as they may."""
    # The positive root of (width + 2 d / pitch_x) (height + 2 d / pitch_y) = texels.
    texels = max(MAX_TEXELS, MAX_RATIO * grid.texels)
    width, height = grid.width * grid.pitch_x, grid.height * grid.pitch_y
    area = texels * grid.pitch_x * grid.pitch_y
    return 0.25 * (math.sqrt((width - height) ** 2 + 4 * area) - width - height)


def _is_rectangle(grid: Grid) -> bool:
    """True if all texels inside the border are covered."""
    return bool((grid.coverage[1:-1, 1:-1] >= WHOLE).all())
