"""Evaluated objects as occluders, which cast shadows, and as polygons, which receive light."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core.bake.job import machine_bytes
from ...core.errors import ReceiverError
from ...core.messages import Message, warning
from ...core.scene.flat_mesh import finite_remedy
from ...core.scene.islands import check_map
from ...core.scene.occluders import Mesh, Occluder, is_within
from ...core.scene.polygons import Polygons
from ...core.scene.tiles import in_tiles
from .. import compat
from ..preferences import memory_limit
from .image_nodes import UVTransform
from .reflection import MaterialReflection, MediumOf, reflection_of
from .scene_cache import SceneCache
from .transparency import MaterialTransmittance, transmittance_of
from .visibility import casts_shadows, lights_surfaces

OWN_MAP = "Beamspread"
"""Name of UV maps that bakes make."""

NO_FACES_REMEDY = {
    "MESH": "Fill its edges (Edit Mode: A, then F), or check modifiers.",
    "CURVE": "Fill it, or give it depth (Object Data Properties > Shape > Fill Mode, Geometry > Bevel).",
    "SURFACE": "Add control points in both directions, or check modifiers.",
    "FONT": "Type some text (Edit Mode), or choose another Fill Mode (Object Data Properties > Shape).",
}
"""Remedy by the type of an object without faces."""

FOR_MESHES = "Edit Mode", "Unwrap the mesh"
"""Words of remedies that work for meshes alone."""

OWN_MAP_REMEDY = (
    "If its image is an atlas, select all objects of the atlas, and make One Atlas for the Selection again "
    "(Properties > Render > Beamspread > New Images). If not, clear the node's UV Map: Beamspread's own Bake makes one."
)
"""Remedy for an object that has lost its map of our own."""

INFINITE_MATRIX = "Its location, rotation or scale is infinite or not a number."
MATRIX_REMEDY = "Clear it (Object > Clear), and check constraints and drivers."

# Memory for each corner of a receiver's faces while they are unwrapped, the most that their planes and islands take.
BYTES_PER_CORNER = 600

# Scale along an axis, over the largest, that counts as zero: single precision can't tell its normals.
NO_SCALE = 1e-12

# A depsgraph holds curves, text and metaballs also as meshes, which are instances of themselves: only these are read.
GEOMETRY_TYPES = {"MESH"}


class Slot(NamedTuple):
    """A material of a mesh; `reflection` is None if no light bounces."""

    transmittance: MaterialTransmittance
    reflection: MaterialReflection | None = None


class OccluderReader:
    """Collects occluders from the instances of a depsgraph; each mesh and each material is read once.

    Attributes
    ----------
    untraceable : as of an `Illumination`.
    """

    def __init__(self, cache: SceneCache, medium_of: MediumOf | None = None, min_roughness: float = 0.0) -> None:
        """`medium_of`: the medium of a material that is baked; None: reflections are not read."""
        self._cache, self._medium_of, self._min_roughness = cache, medium_of, min_roughness
        self.untraceable = ""
        self._meshes: dict[tuple, Mesh | None] = {}
        self._matrices: dict[tuple, list] = {}  # of the instances, by name, key of the mesh and rays that meet it
        self.messages: list[Message] = []

    def add(self, instance) -> None:
        """Add an entry of `depsgraph.object_instances` that renders, of any type, if rays meet it."""
        obj, instancer = instance.object, instance.parent if instance.is_instance else None
        meets = casts_shadows(obj, instancer), self._medium_of is not None and lights_surfaces(obj, instancer)
        if obj.type not in GEOMETRY_TYPES or not any(meets):
            return
        key = mesh_key(obj)
        if key not in self._meshes:
            self._meshes[key] = self._read(instance, key)
        mesh, matrix = self._meshes[key], np.array(instance.matrix_world, float)
        if mesh is None:
            return
        if mesh.lost:
            self.messages.append(lost_triangles(obj.name, mesh.lost))
        if is_within(matrix, mesh.reach):
            self._matrices.setdefault((obj.name, key, meets), []).append(matrix[:3])
        else:
            self.messages.append(lost_instance(obj.name))

    def _read(self, instance, key: tuple) -> Mesh | None:
        obj = instance.object
        slots = [self._slot(slot.material) for slot in obj.material_slots] or [self._slot(None)]
        self.messages += [message for slot in slots for message in slot.transmittance.messages]
        state = tuple(
            (slot.transmittance.transmittance, slot.transmittance.uv_transform, slot.reflection) for slot in slots
        )
        return self._cache.get(("mesh", *key), shapes_of(instance), lambda: local_mesh(obj, slots), state=state)

    def _slot(self, material) -> Slot:
        transmittance = transmittance_of(material, self._cache)
        if self._medium_of is None:
            return Slot(transmittance)
        reflection = reflection_of(material, self._cache, self._medium_of, self._min_roughness)
        if reflection.problem and not self.untraceable:
            self.untraceable = f"They can't trace the material '{material.name}'. {reflection.problem}"
        return Slot(transmittance, reflection)

    def occluders(self) -> list[Occluder]:
        return [
            Occluder(name, self._meshes[key], np.array(matrices, float).reshape(-1, 3, 4), *meets)
            for (name, key, meets), matrices in self._matrices.items()
        ]


def lost_triangles(name: str, count: int) -> Message:
    """Warning about triangles of an object whose vertices are at no finite position."""
    triangles = "triangle is" if count == 1 else "triangles are"
    text = f"{count} {triangles} left out of '{name}': the positions of vertices are infinite or not numbers."
    return warning(name, text, finite_remedy(name))


def lost_instance(name: str) -> Message:
    """Warning about an object, or an instance of it, that is at no finite position."""
    return warning(name, f"'{name}' is left out. {INFINITE_MATRIX}", MATRIX_REMEDY)


def mesh_key(obj) -> tuple:
    """Key of an evaluated object's mesh with its materials; geometry nodes may give an object several meshes."""
    data = obj if obj.data is None else obj.data
    names = (slot.material.name_full if slot.material else None for slot in obj.material_slots)
    return data.as_pointer(), data.name, *names


