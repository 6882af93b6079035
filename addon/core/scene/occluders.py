"""What throws shadows: meshes, where they stand, and what they let through."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..native import native
from .grid import Vector


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in a frame of their own, or in the world.

    Attributes
    ----------
    vertices : float64 (N, 3).
    triangles : uint32 (M, 3).
    transmittances : native `Transmittance`s, by material.
    materials : uint32 (M,), indices of these; None: all triangles are opaque.
    uvs : float32 (M, 3, 2), where the corners lie in their material's image; None: there is none.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    transmittances: tuple = ()
    materials: np.ndarray | None = None
    uvs: np.ndarray | None = None

    @cached_property
    def content(self) -> int:
        """A number that tells meshes apart, but for what their materials let through."""
        arrays = (self.vertices, self.triangles, self.materials, self.uvs)
        return zlib.crc32(b"".join(np.ascontiguousarray(one).tobytes() for one in arrays if one is not None))

    def native(self, placements: np.ndarray | None):
        """The native `OccluderMesh`, in the world as it is or once for each of (K, 3, 4) matrices."""
        return native.OccluderMesh(
            np.ascontiguousarray(self.vertices, float),
            np.ascontiguousarray(self.triangles, np.uint32),
            None if placements is None else np.ascontiguousarray(placements, float).reshape(-1, 12),
            list(self.transmittances),
            None if self.materials is None else np.ascontiguousarray(self.materials, np.uint32).reshape(-1, 1),
            None if self.uvs is None else np.ascontiguousarray(self.uvs, np.float32).reshape(-1, 6),
        )


@dataclass(frozen=True, eq=False)
class Occluder:
    """An object, or all instances of one.

    Attributes
    ----------
    name : of the object, by which lights know what they are blocked by.
    mesh : may be shared by several occluders.
    placements : float64 (K, 3, 4), from the mesh's frame to the world; None: the mesh is in the world.
    """

    name: str
    mesh: Mesh
    placements: np.ndarray | None = None


def build(occluders: Sequence[Occluder], origin: Vector, most_crossings: int | None):
    """The native `Occluders`, or None without triangles."""
    by_mesh: dict[int, list[Occluder]] = {}
    for occluder in occluders:
        if len(occluder.mesh.triangles):
            by_mesh.setdefault(id(occluder.mesh), []).append(occluder)
    meshes = []
    for same in by_mesh.values():
        matrices = [np.eye(4)[None, :3] if one.placements is None else one.placements for one in same]
        meshes.append(same[0].mesh.native(np.concatenate(matrices)))
    return native.Occluders(meshes, origin, most_crossings) if meshes else None
