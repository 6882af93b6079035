"""The panorama that Cycles has rendered last, for later bakes and frames with the same world."""

from __future__ import annotations

from dataclasses import replace

from bpy.app.handlers import persistent

from ...core.recent import keep_recent
from ...core.scene.lights import WorldLight
from .. import compat
from ..read.digests import digest
from ..read.scene_cache import scene_cache
from ..registration import all_or_nothing, handlers

MAX_WORLDS = 1
"""Number of panoramas, 100 MB each."""

MOVING = {"SEQUENCE", "MOVIE"}
"""Sources of images that change from frame to frame."""

OUTSIDE = {"ShaderNodeAttribute", "ShaderNodeScript"}
"""Nodes that depend on more than their values."""

_kept: dict[str, WorldLight] = {}


def key_of(world, scene) -> str:
    """Text that is equal for worlds of the same light; "" if more than the world's nodes decides about its light.

    Call it in the main thread, with original data.
    """
    trees = _trees_of(world)
    nodes = [node for tree in trees for node in tree.nodes]
    if any(node.bl_idname in OUTSIDE or getattr(node, "object", None) is not None for node in nodes):
        return ""
    moves = any(block.animation_data is not None for block in (world, *trees))
    moves |= any(getattr(getattr(node, "image", None), "source", "") in MOVING for node in nodes)
    frame = (scene.frame_current, scene.frame_subframe) if moves else ()
    tree = scene_cache.tree(world)
    return digest(tree.text, frame, *map(scene_cache.image_digest, tree.images))


def kept(key: str, name: str) -> WorldLight | None:
    """The light of a world of this name, or None."""
    light = _kept.get(key) if key else None
    return light and replace(light, name=name)


def keep(key: str, light: WorldLight) -> None:
    """Keep the light of a world in place of the former one; any thread may call this."""
    if key:
        keep_recent(_kept, key, light, MAX_WORLDS)


def _trees_of(world) -> list:
    """The node trees of a world, those of groups included."""
    trees = [world.node_tree] if compat.uses_nodes(world) else []
    for tree in trees:
        inner = (getattr(node, "node_tree", None) for node in tree.nodes)
        trees += [group for group in inner if group is not None and group not in trees]
    return trees


@persistent
def _forget(*_arguments) -> None:
    _kept.clear()


register, unregister = all_or_nothing(*handlers(load_pre=_forget), (lambda: None, _kept.clear))
