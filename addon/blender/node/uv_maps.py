"""UV maps that bakes make, where no other map of an object fits into one image."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

import bmesh
import bpy
import numpy as np

from ...core.errors import BakeError, ReceiverError
from ...core.messages import Message, note
from ...core.scene.islands import check_map
from ...core.scene.polygons import Polygons
from ...core.scene.unwrap import unwrap, unwrap_together
from ...core.target import Target
from ..read.geometry import OWN_MAP, faces_with, polygons_of, read_polygons
from ..read.visibility import RECEIVER_TYPES, find_instances
from .find import node_of, uses_tiles
from .unwrap_group import NAME as MODIFIER
from .unwrap_group import find_modifier, remove_modifier, set_uvs

Outcome = Message | BakeError
"""A note about a new map, or the reason why there can be none."""


def make_maps(depsgraph, targets: Iterable[Target], fills_nodes: bool = False) -> dict[str, Outcome]:
    """Give each object without a UV map that fits into one image a map of its own; outcomes by the object's name.

    The other maps stay as they are, and so does the choice of the active one. Where modifiers make new faces, another
    modifier makes the map after them. If the results fill the nodes' images (`fills_nodes`), maps of objects that will
    share a new image, since they have one material, lie side by side.
    """
    targets = list(targets)
    problems = problems_of(depsgraph, targets)
    outcomes: dict[str, Outcome] = {}
    for objects, materials in _sharing(depsgraph, targets, problems) if fills_nodes else ():
        make_maps_together(depsgraph, {obj: _materials_of(obj) for obj in objects})
        depsgraph.update()
        names = {obj.name for obj in objects}
        names -= set(problems_of(depsgraph, [target for target in targets if target.object_name in names]))
        beside = f"The {len(names)} objects with {_named(materials)} lie side by side in it."
        for obj in objects:
            if obj.name in names:
                problem = problems.get(obj.name, "The image is new.")
                outcomes[obj.name] = note(obj.name, f"{problem} So {_added(obj)} {beside}")
    rest = {name: problem for name, problem in problems.items() if name not in outcomes}
    return outcomes | {name: _make(depsgraph, name, targets, problem) for name, problem in rest.items()}


def _sharing(depsgraph, targets: Iterable[Target], problems: Collection[str]) -> list[tuple[list, list[str]]]:
    """Objects that share materials without an image yet, with these, if bakes make or have made their maps.

    An object has one map for all of its materials, so those that share one material share the places of all.
    """
    by_object: dict[str, dict[str, Target]] = defaultdict(dict)
    for target in targets:
        by_object[target.object_name][target.material_name] = target
    groups: list[tuple[list, list[str]]] = []
    for name, instance in find_instances(depsgraph, set(by_object)).items():
        obj, own = instance.obj.original, by_object[name]
        if obj.type not in RECEIVER_TYPES or not (name in problems or _has_own_map(obj)):
            continue
        if not all(_wants_image(node_of(target)) for target in own.values()):
            continue
        if _is_foreign(obj) or getattr(obj.data, "is_editmode", False) or not _has_materials(depsgraph, obj):
            continue
        # A map that is made after subdivisions fits one of their levels alone.
        if _last_subdivisions(obj):
            continue
        joined = [group for group in groups if not own.keys().isdisjoint(group[1])]
        groups = [group for group in groups if group not in joined]
        objects = [obj for group in joined for obj in group[0]]
        materials = dict.fromkeys([*(name for group in joined for name in group[1]), *own])
        groups.append(([*objects, obj], list(materials)))
    return [group for group in groups if len(group[0]) > 1]


def _wants_image(node) -> bool:
    """True if the first bake of a node will make an image and choose a map for it."""
    return node is not None and not (node.uv_map or uses_tiles(node) or node.image or node.image_back)


def _materials_of(obj) -> set[str]:
    """Names of all materials of an object. One that gets a node later has its place, too."""
    return {slot.material.name for slot in obj.material_slots if slot.material is not None}


def _named(materials: list[str]) -> str:
    first, *others = materials
    if not others:
        return f"the material '{first}'"
    return f"the materials '{first}' and {repr(others[0]) if len(others) == 1 else f'{len(others)} more'}"


def _has_materials(depsgraph, obj) -> bool:
    """True if all faces of an object, after its modifiers, carry a material: a later bake may need places for all."""
    evaluated = obj.evaluated_get(depsgraph)
    try:
        mesh = evaluated.to_mesh()
        return len(faces_with(evaluated, mesh, _materials_of(obj))) == len(mesh.polygons)
    finally:
        evaluated.to_mesh_clear()


def _is_foreign(obj) -> bool:
    """True if an object or its mesh belongs to another .blend file."""
    return any(block.library or block.override_library for block in (obj, obj.data))


def _added(obj) -> str:
    """Sentence about the map of our own that an object has got."""
    if find_modifier(obj) is None:
        return f"'{obj.name}' has a new UV map '{OWN_MAP}', which its image uses."
    return f"'{obj.name}' has a new modifier '{MODIFIER}', which makes the UV map '{OWN_MAP}' for its image."


def problems_of(depsgraph, targets: Iterable[Target]) -> dict[str, str]:
    """Sentences that say why no UV map of an object fits into one image, by the object's name."""
    problems: dict[str, str] = {}
    targets = list(targets)
    instances = find_instances(depsgraph, {target.object_name for target in targets})
    for target in targets:
        instance = instances.get(target.object_name)
        if instance is None or instance.obj.type not in RECEIVER_TYPES:
            continue
        node = node_of(target)
        if getattr(node, "uv_map", ""):  # the artist has chosen one
            continue
        is_tiled = node is not None and uses_tiles(node)
        try:
            polygons = read_polygons(instance.obj, target.material_name, instance.matrix, is_tiled=is_tiled)
        except ReceiverError:
            continue  # no map mends it: the bake says what would
        try:
            if polygons.count and polygons.is_finite.all():
                check_map(polygons)
        except ReceiverError as error:
            problems.setdefault(target.object_name, error.text)
    return problems


