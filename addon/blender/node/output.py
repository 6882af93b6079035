"""What a material shows: the baked result, what it had before, or nodes that need no add-on."""

from __future__ import annotations

import bpy

from ...core.messages import Message, note, warning
from .tree import NORMAL, ROUGHNESS

PLAIN_LABEL = "Baked Light"


def plain_of(node):
    """The group that shows the bake in the node's place, or None."""
    plain = node.id_data.nodes.get(node.plain_node) if node.plain_node else None
    return plain if plain is not None and plain.bl_idname == "ShaderNodeGroup" else None


def is_linked(node) -> bool:
    """Whether anything uses the node's outputs, or those of the group in its place."""
    return any(socket.is_linked for one in (node, plain_of(node)) if one is not None for socket in one.outputs)


def former_output(node):
    """The output that the material showed before the node's, or None."""
    former = node.id_data.nodes.get(node.former_node) if node.former_node else None
    return former and next((one for one in former.outputs if one.identifier == node.former_socket), None)


def is_shown(node) -> bool:
    """Whether the material shows the node's result at its output, and nothing else."""
    surface = _surface(node.id_data)
    if surface is None or not surface.is_linked:
        return False
    return surface.links[0].from_node in (node, plain_of(node))


def link_output(node) -> list[Message]:
    """Put the node at its material's output, unless something uses it or the user has chosen.

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
    _remember(node, surface.links[0])
    _link(surface, node)
    return [note(name, f"'{name}' now shows the bake.", f"Show Former Shader brings '{shader.name}' back.")]


def toggle(node) -> str:
    """Swap the baked result with what the material showed before; the name of the node shown now, "" if none is."""
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
    """A group of ordinary nodes, linked wherever the node is, that every Blender shows without the add-on.

    It shares the node's inner tree: a bake changes both.
    """
    tree = node.id_data
    plain = plain_of(node)
    if plain is None:
        plain = tree.nodes.new("ShaderNodeGroup")
        plain.name = plain.label = PLAIN_LABEL
        plain.location, plain.width = (node.location.x, node.location.y + 200), 180
        node.plain_node = plain.name
    plain.node_tree = node.node_tree
    for name in (ROUGHNESS, NORMAL):
        _same_input(node, plain, name)
    _move_links(node, plain)
    return plain


def remove_plain(node) -> None:
    """Put the node back where the plain group is."""
    plain = plain_of(node)
    if plain is not None:
        _move_links(plain, node)
        node.id_data.nodes.remove(plain)
    node.plain_node = ""


def _surface(tree):
    output = None if _is_group(tree) else tree.get_output_node("ALL")
    return output and output.inputs["Surface"]


def is_in_group(node) -> bool:
    """Whether the node is in a node group, and not in the tree of a material itself."""
    return _is_group(node.id_data)


def _is_group(tree) -> bool:
    return tree.name in bpy.data.node_groups and bpy.data.node_groups[tree.name] == tree


def _owner_name(tree) -> str:
    return next((one.name for one in bpy.data.materials if one.node_tree == tree), tree.name)


def _link(surface, node) -> None:
    node.id_data.links.new(surface, (plain_of(node) or node).outputs["BSDF"])


def _remember(node, link) -> None:
    node.former_node, node.former_socket = link.from_node.name, link.from_socket.identifier


def _same_input(source, target, name: str) -> None:
    """Value and link of an input for another node's."""
    if name not in source.inputs or name not in target.inputs:
        return
    target.inputs[name].default_value = source.inputs[name].default_value
    if source.inputs[name].is_linked:
        source.id_data.links.new(target.inputs[name], source.inputs[name].links[0].from_socket)


def _move_links(source, target) -> None:
    for socket in source.outputs:
        for link in list(socket.links):
            source.id_data.links.new(link.to_socket, target.outputs[socket.name])
