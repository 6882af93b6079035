"""Beamspread nodes of a scene: targets that can be baked, and nodes in places where no bake can use them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import bpy

from ...core.bake.runner import Bake
from ...core.target import Target
from .. import compat
from ..read.visibility import count_instances, render_visible_names, with_instanced
from .node import BeamspreadNode
from .output import is_linked

NOTHING_FOUND = "No mesh has a material with a Beamspread node: add one in the Shader Editor."


def find_node(material):
    """The material's Beamspread node, or None; a linked node wins over others."""
    node = find_node_in_groups(material)
    return node and node[0]


def node_of(target: Target):
    """The target's Beamspread node, or None if it or its material is gone."""
    return find_node(bpy.data.materials.get(target.material_name))


def image_of(target: Target):
    """The image of the target's node, or None."""
    node = node_of(target)
    return None if node is None else node.image


def find_node_in_groups(material) -> tuple | None:
    """The material's node and the group nodes around it, or None; groups with other users don't count."""
    if material is None or not compat.uses_nodes(material):
        return None
    nodes = [(node, groups) for node, groups in _nodes_in(material.node_tree) if all(map(_has_one_user, groups))]
    nodes.sort(key=lambda pair: (len(pair[1]) > 0, not is_linked(pair[0])))
    return next(iter(nodes), None)


def _nodes_in(tree) -> Iterator[tuple]:
    """Beamspread nodes of a tree and its groups, each with the group nodes around it; every group is entered once."""
    entered, stack = set(), [(iter(tree.nodes), ())]
    while stack:
        nodes, groups = stack[-1]
        node = next(nodes, None)
        if node is None:
            stack.pop()
        elif node.bl_idname == BeamspreadNode.bl_idname:
            yield node, groups
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree not in {None, *entered}:
            entered.add(node.node_tree)
            stack.append((iter(node.node_tree.nodes), (*groups, node)))


def _has_one_user(group) -> bool:
    """True if no other node shows the tree of a group node."""
    tree = group.node_tree.original
    return tree.users - tree.use_fake_user <= 1


def materials_of(obj) -> list:
    """The object's materials that have a Beamspread node, each once."""
    return [material for material in _all_materials(obj) if obj.type == "MESH" and find_node(material) is not None]


def find_targets(objects: Iterable) -> list[Target]:
    """Targets among the objects, in their order."""
    return [Target(obj.name, material.name) for obj in objects for material in materials_of(obj)]


def find_bakeable(view_layer, chosen: Iterable | None = None) -> list[Target]:
    """Targets among the chosen objects (None: the scene's), and among objects that only their instances show.

    A material of an instance that already shows an image is left out if it belongs to another file, or if it has
    several instances and nobody has chosen it: it was baked elsewhere.
    """
    objects = list(view_layer.id_data.objects if chosen is None else chosen)
    inner = with_instanced(objects)[len(objects) :]
    names = {obj.name for obj in (*view_layer.objects, *objects)} if inner else set()
    instanced = [(obj, material) for obj in inner if obj.name not in names for material in materials_of(obj)]
    counts = rendered_counts(view_layer) if instanced and chosen is None else {}
    targets = find_targets(objects)
    for obj, material in instanced:
        if not was_baked_elsewhere(material) and (counts.get(obj.name, 0) <= 1 or find_node(material).image is None):
            targets.append(Target(obj.name, material.name))
    return targets


def was_baked_elsewhere(material) -> bool:
    """True if a material with a node belongs to another file and shows the image that was baked there."""
    is_local = material.library is None and material.override_library is None
    return not is_local and find_node(material).image is not None


def rendered_counts(view_layer) -> dict[str, int]:
    """Number of instances that a render shows, by object name; 1 for objects of the view layer themselves."""
    visible = render_visible_names(view_layer)
    shown = count_instances(obj for obj in view_layer.objects if obj.name in visible)
    return {**shown, **dict.fromkeys(visible, 1)}


def find_misplaced(objects: Iterable) -> list[Bake]:
    """Failed bakes of Beamspread nodes that no bake can use, with the remedy.

    A node with an image on an object without a mesh is left out: it was baked elsewhere.
    """
    shown = with_instanced(objects)
    return [Bake(Target(obj.name, material.name), error=why) for obj in shown for material, why in _misplaced(obj)]


def _misplaced(obj) -> Iterator[tuple]:
    for material in _all_materials(obj):
        node = find_node(material)
        if node is not None and obj.type != "MESH" and node.image is None:
            yield material, f"'{obj.name}' is not a mesh: convert it to one (Object > Convert > Mesh)."
        if node is None and compat.uses_nodes(material):
            for _, groups in _nodes_in(material.node_tree):
                yield material, _why_not_in_group(material, groups)


def _all_materials(obj) -> list:
    materials = (slot.material for slot in obj.material_slots)
    return list(dict.fromkeys(material for material in materials if material is not None))


def _why_not_in_group(material, groups: tuple) -> str:
    shared = next(group.node_tree.name for group in groups if not _has_one_user(group))
    return (
        f"The Beamspread node of '{material.name}' has one image, but its node group '{shared}' is used several times: "
        "make the group single-user (click the number beside its name), or ungroup it (Ctrl Alt G)."
    )
