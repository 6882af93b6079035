"""Emissive meshes: the radiance that their materials emit, for each triangle."""

from __future__ import annotations

from copy import copy

import numpy as np

from ...core.errors import MissingImageError, NotSupportedError
from ...core.native import native
from ...core.scene.lights import MeshLight
from ...core.scene.occluders import is_within
from ...core.scene.polygons import MAX_COORDINATE
from .. import compat
from .image_nodes import missing_images
from .nodes import InputSocket, Links, surface_of
from .scene_cache import SceneCache
from .shading import ON_NO_PATH, ShadingPoints

# Number of triangles that a mesh with an emissive image is cut into, at least; each has the mean of the image over it.
TEXTURED_TRIANGLES = 8192
# Most cuts along an edge of a triangle.
MAX_CUTS = 64
# Sample positions along each edge of a triangle, for its mean.
POSITIONS = 6


VARYING = "varying"
"""Radiance that differs from point to point, or that only Cycles can evaluate."""


def radiance_of(material, cache: SceneCache) -> np.ndarray | str | None:
    """Radiance (3,) of a material, W/(m^2 sr); None if it is dark; `VARYING`."""
    if material is None:
        return None
    return cache.of_nodes("radiance", material, lambda: _read(material, cache))


def _read(material, cache: SceneCache) -> np.ndarray | str | None:
    surface = surface_of(material.node_tree) if compat.uses_nodes(material) else None
    if surface is None:
        return None
    try:
        light = ShadingPoints(images=cache.images, check=cache.check).value(surface)
    except NotSupportedError:
        return VARYING
    return light if light.any() else None


class EmissiveMesh:
    """Radiance of the triangles of an evaluated object, and the matrices of its instances.

    Attributes
    ----------
    reason : why the emission of a material is left out; None if it is not.
    missing : errors for the images of that material that no renderer can load.
    lost : number of triangles that are left out, since a vertex is at no finite position.
    """

    def __init__(self, obj, cache: SceneCache) -> None:
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []
        self._is_closed, self._bounds = False, np.zeros((1, 0, 3))
        self._matrices: list[np.ndarray] = []
        self.reason: NotSupportedError | None = None
        self.missing: list[MissingImageError] = []
        self.lost, self._reach = 0, 0.0
        radiance = {index: radiance_of(slot.material, cache) for index, slot in enumerate(obj.material_slots)}
        radiance = {index: light for index, light in radiance.items() if light is not None}
        if radiance:
            self._add(obj, radiance, cache)

    def without_instances(self) -> EmissiveMesh:
        """The mesh without its instances."""
        mesh = copy(self)
        mesh._matrices = []
        return mesh

    def show_backs(self) -> None:
        """Note that light leaves the mesh through its own triangles, as they do not block all of it."""
        self._is_closed = False

    def add_instance(self, matrix) -> bool:
        """Add an instance at a 4 x 4 matrix; False if that is at no finite position."""
        matrix = np.array(matrix, dtype=float)
        is_finite = is_within(matrix, self._reach)
        if self._parts and is_finite:
            self._matrices.append(matrix)
            self._is_closed &= not _is_flat(matrix)
        return is_finite

    def light(self, common: tuple) -> MeshLight | None:
        """All instances in the world as one light, or None if they are dark."""
        if not self._matrices:
            return None
        corners = np.concatenate([corners for corners, _ in self._parts])
        vertices = np.concatenate([_placed(corners, matrix) for matrix in self._matrices])
        light = np.concatenate([light for _, light in self._parts] * len(self._matrices))
        triangles = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
        if self._is_closed:  # faces that do not glow close the mesh, too
            vertices = np.concatenate([vertices, *(_placed(self._bounds, matrix) for matrix in self._matrices)])
        return MeshLight(*common, vertices, triangles, light, is_closed=self._is_closed)

    def _add(self, obj, radiance: dict, cache: SceneCache) -> None:
        mesh = obj.to_mesh()
        if mesh is None:
            return
        try:
            corners, uvs, slots = _triangles(mesh, len(obj.material_slots))
            self._is_closed = _is_closed(mesh, len(obj.material_slots), list(radiance))
        finally:
            obj.to_mesh_clear()
        is_finite = (np.abs(corners) < MAX_COORDINATE).all(axis=(1, 2))
        self.lost = int(np.count_nonzero(~is_finite))
        if self.lost:
            corners, slots, uvs = corners[is_finite], slots[is_finite], None if uvs is None else uvs[is_finite]
        self._reach = float(np.abs(corners).max(initial=0.0))
        if self._is_closed:
            low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
            self._bounds = np.stack(np.meshgrid(*zip(low, high)), axis=-1).reshape(1, 8, 3)
        for index, light in radiance.items():
            chosen = slots == index
            if not chosen.any():
                continue
            if isinstance(light, np.ndarray):
                self._parts.append((corners[chosen], np.tile(np.float32(light), (chosen.sum(), 1))))
                continue
            surface = surface_of(obj.material_slots[index].material.node_tree)
            try:
                self._parts.append(_textured(surface, corners[chosen], None if uvs is None else uvs[chosen], cache))
            except NotSupportedError as error:
                self.reason, self.missing = error.with_traceback(None), missing_images(Links(), surface)


