"""Objects and instances that throw shadows, as meshes and the places where they stand."""

from __future__ import annotations

import numpy as np

from ...core.scene.occluders import Mesh, Occluder
from .geometry import GEOMETRY_TYPES, local_mesh
from .kept import Kept


class OccluderReader:
    """Collects them from the instances of a depsgraph; each mesh and each material is read once."""

    def __init__(self, kept: Kept) -> None:
        self._kept = kept
        self._meshes: dict[tuple, Mesh | None] = kept.meshes
        self._places: dict[tuple, list] = {}  # by name and key of the mesh

    def add(self, instance) -> None:
        """An entry of `depsgraph.object_instances` that renders, of any type; it counts if it throws shadows."""
        obj = instance.object
        owners = (obj, instance.parent) if instance.is_instance else (obj,)
        if obj.type not in GEOMETRY_TYPES or not all(getattr(owner, "visible_shadow", True) for owner in owners):
            return
        data = obj if obj.data is None else obj.data
        key = (
            data.as_pointer(),
            data.name,
            *(slot.material.name_full if slot.material else None for slot in obj.material_slots),
        )
        if key not in self._meshes:
            self._meshes[key] = local_mesh(obj, self._kept.transparency)
            self._kept.note(self._meshes, key, instance)
        if self._meshes[key] is not None:
            matrix = instance.matrix_world
            self._places.setdefault((obj.name, key), []).append((*matrix[0], *matrix[1], *matrix[2]))

    @property
    def warnings(self) -> list[str]:
        return self._kept.transparency.warnings

    def occluders(self) -> list[Occluder]:
        return [
            Occluder(name, self._meshes[key], np.array(places, float).reshape(-1, 3, 4))
            for (name, key), places in self._places.items()
        ]