def shapes_of(instance) -> set:
    """Original objects whose changes of geometry may change the mesh of an entry of `depsgraph.object_instances`."""
    parent = instance.parent if instance.is_instance else None
    return {instance.object.original, *([] if parent is None else [parent.original])}


def local_mesh(obj, slots: Sequence[Slot]) -> Mesh | None:
    """Triangles of an evaluated object in its own frame, None without any. `slots` has one material at least."""
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
        reflections = [slot.reflection or MaterialReflection() for slot in slots]
        transmittances = tuple(slot.transmittance.transmittance for slot in slots)
        transmittances = () if all(item.is_black for item in transmittances) else transmittances
        is_even = not transmittances and all(item is reflections[0] for item in reflections)
        if is_even and reflections[0].uv_transform is None:
            reflector = reflections[0].reflector
            return Mesh(vertices, triangles, reflectors=(reflector,) if reflector else ()).finite()
        if not transmittances and not any(item.reflector for item in reflections):
            return Mesh(vertices, triangles).finite()
        numbers = np.empty(count, np.int32)
        mesh.loop_triangles.foreach_get("material_index", numbers)
        numbers = np.clip(numbers, 0, len(slots) - 1)
        mesh.loop_triangles.foreach_get("loops", corners)
        uvs, reflector_uvs = (
            _image_uvs(mesh, transforms, numbers, corners.reshape(-1, 3))
            for transforms in (
                [slot.transmittance.uv_transform for slot in slots],
                [reflection.uv_transform for reflection in reflections],
            )
        )
        reflectors = tuple(item.reflector for item in reflections)
        reflectors = reflectors if any(reflectors) else ()
        return Mesh(
            vertices, triangles, transmittances, numbers.astype(np.uint32), uvs, reflectors, reflector_uvs
        ).finite()
    finally:
        obj.to_mesh_clear()


def _image_uvs(
    mesh, transforms: Sequence[UVTransform | None], numbers: np.ndarray, corners: np.ndarray
) -> np.ndarray | None:
    """UVs of each triangle's corners in its material's image, float32 (M, 3, 2)."""
    if not any(transforms):
        return None
    image_uvs = np.zeros((*corners.shape, 2), np.float32)
    for number, transform in enumerate(transforms):
        chosen = numbers == number
        if transform is not None and chosen.any():
            uvs = _uvs(mesh, transform.uv_map)
            at = np.zeros((chosen.sum(), 3, 2)) if uvs is None else uvs[corners[chosen]]
            matrix = np.array(transform.matrix)
            image_uvs[chosen] = at @ matrix[:, :2].T + matrix[:, 2]
    return np.clip(np.nan_to_num(image_uvs), -1e6, 1e6)  # larger UVs have no texels in single precision


