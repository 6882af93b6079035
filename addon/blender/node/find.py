"""Where a scene has Beamspread nodes: what can be baked, and what can't because of where its node is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ...core.bake.runner import Bake
from ...core.target import Target
from .. import compat
from ..read.visibility import count_instances, render_visible_names, with_instanced
from .node import BeamspreadNode
from .output import is_linked

NOTHING_FOUND = "No mesh has a material with a Beamspread node: add one in the Shader Editor."


def find_node(material):
    """The material's Beamspread node (one that is linked rather than one that is not), or None."""
    found = find_node_in_groups(material)
    return found and found[0]


def find_node_in_groups(material) -> tuple | None:
    """The node, and the group nodes around it: a node group counts if nothing else uses it, since it has one image."""
    if material is None or not compat.uses_nodes(material):
        return None
    found = [one for one in _nodes_in(material.node_tree) if all(map(_is_own, one[1]))]
    found.sort(key=lambda one: (len(one[1]) > 0, not is_linked(one[0])))
    return next(iter(found), None)


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


def _is_own(group) -> bool:
    """Whether a group node alone shows its tree."""
    tree = group.node_tree.original
    return tree.users - tree.use_fake_user <= 1


def materials_of(obj) -> list:
    """The object's materials that have a Beamspread node, each once."""
    return [material for material in _all_materials(obj) if obj.type == "MESH" and find_node(material) is not None]


def find_targets(objects: Iterable) -> list[Target]:
    """Everything to bake among the objects, in their order."""
    return [Target(obj.name, material.name) for obj in objects for material in materials_of(obj)]


def find_bakeable(view_layer, chosen: Iterable | None = None) -> list[Target]:
    """The targets among the chosen objects, None: among the scene's, and among what only instances of these show.

    Of the latter a material that shows an image already has been baked elsewhere if it belongs to another file, or if
    it stands in several places and nobody has chosen it.
    """
    objects = list(view_layer.id_data.objects if chosen is None else chosen)
    inner = with_instanced(objects)[len(objects) :]
    own = {obj.name for obj in (*view_layer.objects, *objects)} if inner else set()
    found = [(obj, material) for obj in inner if obj.name not in own for material in materials_of(obj)]
    places = rendered_counts(view_layer) if found and chosen is None else {}
    targets = find_targets(objects)
    for obj, material in found:
        if not was_baked_elsewhere(material) and (places.get(obj.name, 0) <= 1 or find_node(material).image is None):
            targets.append(Target(obj.name, material.name))
    return targets


def was_baked_elsewhere(material) -> bool:
    """Whether a material with a node belongs to another file and shows the image that was baked there."""
    is_local = material.library is None and material.override_library is None
    return not is_local and find_node(material).image is not None


def rendered_counts(view_layer) -> dict[str, int]:
    """By name, in how many places a render shows objects; where they stand themselves, others don't count."""
    visible = render_visible_names(view_layer)
    shown = count_instances(obj for obj in view_layer.objects if obj.name in visible)
    return {**shown, **dict.fromkeys(visible, 1)}


def find_misplaced(objects: Iterable) -> list[Bake]:
    """Beamspread nodes where no bake can use them: failures that say where, and what to do.

    A node on what is no mesh that shows an image already has been baked elsewhere.
    """
    shown = with_instanced(objects)
    return [Bake(Target(obj.name, material.name), error=why) for obj in shown for material, why in _misplaced(obj)]


def _misplaced(obj) -> Iterator[tuple]:
    for material in _all_materials(obj):
        node = find_node(material)
        if node is not None and obj.type != "MESH" and node.image is None:
            yield material, f"'{obj.name}' is no mesh: convert it to one (Object > Convert > Mesh)."
        if node is None and compat.uses_nodes(material):
            for _, groups in _nodes_in(material.node_tree):
                yield material, _why_not_in_group(material, groups)


def _all_materials(obj) -> list:
    materials = (slot.material for slot in obj.material_slots)
    return list(dict.fromkeys(material for material in materials if material is not None))


def _why_not_in_group(material, groups: tuple) -> str:
    shared = next(group.node_tree.name for group in groups if not _is_own(group))
    return (
        f"The Beamspread node of '{material.name}' is in the node group '{shared}', used several times, though "
        "a node has one image: make it single-user (click the number beside its name), or ungroup it (Ctrl Alt G)."
    )
