"""Textures from images, as Cycles looks them up."""

from __future__ import annotations

import numpy as np

from .node_math import NotUnderstoodError

# Environment images that are wider are averaged down to it: a texel is then a tenth of a degree.
MOST_WIDE = 4096


class Images:
    """Pixels of images, each read once.

    Attributes
    ----------
    lookups : where not None, gets (pixels, directions (N, 3)) of each environment texture that is looked up.
    """

    def __init__(self) -> None:
        self._flat: dict[str, np.ndarray] = {}
        self._environments: dict[str, np.ndarray] = {}
        self.lookups: list[tuple[np.ndarray, np.ndarray]] | None = None

    def flat(self, image) -> np.ndarray:
        """Float32 (H, W, 4) of scene linear colour and alpha, row 0 at the bottom."""
        if image.name_full not in self._flat:
            self._flat[image.name_full] = _pixels(image)
        return self._flat[image.name_full]

    def environment(self, image) -> np.ndarray:
        """The same, at most `MOST_WIDE` texels wide."""
        if image.name_full not in self._environments:
            self._environments[image.name_full] = shrunk(_pixels(image))
        return self._environments[image.name_full]


def _pixels(image) -> np.ndarray:
    if image.source not in ("FILE", "GENERATED"):
        raise NotUnderstoodError(f"its image '{image.name}' is no single picture")
    width, height = image.size
    if not (width and height and image.channels == 4):
        raise NotUnderstoodError(f"its image '{image.name}' can't be read")
    values = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, 4)
    if not image.is_float:
        _linearize(image, values)
    # As Cycles; files of HDRIs have such texels now and then.
    values[~np.isfinite(values)] = 0
    return values


def _linearize(image, values: np.ndarray) -> None:
    """Bytes come as they are stored; of float images Blender has already made scene linear values."""
    space = image.colorspace_settings
    if image.alpha_mode in ("STRAIGHT", "PREMUL"):
        values[..., :3] *= values[..., 3:]
    if space.name == "sRGB":
        color = values[..., :3]
        values[..., :3] = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    elif not (space.is_data or space.name in ("Linear", "Linear Rec.709")):
        raise NotUnderstoodError(f"its image '{image.name}' has the color space {space.name}")


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


def environment_texture(node):
    if node.node.projection != "EQUIRECTANGULAR":
        return None
    directions = _vector(node, "Generated")
    if directions is None:
        return None
    pixels = node.scope.images.environment(_image_of(node))
    if node.scope.images.lookups is not None:
        node.scope.images.lookups.append((pixels, directions))
    x, y, z = np.moveaxis(directions, -1, 0)
    columns = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * pixels.shape[1]
    rows = (0.5 + np.arctan2(z, np.hypot(x, y)) / np.pi) * pixels.shape[0]
    return lookup(pixels, columns, rows, node.node.interpolation, "REPEAT", "EXTEND")[..., :3]


def image_texture(node):
    if node.node.projection != "FLAT":
        return None
    places = _vector(node, "UV")
    if places is None:
        return None
    pixels, extension = node.scope.images.flat(_image_of(node)), node.node.extension
    if extension not in ("REPEAT", "EXTEND", "CLIP"):
        return None
    columns, rows = places[..., 0] * pixels.shape[1], places[..., 1] * pixels.shape[0]
    color = lookup(pixels, columns, rows, node.node.interpolation, extension, extension)
    return color[..., 3:] if node.output.name == "Alpha" else color[..., :3]


def _image_of(node):
    if node.node.image is None:
        raise NotUnderstoodError(f"its node '{node.node.name}' has no image")
    return node.node.image


def _vector(node, default: str):
    """Where to look, or None if the place is unknown."""
    if node.is_linked("Vector"):
        return node["Vector"]
    return node.scope.outputs.get(("ShaderNodeTexCoord", default))


def lookup(pixels, columns, rows, interpolation: str, across: str, along: str) -> np.ndarray:
    """Pixels (H, W, C) at positions in texels from the image's corner, (N,) each -> (N, C)."""
    if interpolation == "Closest":
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
    numbers = np.mod(numbers, count) if extension == "REPEAT" else np.clip(numbers, 0, count - 1)
    return numbers.astype(int)
