"""Digests of the objects that bakes read: lamps, and solids, which block, emit and reflect light."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Matrix

from ....core.bake.surface import OPEN
from ... import compat
from ...node.find import find_node_in_groups
from ...read.digests import TreeDigest, digest, digest_of_mesh, values_of
from ...read.emitters import VARYING, radiance_of
from ...read.lamps import is_portal, read_lamp
from ...read.lights import links_of
from ...read.scene_cache import scene_cache
from ...read.transparency import transmittance_of
from ...read.visibility import (
    SOLID_TYPES,
    SURFACE_TYPES,
    casts_shadows,
    lights_surfaces,
    placed,
    render_visible_names,
    renders,
)

# Blender changes the number of trails on loading.
_PARTICLE_LOOKS = set(bpy.types.ID.bl_rna.properties.keys()) | {"animation_data", "trail_count"}
_MODIFIER_LOOKS = {
    "execution_time",
    "show_viewport",
    "levels",
    "persistent_uid",
    "object",
    "is_active",
    "particle_system",
}


class _Instance(NamedTuple):
    """One instance of an object: hash of its shape and place; full name and digest of the material of each slot."""

    number: int
    looks: list[tuple[str, str]]

    def without(self, own: str | None) -> int:
        """Hash of the instance. Of the material with the full name `own`, only its slot counts."""
        return _number(self.number, self.looks_without(own))

    def looks_without(self, own: str | None) -> list[str]:
        """Digests of the materials; [] if none emits light or lets any through."""
        looks = ["own" if name == own else text for name, text in self.looks]
        return looks if any(looks) else []


class ObjectDigests:
    """Hashes of the objects of a scene that render, and of instances: numbers, so that their sum has no order.

    Objects that the window hides are read without modifiers; the values of modifiers always count.

    Attributes
    ----------
    lamps : sum of the hashes of all lamps.
    images : full names of the images that the nodes of lamps and materials show, in the order in which they are met.
    """

    def __init__(self, depsgraph, is_for_bake: bool) -> None:
        """`is_for_bake`: as for `fingerprints`."""
        scene = depsgraph.scene.original
        self._depsgraph, self._is_for_bake, self._bounces = depsgraph, is_for_bake, scene.beamspread.use_indirect
        self._visible = render_visible_names(depsgraph.view_layer)
        self.lamps, self.images = 0, {}
        self._instances: dict[str, list[_Instance]] = defaultdict(list)
        shown = [*placed(depsgraph, (obj for obj in scene.objects if obj.name in self._visible))]
        self._names = {obj.name for obj, *_ in shown if obj.type in SOLID_TYPES}
        for obj, matrix, instancer in shown:
            if not obj.is_instancer or obj.show_instancer_for_render:
                self._add(obj, matrix, instancer)
        scatterers = [(instancer or obj).original for obj, _, instancer in shown if _scatters(obj)]
        if scatterers:
            self._add_scattered([*dict.fromkeys(scatterers)])
        self._sums, self._users = Counter(), defaultdict(set)
        for name, instances in self._instances.items():
            self._sums[name] = sum(instance.without(None) for instance in instances)
            for instance in instances:
                for material_name, _ in instance.looks:
                    self._users[material_name].add(name)

    def solids(self, own: str) -> Counter[str]:
        """Sum of the hashes of all instances of each object but lamps, by name; `own` as for `_Instance.without`."""
        solids = Counter(self._sums)
        for name in self._users[own]:
            solids[name] = sum(instance.without(own) for instance in self._instances[name])
        return solids

    def shape_of(self, name: str) -> int:
        """Sum of the hashes of all instances of an object, without its materials."""
        return sum(instance.number for instance in self._instances[name])

    def other_materials(self, name: str, own: str) -> str:
        """Digest of the materials of an object's slots, `own` as for `_Instance.without`."""
        return digest([instance.looks_without(own) for instance in self._instances[name]])

    def look_of(self, material) -> str:
        """Digest of the light that a material lets through and emits; of all of the material if light bounces."""
        return self._whole(material) if self._bounces else self._light_of(material)

    def _add(self, obj, matrix: Matrix, instancer) -> None:
        """Add an evaluated object; `instancer` has an instance of it, or is None."""
        is_lit = lights_surfaces(obj, instancer)
        if obj.type == "LIGHT" and is_lit and not is_portal(obj.data):
            self.lamps += self._lamp(obj, matrix)
        elif obj.type in (SOLID_TYPES if self._bounces else SURFACE_TYPES) and not _is_faceless(obj.original):
            casts = casts_shadows(obj, instancer)
            looks = self._looks(_shown_materials(obj))
            glows = any(text for _, text in looks)
            links = self._links(obj) if is_lit and glows else []
            unseen = [] if is_lit or not (glows or self._bounces) else ["unseen"]
            number = _number(self._shape(obj), _rows(matrix), casts, links, *unseen)
            self._instances[obj.name].append(_Instance(number, looks))

    def _lamp(self, obj, matrix: Matrix) -> int:
        light, reason = read_lamp(obj, matrix)
        tree = self._noted(scene_cache.tree(obj.data)) if compat.lamp_uses_nodes(obj.data) else TreeDigest()
        return _number(light and replace(light, name=""), reason and tree.text, self._links(obj))

    def _links(self, obj) -> list:
        """Names of the objects that the object's light is linked to; [] if it is linked to all."""
        links = [*links_of(obj, self._names).values()]
        if all(names is None for names in links):
            return []
        return [names if names is None else sorted(names & self._names) for names in links]

    def _shape(self, obj) -> str:
        """Digest of a mesh, modifiers and particles; of a name where there is no mesh."""
        if obj.type not in SURFACE_TYPES:
            return obj.data.name_full if obj.data else ""

        block = obj.original

        def read() -> str:
            # The originals' settings: Blender 3.4 crashes when evaluated particles are read.
            modifiers = [(item.show_render, item.type, values_of(item, _MODIFIER_LOOKS)) for item in block.modifiers]
            particles = [
                (system.seed, values_of(system.settings, _PARTICLE_LOOKS)) for system in block.particle_systems
            ]
            return digest(digest_of_mesh(obj), modifiers, particles)

        return scene_cache.get(("shape", block, self._is_for_bake and not obj.is_evaluated), [block], read)

    def _looks(self, materials: Iterable) -> list[tuple[str, str]]:
        return [("" if material is None else material.name_full, self.look_of(material)) for material in materials]

    def _light_of(self, material) -> str:
        """Digest of the light that a material emits and lets through; "" for none."""
        if material is None:
            return ""
        tree = self._noted(scene_cache.tree(material))
        if not tree.images:
            color, radiance = transmittance_of(material, scene_cache).color, radiance_of(material, scene_cache)
            if radiance is None and not any(color):
                return ""
            if radiance is not VARYING:
                return digest(color, radiance is not None and radiance.tolist())
        return digest(tree.text, compat.has_transparent_shadow(material))

    def _whole(self, material) -> str:
        """Digest of all of a material; one with a Beamspread node counts by its medium, not by its baked image."""
        place = None if material is None else find_node_in_groups(material.original)
        if place is not None:
            return digest(surface_values(*place), self._noted(texture_tree(material, *place)).text)
        tree = TreeDigest() if material is None else self._noted(scene_cache.tree(material, is_whole=True))
        plain = None if material is None or compat.uses_nodes(material) else tuple(material.diffuse_color)
        return digest(tree.text, material and compat.has_transparent_shadow(material), plain)

    def _noted(self, tree: TreeDigest) -> TreeDigest:
        self.images |= dict.fromkeys(tree.images)
        return tree

    def _add_scattered(self, scatterers: list) -> None:
        """Add instances from geometry nodes, particles, vertices and faces, as parts of the object that has them."""
        transforms = tuple((obj.name, repr(_rows(obj.matrix_world))) for obj in scatterers)
        state = scene_cache.geometry_time, frozenset(self._visible), transforms

        def read() -> dict:
            return _scattered(self._depsgraph, scatterers, self._visible)

        for name, (number, names) in scene_cache.get(("scattered",), [], read, state=state).items():
            looks = self._looks(map(bpy.data.materials.get, names))
            self._instances[name].append(_Instance(number, looks))