def _vertices(mesh) -> np.ndarray:
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    return vertices.reshape(-1, 3)


def _transform(points: np.ndarray, matrix) -> np.ndarray:
    world = np.array(matrix, dtype=float)
    return points.astype(float) @ world[:3, :3].T + world[:3, 3]


def read_polygons(obj, material_name: str, matrix=None, uv_map: str = "", is_tiled: bool = False) -> Polygons:
    """Faces of an evaluated object that carry the material, in world space.

    Parameters
    ----------
    matrix : transform to the world; None: the object's own.
    uv_map : name of the map of their UVs; "": the one that renders or, if this does not fit into one image, a map of
        our own.
    is_tiled : True if the image has UDIM tiles.

    Raises
    ------
    ReceiverError
        The object has no faces, no UV map of that name, no finite position or more faces than fit into the memory; a
        face crosses the border of a tile.
    """
    matrix = obj.matrix_world if matrix is None else matrix
    _check_memory(obj, obj.data)

    def placed(polygons: Polygons) -> Polygons:
        return in_tiles(polygons, obj.name) if is_tiled else polygons

    mesh = obj.to_mesh()
    try:
        if mesh is None or not len(mesh.polygons):
            raise ReceiverError(f"'{obj.name}' has no faces.", NO_FACES_REMEDY.get(obj.type, NO_FACES_REMEDY["MESH"]))
        _check_memory(obj, mesh)
        chosen, everything = faces_with(obj, mesh, {material_name}), polygons_of(mesh, matrix)
        if uv_map:
            uvs = _uvs_by_name(obj, mesh, uv_map)
            return placed(_part(replace(everything, uvs=uvs, uv_map=uv_map), chosen))
        polygons = placed(_part(everything, chosen))
        uvs = _uvs(mesh, OWN_MAP)
        if uvs is None or not polygons.count:
            return polygons
        if _fits(polygons):
            # By its name, so that the image keeps it when the artist makes another one render.
            return replace(polygons, uv_map=OWN_MAP) if _renders(mesh, OWN_MAP) else polygons
        again = placed(_part(replace(everything, uvs=uvs.astype(float), uv_map=OWN_MAP), chosen))
        return again if _fits(again) else polygons
    finally:
        obj.to_mesh_clear()


def _part(everything: Polygons, chosen: np.ndarray) -> Polygons:
    """Some faces of a mesh, which know the others unless their positions are not finite."""
    part = everything.of_faces(chosen)
    if part.count == everything.count or not everything.is_finite.all():
        return part
    return replace(part, whole=replace(everything, uvs=None))


def remedy_for(obj, remedy: str) -> str:
    """The advice about an object: text and curves have neither the Edit Mode nor the UV maps of a mesh."""
    if obj.type == "MESH" or remedy in NO_FACES_REMEDY.values() or not any(words in remedy for words in FOR_MESHES):
        return remedy
    return f"Convert it to a mesh first (Object > Convert > Mesh). {remedy}"


def _renders(mesh, name: str) -> bool:
    """True if the UV map of that name is the one that renders."""
    return any(layer.active_render and layer.name == name for layer in mesh.uv_layers)


def _check_memory(obj, data) -> None:
    """Raise ReceiverError if the faces of an object would take more memory than the limit, or than there is.

    `data` is its mesh; curves and text have none until it is made.
    """
    count, limit = len(getattr(data, "loops", ())), memory_limit() or machine_bytes()
    needed = BYTES_PER_CORNER * count
    if limit and needed > limit:
        text = (
            f"The {len(data.polygons)} faces of '{obj.name}' take about {needed / 2**30:.1f} GB of memory, and "
            f"{limit / 2**30:.1f} GB are allowed."
        )
        remedy = "Simplify the mesh (modifier Decimate), or raise the memory limit in the add-on's preferences."
        raise ReceiverError(text, remedy)


