"""Takes the noise out of small maps of light, by Open Image Denoise where this Blender has it.

Part of the child process (child.py). The compositor's node is the one way to it from Python; it works in a scene of its
own. Debian's Blender is built without.
"""

import tempfile
from pathlib import Path

import bpy
import compat
import numpy as np

# Around each map goes its mirror image, so many nodes wide: neither the borders nor other maps show within it.
MARGIN = 16


class Denoiser:
    """Maps go in and come back as often as wanted."""

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
        """Of float32 (rows, columns, 3) each; every map keeps its mean in each channel, and what is dark stays dark."""
        means = [one.mean(axis=(0, 1)) for one in maps]
        scales = [max(float(mean.max()), 1e-30) for mean in means]
        width = max(one.shape[1] for one in maps) + 2 * MARGIN
        blocks = []
        for one, scale in zip(maps, scales):
            across = width - MARGIN - one.shape[1]
            blocks.append(np.pad(fill_dark(one) / scale, ((MARGIN, MARGIN), (MARGIN, across), (0, 0)), "symmetric"))
        clean, row, results = self._run(np.concatenate(blocks)), MARGIN, []
        for one, mean, scale in zip(maps, means, scales):
            rows, columns = one.shape[:2]
            part = np.maximum(clean[row : row + rows, MARGIN : MARGIN + columns] * scale, 0)
            part[~one.any(axis=2)] = 0
            found = part.mean(axis=(0, 1))
            results.append(part * np.divide(mean, found, out=np.zeros_like(mean), where=found > 0))
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
            raise RuntimeError("the denoiser returned no picture")
        for one in (image, clean):
            bpy.data.images.remove(one)
        return values


def fill_dark(values: np.ndarray) -> np.ndarray:
    """Nodes without light, as those inside of things, get that of the nearest with some: else they would darken these.

    Not a mean of those around: nodes that are half inside are dim, and would pass for noise between brighter ones.
    """
    result, lit = values.copy(), values.any(axis=2)
    rows, columns = lit.shape
    while lit.any() and not lit.all():
        padded, known, unknown = np.pad(result, ((1, 1), (1, 1), (0, 0))), np.pad(lit, 1), ~lit
        for down, right in ((0, 1), (1, 0), (1, 2), (2, 1), (0, 0), (0, 2), (2, 0), (2, 2)):
            place = slice(down, down + rows), slice(right, right + columns)
            new = unknown & known[place]
            result[new] = padded[place][new]
            unknown &= ~new
        lit = ~unknown
    return result
