"""The material's output: the baked result, the former shader, or nodes that need no add-on."""

from __future__ import annotations

import bpy

from ...core.errors import NotSupportedError
from ...core.messages import Message, note, warning
from ..read.nodes import InputSocket
from ..read.shading import ShadingPoints
from . import plain
from .tree import NORMAL, ROUGHNESS, plain_of

OUTPUT_KINDS = ("ShaderNodeOutputMaterial", "NodeGroupOutput")

GAP, NODE_HEIGHT = 50.0, 640.0
"""Distance of a new node from others, and the height of the Beamspread node, in units of the node editor."""


def place(node) -> None:
    """Put a new node left of its tree's output, above the nodes that are there."""
    tree = node.id_data
    output = next((other for other in tree.nodes if other.bl_idname in OUTPUT_KINDS), None)
    if output is None:
        return
    left, right = output.location.x - GAP - node.width, output.location.x - GAP
    below = (
        other.location.y
        for other in tree.nodes
        if other != node and other.location.x < right and other.location.x + other.width > left
    )
    highest = max(below, default=None)
    node.location = (left, output.location.y if highest is None else highest + GAP + NODE_HEIGHT)


def is_linked(node) -> bool:
    """True if an output of the node, or of plain nodes in its place, is linked."""
    image = plain.image_node_of(node)
    if image is not None:
        own = plain.nodes_of(node)
        return any(link.to_node not in own for socket in plain.outputs_of(node).values() for link in socket.links)
    nodes = [node, *filter(None, [plain_of(node)])]
    return any(socket.is_linked for shown in nodes for socket in shown.outputs)


def former_output(node):
    """Output that the material showed before the node's, or None."""
    former = node.id_data.nodes.get(node.former_node) if node.former_node else None
    return former and next((output for output in former.outputs if output.identifier == node.former_socket), None)


def is_shown(node) -> bool:
    """True if the material's output shows the node's result and nothing else."""
    surface = _surface(node.id_data)
    if surface is None or not surface.is_linked:
        return False
    return surface.links[0].from_node in (node, plain_of(node), *plain.nodes_of(node))


def link_output(node) -> list[Message]:
    """Put the node at its material's output, unless it is linked, the user has chosen, or the material shines.

    The former shader stays in the tree, and the node remembers it. A warning says that the bake is not shown, a note
    which shader it replaces.
    """
    tree = node.id_data
    if is_in_group(node):
        if is_linked(node):
            return []
        remedy = f"Link the BSDF of the node in '{tree.name}' to the group's output."
        return [warning(tree.name, "Nothing shows the bake.", remedy)]
    output = tree.get_output_node("ALL") or tree.nodes.new("ShaderNodeOutputMaterial")
    surface = output.inputs["Surface"]
    if not surface.is_linked:
        _link(surface, node)
        return []
    if is_linked(node):
        return []
    name, shader = _owner_name(tree), surface.links[0].from_node
    if former_output(node) is not None:
        text = f"'{name}' shows '{shader.name}' instead of the bake."
        return [warning(name, text, "Show Baked Result in its node changes that.")]
    if _shines(surface):
        text = f"'{name}' emits light by '{shader.name}', so it does not show the bake."
        return [warning(name, text, "Show Baked Result in its node changes that, and takes its light away.")]
    _remember(node, surface.links[0])
    _link(surface, node)
    return [note(name, f"'{name}' now shows the bake.", f"Show Former Shader brings '{shader.name}' back.")]


def toggle(node) -> str:
    """Switch the baked result and the former shader; the name of the node shown now, "" if there is no other."""
    surface = _surface(node.id_data)
    if surface is None:
        return ""
    if not is_shown(node):
        if surface.is_linked:
            _remember(node, surface.links[0])
        _link(surface, node)
        return node.name
    former = former_output(node)
    if former is None:
        return ""
    node.id_data.links.new(surface, former)
    return former.node.name


def make_plain(node):
    """Link a group of plain nodes, which needs no add-on, in the node's place.

    The group shares the node's inner tree: a bake changes both.
    """
    tree = node.id_data
    group = plain_of(node)
    if group is None:
        group = tree.nodes.new("ShaderNodeGroup")
        group.name = group.label = plain.LABEL
        group.location, group.width = (node.location.x, node.location.y + 200), 180
        node.plain_node = group.name
    group.node_tree = node.node_tree
    for name in (ROUGHNESS, NORMAL):
        _same_input(node, group, name)
    _move_links(node, group)
    return group


def remove_plain(node) -> None:
    """Put the node back where its plain nodes are."""
    plain.remove(node)
    group = plain_of(node)
    if group is not None:
        _move_links(group, node)
        node.id_data.nodes.remove(group)
    node.plain_node = ""


def has_plain(node) -> bool:
    """True if plain nodes of any kind are in the node's place."""
    return plain_of(node) is not None or plain.image_node_of(node) is not None


def _shines(surface) -> bool:
    """True if an input emits light, or may emit it by nodes that only Cycles can evaluate."""
    try:
        return bool(ShadingPoints().value(InputSocket(surface, ())).any())
    except NotSupportedError:
        return True


def _surface(tree):
    output = None if _is_group(tree) else tree.get_output_node("ALL")
    return output and output.inputs["Surface"]


def is_in_group(node) -> bool:
    """True if the node is in a node group, and not in the tree of a material itself."""
    return _is_group(node.id_data)


def _is_group(tree) -> bool:
    return tree.name in bpy.data.node_groups and bpy.data.node_groups[tree.name] == tree


def _owner_name(tree) -> str:
    return next((material.name for material in bpy.data.materials if material.node_tree == tree), tree.name)


def _link(surface, node) -> None:
    shown = plain.outputs_of(node) or (plain_of(node) or node).outputs
    node.id_data.links.new(surface, shown["BSDF"])


def _remember(node, link) -> None:
    node.former_node, node.former_socket = link.from_node.name, link.from_socket.identifier


def _same_input(source, target, name: str) -> None:
    """Copy the value and the link of an input to another node."""
    if name not in source.inputs or name not in target.inputs:
        return
    target.inputs[name].default_value = source.inputs[name].default_value
    if source.inputs[name].is_linked:
        source.id_data.links.new(target.inputs[name], source.inputs[name].links[0].from_socket)


def _move_links(source, target) -> None:
    for socket in source.outputs:
        for link in list(socket.links):
            source.id_data.links.new(link.to_socket, target.outputs[socket.name])
