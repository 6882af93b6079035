"""Base colors from textures, as bakes have them; read again only when nodes, images or the receiver change."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import bpy

from ...core.messages import Message, note
from ...core.scene.receiver import Receiver, build_receiver, texture_size
from ...core.scene.texture import BaseColor
from ...core.scene.uv_map import Polygons, fit_uv_maps
from ...core.target import Target
from ..node.find import find_node_in_groups
from ..read.base_color import read_texture
from ..read.visibility import find_instances

MAX_TEXELS = 1024
"""Texels along the longer side at which nodes are evaluated; more is finer and keeps the window waiting."""

Size = tuple[int, int] | int
"""Size of an image, or texels along its longer side."""


class TextureCache:
    """The base color of each target, and the polygons and the image size that it was read for."""

    def __init__(self, check: Callable[[], None] | None = None) -> None:
        """`check` is called while nodes are evaluated, and raises an exception to cancel that."""
        self._check = check
        self._colors: dict[Target, tuple[Polygons, Size, BaseColor]] = {}

    def forget(self, material_names: Collection[str] | None = None) -> None:
        """Read the textures of these materials again; None: of all."""
        names = {target.material_name for target in self._colors} if material_names is None else material_names
        self._colors = {target: entry for target, entry in self._colors.items() if target.material_name not in names}

    def read(self, depsgraph, target: Target, polygons: Polygons, size: Size) -> BaseColor | None:
        """The texture that is linked to the target's node; None without a link."""
        node, groups = find_node_in_groups(bpy.data.materials[target.material_name])
        if not node.has_texture():
            self._colors.pop(target, None)
            return None
        old_polygons, old_size, color = self._colors.get(target, (None, None, BaseColor()))
        if old_polygons is not polygons or old_size != size:
            instance = find_instances(depsgraph, {target.object_name})[target.object_name]
            wanted, receiver = node.color_input(groups), _receiver(polygons, size)
            color = read_texture(wanted, node.texture_blur, instance, receiver, self._check)
        elif color.texture is not None and color.texture.blur != node.texture_blur:
            color = replace(color, texture=replace(color.texture, blur=node.texture_blur))
        self._colors[target] = polygons, size, color
        return color

    def messages(self) -> list[Message]:
        """Messages about textures."""
        messages = [message for *_, color in self._colors.values() for message in color.warnings]
        for target, (_, size, color) in self._colors.items():
            if color.unknown:
                shown = f"Live can't evaluate the Base Color of '{target.object_name}' and shows the node's own color"
                messages.append(note("", f"{shown}; bakes have Cycles evaluate it. {color.unknown}"))
            if color.texture is not None and (size if isinstance(size, int) else max(size)) > MAX_TEXELS:
                text = f"Live has the texture of '{target.material_name}' with {MAX_TEXELS} texels along a side."
                messages.append(note("", text))
        return messages


def _receiver(polygons: Polygons, size: Size) -> Receiver:
    maps = fit_uv_maps(polygons)
    width, height = texture_size(maps, size) if isinstance(size, int) else size
    shrink = min(1.0, MAX_TEXELS / max(width, height))
    return build_receiver(maps, max(1, round(width * shrink)), max(1, round(height * shrink)))
