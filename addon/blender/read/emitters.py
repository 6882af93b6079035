"""EmissiveMeshing meshes: what their materials emit, triangle by triangle."""

from __future__ import annotations

from copy import copy

import numpy as np

from ...core.scene.lights import MeshLight
from .. import compat
from .image_texture import NotUnderstoodError
from .node_links import Wanted
from .places import ON_NO_PATH, Places
from .shaders import radiance, surface_of
from .textures import Images

# A mesh whose materials glow by an image is cut into at least about this many triangles, each of which has the mean of
# the image over it, at most `MOST_CUTS` along an edge.
TEXTURED_TRIANGLES, MOST_CUTS = 8192, 64
# Places along each edge of a triangle that its mean is taken over.
PLACES = 6


def _shows_a_bake(tree) -> bool:
    """Whether what glows is light that was baked before: what a receiver returns, no light of its own."""
    return any(node.bl_idname == "BeamspreadNode" for node in tree.nodes)


class Materials:
    """What materials emit, each evaluated once."""

    def __init__(self) -> None:
        self.images = Images()
        self._known: dict[str | None, np.ndarray | Wanted | None] = {None: None}

    def read(self, material) -> np.ndarray | Wanted | None:
        """W/(m^2 sr), (3,); or what it comes from if not every place emits the same; or None if it is dark."""
        name = material and material.name_full
        if name not in self._known:
            self._known[name] = self._read(material)
        return self._known[name]

    def forget(self, name: str) -> None:
        """Evaluate a material of that full name again."""
        self._known.pop(name, None)

    def _read(self, material) -> np.ndarray | Wanted | None:
        surface = surface_of(material.node_tree) if compat.uses_nodes(material) else None
        if surface is None or _shows_a_bake(material.node_tree):
            return None
        try:
            light = radiance(Places(images=self.images), surface)
        except NotUnderstoodError:
            return surface
        return light if light.any() else None


class EmissiveMesh:
    """What the triangles of an evaluated object emit, and where its instances stand."""

    def __init__(self, obj, materials: Materials) -> None:
        self._images = materials.images
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []
        self._matrices: list[np.ndarray] = []
        self.reason = ""
        found = {slot: materials.read(one.material) for slot, one in enumerate(obj.material_slots)}
        glowing = {slot: light for slot, light in found.items() if light is not None}
        if glowing:
            self._add(obj, glowing)

    def without_instances(self) -> EmissiveMesh:
        """The same without any instance."""
        mesh = copy(self)
        mesh._matrices = []
        return mesh

    def add_instance(self, matrix) -> None:
        """Add an instance at a 4 x 4 matrix."""
        if self._parts:
            self._matrices.append(np.array(matrix, dtype=float))

    def light(self, common: tuple) -> MeshLight | None:
        """All instances in the world, or None if all is dark."""
        if not self._matrices:
            return None
        corners = np.concatenate([corners for corners, _ in self._parts]).reshape(-1, 3)
        vertices = np.concatenate([corners @ matrix[:3, :3].T + matrix[:3, 3] for matrix in self._matrices])
        light = np.concatenate([light for _, light in self._parts] * len(self._matrices))
        return MeshLight(*common, vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3), light)

    def _add(self, obj, glowing: dict) -> None:
        mesh = obj.to_mesh()
        if mesh is None:
            return
        try:
            corners, uvs, slots = _triangles(mesh, len(obj.material_slots))
        finally:
            obj.to_mesh_clear()
        for slot, light in glowing.items():
            own = slots == slot
            if not own.any():
                continue
            if isinstance(light, np.ndarray):
                self._parts.append((corners[own], np.tile(np.float32(light), (own.sum(), 1))))
                continue
            try:
                self._parts.append(self._textured(light, corners[own], None if uvs is None else uvs[own]))
            except NotUnderstoodError as error:
                self.reason = str(error)

    def _textured(self, surface, corners: np.ndarray, uvs: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        cuts = int(np.clip(np.ceil(np.sqrt(TEXTURED_TRIANGLES / len(corners))), 1, MOST_CUTS))
        pieces = _pieces(cuts)
        corners = (pieces @ corners[:, None]).reshape(-1, 3, 3)
        outputs = dict(ON_NO_PATH)
        if uvs is not None:
            places = _middles(PLACES) @ (pieces @ uvs[:, None]).reshape(-1, 3, 2)
            flat = np.concatenate([places.reshape(-1, 2), np.zeros((places[..., 0].size, 1))], axis=1)
            outputs["ShaderNodeTexCoord", "UV"] = flat
        light = radiance(Places(outputs, self._images), surface)
        light = np.broadcast_to(light, (len(corners) * PLACES**2, 3)).reshape(len(corners), -1, 3).mean(axis=1)
        return corners, light.astype(np.float32)


def _triangles(mesh, slot_count: int) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Corners (M, 3, 3), UVs (M, 3, 2) or None, and material slots (M,)."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    vertices, loops = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    slots, places = np.empty(count, np.int32), np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("material_index", slots)
    mesh.vertices.foreach_get("co", places)
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uvs = None
    if layer is not None:
        uvs = np.empty(len(mesh.loops) * 2, np.float32)
        layer.data.foreach_get("uv", uvs)
        uvs = uvs.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(float)
    corners = places.reshape(-1, 3)[vertices].reshape(-1, 3, 3).astype(float)
    own = _seen(corners)
    return corners[own], uvs if uvs is None else uvs[own], np.clip(slots[own], 0, slot_count - 1)


def _seen(corners: np.ndarray) -> np.ndarray:
    """Numbers of the triangles that no other one lies upon: flat text has each twice, and one hides the other."""
    order = np.lexsort(np.moveaxis(corners, -1, 0))
    same = np.take_along_axis(corners, order[..., None], axis=1).reshape(-1, 9)
    return np.sort(np.unique(same, axis=0, return_index=True)[1])


def _pieces(cuts: int) -> np.ndarray:
    """Barycentric corners (cuts^2, 3, 3) of the equal triangles that cut one along each edge that many times."""
    pieces = []
    for row in range(cuts):
        for column in range(cuts - row):
            a, b, c = (row, column), (row + 1, column), (row, column + 1)
            pieces.append((a, b, c))
            if row + column < cuts - 1:
                pieces.append((b, (row + 1, column + 1), c))
    places = np.array(pieces) / cuts
    return np.concatenate([1 - places.sum(axis=-1, keepdims=True), places], axis=-1)


def _middles(cuts: int) -> np.ndarray:
    """Barycentric centres (cuts^2, 3) of such pieces."""
    return _pieces(cuts).mean(axis=1)