def make_maps_together(depsgraph, materials: Mapping[object, Collection[str]]) -> list[Polygons]:
    """Give local objects maps of our own that lie side by side in one image, at one texel density.

    Parameters
    ----------
    materials : names of the materials whose faces get places in the image, by (original) object.

    Returns
    -------
    Their faces, with the new UVs.
    """
    # A modifier gives each of the objects that share a mesh a map of its own.
    by_layer = [_users(obj.data) == 1 and _keeps_faces(depsgraph, obj) for obj in materials]
    meshes = [
        _mesh_polygons(obj) if is_layer else _evaluated_polygons(depsgraph, obj)
        for obj, is_layer in zip(materials, by_layer)
    ]
    chosen = [_evaluated_faces(depsgraph, obj, names) for obj, names in materials.items()]
    parts = [polygons.of_faces(faces) for polygons, faces in zip(meshes, chosen)]
    parts = [replace(part, uvs=uvs) for part, uvs in zip(parts, unwrap_together(parts))]
    for obj, is_layer, polygons, faces, part in zip(materials, by_layer, meshes, chosen, parts):
        uvs = np.zeros((len(polygons.corners), 2), np.float32)
        uvs[np.isin(polygons.face_of, faces)] = part.uvs
        if is_layer and find_modifier(obj) is not None:
            remove_modifier(obj)
        if not is_layer or not _fill_layer(obj.data, uvs):  # the mesh may have as many maps as it can have
            set_uvs(obj, uvs)
    return parts


def _users(mesh) -> int:
    return mesh.users - mesh.use_fake_user


def objects_with_maps() -> set[str]:
    """Names of all objects that have a map of our own, or the modifier that makes it."""
    return {obj.name for obj in bpy.data.objects if obj.type in RECEIVER_TYPES and _has_own_map(obj)}


def _has_own_map(obj) -> bool:
    return OWN_MAP in getattr(obj.data, "uv_layers", ()) or find_modifier(obj) is not None


def _make(depsgraph, name: str, targets: list[Target], problem: str) -> Outcome:
    obj = find_instances(depsgraph, {name})[name].obj.original
    mesh = obj.data
    if _is_foreign(obj):
        text = f"{problem} '{name}' belongs to another .blend file, so it can't get a map of its own."
        return ReceiverError(
            text, "Make it local (Object > Relations > Make Local > Selected Objects, Data and Materials)."
        )
    if mesh.is_editmode:
        obj.update_from_editmode()
    before = _make_before_subdivision(depsgraph, obj, targets)
    if before:
        added = before
    elif _keeps_faces(depsgraph, obj):
        # The data of a mesh in Edit Mode are empty.
        polygons = _evaluated_polygons(depsgraph, obj) if mesh.is_editmode else _mesh_polygons(obj)
        if not _fill_layer(mesh, unwrap(polygons).astype(np.float32)):
            text = f"{problem} The mesh has as many UV maps as it can have."
            return ReceiverError(text, "Remove one of them.")
        added = _added(obj)
    else:
        set_uvs(obj, unwrap(_evaluated_polygons(depsgraph, obj)))
        depsgraph.update()
        if name in problems_of(depsgraph, [target for target in targets if target.object_name == name]):
            remove_modifier(obj)
            return ReceiverError(
                f"{problem} Its modifiers make new faces, and these could not be unwrapped.",
                "Apply the modifiers (Object > Apply > Visual Geometry to Mesh), and bake again.",
            )
        added = _added(obj)
    return note(name, f"{problem} So {added}")


