"""Base colors from textures, as bakes have them; read again only when nodes, images or the receiver change."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import bpy

from ...core.messages import Message, note
from ...core.scene.receiver import build_receiver, texture_size
from ...core.scene.texture import Texture
from ...core.scene.uv_map import Polygons, fit_uv_maps
from ...core.target import Target
from ..jobs.run.linked_color import BaseColor, read_texture
from ..node.find import find_node_in_groups
from ..read.visibility import ObjectInstance, find_instances

MAX_TEXELS = 1024
"""Texels along the longer side at which nodes are evaluated; more is finer and keeps the window waiting."""


@dataclass(frozen=True, eq=False)
class CachedTexture:
    """The texture of a target at its Base Color.

    Attributes
    ----------
    texture : colors on the receiver; None where nodes can't be evaluated.
    size : size of the image, or texels along its longer side.
    is_coarse : True if the texture has fewer texels than the image.
    """

    base_color: BaseColor
    texture: Texture | None
    polygons: Polygons
    size: tuple[int, int] | int
    is_coarse: bool


class TextureCache:
    """Reads textures of targets, and keeps them."""

    def __init__(self) -> None:
        self._textures: dict[Target, CachedTexture] = {}

    def forget(self, material_names: Collection[str] | None = None) -> None:
        """Read the textures of these materials again; None: of all."""
        self._textures = {
            target: texture
            for target, texture in self._textures.items()
            if material_names is not None and target.material_name not in material_names
        }

    def read(self, depsgraph, target: Target, polygons: Polygons, size: tuple[int, int] | int) -> CachedTexture | None:
        """The texture linked to the target's node; None without a link, or if it makes no difference.

        `size` is the image's, or the texels along its longer side.
        """
        node, groups = find_node_in_groups(bpy.data.materials[target.material_name])
        if not node.has_texture():
            self._textures.pop(target, None)
            return None
        cached = self._textures.get(target)
        if cached is None or cached.polygons is not polygons or cached.size != size:
            instance = find_instances(depsgraph, {target.object_name})[target.object_name]
            cached = _evaluated(node, groups, instance, polygons, size)
        elif cached.texture is not None and cached.texture.blur != node.texture_blur:
            cached = replace(cached, texture=replace(cached.texture, blur=node.texture_blur))
        self._textures[target] = cached
        return cached

    def messages(self) -> list[Message]:
        """Messages about textures."""
        messages = [message for cached in self._textures.values() for message in cached.base_color.warnings]
        for target, cached in self._textures.items():
            if cached.base_color.unknown:
                shown = f"Live can't evaluate the Base Color of '{target.object_name}' and shows the node's own color"
                messages.append(note("", f"{shown}; bakes have Cycles evaluate it. {cached.base_color.unknown}"))
            if cached.is_coarse:
                text = f"Live has the texture of '{target.material_name}' with {MAX_TEXELS} texels along a side."
                messages.append(note("", text))
        return messages


def _evaluated(
    node, groups: tuple, instance: ObjectInstance, polygons: Polygons, size: tuple[int, int] | int
) -> CachedTexture:
    maps = fit_uv_maps(polygons)
    width, height = texture_size(maps, size) if isinstance(size, int) else size
    shrink = min(1.0, MAX_TEXELS / max(width, height))
    receiver = build_receiver(maps, max(1, round(width * shrink)), max(1, round(height * shrink)))
    base_color = read_texture(node, groups, instance, receiver)
    texture = Texture(receiver, base_color.colors, base_color.blur) if base_color.colors else None
    return CachedTexture(base_color, texture, polygons, size, texture is not None and shrink < 1)
