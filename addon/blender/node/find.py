"""Where a scene has Beamspread nodes: what can be baked, and what can't because of where its node is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ...core.bake.runner import Bake, Target
from .. import compat
from .node import BeamspreadNode
from .output import is_linked

NOTHING_FOUND = "No mesh has a material with a Beamspread node: add one in the Shader Editor."


def find_node(material):
    """The material's Beamspread node (one that is linked rather than one that is not), or None."""
    if material is None or not compat.uses_nodes(material):
        return None
    nodes = [node for node in material.node_tree.nodes if node.bl_idname == BeamspreadNode.bl_idname]
    linked = [node for node in nodes if is_linked(node)]
    return next(iter(linked + nodes), None)


def materials_of(obj) -> list:
    """The object's materials that have a Beamspread node, each once."""
    return [material for material in _all_materials(obj) if obj.type == "MESH" and find_node(material) is not None]


def find_targets(objects: Iterable) -> list[Target]:
    """Everything to bake among the objects, in their order."""
    return [Target(obj.name, material.name) for obj in objects for material in materials_of(obj)]


def find_misplaced(objects: Iterable) -> list[Bake]:
    """Beamspread nodes where no bake can use them: failures that say where, and what to do.

    A node that shows an image already has been baked elsewhere, as those of instances often are.
    """
    return [Bake(Target(obj.name, material.name), error=why) for obj in objects for material, why in _misplaced(obj)]


def _misplaced(obj) -> Iterator[tuple]:
    for material in _all_materials(obj):
        node = find_node(material)
        if node is not None and obj.type != "MESH" and node.image is None:
            yield material, f"'{obj.name}' is no mesh: convert it to one (Object > Convert > Mesh)."
        group = "" if node is not None or not compat.uses_nodes(material) else _group_with_node(material.node_tree)
        if group:
            why = f"The Beamspread node of '{material.name}' can't be baked inside the node group '{group}': "
            yield material, why + "put it into the material itself (select the group, Ctrl Alt G)."
    if obj.instance_type != "COLLECTION" or obj.instance_collection is None:
        return
    for inner in _objects_shown_by(obj.instance_collection):
        for material in materials_of(inner):
            if find_node(material).image is None:
                why = f"'{inner.name}', which has the Beamspread node, is only an instance here, of the collection "
                remedy = "make it real (Object > Apply > Make Instances Real)."
                yield material, f"{why}'{obj.instance_collection.name}': {remedy}"


def _all_materials(obj) -> list:
    materials = (slot.material for slot in obj.material_slots)
    return list(dict.fromkeys(material for material in materials if material is not None))


def _objects_shown_by(collection) -> Iterator:
    """Objects of an instanced collection, and of those that it instances in turn (Blender allows no circles)."""
    for obj in collection.all_objects:
        yield obj
        if obj.instance_type == "COLLECTION" and obj.instance_collection is not None:
            yield from _objects_shown_by(obj.instance_collection)


def _group_with_node(tree) -> str:
    """Name of the innermost node group of the tree that holds a Beamspread node without an image."""
    for node in tree.nodes:
        if node.bl_idname != "ShaderNodeGroup" or node.node_tree is None:
            continue
        inner = node.node_tree
        if any(one.bl_idname == BeamspreadNode.bl_idname and one.image is None for one in inner.nodes):
            return inner.name
        if deeper := _group_with_node(inner):
            return deeper
    return ""
