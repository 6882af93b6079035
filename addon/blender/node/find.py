"""Beamspread nodes of a scene: targets that can be baked, and nodes in places where no bake can use them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import bpy

from ...core.bake.runner import Bake
from ...core.bake.surface import Surface
from ...core.errors import BakeError
from ...core.target import FRONT, Target
from .. import compat
from ..read.nodes import InputSocket
from ..read.visibility import RECEIVER_TYPES, UNKNOWN_TYPES, count_instances, render_visible_names, with_instanced
from .faced import materials_with_faces
from .node import BeamspreadNode, image_of_side
from .output import is_linked


@dataclass(frozen=True)
class BakeTarget:
    """A target in Blender's data, original or evaluated. Undo replaces these data: keep the name for later.

    Attributes
    ----------
    groups : group nodes around the node, outermost first.
    side : the face that the image shows, `FRONT` or `BACK`.
    """

    obj: object
    material: object
    node: object
    groups: tuple
    side: str = FRONT

    @property
    def name(self) -> Target:
        return Target(self.obj.name, self.material.name, self.side)

    @property
    def image(self):
        """The node's image of this side among the original data, or None."""
        image = image_of_side(self.node, self.side)
        return image and image.original

    def was_baked_elsewhere(self) -> bool:
        """True if the material belongs to another file and shows the image that was baked there."""
        is_local = self.material.library is None and self.material.override_library is None
        return not is_local and self.image is not None


NOTHING_FOUND = BakeError("No mesh has a material with a Beamspread node.", "Add one in the Shader Editor.")


def find_node(material):
    """The material's Beamspread node, or None; a linked node wins over others."""
    node = find_node_in_groups(material)
    return node and node[0]


def node_of(target: Target):
    """The target's Beamspread node, or None if it or its material is gone."""
    return find_node(bpy.data.materials.get(target.material_name))


def image_of(target: Target):
    """The image of the target in its node, or None."""
    node = node_of(target)
    return None if node is None else image_of_side(node, target.side)


def uses_tiles(node, side: str = FRONT) -> bool:
    """True if the node's image of a side has UDIM tiles, or will have them."""
    image = image_of_side(node, side)
    return bpy.context.scene.beamspread.use_udim if image is None else image.source == "TILED"


def find_node_in_groups(material) -> tuple | None:
    """The material's node and the group nodes around it, or None; groups with other users don't count."""
    if material is None or not compat.uses_nodes(material):
        return None
    nodes = [(node, groups) for node, groups in _nodes_in(material.node_tree) if all(map(_has_one_user, groups))]
    return min(nodes, key=lambda pair: (len(pair[1]) > 0, not is_linked(pair[0])), default=None)


def medium_of(material) -> tuple[Surface, InputSocket | None] | None:
    """Medium of a material with a Beamspread node, and the input that a texture of its color is linked to, if any."""
    place = find_node_in_groups(material)
    if place is None:
        return None
    node, groups = place
    return node.surface(), node.color_input(groups) if node.has_texture() else None


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


def targets_of(obj) -> list[BakeTarget]:
    """The targets of an object: its materials that have a Beamspread node, each once for each side with an image.

    Materials that no face uses are left out, unless all are.
    """
    materials = _all_materials(obj) if obj.type in RECEIVER_TYPES else ()
    places = ((material, find_node_in_groups(material)) for material in materials)
    found = [(material, *place) for material, place in places if place is not None]
    used = materials_with_faces(obj) if len(found) > 1 else None
    found = [item for item in found if used is None or item[0] in used] or found
    return [BakeTarget(obj, material, node, groups, side) for material, node, groups in found for side in node.sides()]


def find_targets(objects: Iterable) -> list[Target]:
    """Names of the targets among the objects, in their order."""
    return [target.name for obj in objects for target in targets_of(obj)]


def find_bakeable(view_layer, chosen: Iterable | None = None) -> list[Target]:
    """Names of the targets of the chosen objects (None: the scene's), and of objects that only their instances show.

    A material of an instance that already shows an image is left out if it belongs to another file, or if it has
    several instances and nobody has chosen it: it was baked elsewhere.
    """
    objects = list(view_layer.id_data.objects if chosen is None else chosen)
    inner = with_instanced(objects)[len(objects) :]
    names = {obj.name for obj in (*view_layer.objects, *objects)} if inner else set()
    instanced = [target for obj in inner if obj.name not in names for target in targets_of(obj)]
    counts = rendered_counts(view_layer) if instanced and chosen is None else {}
    free = [target for target in instanced if not target.was_baked_elsewhere()]
    free = [target for target in free if target.image is None or counts.get(target.obj.name, 0) <= 1]
    return find_targets(objects) + [target.name for target in free]


def rendered_counts(view_layer) -> dict[str, int]:
    """Number of instances that a render shows, by object name; 1 for objects of the view layer themselves."""
    visible = render_visible_names(view_layer)
    shown = count_instances(obj for obj in view_layer.objects if obj.name in visible)
    return {**shown, **dict.fromkeys(visible, 1)}


def find_misplaced(objects: Iterable, with_images: bool = False) -> list[Bake]:
    """Failed bakes of Beamspread nodes that no bake can use, with the remedy.

    A node with an image on an object that can't be baked is left out, unless `with_images`: it was baked elsewhere.
    """
    return [
        Bake(Target(obj.name, material.name), error=error)
        for obj in with_instanced(objects)
        for material, error in _misplaced(obj, with_images)
    ]


def has_node(objects: Iterable) -> bool:
    """True if a bake of the objects has a Beamspread node to bake, or one to complain about."""
    return any(targets_of(obj) or any(_misplaced(obj, with_images=True)) for obj in with_instanced(objects))


def _misplaced(obj, with_images: bool) -> Iterator[tuple]:
    for material in _all_materials(obj):
        node = find_node(material)
        is_wanted = node is not None and (not any(node.shown_images()) or (with_images and material.library is None))
        if is_wanted and obj.type not in RECEIVER_TYPES:
            yield material, _error_of_type(obj)
        if node is None and compat.uses_nodes(material):
            for _, groups in _nodes_in(material.node_tree):
                yield material, _error_of_group(material, groups)


def _error_of_type(obj) -> BakeError:
    if obj.type in UNKNOWN_TYPES:
        return BakeError(f"'{obj.name}' is {UNKNOWN_TYPES[obj.type]}, which has no faces.", "Give the node to a mesh.")
    return BakeError(f"'{obj.name}' is not a mesh.", "Convert it to one (Object > Convert > Mesh).")


def _all_materials(obj) -> list:
    materials = (slot.material for slot in obj.material_slots)
    return list(dict.fromkeys(material for material in materials if material is not None))


def _error_of_group(material, groups: tuple) -> BakeError:
    shared = next(group.node_tree.name for group in groups if not _has_one_user(group))
    return BakeError(
        f"The Beamspread node of '{material.name}' has one image, but its node group '{shared}' is used several times.",
        "Make the group single-user (click the number beside its name), or ungroup it (Ctrl Alt G).",
    )