def texture_tree(material, node, groups: tuple) -> TreeDigest:
    """Digest of the nodes before the Base Color of a material's node."""
    return scene_cache.texture(material, node.color_input(groups)) if node.has_texture() else TreeDigest()


def surface_values(node, _groups: tuple = (), side: str = "") -> list:
    """Values of a Beamspread node that bakes read, without those that are linked to it.

    `side`: of the target; digests of earlier versions, which knew no light on the back of slabs, have none.
    """
    surface = node.surface()
    edges, use = [] if surface.edges == OPEN else [surface.edges], node.texture_use()
    texture = node.has_texture() and (use.method if use.is_scattered else use.blur)
    return [repr(surface), side if surface.thickness > 0 else "", texture, *edges]


def _is_faceless(obj) -> bool:
    """True for paths and for meshes without faces, if nothing gives them any: no light meets them."""
    if obj.modifiers or obj.particle_systems:
        return False
    data = obj.data
    if obj.type == "CURVE":
        return data.dimensions == "3D" and data.bevel_object is None and data.extrude == data.bevel_depth == 0
    return obj.type == "MESH" and not data.polygons


def _scatters(obj) -> bool:
    """True if the object may have instances that are no objects of the scene."""
    if obj.instance_type in ("VERTS", "FACES") or any(modifier.type == "NODES" for modifier in obj.modifiers):
        return True
    return any(system.settings.render_type in ("OBJECT", "COLLECTION") for system in obj.particle_systems)


