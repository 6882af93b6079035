"""Reads a scene's light once, through its evaluated depsgraph."""

from __future__ import annotations

from ...core.scene.illumination import Illumination, Mesh
from .geometry import GEOMETRY_TYPES, world_triangles
from .lights import read_light
from .visible import render_visible_names, renders


def read_illumination(depsgraph) -> Illumination:
    """Lights and shadow casters of all objects and instances that render."""
    visible = render_visible_names(depsgraph.view_layer)
    lights, parts, warnings, cache = [], [], [], {}
    for instance in depsgraph.object_instances:
        if not renders(instance, visible):
            continue
        obj = instance.object
        if obj.type == "LIGHT":
            lights.append(read_light(obj, instance.matrix_world, warnings))
        elif obj.type in GEOMETRY_TYPES and getattr(obj, "visible_shadow", True):
            parts.append(world_triangles(obj, instance.matrix_world, cache))
    occluders = Mesh.join([part for part in parts if part is not None])
    return Illumination([light for light in lights if light is not None], occluders, tuple(dict.fromkeys(warnings)))
