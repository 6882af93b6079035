"""Image and Environment Texture nodes: pixels, lookups and UV transforms as in Cycles."""

from __future__ import annotations

import glob
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...core.errors import MissingImageError, NotSupportedError
from ...core.scene.sampling import bilinear, nearest
from .. import compat
from .node_math import rotation_matrix
from .nodes import InputSocket, Links, Source

EXTENSIONS = {"REPEAT": "repeat", "EXTEND": "extend", "CLIP": "clip", "MIRROR": "mirror"}

# Largest width of an environment, texels; wider ones are averaged down. A texel is then a tenth of a degree.
MAX_WIDTH = 4096


@dataclass(frozen=True)
class UVTransform:
    """From a mesh's UVs to texels of an image.

    Attributes
    ----------
    uv_map : name of the UV map; empty for the one that renders.
    matrix : rows of the 2 x 3 matrix from the map's UVs to those of the image.
    extension : as native `ColorTexture.from_image` takes it.
    is_smooth : True if texels are interpolated.
    """

    uv_map: str
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    extension: str
    is_smooth: bool


def uv_transform_of(links: Links, texture: Source) -> UVTransform:
    """UV transform of an Image Texture node; NotSupportedError names the node that has none."""
    node = texture.node
    if node.projection != "FLAT":
        raise NotSupportedError("node", node.name, "its projection is not flat")
    uv_map, matrix = _uvs(links, texture)
    rows = tuple(tuple(float(value) for value in row) for row in matrix[:2])
    return UVTransform(uv_map, rows, EXTENSIONS[node.extension], node.interpolation != "Closest")


def _uvs(links: Links, texture: Source) -> tuple[str, np.ndarray]:
    """Name of the UV map, and the 3 x 3 matrix that the Mapping nodes after it make."""
    matrix, source = np.eye(3), links.source(texture.input("Vector"))
    while source.socket.is_output and source.node.bl_idname == "ShaderNodeMapping":
        matrix, source = matrix @ _mapping(links, source), links.source(source.input("Vector"))
    if not source.socket.is_output:
        return "", matrix
    node = source.node
    if node.bl_idname == "ShaderNodeTexCoord" and source.socket.name == "UV" and not node.from_instancer:
        return "", matrix
    if node.bl_idname == "ShaderNodeUVMap" and not node.from_instancer:
        return node.uv_map, matrix
    if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type == "GEOMETRY" and source.socket.name != "Alpha":
        return node.attribute_name, matrix
    raise NotSupportedError("node", node.name, "its coordinates are not those of a UV map")


def _mapping(links: Links, mapping: Source) -> np.ndarray:
    """3 x 3 matrix of homogeneous UVs."""
    kind = mapping.node.vector_type
    if kind == "NORMAL":
        raise NotSupportedError("node", mapping.node.name, "its coordinates are not those of a UV map")

    def numbers(name: str) -> np.ndarray:
        source = links.source(mapping.input(name))
        if source.socket.is_output:
            raise NotSupportedError("node", mapping.node.name, "its values are linked")
        return np.array(source.socket.default_value, float)

    rotation, scale, shift = rotation_matrix(numbers("Rotation")), numbers("Scale"), np.zeros(3)
    if kind != "VECTOR":
        shift = numbers("Location")
    if kind == "TEXTURE":
        with np.errstate(divide="ignore"):
            linear = np.diag(np.where(scale == 0, 0, 1 / scale)) @ rotation.T
        shift = -linear @ shift
    else:
        linear = rotation @ np.diag(scale)
    return np.array([[*linear[0, :2], shift[0]], [*linear[1, :2], shift[1]], [0, 0, 1]])


class Pixels:
    """Pixels of images as stored, each read once."""

    def __init__(self) -> None:
        self._known: dict[str, np.ndarray] = {}

    def __call__(self, node) -> np.ndarray:
        """Pixels of a node's image, float32 (H, W, 4).

        Raises
        ------
        MissingImageError
            The node has no image, or its files can't be read.
        """
        image = node.image
        if image is None:
            raise MissingImageError(node=node.name)
        if image.source not in ("FILE", "GENERATED", "VIEWER"):
            if _is_missing(image):
                raise MissingImageError(image.name)
            raise NotSupportedError("image", image.name, "it is a sequence, a movie or tiled")
        if image.name_full not in self._known:
            self._known[image.name_full] = self._read(image)
        return self._known[image.name_full]

    @staticmethod
    def _read(image) -> np.ndarray:
        values = np.empty(len(image.pixels), np.float32)
        if not len(values):
            raise MissingImageError(image.name)
        image.pixels.foreach_get(values)
        values = values.reshape(image.size[1], image.size[0], -1)
        if values.shape[2] == 4:
            return values
        color = values if values.shape[2] == 3 else np.repeat(values[..., :1], 3, axis=2)
        return np.concatenate([color, np.ones_like(color[..., :1])], axis=2)