def _textured(
    surface: InputSocket, corners: np.ndarray, uvs: np.ndarray | None, cache: SceneCache
) -> tuple[np.ndarray, np.ndarray]:
    """Corners (N, 3, 3) of pieces of the triangles, and the mean radiance (N, 3) of each piece."""
    cuts = int(np.clip(np.ceil(np.sqrt(TEXTURED_TRIANGLES / len(corners))), 1, MAX_CUTS))
    pieces = _pieces(cuts)
    corners = (pieces @ corners[:, None]).reshape(-1, 3, 3)
    outputs = dict(ON_NO_PATH)
    if uvs is not None:
        positions = _middles(POSITIONS) @ (pieces @ uvs[:, None]).reshape(-1, 3, 2)
        flat = np.concatenate([positions.reshape(-1, 2), np.zeros((positions[..., 0].size, 1))], axis=1)
        outputs["ShaderNodeTexCoord", "UV"] = flat
    light = ShadingPoints(outputs, cache.images, check=cache.check).value(surface)
    light = np.broadcast_to(light, (len(corners) * POSITIONS**2, 3)).reshape(len(corners), -1, 3).mean(axis=1)
    return corners, light.astype(np.float32)


def _triangles(mesh, slot_count: int) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Corners (M, 3, 3), UVs (M, 3, 2) or None, and material slots (M,)."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    vertices, loops = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    slots, vertex_positions = np.empty(count, np.int32), np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", slots)
    mesh.vertices.foreach_get("co", vertex_positions)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uvs = None
    if layer is not None:
        uvs = np.empty(len(mesh.loops) * 2, np.float32)
        layer.data.foreach_get("uv", uvs)
        uvs = uvs.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(float)
    corners = vertex_positions.reshape(-1, 3)[vertices].reshape(-1, 3, 3).astype(float)
    visible = _visible(corners)
    return corners[visible], uvs if uvs is None else uvs[visible], np.clip(slots[visible], 0, slot_count - 1)


def _is_closed(mesh, slot_count: int, glowing: list[int]) -> bool:
    """True if from outside the fronts of the mesh's triangles hide their backs; `glowing`: slots that emit light."""
    count = len(mesh.loop_triangles)
    triangles, slots = np.empty(count * 3, np.int32), np.empty(count, np.int32)
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    mesh.loop_triangles.foreach_get("material_index", slots)
    mesh.vertices.foreach_get("co", vertices)
    if not (np.abs(vertices) < MAX_COORDINATE).all():
        return False
    starts = np.flatnonzero(np.isin(np.clip(slots, 0, slot_count - 1), glowing)).astype(np.uint32)
    triangles = triangles.astype(np.uint32).reshape(-1, 3)
    return native.is_closed(vertices.astype(float).reshape(-1, 3), triangles, starts.reshape(-1, 1))


def _is_flat(matrix: np.ndarray) -> bool:
    """True if rounding decides whether a matrix mirrors."""
    axes = matrix[:3, :3]
    return bool(abs(np.linalg.det(axes)) <= 1e-9 * np.prod(np.linalg.norm(axes, axis=0)))


def _placed(corners: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """World positions (N, 3) of groups of corners (M, K, 3); a matrix that mirrors triangles leaves fronts outside."""
    mirrors = np.linalg.det(matrix[:3, :3]) < 0
    return (corners[:, ::-1] if mirrors else corners).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def _visible(corners: np.ndarray) -> np.ndarray:
    """Indices of the triangles without those that lie on another: flat text has each twice, and one hides the other."""
    order = np.lexsort(np.moveaxis(corners, -1, 0))
    same = np.take_along_axis(corners, order[..., None], axis=1).reshape(-1, 9)
    return np.sort(np.unique(same, axis=0, return_index=True)[1])


def _pieces(cuts: int) -> np.ndarray:
    """Barycentric corners (cuts^2, 3, 3) of the equal pieces of a triangle that is cut along each edge."""
    pieces = []
    for row in range(cuts):
        for column in range(cuts - row):
            a, b, c = (row, column), (row + 1, column), (row, column + 1)
            pieces.append((a, b, c))
            if row + column < cuts - 1:
                pieces.append((b, (row + 1, column + 1), c))
    corners = np.array(pieces) / cuts
    return np.concatenate([1 - corners.sum(axis=-1, keepdims=True), corners], axis=-1)


def _middles(cuts: int) -> np.ndarray:
    """Barycentric centers (cuts^2, 3) of the pieces of a triangle."""
    return _pieces(cuts).mean(axis=1)
