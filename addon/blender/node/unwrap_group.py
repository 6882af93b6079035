"""A modifier that gives a mesh its UV map after all others, which may multiply faces.

Its node group reads the UVs from the vertices of a mesh that no scene shows: vertex i has those of face corner i.
Blender's own nodes UV Unwrap and Pack UV Islands make maps without area for closed smooth meshes, and maps that overlap
for faces without area.
"""

from __future__ import annotations

import bpy
import numpy as np

from .. import compat
from ..read.geometry import OWN_MAP

NAME = "Beamspread UV Map"
"""Name of the modifier, of its node group and of the mesh with the UVs."""

SOURCE = "UVs"
"""Input of the node group: the object whose vertices are the UVs."""


def set_uvs(obj, uvs: np.ndarray, before=None) -> None:
    """Give the face corners of an object, after its modifiers, UVs (K, 2) by the modifier, which is its last one.

    `before` is a modifier of the object that comes after it, None for none.
    """
    # A new modifier tells Blender about its new source. A copy of an object shares the source until its faces differ.
    if find_modifier(obj) is not None:
        remove_modifier(obj)
    mesh = bpy.data.meshes.new(NAME)
    mesh.vertices.add(len(uvs))
    mesh.vertices.foreach_set("co", np.column_stack([uvs, np.zeros(len(uvs))]).astype(np.float32).ravel())
    modifier = obj.modifiers.new(NAME, "NODES")
    modifier.node_group = next((tree for tree in bpy.data.node_groups if _is_group(tree)), None) or _make_group()
    compat.set_group_input(modifier, SOURCE, bpy.data.objects.new(NAME, mesh))
    if before is not None:
        compat.move_modifier(obj, modifier, list(obj.modifiers).index(before))
    obj.update_tag()


def remove_modifier(obj) -> None:
    """Remove the modifier, and its UVs unless a copy of the object uses them."""
    modifier = find_modifier(obj)
    source = compat.group_input(modifier, SOURCE)
    obj.modifiers.remove(modifier)
    if source is not None and source.users == 0:
        mesh = source.data
        bpy.data.objects.remove(source)
        if mesh.users == 0:
            bpy.data.meshes.remove(mesh)


def find_modifier(obj):
    """The modifier of an object, or None."""
    return next((item for item in obj.modifiers if item.type == "NODES" and _is_group(item.node_group)), None)


def _is_group(tree) -> bool:
    is_local = tree is not None and tree.name.startswith(NAME) and tree.library is None
    return is_local and tree.bl_idname == "GeometryNodeTree" and compat.input_identifier(tree, SOURCE) is not None


def _make_group():
    tree = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    compat.add_input_socket(tree, "NodeSocketGeometry", "Geometry")
    compat.add_input_socket(tree, "NodeSocketObject", SOURCE)
    compat.add_output_socket(tree, "NodeSocketGeometry", "Geometry")
    if hasattr(tree, "is_modifier"):
        tree.is_modifier = True
    given, result = _add(tree, "NodeGroupInput", -600), _add(tree, "NodeGroupOutput", 600)
    source, position = _add(tree, "GeometryNodeObjectInfo", -300), _add(tree, "GeometryNodeInputPosition", -300)
    corner, sample = _add(tree, "GeometryNodeInputIndex", -300), _add(tree, "GeometryNodeSampleIndex", 0)
    store = _add(tree, "GeometryNodeStoreNamedAttribute", 300)
    sample.data_type, sample.domain = "FLOAT_VECTOR", "POINT"
    store.data_type, store.domain = compat.uv_attribute_type(), "CORNER"
    store.inputs["Name"].default_value = OWN_MAP
    link = tree.links.new
    link(source.inputs["Object"], given.outputs[SOURCE])
    link(sample.inputs["Geometry"], source.outputs["Geometry"])
    link(_vector(sample.inputs), position.outputs["Position"])
    link(sample.inputs["Index"], corner.outputs["Index"])
    link(_vector(store.inputs), _vector(sample.outputs))
    link(store.inputs["Geometry"], given.outputs["Geometry"])
    link(result.inputs["Geometry"], store.outputs["Geometry"])
    return tree


def _vector(sockets):
    """The socket named Value that takes vectors: up to 3.6 a node has one for each type."""
    return next(socket for socket in sockets if socket.name == "Value" and socket.type == "VECTOR")


def _add(tree, kind: str, x: float):
    node = tree.nodes.new(kind)
    node.location.x = x
    return node