class Images:
    """Textures that are looked up by direction or by UV; the pixels of each are read once."""

    def __init__(self, pixels: Pixels | None = None) -> None:
        self._pixels = pixels or Pixels()
        self._environments: dict[str, np.ndarray] = {}

    def environment(self, node) -> np.ndarray:
        """Linear float32 (H, W, 3) of a node's image, at most `MAX_WIDTH` texels wide, row 0 at the bottom."""
        name = node.image.name_full if node.image else ""
        if name not in self._environments:
            color = np.asarray(outputs_of(node, self._stored(node))["Color"], np.float32)
            # Cycles reads infinity and NaN, which some files of HDRIs have, as 0.
            self._environments[name] = shrunk(np.where(np.isfinite(color), color, np.float32(0)))
        return self._environments[name]

    def check(self, node) -> None:
        """Raise NotSupportedError if a node's image can't be looked up."""
        self._stored(node)

    def at(self, node, uvs: np.ndarray) -> dict[str, np.ndarray]:
        """Outputs of an Image Texture node at UVs (N, 3)."""
        stored = self._stored(node)
        columns, rows = uvs[..., 0] * stored.shape[1], uvs[..., 1] * stored.shape[0]
        texels = sampled(node, stored, columns, rows, node.extension, node.extension)
        return outputs_of(node, texels)

    def _stored(self, node) -> np.ndarray:
        image = node.image
        if image is not None and not image.is_float:
            space = image.colorspace_settings
            if not (space.is_data or space.name == "sRGB" or space.name in ("Linear", "Linear Rec.709")):
                raise NotSupportedError("image", image.name, f"its color space is {space.name}")
        return self._pixels(node)


def missing_images(links: Links, wanted: InputSocket) -> list[MissingImageError]:
    """Errors for images that an input depends on and that no renderer can load, each once; reads no pixels."""
    nodes = dict.fromkeys(source.node for source in links.readers(wanted) if source.socket.is_output)
    textures = [node for node in nodes if node.bl_idname in ("ShaderNodeTexImage", "ShaderNodeTexEnvironment")]
    missing = {node.image.name if node.image else node.name: node for node in textures if _is_missing(node.image)}
    return [MissingImageError(node.image.name if node.image else "", node.name) for node in missing.values()]


def _is_missing(image) -> bool:
    """True if none of the image's files, tiles or frames exists, and its pixels are nowhere else."""
    if image is None:
        return True
    if image.source not in ("FILE", "MOVIE", "TILED", "SEQUENCE") or image.packed_file is not None or image.has_data:
        return False
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    if image.source == "TILED":
        return not any(Path(str(path).replace("<UDIM>", str(tile.number))).exists() for tile in image.tiles)
    if image.source == "SEQUENCE":
        return not any(path.parent.glob(glob.escape(path.stem.rstrip("0123456789")) + "*" + path.suffix))
    return not path.exists()


def shrunk(pixels: np.ndarray) -> np.ndarray:
    """Means over boxes of texels, weighted by their solid angles, so that an environment keeps its energy."""
    height, width, channels = pixels.shape
    step = -(-width // MAX_WIDTH)
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
    """Columns and rows of directions (N, 3) in an equirectangular image, in texels from its corner."""
    x, y, z = np.moveaxis(directions, -1, 0)
    columns = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * shape[1]
    return columns, (0.5 + np.arctan2(z, np.hypot(x, y)) / np.pi) * shape[0]


def sampled(node, pixels: np.ndarray, columns, rows, across: str, along: str) -> np.ndarray:
    """Pixels (H, W, C) at positions in texels from the image's corner, (N,) or one, interpolated as the node says."""
    sample = nearest if node.interpolation == "Closest" else bilinear
    values = sample(pixels, np.atleast_1d(columns), np.atleast_1d(rows), across, along).astype(float)
    return values if np.ndim(columns) else values[0]


def alpha_of(node, stored: np.ndarray) -> np.ndarray:
    """Alpha (H, W, 1) of a node, from the alpha of pixels as stored."""
    return np.ones_like(stored) if node.image is not None and node.image.alpha_mode == "NONE" else stored


def color_of(node, stored: np.ndarray) -> np.ndarray:
    """Linear color (H, W, 3) of a node, from pixels as stored or interpolated between them."""
    color, alpha, image = stored[..., :3], stored[..., 3:], node.image
    if image is None:
        return color
    is_data = image.colorspace_settings.is_data
    if image.alpha_mode not in ("NONE", "CHANNEL_PACKED") and not is_data:
        # Cycles works with associated alpha, and divides by it if the node's alpha is used.
        wants_straight = "Alpha" in node.outputs and node.outputs["Alpha"].is_linked
        is_straight = compat.alpha_is_straight(image)
        if wants_straight and not is_straight:
            color = color / np.where(alpha > 0, alpha, 1)
        elif is_straight and not wants_straight:
            color = color * alpha
    if not (is_data or image.is_float or image.colorspace_settings.name.startswith("Linear")):
        color = from_srgb(color)
    return color


def from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Linear values of the sRGB transfer function (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4)


def outputs_of(node, stored: np.ndarray) -> dict[str, np.ndarray]:
    """Color and Alpha of a node, from pixels as stored or interpolated between them."""
    return {"Color": color_of(node, stored), "Alpha": alpha_of(node, stored[..., 3:])}
