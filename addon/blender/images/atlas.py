"""One Atlas for the Selection: objects get UV maps side by side in one new image, which their next bakes fill."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import bpy
import numpy as np

from ...core.bake.runner import Bake
from ...core.bake.spread import image_length
from ...core.errors import BakeError, ReceiverError
from ...core.messages import Level, Message, note, warning
from ...core.scene.flat_mesh import flatten
from ...core.scene.unwrap import unwrap
from ...core.target import BACK, FRONT, Target
from .. import popup
from ..node.find import BakeTarget, targets_of
from ..node.node import set_image
from ..node.tree import keep_map, own_tree
from ..node.uv_maps import make_maps_together
from ..read.geometry import OWN_MAP, read_polygons
from ..read.visibility import as_rendered
from ..registration import all_or_nothing, classes
from .facts import users_of_material
from .new_image import store_new

NAME = "Atlas"
"""Name of new images."""


class BEAMSPREAD_OT_make_atlas(bpy.types.Operator):
    """Give the selected objects UV maps side by side in one new image, at one texel density. Their other maps stay. \
The next bake fills the image"""

    bl_idname = "beamspread.make_atlas"
    bl_label = "One Atlas for the Selection"
    bl_options = {"REGISTER", "UNDO"}

    _in_window = False

    @classmethod
    def poll(cls, context):
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        return True

    def invoke(self, context, _event):
        self._in_window = not bpy.app.background
        return self.execute(context)

    def execute(self, context):
        with as_rendered(context.view_layer):
            depsgraph = context.evaluated_depsgraph_get()
            targets, messages = _choose(depsgraph, list(context.view_layer.objects.selected))
            messages += _make(depsgraph, context.scene, targets) if targets else [NOTHING]
        has_failed = any(message.level == Level.ERROR for message in messages)
        for message in messages:
            self.report({message.level.value}, message.line())
        lines = [message.line() for message in messages if message.level != Level.INFO]
        if lines and self._in_window:
            popup.show_soon("One Atlas for the Selection", lines)
        return {"CANCELLED"} if has_failed else {"FINISHED"}


NOTHING = Message(
    Level.ERROR, "", "No selected object can have a place in an atlas.", "Select meshes with a Beamspread node."
)


def _choose(depsgraph, objects: list) -> tuple[list[BakeTarget], list[Message]]:
    """Targets of the objects that can have a place in an atlas, and warnings about the others."""
    targets, messages = [], []
    names = {obj.name for obj in objects}
    for obj in objects:
        mine = targets_of(obj)
        if not mine:
            messages.append(warning(obj.name, f"'{obj.name}' is left out: it is no mesh with a Beamspread node."))
        for target in mine:
            try:
                _check(depsgraph, target, names)
                targets.append(target)
            except BakeError as error:
                messages.append(warning(str(target.name), f"'{target.name}' is left out: {error.text}", error.remedy))
    return targets, messages


def _check(depsgraph, target: BakeTarget, names: set[str]) -> None:
    """Raise BakeError if the target can't have a place in an atlas of the objects of these names."""
    obj, material = target.obj, target.material
    if any(block.library or block.override_library for block in (obj, obj.data, material)):
        remedy = "Make it local (Object > Relations > Make Local > Selected Objects, Data and Materials)."
        raise ReceiverError("It belongs to another .blend file.", remedy)
    beside = {user.object_name for user in users_of_material(material.name)} - names
    if beside:
        listed = " and ".join(f"'{name}'" for name in sorted(beside))
        text = f"{listed} {'has' if len(beside) == 1 else 'have'} the same material, and would show the atlas."
        raise ReceiverError(text, "Select all objects of the material, or give these a material of their own.")
    polygons = read_polygons(obj.evaluated_get(depsgraph), material.name)
    surface = target.node.surface()
    surface.check()
    flatten(replace(polygons, uvs=unwrap(polygons)), min(surface.material.mean_free_path), obj.name)


def _make(depsgraph, scene, targets: list[BakeTarget]) -> list[Message]:
    """Make the maps and the image, and have the targets' nodes show both."""
    materials = defaultdict(set)
    for target in targets:
        materials[target.obj].add(target.material.name)
    length = image_length(make_maps_together(depsgraph, materials))
    nodes = {target.node.as_pointer(): target.node for target in targets}
    side = max(scene.beamspread.side_for(length, node.surface(), node.has_texture()) for node in nodes.values())
    bake, messages = Bake(Target("")), []
    for node in nodes.values():
        node.uv_map = OWN_MAP
    for face in (FRONT, BACK):
        shown = [target for target in targets if target.side == face]
        if not shown:
            continue
        name = NAME if face == FRONT else f"{NAME} {face.title()}"
        _path, image = store_new(name, np.zeros((side, side, 3), np.float32), bake)
        for target in shown:
            set_image(target.node, image, face)
        count = len({target.obj for target in shown})
        number = f"{count} object{'s have their' if count > 1 else ' has its'}"
        text = f"{number} place in the image '{image.name}' of {side} x {side} texels: Bake fills it."
        messages.append(note(image.name, text))
    for node in nodes.values():
        tree = own_tree(node)
        if tree is not None:
            keep_map(tree, OWN_MAP)
    return [*bake.messages, *messages]


register, unregister = all_or_nothing(*classes(BEAMSPREAD_OT_make_atlas))
