"""The lights of a scene and the triangles that throw their shadows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..native import native
from .grid import Grid
from .lights import Light

# Shadows are traced in single precision relative to an origin, on a lattice this many texels wide or up to twice that:
# vertices near a receiver are off by at most 2^-24 of it, and rays start 16 times 2^-23 of it off the plane, which is a
# 32nd of a texel. Wider, more receivers share a hierarchy.
TEXELS_BETWEEN_ORIGINS = 2**13


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in world space: vertices float64 (N, 3), triangles uint32 (M, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray

    @classmethod
    def empty(cls) -> Mesh:
        return cls(np.zeros((0, 3)), np.zeros((0, 3), np.uint32))

    @classmethod
    def join(cls, parts: list[Mesh]) -> Mesh:
        parts = [cls.empty(), *parts]
        offsets = np.cumsum([0] + [len(part.vertices) for part in parts], dtype=np.uint32)
        triangles = [part.triangles + offset for part, offset in zip(parts, offsets)]
        return cls(np.concatenate([part.vertices for part in parts]), np.concatenate(triangles))


class Illumination:
    """Lights and what they shine past, shared by all bakes of a scene; owns the hierarchy that rays are cast in.

    Attributes
    ----------
    lights : those that can be baked.
    warnings : sentences that name lights that are left out.
    """

    def __init__(self, lights: Sequence[Light], occluders: Mesh | None = None, warnings: Sequence[str] = ()) -> None:
        self.lights = tuple(lights)
        self.warnings = tuple(warnings)
        self._occluders = occluders or Mesh.empty()
        self._caster = self._origin = None

    @property
    def triangle_count(self) -> int:
        """Of all that can stand in the light's way."""
        return len(self._occluders.triangles)

    def caster(self, grid: Grid):
        """The native `Occluders` with its origin near the receiver; None without triangles.

        The origin follows from the receiver alone, so that a bake does not depend on those before it. The last one made
        serves all receivers with the same origin.
        """
        if not len(self._occluders.triangles):
            return None
        step = TEXELS_BETWEEN_ORIGINS * 2.0 ** math.ceil(math.log2(min(grid.pitch_x, grid.pitch_y)))
        origin = tuple(step * np.round(grid.centre / step))
        if self._origin != origin:
            self._caster = None  # before another is made: each may take gigabytes
            vertices = np.ascontiguousarray(self._occluders.vertices, float)
            self._caster = native.Occluders(vertices, self._occluders.triangles, origin)
            self._origin = origin
        return self._caster