def _make_before_subdivision(depsgraph, obj, targets: list[Target]) -> str:
    """Give a mesh whose last modifiers subdivide it a map of the faces before: it fits all levels of subdivision.

    The window mostly shows fewer levels than renders. Returns a sentence about the map; "" if there is none.
    """
    last = _last_subdivisions(obj)
    if obj.type != "MESH" or obj.data.is_editmode or not last:
        return ""
    for modifier in last:
        modifier.show_viewport = False
    depsgraph.update()
    is_layer, had_layer = _keeps_faces(depsgraph, obj), OWN_MAP in obj.data.uv_layers
    try:
        if is_layer and not _fill_layer(obj.data, unwrap(_mesh_polygons(obj)).astype(np.float32)):
            return ""
        if not is_layer:
            set_uvs(obj, unwrap(_evaluated_polygons(depsgraph, obj)), before=last[0])
    finally:
        for modifier in last:
            modifier.show_viewport = True
        depsgraph.update()
    if obj.name in problems_of(depsgraph, [target for target in targets if target.object_name == obj.name]):
        if not is_layer:
            remove_modifier(obj)
        elif not had_layer:
            obj.data.uv_layers.remove(obj.data.uv_layers[OWN_MAP])
        depsgraph.update()
        return ""
    return _added(obj)


def _last_subdivisions(obj) -> list:
    """Modifiers that subdivide an object after all others that are shown; our own does not count."""
    last = []
    for modifier in reversed(obj.modifiers):
        if modifier.type == "SUBSURF" and modifier.show_viewport:
            last.insert(0, modifier)
        elif modifier.show_viewport and modifier != find_modifier(obj):
            break
    return last


def _keeps_faces(depsgraph, obj) -> bool:
    """True if an object is a mesh, and its modifiers make no faces."""
    if obj.type != "MESH":
        return False
    evaluated = obj.evaluated_get(depsgraph)
    copy = evaluated.to_mesh()
    try:
        return len(copy.loops) == len(obj.data.loops) and len(copy.polygons) == len(obj.data.polygons)
    finally:
        evaluated.to_mesh_clear()


def _mesh_polygons(obj) -> Polygons:
    """All faces of an object's own mesh, in world space."""
    return polygons_of(obj.data, obj.matrix_world)


def _evaluated_faces(depsgraph, obj, materials: Collection[str]) -> np.ndarray:
    """Numbers of the faces of an object, after its modifiers, that carry one of the materials."""
    evaluated = obj.evaluated_get(depsgraph)
    try:
        return faces_with(evaluated, evaluated.to_mesh(), materials)
    finally:
        evaluated.to_mesh_clear()


def _evaluated_polygons(depsgraph, obj) -> Polygons:
    """All faces of an object, after its modifiers, in world space."""
    evaluated = obj.evaluated_get(depsgraph)
    try:
        return polygons_of(evaluated.to_mesh(), evaluated.matrix_world)
    finally:
        evaluated.to_mesh_clear()


def _fill_layer(mesh, uvs: np.ndarray) -> bool:
    """Store UVs in the map of our own of a mesh; False if there is no room for it. The active maps stay active."""
    layers = mesh.uv_layers
    if OWN_MAP not in layers:
        active, rendered = layers.active_index, next((layer.name for layer in layers if layer.active_render), "")
        if layers.new(name=OWN_MAP, do_init=False) is None:
            return False
        if rendered:
            layers.active_index, layers[rendered].active_render = active, True
    if mesh.is_editmode:
        _fill_edited(mesh, uvs)
    else:
        layers[OWN_MAP].data.foreach_set("uv", uvs.ravel())
        mesh.update()
    return True


def _fill_edited(mesh, uvs: np.ndarray) -> None:
    """Store UVs of all face corners in the map of our own of a mesh in Edit Mode."""
    edited = bmesh.from_edit_mesh(mesh)
    layer = edited.loops.layers.uv[OWN_MAP]
    loops = (loop for face in edited.faces for loop in face.loops)
    for loop, uv in zip(loops, uvs.tolist()):
        loop[layer].uv = uv
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)