def _scattered(depsgraph, scatterers: list, visible: set[str]) -> dict[str, tuple[int, list[str]]]:
    """By name of an object that has instances: a hash of these, and the names of their materials."""
    seen = {obj: ({}, []) for obj in scatterers}
    for instance in depsgraph.object_instances:
        parent = instance.parent.original if instance.is_instance and instance.parent is not None else None
        if parent in seen and renders(instance, visible):
            obj, (shapes, matrices) = instance.object, seen[parent]
            key = obj.data.as_pointer() if obj.data is not None else 0
            if key not in shapes:
                materials = [slot.material.name for slot in obj.material_slots if slot.material is not None]
                shapes[key] = _content(obj), materials
            # Hashes of matrices: an array of these takes ten times as long.
            matrices.append((key, hash(instance.matrix_world.copy().freeze())))
    scattered = {}
    for obj, (shapes, matrices) in seen.items():
        number = _number([(shapes[key][0], matrix) for key, matrix in matrices])
        scattered[obj.name] = number, [name for _, names in shapes.values() for name in names]
    return scattered


def _content(obj) -> str:
    """Digest of a scattered object."""
    if obj.type == "LIGHT":
        return digest(read_lamp(obj, Matrix()))
    return digest(obj.type, digest_of_mesh(obj) if obj.type == "MESH" else "")


def _shown_materials(obj) -> list:
    """The materials of an object's slots, without those at the end that no face has."""
    materials = [slot.material for slot in obj.material_slots]
    if len(materials) > 1 and obj.type == "MESH":
        # An evaluated mesh in Edit Mode has no polygons.
        del materials[max(_largest_slot(obj.data), _largest_slot(obj.original.data)) + 1 :]
    return materials if any(materials) else []


def _largest_slot(mesh) -> int:
    indices = np.zeros(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", indices)
    return int(indices.max(initial=0))


def _number(*values) -> int:
    return int(digest(*values), 16)


def _rows(matrix: Matrix) -> list:
    return np.array(matrix, np.float32).tolist()
