"""Image Texture nodes: pixels as Cycles sees them, and where they lie on a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .node_links import End, Wanted, follow

MISSING = np.array([1.0, 0.0, 1.0, 1.0], np.float32)  # what Cycles shows for an image that it can't load
EXTENSIONS = {"REPEAT": "repeat", "EXTEND": "extend", "CLIP": "clip", "MIRROR": "mirror"}


class NotUnderstoodError(Exception):
    """What of a node tree is not understood, as the beginning of a sentence about it."""


@dataclass(frozen=True)
class TexturePlace:
    """How a mesh's UVs look an image up.

    Attributes
    ----------
    uv_map : its name; empty for the one that renders.
    matrix : rows of the 2 x 3 matrix from the map's UVs to those of the image.
    extension : as native `Transmittance.from_image` takes it.
    is_smooth : interpolated between texels.
    """

    uv_map: str
    matrix: tuple[tuple[float, float, float], tuple[float, float, float]]
    extension: str
    is_smooth: bool


def place_of(texture: End) -> TexturePlace:
    node = texture.node
    if node.projection != "FLAT":
        raise NotUnderstoodError(f"the projection of the node '{node.name}' is")
    uv_map, matrix = _uvs(texture.input("Vector"))
    rows = tuple(tuple(float(value) for value in row) for row in matrix[:2])
    return TexturePlace(uv_map, rows, EXTENSIONS[node.extension], node.interpolation != "Closest")


def _uvs(vector: Wanted) -> tuple[str, np.ndarray]:
    end = follow(vector)
    if not end.socket.is_output:
        return "", np.eye(3)
    node = end.node
    if node.bl_idname == "ShaderNodeTexCoord" and end.socket.name == "UV" and not node.from_instancer:
        return "", np.eye(3)
    if node.bl_idname == "ShaderNodeUVMap" and not node.from_instancer:
        return node.uv_map, np.eye(3)
    if node.bl_idname == "ShaderNodeAttribute" and node.attribute_type == "GEOMETRY" and end.socket.name != "Alpha":
        return node.attribute_name, np.eye(3)
    if node.bl_idname == "ShaderNodeMapping" and node.vector_type != "NORMAL":
        uv_map, before = _uvs(end.input("Vector"))
        return uv_map, _mapping(end) @ before
    raise NotUnderstoodError(f"the texture coordinates of the node '{node.name}' are")


def _mapping(mapping: End) -> np.ndarray:
    """3 x 3, of homogeneous UVs."""

    def numbers(name: str) -> np.ndarray:
        end = follow(mapping.input(name))
        if end.socket.is_output:
            raise NotUnderstoodError(f"the node '{mapping.node.name}', whose values are linked, is")
        return np.array(end.socket.default_value, float)

    rotation, scale = numbers("Rotation"), numbers("Scale")
    x, y, z = ((math.cos(angle), math.sin(angle)) for angle in rotation)
    turn_x = np.array([[1, 0, 0], [0, x[0], -x[1]], [0, x[1], x[0]]])
    turn_y = np.array([[y[0], 0, y[1]], [0, 1, 0], [-y[1], 0, y[0]]])
    turn_z = np.array([[z[0], -z[1], 0], [z[1], z[0], 0], [0, 0, 1]])
    turn, shift = turn_z @ turn_y @ turn_x, np.zeros(3)
    kind = mapping.node.vector_type
    if kind != "VECTOR":
        shift = numbers("Location")
    if kind == "TEXTURE":
        with np.errstate(divide="ignore"):
            linear = np.diag(np.where(scale == 0, 0, 1 / scale)) @ turn.T
        shift = -linear @ shift
    else:
        linear = turn @ np.diag(scale)
    return np.array([[*linear[0, :2], shift[0]], [*linear[1, :2], shift[1]], [0, 0, 1]])


class Pixels:
    """Pixels of a material's images, read once."""

    def __init__(self) -> None:
        self._known: dict[str, np.ndarray] = {}

    def __call__(self, image) -> np.ndarray:
        """As stored, float32 (H, W, 4)."""
        if image is None:
            return MISSING[None, None]
        if image.source not in ("FILE", "GENERATED", "VIEWER"):
            raise NotUnderstoodError(f"the image '{image.name}', which is no single one, is")
        if image.name_full not in self._known:
            self._known[image.name_full] = self._read(image)
        return self._known[image.name_full]

    @staticmethod
    def _read(image) -> np.ndarray:
        values = np.empty(len(image.pixels), np.float32)
        if not len(values):
            return MISSING[None, None]
        image.pixels.foreach_get(values)
        values = values.reshape(image.size[1], image.size[0], -1)
        if values.shape[2] == 4:
            return values
        color = values if values.shape[2] == 3 else np.repeat(values[..., :1], 3, axis=2)
        return np.concatenate([color, np.ones_like(color[..., :1])], axis=2)


def resampled(texels: np.ndarray, place: TexturePlace, size: tuple[int, int]) -> np.ndarray:
    """An image of another size (height, width) that looks the same."""
    for axis in (0, 1):
        count = texels.shape[axis]
        if count == size[axis]:
            continue
        at = (np.arange(size[axis]) + 0.5) / size[axis] * count - (0.5 if place.is_smooth else 0)
        cell = np.floor(at).astype(int)
        part = (at - cell if place.is_smooth else np.zeros(len(at))).astype(np.float32)
        part = part.reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
        # Neighbours beyond the border; those of a clipped image count as its last ones here.
        wrap = {"repeat": "wrap"}.get(place.extension, "clip")
        low, high = (np.take(texels, cell + i, axis=axis, mode=wrap) for i in (0, 1))
        texels = low * (1 - part) + high * part
    return texels


def alpha_of(node, stored: np.ndarray) -> np.ndarray:
    """(H, W, 1) from the alpha of pixels as stored."""
    return np.ones_like(stored) if node.image is not None and node.image.alpha_mode == "NONE" else stored


def color_of(node, stored: np.ndarray) -> np.ndarray:
    """Linear (H, W, 3) from pixels as stored, or as interpolated between these."""
    color, alpha, image = stored[..., :3], stored[..., 3:], node.image
    if image is None:
        return color
    is_data = image.colorspace_settings.is_data
    if image.alpha_mode not in ("NONE", "CHANNEL_PACKED") and not is_data:
        # Cycles works with associated alpha and takes it off again where the node's alpha is used.
        wants_straight = "Alpha" in node.outputs and node.outputs["Alpha"].is_linked
        if image.is_float and wants_straight:
            color = color / np.where(alpha > 0, alpha, 1)
        elif not image.is_float and not wants_straight:
            color = color * alpha
    if not (is_data or image.is_float or image.colorspace_settings.name.startswith("Linear")):
        color = np.where(color <= 0.04045, color / 12.92, ((np.maximum(color, 0) + 0.055) / 1.055) ** 2.4)
    return color


def outputs_of(node, stored: np.ndarray) -> dict[str, np.ndarray]:
    """Color and Alpha of pixels as stored, or as interpolated between these."""
    return {"Color": color_of(node, stored), "Alpha": alpha_of(node, stored[..., 3:])}
