"""Puts finished bakes into the images of their nodes and shows them in the materials."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.bake.margin import WHOLE, extend_margin
from ...core.bake.runner import Bake
from ...core.bake.settings import COMBINED
from ...core.errors import BakeError
from ..node.find import find_node
from ..node.node import link_result
from . import files

# Texels wholly inside two charts, as a part of one of them: more than rounding at a common border.
OVERLAP_TOLERANCE = 0.01


class Results:
    """The images filled in one run; objects that share an image each fill their own part of it."""

    def __init__(self) -> None:
        self._filled: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def store(self, bake: Bake) -> str:
        """Fill the image of the target's node, or a new one, and link it back; other layers have images beside it.

        The path of the first layer's file, "" where it is packed; BakeError if it can't be kept, or if another object
        of this run has filled the same part of it.
        """
        node = find_node(bpy.data.materials.get(bake.target.material_name))
        if node is None:
            raise BakeError("The material or its Beamspread node was removed during the bake.")
        name = node.image.name if node.image else f"Beamspread {bake.target.object_name}"
        paths = []
        for layer, texture in bake.layers.items():
            shown, size = layer == COMBINED, texture.shape[1::-1]
            image = node.image if shown else self._image_beside(f"{name} {layer}", size)
            if image is None:
                image = files.make_image(name if shown else f"{name} {layer}", *size, is_data=not shown)
            paths.append(self._fill(image, bake, texture))
            if shown:
                bake.warnings += link_result(node, image)
        return paths[0]

    def _image_beside(self, name: str, size: tuple[int, int]):
        """The image of that name, if an earlier bake has made one; its size follows that of the node's."""
        image = bpy.data.images.get(name)
        if image is not None and image.name not in self._filled and tuple(image.size) != size and 0 not in image.size:
            image.scale(*size)
        return image

    def _fill(self, image, bake: Bake, texture: np.ndarray) -> str:
        covered = bake.job.receiver.coverage
        if image.name in self._filled:
            covered, texture = self._merge(image.name, bake, texture)
        path = files.fill_image(image, texture)
        self._filled[image.name] = (covered, texture)
        return path

    def _merge(self, image_name: str, bake: Bake, texture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        covered, merged = self._filled[image_name]
        receiver, inside = bake.job.receiver, bake.job.receiver.inside()
        overlap = 1.0
        if inside.shape == covered.shape:
            overlap = ((receiver.coverage > WHOLE) & (covered > 0)).sum() / inside.sum()
        if overlap > OVERLAP_TOLERANCE:
            raise BakeError(
                f"Another object is baked to the same part of the image '{image_name}': "
                "give each object a material and an image of its own, or move its UVs."
            )
        merged, covered = np.where(inside[..., None], texture, merged), np.maximum(covered, receiver.coverage)
        return covered, extend_margin(merged, covered, bake.job.settings.margin)