def _uvs_by_name(obj, mesh, name: str) -> np.ndarray:
    """UVs of each loop, float64 (N, 2), in the map of that name."""
    uvs = _uvs(mesh, name)
    if uvs is None:
        names = " and ".join(f"'{layer.name}'" for layer in mesh.uv_layers)
        text = f"'{obj.name}' has no UV map '{name}', which the Beamspread node asks for."
        text += f" It has {names}." if names else " It has none."
        remedy = "Choose another one in the node, or clear the field."
        raise ReceiverError(text, OWN_MAP_REMEDY if name == OWN_MAP else remedy)
    return uvs.astype(float)


def _fits(polygons: Polygons) -> bool:
    """True if the UV map shows each face in a place of its own."""
    try:
        check_map(polygons)
    except ReceiverError:
        return False
    return True


def polygons_of(mesh, matrix) -> Polygons:
    """All faces of a mesh, in world space."""
    totals, first = (np.empty(len(mesh.polygons), np.int32) for _ in range(2))
    mesh.polygons.foreach_get("loop_total", totals)
    mesh.polygons.foreach_get("loop_start", first)
    normals = np.empty(len(mesh.polygons) * 3, np.float32)
    mesh.polygons.foreach_get("normal", normals)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    uvs, vertices, shading = _uvs(mesh), _vertices(mesh), compat.corner_normals(mesh)
    starts = np.concatenate([[0], np.cumsum(totals)]).astype(int)
    loops = np.repeat(first - starts[:-1], totals) + np.arange(starts[-1])
    world = np.array(matrix, dtype=float)[:3]
    if not is_within(world, 1.0):
        raise ReceiverError(INFINITE_MATRIX, MATRIX_REMEDY)
    world = _regular(world[:, :3])
    # Normals transform with the inverse transpose, which also keeps them outward under mirroring.
    inverse = np.linalg.inv(world)
    return Polygons(
        corners=_transform(vertices[corners[loops]], matrix),
        uvs=None if uvs is None else uvs[loops].astype(float),
        starts=starts,
        normals=_unit(normals.reshape(-1, 3) @ inverse),
        corner_normals=None if shading is None else _unit(shading[loops] @ inverse).astype(np.float32),
    )


def _unit(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)


def _regular(world: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) with a length along an axis of scale 0: planes may have one, which only their normals need."""
    left, scales, right = np.linalg.svd(world)
    if not scales[1] > NO_SCALE * scales[0]:
        raise ReceiverError(
            "The object's scale is zero along more than one axis.", "Clear it (Object > Clear > Scale)."
        )
    if scales[2] > NO_SCALE * scales[0]:
        return world
    # The sign keeps normals outward.
    scales[2] = scales[0] * np.sign(np.linalg.det(left) * np.linalg.det(right))
    return left * scales @ right


def _uvs(mesh, name: str = "") -> np.ndarray | None:
    """UVs of each loop, float32 (N, 2), in the map of that name, or without a name in the map that renders."""
    layer = next((layer for layer in mesh.uv_layers if (layer.name == name if name else layer.active_render)), None)
    if layer is not None:
        uvs = np.empty(len(mesh.loops) * 2, np.float32)
        layer.data.foreach_get("uv", uvs)
        return uvs.reshape(-1, 2)
    # Blender 3.4 stores UVs of geometry nodes as vectors.
    attribute = mesh.attributes.get(name) if name else None
    if attribute is None or (attribute.domain, attribute.data_type) != ("CORNER", "FLOAT_VECTOR"):
        return None
    vectors = np.empty(len(mesh.loops) * 3, np.float32)
    attribute.data.foreach_get("vector", vectors)
    return np.ascontiguousarray(vectors.reshape(-1, 3)[:, :2])


def faces_with(obj, mesh, materials: Collection[str]) -> np.ndarray:
    """Numbers of the faces that carry one of the materials; a slot too high stands for the last one, as in Blender."""
    slots = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", slots)
    matches = np.array(
        [bool(slot.material and slot.material.name in materials) for slot in obj.material_slots] or [False]
    )
    return np.flatnonzero(matches[np.clip(slots, 0, len(matches) - 1)])
