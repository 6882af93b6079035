"""Stores finished bakes in the images of their nodes, and shows them in the materials."""

from __future__ import annotations

from collections.abc import Iterable

import bpy
import numpy as np

from ...core.bake.bake_settings import COMBINED
from ...core.bake.runner import Bake
from ...core.errors import BakeError
from ...core.messages import note
from ...core.scene.tiles import Tiling
from ...core.target import Target
from ..node import plain
from ..node.find import find_node, node_of, uses_tiles
from ..node.node import image_of_side, link_result
from ..node.uv_maps import objects_with_maps
from ..read.geometry import read_polygons
from . import files, icons, tiled
from .facts import note_bake, owners_of, users_of, users_of_material
from .new_image import name_for, separate_from_other_scene, store_new
from .shared import Parts, Size, overlaps, parts_of, read_parts, texels_of
from .udim import is_tiled
from .waiting import Waiting


class Results:
    """Images that one run fills. Objects that share an image fill a part of it each.

    Attributes
    ----------
    waiting : results that are not yet in their images, because others of the run follow.
    """

    def __init__(self) -> None:
        self.waiting = Waiting()
        self._planned: dict[str, list[Target]] = {}  # targets by the name of their image, in the order of the run
        self._maps: dict[Target, str | None] = {}  # as of `_map_of`
        self._parts: dict[tuple, Parts | None] = {}  # islands by target and size of the image

    def admit(self, bake: Bake) -> Bake:
        """The bake if its result can be stored, else a failed bake with the reason."""
        if bake.job is None:
            return bake
        try:
            self._plan(image_of_side(_node(bake.target, bake.job.settings.layer), bake.target.side), bake)
        except BakeError as error:
            return Bake(bake.target, error=error)
        return bake

    def _plan(self, image, bake: Bake) -> None:
        """Reserve the bake's part of an image; raises BakeError if it belongs to another target of the material."""
        if image is not None:
            files.check_image(image)
            if is_tiled(image) and files.file_of(image) is None:
                tiled.check_folder()
            self._check_room(image, bake)
            self._planned.setdefault(image.name, []).append(bake.target)
            self._parts[bake.target, _size_in(image, bake)] = parts_of(bake.job.receiver)
        elif bake.job.receiver.tiling is not None:
            tiled.check_folder()

    def store(self, bake: Bake, others_follow: bool = False) -> str:
        """Fill the image of the target's node, or a new one, and show it; other layers have images of their own.

        If `others_follow`, bakes of the run that fill the same image, the result may wait for them: `waiting.write()`
        has to come after the last one. If the node's image holds the result of another target, the target gets a new
        image. Returns the path of the file, "" if the image is packed.

        Raises
        ------
        BakeError
            The result can't be stored.
        """
        self.waiting.others_follow = others_follow
        layer, texture = bake.job.settings.layer, bake.texture
        node = _node(bake.target, layer)
        if layer != COMBINED:
            return self._store_beside(node, bake, layer, texture)
        path, image = self._store_shown(node, bake, texture)
        self._warn_of_other_maps(image, bake)
        bake.messages.add(*link_result(node, image, bake.job.receiver.uv_map, bake.target.side))
        return path

    def fill(self, image, bake: Bake, texture: np.ndarray, shown=None) -> str | None:
        """Fill the bake's part of an image; the path of its file, None if the part belongs to another target.

        `shown` is the image whose owners count: the node's, if `image` is beside it.
        """
        users = users_of(shown or image)
        owners = self._other_owners(shown or image, bake, users)
        if any(self._covers(owner, image, bake) for owner in owners):
            return None
        neighbors = self._neighbors(image, bake, owners, users)
        if not neighbors:
            return self.waiting.fill(image, bake, texture)
        filled = texels_of(bake.target, bake.job.receiver, neighbors, bake.job.settings.margin)
        return self.waiting.fill(image, bake, texture, filled)

    def fill_shown(self, image, bake: Bake, texture: np.ndarray) -> str | None:
        """Fill the bake's part of its node's image and record its owner; None if the part belongs to another."""
        size = texture.shape[1::-1]
        if bake.job.receiver.tiling is None and tuple(image.size) != size and 0 not in image.size:
            icons.scale(image, *size)
            bake.warn(
                image.name, f"The image '{image.name}' was resized during the bake. It has its former size again."
            )
        path = self.fill(image, bake, texture)
        if path is not None:
            note_bake(image, bake.target)
            plain.refresh(image)
            if texture.max() > 1 and files.clips(image):
                bake.warn(image.name, f"The image '{image.name}' clips values above 1.", "Make Float keeps them.")
        return path

    def _store_shown(self, node, bake: Bake, texture: np.ndarray) -> tuple[str, bpy.types.Image]:
        image = image_of_side(node, bake.target.side)
        if image is None:
            return self._new(bake, texture)
        separate = tiled.separate_from_other_scene if is_tiled(image) else separate_from_other_scene
        bake.messages.add(*separate(image))
        path = self.fill_shown(image, bake, texture)
        if path is not None:
            return path, image
        self._check_room(image, bake)
        overlapping = (owner for owner in self._other_owners(image, bake) if self._covers(owner, image, bake))
        names = " and ".join(f"'{owner}'" for owner in overlapping)
        path, new = self._new(bake, texture)
        text = (
            f"The image '{image.name}' belongs to {names}: '{bake.target}' overlaps it there and now has '{new.name}'."
        )
        bake.warn(image.name, text, "To share one image, move the UVs of one of them.")
        return path, new

    def _new(self, bake: Bake, texture: np.ndarray) -> tuple[str, bpy.types.Image]:
        """Store the bake in a new image; texels of objects with the same material, which will share it, stay empty."""
        users = [user for user in users_of_material(bake.target.material_name) if user.side == bake.target.side]
        neighbors = self._parts_beside(bake, users, bake.job.receiver.tiling or texture.shape[1::-1])
        if neighbors:
            filled = texels_of(bake.target, bake.job.receiver, neighbors, bake.job.settings.margin)
            texture = np.where(filled[..., None], texture, np.float32(0))
        path, image = _store_new(name_for(bake.target), texture, bake)
        note_bake(image, bake.target)
        return path, image

    def _warn_of_other_maps(self, image, bake: Bake) -> None:
        """Warn if another object of the same material shows its part of the image by another UV map."""
        target, uv_map = bake.target, bake.job.receiver.uv_map
        self._maps[target] = uv_map
        for owner in owners_of(image):
            if owner == target or owner.image_key != target.image_key:
                continue
            if owner not in self._maps:
                self._maps[owner] = _map_of(owner)
            if self._maps[owner] not in (None, uv_map):
                bake.warn(
                    image.name,
                    f"'{owner.object_name}' and '{target.object_name}' share a material and have different UV maps: "
                    f"only '{target.object_name}' shows its bake.",
                    f"{own_material(target.object_name)}.",
                )

    def _store_beside(self, node, bake: Bake, layer: str, texture: np.ndarray) -> str:
        """Fill the image of a layer that no node shows; its name begins with that of the node's image."""
        own = image_of_side(node, bake.target.side)
        names = [f"{own.name} {layer}"] if own else []
        for name in [*names, f"{name_for(bake.target)} {layer}"]:
            image, size = bpy.data.images.get(name), texture.shape[1::-1]
            if image is None:
                return _store_new(name, texture, bake, is_data=True)[0]
            if bake.job.receiver.tiling is None and tuple(image.size) != size and 0 not in image.size:
                icons.scale(image, *size)
            path = self.fill(image, bake, texture, own)
            if path is not None:
                return path
        raise BakeError(
            f"Another object is baked to the same part of the image '{name}'.", "Move the UVs of one of them."
        )

    def _other_owners(self, image, bake: Bake, users: list[Target] | None = None) -> list[Target]:
        """Other targets whose results the image holds, or that come first in this run; `users` as of `owners_of`."""
        target = bake.target
        planned = self._planned.get(image.name, [])
        first = planned[: planned.index(target)] if target in planned else planned
        users = users_of(image) if users is None else users
        owners = dict.fromkeys([*owners_of(image, users), *(owner for owner in first if owner in users)])
        owners.pop(target, None)
        if target.object_name in bpy.data.objects:
            return list(owners)
        # The target was renamed during the bake: a target of the same material and charts is the target itself.
        return [
            owner
            for owner in owners
            if owner.material_name != target.material_name or not self._covers(owner, image, bake)
        ]

    def _covers(self, owner: Target, image, bake: Bake) -> bool:
        return overlaps(bake.job.receiver, self._parts_of(owner, _size_in(image, bake)))

    def _neighbors(self, image, bake: Bake, owners: list[Target], users: list[Target]) -> dict[Target, Parts]:
        """Parts of an image that other targets fill, or will fill. A note names those that the bake overlaps."""
        size = _size_in(image, bake)
        neighbors = self._parts_beside(bake, [*owners, *users], size)
        if bake.target.object_name in bpy.data.objects:  # it may have been renamed, and be a user itself
            for user in [user for user in users if user not in (*owners, *neighbors, bake.target)]:
                if self._known_parts(user, size):
                    text = f"'{bake.target}' and '{user}' overlap in the image '{image.name}'."
                    bake.messages.add(note(image.name, text, "To share it, move the UVs of one of them."))
        return neighbors

    def _parts_beside(self, bake: Bake, targets: Iterable[Target], size: Size) -> dict[Target, Parts]:
        """Parts of other targets in a texture, without those of targets that can't be baked, or that overlap."""
        known = {target: self._known_parts(target, size) for target in targets if target != bake.target}
        return {target: parts for target, parts in known.items() if parts and not overlaps(bake.job.receiver, parts)}

    def _parts_of(self, target: Target, size: Size) -> Parts:
        """The target's islands in a texture; the whole texture if they are unknown."""
        parts = self._known_parts(target, size)
        if parts is None:
            width, height = size.size if isinstance(size, Tiling) else size
            return ((0, 0, np.ones((height, width), np.float32)),)
        return parts

    def _known_parts(self, target: Target, size: Size) -> Parts | None:
        """The target's islands in a texture; None if it can't be baked."""
        key = target, size
        if key not in self._parts:
            self._parts[key] = read_parts(*key)
        return self._parts[key]

    def _check_room(self, image, bake: Bake) -> None:
        """Raise BakeError if the part belongs to a target of the same material, which can't have two images."""
        receiver, target = bake.job.receiver, bake.target
        if receiver.tiling is None and receiver.coverage.shape != tuple(image.size)[::-1]:
            return
        for owner in self._other_owners(image, bake):
            if owner.material_name == target.material_name and self._covers(owner, image, bake):
                if owner.object_name == target.object_name:
                    text = f"Both sides of '{owner.object_name}' have the image '{image.name}'."
                    raise BakeError(text, "Clear Back Image in the node: the bake makes a new one.")
                raise BakeError(
                    f"'{owner.object_name}' is baked to the same part of the image '{image.name}' by the same "
                    "material.",
                    f"{own_material(target.object_name)}, or {_own_place(target.object_name)}.",
                )


