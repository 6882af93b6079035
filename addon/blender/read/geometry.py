"""Evaluated objects as triangles that throw shadows and as polygons that receive light."""

from __future__ import annotations

import numpy as np

from ...core.errors import ReceiverError
from ...core.scene.occluders import Mesh
from ...core.scene.uv_map import Polygons

# A depsgraph has curves, text and metaballs as they are and, as instances of themselves, as meshes: these count.
GEOMETRY_TYPES = {"MESH"}


def local_mesh(obj, materials) -> Mesh | None:
    """Triangles of an evaluated object in its own frame, with what `materials` read of its slots; None without any."""
    mesh = obj.to_mesh()
    if mesh is None:
        return None
    try:
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        if not count:
            return None
        triangles, corners = np.empty((2, count * 3), np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        vertices = _vertices(mesh).astype(float)
        triangles = triangles.astype(np.uint32).reshape(-1, 3)
        slots = [materials.read(slot.material) for slot in obj.material_slots]
        if all(slot.transmittance.is_opaque for slot in slots):
            return Mesh(vertices, triangles)
        numbers = np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("material_index", numbers)
        numbers = np.clip(numbers, 0, len(slots) - 1)
        mesh.loop_triangles.foreach_get("loops", corners)
        uvs = _image_uvs(mesh, slots, numbers, corners.reshape(-1, 3))
        transmittances = tuple(slot.transmittance for slot in slots)
        return Mesh(vertices, triangles, transmittances, numbers.astype(np.uint32), uvs)
    finally:
        obj.to_mesh_clear()


def _image_uvs(mesh, slots: list, numbers: np.ndarray, corners: np.ndarray) -> np.ndarray | None:
    """Where each triangle's corners lie in its material's image, float32 (M, 3, 2)."""
    if all(slot.place is None for slot in slots):
        return None
    found = np.zeros((*corners.shape, 2), np.float32)
    for number, slot in enumerate(slots):
        chosen = numbers == number
        if slot.place is not None and chosen.any():
            uvs = _uvs(mesh, slot.place.uv_map)
            at = np.zeros((chosen.sum(), 3, 2)) if uvs is None else uvs[corners[chosen]]
            matrix = np.array(slot.place.matrix)
            found[chosen] = at @ matrix[:, :2].T + matrix[:, 2]
    return np.clip(np.nan_to_num(found), -1e6, 1e6)  # beyond, an image has no texels in single precision


def _vertices(mesh) -> np.ndarray:
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    return vertices.reshape(-1, 3)


def _transform(points: np.ndarray, matrix) -> np.ndarray:
    world = np.array(matrix, dtype=float)
    return points.astype(float) @ world[:3, :3].T + world[:3, 3]


def read_polygons(obj, material_name: str, matrix=None) -> Polygons:
    """The faces of an evaluated mesh object that carry the material, in world space.

    `matrix` is where it stands, None: its own.
    """
    matrix = obj.matrix_world if matrix is None else matrix
    mesh = obj.to_mesh()
    try:
        totals, starts, slots = (np.empty(len(mesh.polygons), np.int32) for _ in range(3))
        mesh.polygons.foreach_get("loop_total", totals)
        mesh.polygons.foreach_get("loop_start", starts)
        mesh.polygons.foreach_get("material_index", slots)
        normals = np.empty(len(mesh.polygons) * 3, np.float32)
        mesh.polygons.foreach_get("normal", normals)
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        uvs, vertices = _uvs(mesh), _vertices(mesh)
    finally:
        obj.to_mesh_clear()
    chosen = np.flatnonzero(_has_material(obj, slots, material_name))
    sizes = totals[chosen]
    new_starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    loops = np.repeat(starts[chosen] - new_starts[:-1], sizes) + np.arange(new_starts[-1])
    world = np.array(matrix, dtype=float)[:3, :3]
    if abs(np.linalg.det(world)) < 1e-30:
        world = _flat_scale(world)
    # Normals transform with the inverse transpose, which also keeps them outward under mirroring.
    world_normals = normals.reshape(-1, 3)[chosen] @ np.linalg.inv(world)
    lengths = np.linalg.norm(world_normals, axis=1, keepdims=True)
    return Polygons(
        corners=_transform(vertices[corners[loops]], matrix),
        uvs=None if uvs is None else uvs[loops].astype(float),
        starts=new_starts,
        normals=world_normals / np.where(lengths > 0, lengths, 1),
    )


def _flat_scale(world: np.ndarray) -> np.ndarray:
    """A plane may well have scale 0 along its normal: give that axis a length, which its normal alone needs."""
    scales = np.linalg.norm(world, axis=0)
    if (scales == 0).sum() != 1:
        raise ReceiverError("The object's scale is zero along more than one axis: reset it (Alt+S).")
    flat = int(np.argmin(scales))
    world = world.copy()
    world[:, flat] = np.cross(world[:, (flat + 1) % 3], world[:, (flat + 2) % 3])
    return world


def _uvs(mesh, name: str = "") -> np.ndarray | None:
    """Of each loop, of the map of that name or, without, the one that renders; float32 (N, 2)."""
    layer = next((layer for layer in mesh.uv_layers if (layer.name == name if name else layer.active_render)), None)
    if layer is None:
        return None
    uvs = np.empty(len(mesh.loops) * 2, np.float32)
    layer.data.foreach_get("uv", uvs)
    return uvs.reshape(-1, 2)


def _has_material(obj, slots: np.ndarray, material_name: str) -> np.ndarray:
    """Which faces carry the material; Blender gives faces with a slot too high the last one."""
    names = [slot.material.name if slot.material else None for slot in obj.material_slots]
    matches = np.array([name == material_name for name in names] or [False])
    return matches[np.clip(slots, 0, len(matches) - 1)]
