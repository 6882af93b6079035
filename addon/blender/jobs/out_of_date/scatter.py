"""Digests of instances from geometry nodes, particles, and instancing on vertices and faces."""

from __future__ import annotations

import hashlib
from collections.abc import Collection

import numpy as np


def scatters(obj) -> bool:
    """True if the object may have instances that are no objects of the scene."""
    if obj.instance_type in ("VERTS", "FACES") or any(modifier.type == "NODES" for modifier in obj.modifiers):
        return True
    return any(one.settings.render_type in ("OBJECT", "COLLECTION") for one in obj.particle_systems)


class Scatter:
    """Digests of the instances of objects, cached until geometry or the object's transform changes."""

    def __init__(self) -> None:
        self._kept: dict[int, tuple] = {}  # by object: its transform, digest, materials of its instances

    def forget(self) -> None:
        self._kept.clear()

    def look(self, depsgraph, objects: Collection) -> None:
        """Scan the objects that are not cached, in one pass, since there may be many instances."""
        unknown = {obj for obj in objects if self._kept.get(obj.as_pointer(), (None,))[0] != _place(obj)}
        if not unknown:
            return
        found: dict = {obj: _Found() for obj in unknown}
        for instance in depsgraph.object_instances:
            if instance.is_instance and instance.parent is not None:
                parent = instance.parent.original
                if parent in found:
                    found[parent].add(instance)
        for obj, one in found.items():
            self._kept[obj.as_pointer()] = _place(obj), one.digest(), one.materials

    def of(self, obj) -> tuple[str, list]:
        """Digest of the object's instances, and their materials."""
        _, text, materials = self._kept[obj.as_pointer()]
        return text, materials


class _Found:
    """Instances of one object."""

    def __init__(self) -> None:
        self._places: list[int] = []  # hashes of matrices: an array of these takes ten times as long
        self._shapes: dict[int, str] = {}
        self._order: list[int] = []
        self.materials: list = []

    def add(self, instance) -> None:
        obj = instance.object
        key = obj.data.as_pointer() if obj.data is not None else 0
        if key not in self._shapes:
            self._shapes[key] = _shape(obj)
            self.materials += [slot.material.original for slot in obj.material_slots if slot.material is not None]
        self._order.append(key)
        self._places.append(hash(instance.matrix_world.copy().freeze()))

    def digest(self) -> str:
        hashed = hashlib.blake2b(digest_size=8)
        hashed.update(np.array(self._places, np.int64).tobytes())
        hashed.update(repr([self._shapes[key] for key in self._order]).encode())
        return hashed.hexdigest()


def _shape(obj) -> str:
    """Digest of the shape of an evaluated object, which geometry nodes may have made."""
    hashed = hashlib.blake2b(obj.type.encode(), digest_size=8)
    vertices = getattr(obj.data, "vertices", None)
    if vertices is None:
        return hashed.hexdigest()
    places = np.empty(3 * len(vertices), np.float32)
    vertices.foreach_get("co", places)
    hashed.update(places.tobytes())
    hashed.update(str(len(obj.data.polygons)).encode())
    return hashed.hexdigest()


def _place(obj) -> tuple:
    return tuple(value for row in obj.matrix_world for value in row)
