"""The lights of a scene and the triangles that throw their shadows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..native import native
from .lights import Light


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in world space: vertices float32 (N, 3), triangles uint32 (M, 3)."""

    vertices: np.ndarray
    triangles: np.ndarray

    @classmethod
    def empty(cls) -> Mesh:
        return cls(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))

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
        self._caster = None

    def caster(self):
        """The native `Occluders`, None without triangles; made on first use, which takes a while in a big scene."""
        if self._caster is None and len(self._occluders.triangles):
            self._caster = native.Occluders(self._occluders.vertices, self._occluders.triangles)
        return self._caster
