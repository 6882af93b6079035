"""Removes noise from small maps of light with Open Image Denoise, if this Blender has it (Debian's has not).

Part of the child process (child.py). Python reaches the denoiser only through a node of the compositor, in a scene of
its own.
"""

import tempfile
from pathlib import Path

import bpy
import compat
import numpy as np

# Width in nodes of the mirror image around each map, which keeps borders and other maps from influencing it.
MARGIN = 16


class Denoiser:
    """Denoises maps, any number of times."""

    def __init__(self) -> None:
        self._scene = bpy.data.scenes.new("Beamspread denoiser")
        settings = self._scene.render
        settings.resolution_percentage = 100
        settings.use_compositing, settings.use_sequencer = True, False
        settings.image_settings.file_format = "OPEN_EXR"
        settings.image_settings.color_mode, settings.image_settings.color_depth = "RGB", "32"
        tree, output = compat.compositor_of(self._scene)
        self._source, denoise = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("CompositorNodeDenoise")
        tree.links.new(denoise.inputs["Image"], self._source.outputs["Image"])
        tree.links.new(output.inputs[0], denoise.outputs["Image"])

    def __call__(self, maps: list) -> list:
        """Denoised maps, float32 (rows, columns, 3). Each keeps its mean in each channel, and dark nodes stay dark."""
        means = [values.mean(axis=(0, 1)) for values in maps]
        scales = [max(float(mean.max()), 1e-30) for mean in means]
        width = max(values.shape[1] for values in maps) + 2 * MARGIN
        blocks = []
        for values, scale in zip(maps, scales):
            across = width - MARGIN - values.shape[1]
            blocks.append(np.pad(fill_dark(values) / scale, ((MARGIN, MARGIN), (MARGIN, across), (0, 0)), "symmetric"))
        clean, row, results = self._run(np.concatenate(blocks)), MARGIN, []
        for values, mean, scale in zip(maps, means, scales):
            rows, columns = values.shape[:2]
            part = np.maximum(clean[row : row + rows, MARGIN : MARGIN + columns] * scale, 0)
            part[~values.any(axis=2)] = 0
            new_mean = part.mean(axis=(0, 1))
            results.append(part * np.divide(mean, new_mean, out=np.zeros_like(mean), where=new_mean > 0))
            row += rows + 2 * MARGIN
        return results

    def _run(self, pixels: np.ndarray) -> np.ndarray:
        height, width, _ = pixels.shape
        image = bpy.data.images.new("Beamspread noisy", width, height, alpha=False, float_buffer=True)
        image.colorspace_settings.name = "Non-Color"
        full = np.ones((height, width, image.channels), np.float32)
        full[..., :3] = pixels
        image.pixels.foreach_set(full.ravel())
        self._source.image = image
        settings = self._scene.render
        settings.resolution_x, settings.resolution_y = width, height
        with tempfile.TemporaryDirectory() as folder:
            settings.filepath = str(Path(folder) / "clean.exr")
            bpy.ops.render.render(write_still=True, scene=self._scene.name)
            clean = bpy.data.images.load(settings.filepath)
            clean.colorspace_settings.name = "Non-Color"
            values = np.empty(len(clean.pixels), np.float32)
            clean.pixels.foreach_get(values)
        values = values.reshape(clean.size[1], clean.size[0], clean.channels)[..., :3]
        if values.shape != pixels.shape or not np.isfinite(values).all():
            raise RuntimeError("the denoiser returned no image")
        for temporary in (image, clean):
            bpy.data.images.remove(temporary)
        return values


def fill_dark(values: np.ndarray) -> np.ndarray:
    """The map with light of the nearest lit node at dark nodes, which else would darken their neighbors.

    Dark nodes are inside of objects. A mean of neighbors would include nodes that are half inside and dim.
    """
    result, lit = values.copy(), values.any(axis=2)
    rows, columns = lit.shape
    while lit.any() and not lit.all():
        padded, known, unknown = np.pad(result, ((1, 1), (1, 1), (0, 0))), np.pad(lit, 1), ~lit
        for down, right in ((0, 1), (1, 0), (1, 2), (2, 1), (0, 0), (0, 2), (2, 0), (2, 2)):
            window = slice(down, down + rows), slice(right, right + columns)
            new = unknown & known[window]
            result[new] = padded[window][new]
            unknown &= ~new
        lit = ~unknown
    return result
