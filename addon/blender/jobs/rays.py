"""Rays that Blender traces among the evaluated objects, before anything is read for a bake."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mathutils import Vector

from ...core.bake.surroundings import Surroundings, directions_of
from ...core.scene.lights import Light, WorldLight

# Places on the object from which rays start, and directions from each. More: surer, slower scans.
PLACES, DIRECTIONS = 16, 8

# Length that keeps a ray off the surface from which it starts, relative to the size of the object.
LIFT = 1e-3

# Length of a ray without an end; Blender takes single precision.
FAR = 1e9


def traced_around(depsgraph, obj, side: float, lights: Sequence[Light]) -> Surroundings:
    """Surroundings of the faces of an object; `side`: -1 for the faces' backs, else 1."""
    places, normals = _places_on(obj.evaluated_get(depsgraph), side)
    if not len(places):
        return Surroundings()
    directions = [directions_of(normal, DIRECTIONS, turn) for turn, normal in enumerate(normals)]
    starts = np.repeat(places, DIRECTIONS, axis=0)
    enclosed = float(np.mean([_is_blocked(depsgraph, *ray) for ray in zip(starts, np.concatenate(directions))]))
    parts = [
        float(not _is_blocked(depsgraph, place, *way))
        for light in lights
        for place, normal in zip(places, normals)
        if (way := _way_to(light, place)) is not None and way[0] @ normal > 0
    ]
    parts += [1.0 - enclosed for light in lights if isinstance(light, WorldLight)]
    return Surroundings(enclosed, float(np.mean(parts)) if parts else 1.0)


def _places_on(obj, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (N, 3) a little above some faces of an evaluated object, and the normals there.

    Each of few faces has several places.
    """
    mesh, matrix = obj.data, np.array(obj.matrix_world)
    if not len(mesh.polygons):
        return np.zeros((0, 3)), np.zeros((0, 3))
    turn = side * np.linalg.pinv(matrix[:3, :3]).T
    lift = LIFT * max(obj.dimensions)
    places, normals = [], []
    for number in np.unique(np.linspace(0, len(mesh.polygons) - 1, PLACES).astype(int)).tolist():
        face = mesh.polygons[number]
        normal = turn @ np.array(face.normal)
        normal /= np.linalg.norm(normal) or 1.0
        corners = [mesh.vertices[index].co for index in face.vertices] if len(mesh.polygons) < PLACES else []
        for point in [face.center, *((corner + face.center) / 2 for corner in corners)]:
            places.append(matrix[:3, :3] @ np.array(point) + matrix[:3, 3] + lift * normal)
            normals.append(normal)
    return np.array(places), np.array(normals)


def _way_to(light: Light, place: np.ndarray) -> tuple | None:
    """Direction and distance of a lamp; None if it has no place."""
    if hasattr(light, "direction"):
        return -np.array(light.direction), FAR
    if not hasattr(light, "position"):
        return None
    way = np.array(light.position) - place
    distance = float(np.linalg.norm(way))
    return (way / distance, distance) if distance > 0 else None


def _is_blocked(depsgraph, start, direction, distance: float = FAR) -> bool:
    """True if a ray meets a face within a distance."""
    return depsgraph.scene.ray_cast(depsgraph, Vector(start), Vector(direction), distance=distance)[0]