def own_material(name: str) -> str:
    """The beginning of a sentence on how an object gets a material of its own."""
    parts = "Object & Data & Materials" if _shares_mesh(name) else "Materials"
    return f"Give '{name}' a material of its own (Object > Relations > Make Single User > {parts})"


def _own_place(name: str) -> str:
    """The end of a sentence on how an object gets a place of its own in an image."""
    if _shares_mesh(name) or name in objects_with_maps():  # the UVs of others, or of our own
        return "make One Atlas for the Selection (Properties > Render > Beamspread > New Images)"
    return "move its UVs"


def _shares_mesh(name: str) -> bool:
    """True if other objects have the mesh of an object, and so its materials and UVs."""
    obj = bpy.data.objects.get(name)
    return obj is not None and obj.data is not None and obj.data.users - obj.data.use_fake_user > 1


def _size_in(image, bake: Bake) -> Size:
    """Size of the texture that a bake fills in an image, or the tiles in it."""
    return bake.job.receiver.tiling or tuple(image.size)


def _store_new(name: str, texture: np.ndarray, bake: Bake, is_data: bool = False) -> tuple[str, bpy.types.Image]:
    store = store_new if bake.job.receiver.tiling is None else tiled.store_new
    return store(name, texture, bake, is_data)


def _node(target: Target, layer: str):
    """The target's node; raises BakeError if it is gone, or if it must be changed and can't be."""
    material = bpy.data.materials.get(target.material_name)
    node = find_node(material)
    if node is None:
        raise BakeError("The material or its Beamspread node was removed or renamed during the bake.", "Bake again.")
    if layer == COMBINED:
        check_editable(material)
    return node


def check_editable(material) -> None:
    """Raise BakeError if changes of the material are lost when the file is closed."""
    if material.library is not None or material.override_library is not None:
        raise BakeError(
            f"The material '{material.name}' belongs to another .blend file, so this one can't keep its image.",
            "Make it local (Object > Relations > Make Local > Selected Objects, Data and Materials), or bake in that "
            "file.",
        )


def _map_of(target: Target) -> str | None:
    """Name of the UV map of a target, "" for the one that renders; None if the target or the map is gone."""
    obj = bpy.data.objects.get(target.object_name)
    if obj is None:
        return None
    evaluated, node = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()), node_of(target)
    in_tiles = node is not None and uses_tiles(node, target.side)
    try:
        return read_polygons(evaluated, target.material_name, None, getattr(node, "uv_map", ""), in_tiles).uv_map
    except BakeError:
        return None
