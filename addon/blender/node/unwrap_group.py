"""A modifier that makes a UV map after all others, which may multiply faces: geometry nodes unwrap and pack."""

from __future__ import annotations

import math

import bpy

from .. import compat
from ..read.geometry import OWN_MAP

NAME = "Beamspread UV Map"
"""Name of the modifier and of its node group."""

SEAM_ANGLE = math.radians(30)
"""Angle between faces from which an edge is a seam, as planes of a bake end there."""

MARGIN = 4 / 1024
"""Space around islands, over the side of the image."""


def add_modifier(obj):
    """Add the modifier to an object, as its last one."""
    modifier = obj.modifiers.new(NAME, "NODES")
    modifier.node_group = next((tree for tree in bpy.data.node_groups if _is_group(tree)), None) or _make_group()
    return modifier


def has_modifier(obj) -> bool:
    """True if the object has the modifier."""
    return any(modifier.type == "NODES" and _is_group(modifier.node_group) for modifier in obj.modifiers)


def _is_group(tree) -> bool:
    return tree is not None and tree.name.startswith(NAME) and tree.library is None


def _make_group():
    tree = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    compat.add_input_socket(tree, "NodeSocketGeometry", "Geometry")
    compat.add_output_socket(tree, "NodeSocketGeometry", "Geometry")
    if hasattr(tree, "is_modifier"):
        tree.is_modifier = True
    given, result = _add(tree, "NodeGroupInput", -600), _add(tree, "NodeGroupOutput", 800)
    angle, seam = _add(tree, "GeometryNodeInputMeshEdgeAngle", -600), _add(tree, "FunctionNodeCompare", -400)
    unwrap, pack = _add(tree, "GeometryNodeUVUnwrap", -200), _add(tree, "GeometryNodeUVPackIslands", 100)
    store = _add(tree, "GeometryNodeStoreNamedAttribute", 500)
    seam.data_type, seam.operation = "FLOAT", "GREATER_THAN"
    seam.inputs["B"].default_value = SEAM_ANGLE
    unwrap.inputs["Margin"].default_value = pack.inputs["Margin"].default_value = MARGIN
    store.data_type, store.domain = compat.uv_attribute_type(), "CORNER"
    store.inputs["Name"].default_value = OWN_MAP
    value = next(socket for socket in store.inputs if socket.name == "Value" and socket.type == "VECTOR")
    link = tree.links.new
    link(seam.inputs["A"], angle.outputs["Unsigned Angle"])
    link(unwrap.inputs["Seam"], seam.outputs["Result"])
    link(pack.inputs["UV"], unwrap.outputs["UV"])
    link(value, pack.outputs["UV"])
    link(store.inputs["Geometry"], given.outputs["Geometry"])
    link(result.inputs["Geometry"], store.outputs["Geometry"])
    return tree


def _add(tree, kind: str, x: float):
    node = tree.nodes.new(kind)
    node.location.x = x
    return node
