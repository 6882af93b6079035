"""Copies of pictures for Cycles' Rendered view, which reads an image once, by its file where it has one.

A new image is read. They are made only while nothing moves, since Cycles begins anew with each.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import bpy
import numpy as np

from ..images import icons
from ..images.previews import MADE_FOR_PREVIEWS
from ..node.node import all_nodes, show_own_images
from ..node.tree import IMAGE

NAME = ".Beamspread Live"  # the dot hides it in menus

# Between two looks, while pictures are still to come.
PAUSE_SECONDS = 1.0


class StandIns:
    """What nodes' inner trees show in place of the nodes' images."""

    def __init__(self) -> None:
        self._shown: dict[str, tuple[str, np.ndarray]] = {}  # image -> stand-in, its pixels
        # image -> the stand-in before: Cycles knows images by their addresses, and a new one must not get its
        self._before: dict[str, str] = {}
        self._is_due, self._last = True, 0.0

    def names(self) -> set[str]:
        """Of the stand-ins."""
        return {*(name for name, _ in self._shown.values()), *self._before.values()}

    def follow(self, context, images: Sequence, has_new: bool, is_calm: bool, is_busy: bool) -> None:
        """Have Cycles see the images where it renders a view, once nothing moves; `is_busy`: more is still to come."""
        if not _is_cycles_looked_at(context):
            self.end()
            return
        self._is_due |= has_new
        now = time.perf_counter()
        if self._is_due and is_calm and (not is_busy or now - self._last >= PAUSE_SECONDS):
            self._show(images)
            self._is_due, self._last = False, now

    def _show(self, images: Sequence) -> None:
        for image in images:
            pixels = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(pixels)
            name, before = self._shown.get(image.name, ("", None))
            if before is not None and np.array_equal(before.view(np.uint32), pixels.view(np.uint32)):
                continue
            new = _copy(image, pixels)
            self._shown[image.name] = new.name, pixels
            for tree in {node.node_tree for node in all_nodes() if node.image == image and node.node_tree is not None}:
                if tree.library is None:
                    tree.nodes[IMAGE].image = new
            _remove(self._before.get(image.name, ""))
            self._before[image.name] = name

    def update(self, image) -> None:
        """Have others than Cycles follow between two looks, if the image has a stand-in."""
        stand_in = bpy.data.images.get(self._shown.get(image.name, ("", None))[0])
        if stand_in is not None and tuple(stand_in.size) == tuple(image.size):
            pixels = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(pixels)
            stand_in.pixels.foreach_set(pixels)
            stand_in.update()

    def end(self) -> None:
        """Show the nodes' own images again."""
        self._is_due = True
        if self._shown:
            show_own_images()
            for name in self.names():
                _remove(name)
            self._shown.clear()
            self._before.clear()


def _is_cycles_looked_at(context) -> bool:
    """Whether a 3D View is rendered by Cycles."""
    if context.scene.render.engine != "CYCLES":
        return False
    areas = (area for window in context.window_manager.windows for area in window.screen.areas)
    return any(area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED" for area in areas)


def _copy(image, pixels: np.ndarray):
    new = bpy.data.images.new(NAME, *image.size, alpha=image.channels == 4, float_buffer=image.is_float)
    new[MADE_FOR_PREVIEWS] = True  # where undo or a crash brings it back, it goes
    new.colorspace_settings.name = image.colorspace_settings.name
    new.alpha_mode = image.alpha_mode
    new.pixels.foreach_set(pixels)
    new.update()
    return new


def _remove(name: str) -> None:
    image = bpy.data.images.get(name)
    if image is not None:
        icons.remove(image)
