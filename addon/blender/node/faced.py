"""Materials that have faces: slots that no face uses, as of imported characters, have nothing to bake."""

from __future__ import annotations

import numpy as np

from .unwrap_group import find_modifier

# fmt: off
KEEPING = {
    "ARMATURE", "CAST", "CLOTH", "COLLISION", "CORRECTIVE_SMOOTH", "CURVE", "DATA_TRANSFER", "DECIMATE",
    "DISPLACE", "EDGE_SPLIT", "HOOK", "LAPLACIANDEFORM", "LAPLACIANSMOOTH", "LATTICE", "MESH_DEFORM", "MIRROR",
    "MULTIRES", "NORMAL_EDIT", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "SOFT_BODY", "SUBSURF", "SURFACE_DEFORM",
    "TRIANGULATE", "UV_PROJECT", "UV_WARP", "VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY",
    "WARP", "WAVE", "WEIGHTED_NORMAL", "WELD",
}
# fmt: on
"""Types of modifiers whose faces have no other materials than the faces before them."""

KEEPING_NODES = ("NodeGroup", "NodeReroute", "NodeFrame", "FunctionNode", "ShaderNode", "GeometryNodeInput")
"""Beginnings of the names of geometry nodes that make no faces and set no materials; so does *Set Shade Smooth*."""


def materials_with_faces(obj) -> set | None:
    """The materials of an object, original or evaluated, that its faces use; None if that is not known.

    The mesh before the modifiers tells it, so that the answer is the same in the window and in renders.
    """
    original = obj.original
    mesh, slots = original.data, obj.material_slots
    if obj.type != "MESH" or not slots or mesh.is_editmode or not mesh.polygons:
        return None
    if not all(_keeps_materials(original, modifier) for modifier in original.modifiers):
        return None
    numbers = np.unique(np.clip(_material_indices(mesh), 0, len(slots) - 1))
    return {slots[int(number)].material for number in numbers} - {None}


def _material_indices(mesh) -> np.ndarray:
    indices = np.zeros(len(mesh.polygons), np.int32)
    # A hundred times as fast as the property of the faces. A mesh whose faces all use the first slot may have none.
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and len(attribute.data) == len(indices):
        attribute.data.foreach_get("value", indices)
    else:
        mesh.polygons.foreach_get("material_index", indices)
    return indices


def _keeps_materials(obj, modifier) -> bool:
    if modifier.type == "NODES":
        return modifier == find_modifier(obj) or _sets_no_materials(modifier.node_group)
    if modifier.type == "SOLIDIFY":
        return not modifier.material_offset and not modifier.material_offset_rim
    if modifier.type == "BEVEL":
        return modifier.material < 0
    if modifier.type == "ARRAY":
        return modifier.start_cap is None and modifier.end_cap is None
    return modifier.type in KEEPING


def _sets_no_materials(tree) -> bool:
    """True if a node group, as *Smooth by Angle*, gives faces no other materials."""
    for node in () if tree is None else tree.nodes:
        if node.bl_idname == "GeometryNodeGroup":
            if not _sets_no_materials(node.node_tree):
                return False
        elif not node.bl_idname.startswith(KEEPING_NODES) and node.bl_idname != "GeometryNodeSetShadeSmooth":
            return False
    return True
