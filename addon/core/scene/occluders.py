"""Meshes that cast shadows or reflect light, their instances, and the light that they let through."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..native import native
from .grid import Vector, owner_number
from .polygons import MAX_COORDINATE


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in the mesh's own frame, or in the world.

    Attributes
    ----------
    vertices : float64 (N, 3).
    triangles : uint32 (M, 3).
    transmittances : a native `ColorTexture` for each material.
    materials : uint32 (M,), the material of each triangle; None: all are opaque.
    uvs : float32 (M, 3, 2), UVs of each triangle's corners in its material's image; None: no material has one.
    reflectors : a native `Reflector` for each material, None for a black one; without `materials` one for all. Empty:
        the mesh reflects nothing.
    reflector_uvs : as `uvs`, in the images of the reflectors.
    lost : number of triangles that are left out, since a vertex is at no finite position.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    transmittances: tuple = ()
    materials: np.ndarray | None = None
    uvs: np.ndarray | None = None
    reflectors: tuple = ()
    reflector_uvs: np.ndarray | None = None
    lost: int = 0

    def finite(self) -> Mesh:
        """The mesh without triangles that have a vertex at no finite position."""
        is_finite = (np.abs(self.vertices) < MAX_COORDINATE).all(axis=1)
        if is_finite.all():
            return self
        kept = is_finite[self.triangles].all(axis=1)
        rows = {name: getattr(self, name) for name in ("triangles", "materials", "uvs", "reflector_uvs")}
        rows = {name: None if values is None else values[kept] for name, values in rows.items()}
        vertices = np.where(is_finite[:, None], self.vertices, 0.0)
        return replace(self, vertices=vertices, lost=int(np.count_nonzero(~kept)), **rows)

    @cached_property
    def reach(self) -> float:
        """Largest coordinate of a vertex."""
        return float(np.abs(self.vertices).max(initial=0.0))

    @cached_property
    def content(self) -> int:
        """A digest of the mesh without its transmittances and reflectors."""
        arrays = (self.vertices, self.triangles, self.materials, self.uvs, self.reflector_uvs)
        return zlib.crc32(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays if array is not None))

    def native(self, placements: np.ndarray | None, owners: Sequence[int] = ()):
        """The native `OccluderMesh`.

        `placements` are matrices (K, 3, 4), None for a mesh in the world; `owners` the number of the object of each.
        """
        return native.OccluderMesh(
            np.ascontiguousarray(self.vertices, float),
            np.ascontiguousarray(self.triangles, np.uint32),
            None if placements is None else np.ascontiguousarray(placements, float).reshape(-1, 12),
            list(self.transmittances),
            None if self.materials is None else np.ascontiguousarray(self.materials, np.uint32).reshape(-1, 1),
            _uvs(self.uvs),
            list(self.reflectors),
            _uvs(self.reflector_uvs),
            owners=owners,
        )


def is_within(matrix: np.ndarray, reach: float) -> bool:
    """True if a matrix (3, 4) or (4, 4) takes coordinates up to `reach` to finite positions."""
    with np.errstate(invalid="ignore", over="ignore"):
        return bool(reach * np.abs(matrix[:3, :3]).sum() + np.abs(matrix[:3, 3]).max() < MAX_COORDINATE)


def _uvs(uvs: np.ndarray | None) -> np.ndarray | None:
    return None if uvs is None else np.ascontiguousarray(uvs, np.float32).reshape(-1, 6)


@dataclass(frozen=True, eq=False)
class Occluder:
    """An object, or all instances of one.

    Attributes
    ----------
    name : name of the object, for lights that only some objects block.
    mesh : its mesh, which several occluders may share.
    placements : float64 (K, 3, 4), matrices from the mesh's frame to the world; None: the mesh is in the world.
    casts_shadows : True if it blocks light on its way from a lamp.
    is_seen : True if light bounces from it.
    """

    name: str
    mesh: Mesh
    placements: np.ndarray | None = None
    casts_shadows: bool = True
    is_seen: bool = True


def build(occluders: Sequence[Occluder], origin: Vector, max_crossings: int | None):
    """The native `Occluders`, or None without triangles."""
    by_mesh: dict[int, list[Occluder]] = {}
    for occluder in occluders:
        if len(occluder.mesh.triangles):
            by_mesh.setdefault(id(occluder.mesh), []).append(occluder)
    meshes = []
    for same in by_mesh.values():
        matrices = [np.eye(4)[None, :3] if item.placements is None else item.placements for item in same]
        owners = [owner_number(item.name) for item, places in zip(same, matrices) for _ in places]
        meshes.append(same[0].mesh.native(np.concatenate(matrices), owners))
    return native.Occluders(meshes, origin, max_crossings) if meshes else None
