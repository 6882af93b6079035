"""Materials while Blender's glTF exporter reads them: image nodes stand in for Beamspread nodes that have none yet.

The exporter would find the texture at *Base Color* behind a node's Color, and nothing behind its BSDF or a group.
"""

from __future__ import annotations

import sys

import bpy

from ...core.errors import ImageError
from . import plain
from .output import is_linked, make_plain, remove_plain
from .tree import all_nodes, plain_of

_replaced: list[tuple[str, str, bool]] = []
"""Nodes that image nodes stand in for: name of the material or group, of the node, and True if a group was there."""


def begin_export() -> None:
    """Put image nodes in place of the nodes that materials show."""
    end_export()  # after an export that failed
    for node in list(all_nodes()):
        tree = node.id_data
        front, back = node.shown_images()
        if front is None or tree.library is not None or plain.image_node_of(node) or not is_linked(node):
            continue
        had_group = plain_of(node) is not None
        remove_plain(node)
        try:
            exposure = plain.make(node, plain.COAT)
        except ImageError as error:
            sys.stderr.write(f"Beamspread: glTF: {error}\n")
            if had_group:
                make_plain(node)
            continue
        _replaced.append((_owner(tree), node.name, had_group))
        if plain.leaves_out_back(node):
            sys.stderr.write(f"Beamspread: glTF: '{back.name}' is left out, since glTF has one image for both faces.\n")
        if exposure != 1:
            text = f"'{front.name}' is exported divided by {1 / exposure:g}, which the emission's strength undoes."
            sys.stderr.write(f"Beamspread: glTF: {text}\n")
    # The exporter calls no function after a failed export.
    if _replaced and not bpy.app.background:
        bpy.app.timers.register(end_export, first_interval=0.0)


def end_export() -> None:
    """Put the nodes back."""
    while _replaced:
        owner, name, had_group = _replaced.pop()
        material = bpy.data.materials.get(owner)
        tree = material.node_tree if material is not None else bpy.data.node_groups.get(owner)
        node = tree.nodes.get(name) if tree is not None else None
        if node is None:
            continue
        remove_plain(node)
        if had_group:
            make_plain(node)


def _owner(tree) -> str:
    return next((material.name for material in bpy.data.materials if material.node_tree == tree), tree.name)
