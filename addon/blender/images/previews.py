"""Images that show for a while what is not theirs: whoever keeps, copies or saves pixels has them put back first."""

from __future__ import annotations

from typing import Protocol

import bpy
from bpy.app.handlers import persistent

from ..node.node import BeamspreadNode
from ..registration import all_or_nothing, handlers
from . import icons

# Of an image that was made to show previews, and holds nothing else: as if the node had none.
MADE_FOR_PREVIEWS = "beamspread_preview"


class Holder(Protocol):
    """Who shows previews."""

    def give_back(self) -> None:
        """Put the images' own pixels back."""

    def covers(self, image) -> bool:
        """Whether the image shows a preview."""


class _Previews:
    """Who shows them in this process."""

    holder: Holder | None = None


previews = _Previews()


def give_back() -> None:
    """Have all images show their own pixels."""
    if previews.holder is not None:
        previews.holder.give_back()


def covers(image) -> bool:
    """Whether the image shows a preview."""
    return previews.holder is not None and previews.holder.covers(image)


def holds_previews_alone(image) -> bool:
    """Whether it was made to show previews, and nobody has saved, packed or used it."""
    if MADE_FOR_PREVIEWS not in image or image.source != "GENERATED" or image.packed_file is not None:
        return False
    return not image.use_fake_user and not _is_used_elsewhere(image)


def _is_used_elsewhere(image) -> bool:
    """Whether anything but Beamspread nodes and editors shows it."""
    trees = [one.node_tree for one in bpy.data.materials if one.node_tree is not None]
    nodes = [node for tree in [*trees, *bpy.data.node_groups] for node in tree.nodes]
    ours = {node.node_tree for node in nodes if node.bl_idname == BeamspreadNode.bl_idname}
    others = (node for node in nodes if node.id_data not in ours and node.bl_idname != BeamspreadNode.bl_idname)
    if any(getattr(node, "image", None) == image for node in others):
        return True
    users = bpy.data.user_map(subset={image})[image]
    return any(not isinstance(user, bpy.types.Material | bpy.types.NodeTree | bpy.types.Screen) for user in users)


def leave(image) -> None:
    """Have an image count as any other."""
    if MADE_FOR_PREVIEWS in image:
        del image[MADE_FOR_PREVIEWS]


@persistent
def _before_saving(*_arguments) -> None:
    give_back()


@persistent
def _forget_made(*_arguments) -> None:
    """Undo, and files that Blender has saved by itself, bring back images that nobody shows previews in any more."""
    if previews.holder is not None:
        return
    for image in [one for one in bpy.data.images if MADE_FOR_PREVIEWS in one]:
        if holds_previews_alone(image) and not image.is_dirty:
            icons.remove(image)
        else:
            leave(image)


register, unregister = all_or_nothing(
    *handlers(save_pre=_before_saving, undo_post=_forget_made, redo_post=_forget_made, load_post=_forget_made)
)
