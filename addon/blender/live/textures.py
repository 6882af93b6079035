"""Base colours from textures, as bakes have them; read again only where nodes, images or the receiver change."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import bpy

from ...core.scene.receiver import build_receiver, texture_size
from ...core.scene.texture import Texture
from ...core.scene.uv_map import Polygons, fit_uv_maps
from ...core.target import Target
from ..jobs.run.linked_color import BaseColor, read_texture
from ..node.find import find_node_in_groups
from ..read.visibility import ObjectInstance, find_instances

# Texels along the longer side where nodes are evaluated: more would keep the window waiting.
MOST_TEXELS = 1024


@dataclass(frozen=True, eq=False)
class Read:
    """What was read of a target, and `texture`, None where its nodes are not understood."""

    base_color: BaseColor
    texture: Texture | None
    polygons: Polygons
    size: tuple[int, int] | int
    is_coarse: bool


class Textures:
    """Keeps what it has read."""

    def __init__(self) -> None:
        self._read: dict[Target, Read] = {}

    def forget(self, material_names: Collection[str] | None = None) -> None:
        """What was read of these materials; None: of all."""
        self._read = {
            target: read
            for target, read in self._read.items()
            if material_names is not None and target.material_name not in material_names
        }

    def read(self, depsgraph, target: Target, polygons: Polygons, size: tuple[int, int] | int) -> Read | None:
        """What is linked to the target's node; None without a link, and where it makes no difference.

        `size` is the image's, or the texels along its longer side.
        """
        node, groups = find_node_in_groups(bpy.data.materials[target.material_name])
        if not node.has_texture():
            self._read.pop(target, None)
            return None
        known = self._read.get(target)
        if known is None or known.polygons is not polygons or known.size != size:
            placed = find_instances(depsgraph, {target.object_name})[target.object_name]
            known = _evaluated(node, groups, placed, polygons, size)
        elif known.texture is not None and known.texture.blur != node.texture_blur:
            known = replace(known, texture=replace(known.texture, blur=node.texture_blur))
        self._read[target] = known
        return known

    def sentences(self) -> list[str]:
        """What there is to say."""
        said = [str(message) for read in self._read.values() for message in read.base_color.warnings]
        said += [_unknown(target, read) for target, read in self._read.items() if read.base_color.unknown]
        coarse = dict.fromkeys(target.material_name for target, read in self._read.items() if read.is_coarse)
        said += [f"Live has the texture of '{name}' with {MOST_TEXELS} texels along a side." for name in coarse]
        return list(dict.fromkeys(said))


def _unknown(target: Target, read: Read) -> str:
    shown = f"Live can't evaluate the Base Color of '{target.object_name}' and shows the node's own color"
    return f"{shown}; bakes have Cycles evaluate it. {read.base_color.unknown}"


def _evaluated(node, groups: tuple, placed: ObjectInstance, polygons: Polygons, size: tuple[int, int] | int) -> Read:
    maps = fit_uv_maps(polygons)
    width, height = texture_size(maps, size) if isinstance(size, int) else size
    shrink = min(1.0, MOST_TEXELS / max(width, height))
    receiver = build_receiver(maps, max(1, round(width * shrink)), max(1, round(height * shrink)))
    found = read_texture(node, groups, placed, receiver)
    texture = Texture(receiver, found.colors, found.blur) if found.colors else None
    return Read(found, texture, polygons, size, texture is not None and shrink < 1)
