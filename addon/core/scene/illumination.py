"""The lights of a scene and what throws their shadows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .grid import Grid
from .lights import Light
from .occluders import Mesh, Occluder, build

# Shadows are traced in single precision relative to an origin, on a lattice this many texels wide or up to twice that:
# vertices near a receiver are off by at most 2^-24 of it, and rays start 16 times 2^-23 of it off the plane, which is a
# 32nd of a texel. Wider, more receivers share a hierarchy.
TEXELS_BETWEEN_ORIGINS = 2**13


class Illumination:
    """Lights and what they shine past, shared by all bakes of a scene; owns the hierarchies that rays are cast in.

    Attributes
    ----------
    lights : those that can be baked.
    warnings : sentences that name what is left out.
    """

    def __init__(
        self,
        lights: Sequence[Light],
        occluders: Sequence[Occluder] | Mesh | None = None,
        warnings: Sequence[str] = (),
        most_crossings: int | None = None,
    ) -> None:
        """`most_crossings`: light that crossed so many see-through surfaces ends at the next; None: it never does."""
        self.lights = tuple(lights)
        self.warnings = tuple(warnings)
        self._occluders = (Occluder("", occluders),) if isinstance(occluders, Mesh) else tuple(occluders or ())
        self._most_crossings = most_crossings
        self._casters: dict = {}
        self._origin = None

    def caster(self, grid: Grid, light: Light | None = None):
        """The native `Occluders` that may block the light, with its origin near the receiver; None without triangles.

        A light's `blockers` are the names of the objects that block it, or None: all do. The origin follows from the
        receiver alone, so that a bake does not depend on those before it. Those last made serve all receivers with the
        same origin, and all lights with the same blockers.
        """
        step = TEXELS_BETWEEN_ORIGINS * 2.0 ** math.ceil(math.log2(min(grid.pitch_x, grid.pitch_y)))
        origin = tuple(step * np.round(grid.centre / step))
        if self._origin != origin:
            self._casters.clear()  # before others are made: each may take gigabytes
            self._origin = origin
        blockers = getattr(light, "blockers", None)
        names = {occluder.name for occluder in self._occluders}
        chosen = None if blockers is None or names <= blockers else frozenset(names & blockers)
        if chosen not in self._casters:
            occluders = [one for one in self._occluders if chosen is None or one.name in chosen]
            self._casters[chosen] = build(occluders, origin, self._most_crossings)
        return self._casters[chosen]
