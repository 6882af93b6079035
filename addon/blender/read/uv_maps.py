"""UV maps of meshes: the one that a bake uses, and a map of our own where no other fits into one image."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...core.errors import BakeError, ReceiverError
from ...core.messages import Message, note
from ...core.scene.islands import check_map
from ...core.scene.unwrap import unwrap
from .geometry import OWN_MAP, polygons_of, read_polygons
from .visibility import ObjectInstance, find_instances

Outcome = Message | BakeError
"""A note about a new map, or the reason why there can be none."""


def make_maps(depsgraph, targets: Iterable) -> dict[str, Outcome]:
    """Give each object without a UV map that fits into one image a map of its own; outcomes by the object's name.

    The other maps stay as they are, and so does the choice of the active one.
    """
    targets = list(targets)
    instances = find_instances(depsgraph, {target.object_name for target in targets})
    problems: dict[str, str] = {}
    for target in targets:
        instance = instances.get(target.object_name)
        if instance is not None and instance.obj.type == "MESH":
            problem = problem_of(instance, target.material_name)
            if problem:
                problems.setdefault(target.object_name, problem)
    return {name: _make(depsgraph, instances[name].obj.original, problem) for name, problem in problems.items()}


def problem_of(instance: ObjectInstance, material_name: str) -> str:
    """Sentence that says why no UV map of a material's faces fits into one image; "" if one does."""
    polygons = read_polygons(instance.obj, material_name, instance.matrix)
    try:
        if polygons.count:
            check_map(polygons)
    except ReceiverError as error:
        return error.text
    return ""


def _make(depsgraph, obj, problem: str) -> Outcome:
    mesh = obj.data
    if mesh.library is not None or mesh.override_library is not None:
        text = f"{problem} '{obj.name}' belongs to another .blend file, so it can't get a map of its own."
        return ReceiverError(text, "Make it local (Object > Relations > Make Local > Selected Objects and Data).")
    if mesh.is_editmode:
        return ReceiverError(f"{problem} A bake makes a map of its own.", "Leave Edit Mode first.")
    layer = mesh.uv_layers.get(OWN_MAP)
    is_new = layer is None
    layer = layer or _new_layer(mesh)
    if layer is None:
        return ReceiverError(f"{problem} The mesh has as many UV maps as it can have.", "Remove one of them.")
    uvs = unwrap(polygons_of(mesh, np.array(obj.matrix_world, float)))
    layer.data.foreach_set("uv", uvs.astype(np.float32).ravel())
    mesh.update()
    depsgraph.update()
    copies = obj.evaluated_get(depsgraph).data
    if len(copies.loops) != len(mesh.loops):
        if is_new:
            mesh.uv_layers.remove(mesh.uv_layers[OWN_MAP])
        return ReceiverError(
            f"{problem} Its modifiers make new faces, which a map of the mesh does not cover.",
            "Apply them (Object > Apply > Visual Geometry to Mesh).",
        )
    return note(obj.name, f"'{obj.name}' has a new UV map '{OWN_MAP}', which its image uses. {problem}")


def _new_layer(mesh):
    """A new UV map; None if there is no room. The active maps stay active."""
    layers = mesh.uv_layers
    active, rendered = layers.active_index, [layer.active_render for layer in layers]
    had_any = bool(rendered)
    layer = layers.new(name=OWN_MAP, do_init=False)
    if layer is not None and had_any:
        layers.active_index = active
        layers[rendered.index(True) if True in rendered else 0].active_render = True
    return layer


def map_name(obj, name: str) -> str:
    """Name of a UV map of an evaluated object; "" is the one that renders."""
    return name or next((layer.name for layer in obj.data.uv_layers if layer.active_render), "")
