"""Puts finished bakes into the images of their nodes and shows them in the materials."""

from __future__ import annotations

import bpy
import numpy as np

from . import bakes, nodes, targets
from .core.errors import BakeError
from .core.job import BakeJob
from .core.margin import extend_margin

# Texels wholly inside two charts, as a part of one of them: more than rounding at a common border.
OVERLAP_TOLERANCE = 0.01


class Results:
    """The images filled in one run; objects that share an image each fill their own part of it."""

    def __init__(self) -> None:
        self._filled: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    def store(self, target: bakes.Target, job: BakeJob, texture: np.ndarray) -> None:
        """Fill the image of the target's node, or a new one, and link it back.

        Raises
        ------
        BakeError
            The image cannot be kept, or another object of this run has filled the same part of it.
        """
        material = bpy.data.materials.get(target.material_name)
        node = nodes.find_node(material)
        if node is None:
            raise BakeError("The material or its Beamspread node was removed during the bake.")
        covered = job.receiver.coverage > 0
        image = node.image
        if image is None:
            height, width = texture.shape[:2]
            image = targets.make_image(f"Beamspread {target.object_name}", width, height)
        elif image.name in self._filled:
            covered, texture = self._merge(image.name, job, texture)
        targets.fill_image(image, texture)
        self._filled[image.name] = (covered, texture)
        nodes.link_result(material, image)

    def _merge(self, image_name: str, job: BakeJob, texture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        covered, merged = self._filled[image_name]
        coverage = job.receiver.coverage
        overlap = 1.0 if coverage.shape != covered.shape else ((coverage > 0.99) & covered).sum() / (coverage > 0).sum()
        if overlap > OVERLAP_TOLERANCE:
            raise BakeError(
                f"Another object is baked to the same part of the image '{image_name}': "
                "give each object a material and an image of its own, or move its UVs."
            )
        merged = np.where((coverage > 0)[..., None], texture, merged)
        covered = covered | (coverage > 0)
        return covered, extend_margin(merged, covered, job.settings.margin)
