"""Hidden images that the inner trees of nodes show while Live is on; the nodes' own images are never touched."""

from __future__ import annotations

from collections.abc import Collection

import bpy
import numpy as np

from ...core.bake.margin import part_in_shared
from ...core.live.framed_receiver import FramedReceiver
from ...core.live.renderer import Rendering
from ...core.target import BACK, Target
from ..images import files, icons
from ..node.find import find_node
from ..node.node import all_nodes, image_of_side, own_tree
from ..node.tree import IMAGE, show_images, show_map_for_now, show_own_images_in, shown_images

NAME = ".Beamspread Live"  # the dot hides it in menus


SINGLE = "FILE", "GENERATED"
"""Sources of images that are a single one, with no tiles or frames."""


class Preview:
    """The light of all targets of one side of a material, over the pixels of the node's own image of that side.

    Undo and deleted data may take the hidden image away at any time, so it is looked up by its name; `place` makes
    it anew from the pixels here. Methods that show something need `fits`.

    Attributes
    ----------
    size : width and height in texels.
    parts : the texels of each target and of its margin.
    tree_name : name of the inner tree that shows the preview.
    """

    def __init__(self, material_name: str, side: str, size: tuple[int, int]) -> None:
        self.size = size
        self._side = side
        self.parts: dict[Target, FramedReceiver] = {}
        self._masks: dict[Target, np.ndarray] = {}  # bool (height, width), texels that each target fills
        self.tree_name = ""
        self._material_name = material_name
        self._pixels = np.zeros((size[1], size[0], 4), np.float32)
        self._pixels[..., 3] = 1
        self._name, self._former_name, self._uv_map = "", "", ""
        self._is_new_to_cycles = False

    def names(self) -> set[str]:
        """Names of its hidden images."""
        return {self._name, self._former_name} - {""}

    def is_shown(self) -> bool:
        """True if the node's inner tree shows the preview."""
        node = self._node()
        image = None if node is None or node.node_tree is None else self._shown_in(node)
        return image is not None and image.name == self._name and image.has_data

    def fits(self) -> bool:
        """True if the node is still there and its own image has no other size."""
        node = self._node()
        if node is None or node.node_tree is None or self._side not in node.sides():
            return False
        image = image_of_side(node, self._side)
        if image is None:
            return True
        return image.source in SINGLE and tuple(image.size) in (self.size, (0, 0))

    def show(self, rendering: Rendering) -> None:
        """Put a rendering into the preview."""
        is_moved = self.parts.get(rendering.target) is not rendering.framed
        self.parts[rendering.target], self._uv_map = rendering.framed, rendering.framed.receiver.uv_map
        if is_moved:
            self._share()
            self._copy_own_pixels()
        np.copyto(self._pixels[..., :3], rendering.texture, where=self._masks[rendering.target][..., None])
        self.place(is_filled=False)

    def place(self, is_filled: bool = True) -> None:
        """Have the node's inner tree show the preview; `is_filled`: the hidden image has its pixels, if it exists."""
        node = self._node()
        image = bpy.data.images.get(self._name) if self._name else None
        if image is None or not image.has_data or tuple(image.size) != self.size:
            image = files.make_image(NAME, *self.size)
            self._name, is_filled = image.name, False
        if not is_filled:
            image.pixels.foreach_set(self._pixels.ravel())
            image.update()
            self._is_new_to_cycles = True
        if self._shown_in(node) != image:
            tree = own_tree(node)
            front, back = shown_images(tree)
            if len(node.sides()) == 1:
                front = back = image
            elif self._side == BACK:
                front, back = front or image, image
            else:
                front, back = image, back or image
            show_images(tree, front, back)
            self.tree_name = tree.name
        show_map_for_now(node.node_tree, self._uv_map)

    def renew(self) -> None:
        """Show the same pixels in a new hidden image. Cycles, which reads an image once, starts again with it."""
        if not self._is_new_to_cycles:
            return
        # Cycles recognizes images by their addresses: as long as the last two are there, the new one gets another.
        oldest, self._former_name, self._name = self._former_name, self._name, ""
        self.place()
        _remove({oldest})
        self._is_new_to_cycles = False

    def mark_saved(self) -> bool:
        """Have Blender take hidden images for saved, or it asks to save them with every file; False if it did."""
        images = [image for image in map(bpy.data.images.get, self.names()) if image is not None and image.is_dirty]
        for image in images:
            image.pack()
            # Each undo step would store the packed pixels: the image keeps those in memory, see `is_shown`.
            image.pack(data=b"0", data_len=1)
        return bool(images)

    def remove_former(self) -> None:
        """Remove the hidden image that the last one replaced."""
        _remove({self._former_name})
        self._former_name = ""

    def hide(self) -> None:
        """Have inner trees show the nodes' own images, and Image Editors, which Texture Paint gives a tree's image."""
        names = self.names()
        _show_own_images(names)
        spaces = (space for screen in bpy.data.screens for area in screen.areas for space in area.spaces)
        for space in spaces:
            if space.type == "IMAGE_EDITOR" and space.image is not None and space.image.name in names:
                node = self._node()
                space.image = None if node is None else image_of_side(node, self._side)

    def remove(self) -> None:
        """Hide the preview and remove its hidden images."""
        self.hide()
        _remove(self.names())
        self._name = self._former_name = ""

    def drop(self, targets: Collection[Target]) -> None:
        """Show the own image's pixels again in the parts of targets that are gone."""
        for target in targets:
            self.parts.pop(target, None)
        self._share()
        self.refresh()

    def refresh(self) -> None:
        """Take the pixels outside of all parts from the node's own image as it is now."""
        self._copy_own_pixels()
        self.place(is_filled=False)

    def _share(self) -> None:
        """Divide the texels among the targets as bakes do."""
        self._masks = {target: framed.region for target, framed in self.parts.items()}
        if len(self.parts) < 2:
            return
        for target, framed in self.parts.items():
            before, after = np.zeros((2, *framed.inside.shape), np.float32)
            for neighbor, its in self.parts.items():
                if neighbor != target and its.inside.shape == framed.inside.shape:
                    side = before if neighbor < target else after
                    np.maximum(side, its.receiver.coverage, out=side)
            self._masks[target] = part_in_shared(framed.receiver.coverage, before, after, framed.margin)

    def _shown_in(self, node):
        """The image that the node's inner tree shows on the preview's side."""
        front, back = shown_images(node.node_tree)
        return back if self._side == BACK else front

    def _node(self):
        return find_node(bpy.data.materials.get(self._material_name))

    def _copy_own_pixels(self) -> None:
        outside = ~np.any([framed.region for framed in self.parts.values()], axis=0)
        if not outside.any():
            return
        image = image_of_side(self._node(), self._side)
        has_pixels = image is not None and tuple(image.size) == self.size
        self._pixels[outside, :3] = files.linear_pixels(image)[outside] if has_pixels else 0


def remove_strays(names: Collection[str] = ()) -> None:
    """Remove hidden images other than these: undo, pasted objects and files that Blender saved by itself have some."""
    hidden = {image.name for image in bpy.data.images if image.name.startswith(NAME) and image.library is None}
    strays = hidden - set(names)
    if strays:
        _show_own_images(strays)
        _remove(strays)


def _show_own_images(names: Collection[str]) -> None:
    """Have inner trees that show one of these images show the nodes' own ones."""
    for node in all_nodes():
        tree = node.node_tree
        if tree is None or tree.library is not None or IMAGE not in tree.nodes:
            continue
        if any(image is not None and image.name in names for image in shown_images(tree)):
            show_own_images_in(tree, node)


def _remove(names: Collection[str]) -> None:
    for name in names:
        image = bpy.data.images.get(name) if name else None
        if image is not None:
            icons.remove(image)
