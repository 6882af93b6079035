"""Images looked up by direction or by UV, as Cycles does it."""

from __future__ import annotations

import numpy as np

from .image_texture import NotUnderstoodError, Pixels, outputs_of

# Environment images that are wider are averaged down to it: a texel is then a tenth of a degree.
MOST_WIDE = 4096


class Images:
    """Pixels of images, each read once."""

    def __init__(self, pixels: Pixels | None = None) -> None:
        self._pixels = pixels or Pixels()
        self._environments: dict[str, np.ndarray] = {}

    def environment(self, node) -> np.ndarray:
        """Linear float32 (H, W, 3) of the image of a node, at most `MOST_WIDE` texels wide, row 0 at the bottom."""
        name = node.image.name_full if node.image else ""
        if name not in self._environments:
            color = np.asarray(outputs_of(node, self._stored(node))["Color"], np.float32)
            # As Cycles; files of HDRIs have such texels now and then.
            self._environments[name] = shrunk(np.where(np.isfinite(color), color, np.float32(0)))
        return self._environments[name]

    def at(self, node, places: np.ndarray) -> dict[str, np.ndarray]:
        """Outputs of an Image Texture node at UVs (N, 3)."""
        stored = self._stored(node)
        columns, rows = places[..., 0] * stored.shape[1], places[..., 1] * stored.shape[0]
        found = lookup(stored, columns, rows, node.interpolation != "Closest", node.extension, node.extension)
        return outputs_of(node, found)

    def _stored(self, node) -> np.ndarray:
        image = node.image
        if image is not None and not image.is_float:
            space = image.colorspace_settings
            if not (space.is_data or space.name == "sRGB" or space.name in ("Linear", "Linear Rec.709")):
                raise NotUnderstoodError(f"the color space {space.name} of the image '{image.name}' is")
        return self._pixels(image)


def shrunk(pixels: np.ndarray) -> np.ndarray:
    """Means over boxes of texels, weighed by their solid angles, so that an environment keeps its energy."""
    height, width, channels = pixels.shape
    step = -(-width // MOST_WIDE)
    while height % step or width % step:
        step += 1
    if step == 1:
        return pixels
    edges = np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, height + 1))
    weights = np.diff(edges).astype(np.float32).reshape(-1, step, 1, 1)
    rows = pixels.reshape(-1, step, width, channels)
    rows = (rows * (weights / weights.sum(axis=1, keepdims=True))).sum(axis=1)
    return rows.reshape(len(rows), -1, step, channels).mean(axis=2)


def environment_coordinates(directions: np.ndarray, shape: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Columns and rows, in texels from the image's corner, where an equirectangular image has directions (N, 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    columns = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * shape[1]
    return columns, (0.5 + np.arctan2(z, np.hypot(x, y)) / np.pi) * shape[0]


def lookup(pixels, columns, rows, is_smooth: bool, across: str, along: str) -> np.ndarray:
    """Pixels (H, W, C) at positions in texels from the image's corner, (N,) each -> (N, C)."""
    if not is_smooth:
        return _texels(pixels, np.floor(columns), np.floor(rows), across, along)
    column, row = np.floor(columns - 0.5), np.floor(rows - 0.5)
    right, up = (columns - 0.5 - column)[..., None], (rows - 0.5 - row)[..., None]
    below = _texels(pixels, column, row, across, along) * (1 - right)
    below += _texels(pixels, column + 1, row, across, along) * right
    above = _texels(pixels, column, row + 1, across, along) * (1 - right)
    above += _texels(pixels, column + 1, row + 1, across, along) * right
    return below * (1 - up) + above * up


def _texels(pixels, columns, rows, across: str, along: str) -> np.ndarray:
    height, width = pixels.shape[:2]
    found = pixels[_inside(rows, height, along), _inside(columns, width, across)].astype(float)
    if across == "CLIP":
        found *= ((columns >= 0) & (columns < width) & (rows >= 0) & (rows < height))[..., None]
    return found


def _inside(numbers, count: int, extension: str) -> np.ndarray:
    if extension == "REPEAT":
        numbers = np.mod(numbers, count)
    elif extension == "MIRROR":
        numbers = np.mod(numbers, 2 * count)
        numbers = np.minimum(numbers, 2 * count - 1 - numbers)
    return np.clip(numbers, 0, count - 1).astype(int)
