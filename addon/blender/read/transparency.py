"""Transmittance of materials for shadow rays, as in Cycles without caustics.

Only transparent closures let light through: Transparent BSDF, and Principled BSDF with alpha below 1, mixed and added.
Glass, refraction and translucent BSDFs bend or spread light, and cast full shadows.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...core.errors import NotSupportedError
from ...core.messages import Message, warning
from ...core.native import native
from ...core.scene.sampling import resized
from .. import compat
from .image_nodes import Pixels, UVTransform, alpha_of, color_of, uv_transform_of
from .nodes import Evaluator, InputSocket, Links, Source, converted, shows_bake, surface_of
from .scene_cache import SceneCache

# Size of the first evaluation, which tells images from constants.
PROBE = (2, 2)

# Cycles interpolates an image before nodes change it. Where nodes are not linear, images are evaluated between their
# texels, too, unless their longer side has this number of texels.
FINE_SIDE = 1024

LINEAR = {f"ShaderNode{name}" for name in ("Invert", "RGBToBW", "SeparateColor", "SeparateRGB")} | {
    f"ShaderNode{name}" for name in ("CombineColor", "CombineRGB", "TexImage")
}

OPAQUE = np.zeros((1, 1, 1), np.float32)


class TexelEvaluator(Evaluator):
    """Evaluates nodes at each texel of their images, all of which must have the same UV transform.

    Values are (1, 1, channels), or (H, W, channels) if they come from images. The quantity of a shader is the weight of
    its transparent closures.

    Attributes
    ----------
    transform : UV transform of the images; None without images.
    largest : size of the largest image, (height, width).
    is_bent : True if an image passes a function that is not linear.
    """

    NO_SHADER = OPAQUE

    def __init__(
        self,
        pixels: Pixels,
        size: tuple[int, int] = (1, 1),
        is_outside: bool = False,
        links: Links | None = None,
        check: Callable[[], None] | None = None,
    ) -> None:
        """`size` of the result; `is_outside` evaluates beyond the border of clipped images, where they are 0."""
        super().__init__(links, check)
        self._pixels = pixels
        self._size = size
        self._is_outside = is_outside
        self.transform: UVTransform | None = None
        self.largest = (1, 1)
        self.is_bent = False

    def own_value(self, source: Source) -> np.ndarray | None:
        if source.node.bl_idname == "ShaderNodeTexImage":
            return self._texture(source)
        if source.node.bl_idname == "ShaderNodeLightPath":
            return self._light_path(source)
        return None

    def computed(self, source: Source) -> np.ndarray:
        value = super().computed(source)
        node = source.node
        is_sum = node.bl_idname == "ShaderNodeMath" and node.operation in ("ADD", "SUBTRACT") and not node.use_clamp
        if not (is_sum or node.bl_idname in LINEAR):
            self._bend(value)
        return value

    def shader(self, source: Source) -> np.ndarray:
        kind = source.node.bl_idname
        if shows_bake(source.node):
            return OPAQUE
        if kind == "ShaderNodeBsdfTransparent":
            return self._of_type(source.input("Color"), "RGBA")
        if kind == "ShaderNodeBsdfPrincipled":
            return 1 - np.clip(self._of_type(source.input("Alpha"), "VALUE"), 0, 1)
        if kind == "ShaderNodeAddShader":
            return self.value(source.input(0)) + self.value(source.input(1))
        if kind == "ShaderNodeMixShader":
            return self._mix(source)
        return OPAQUE

    def _mix(self, source: Source) -> np.ndarray:
        first, second = self.value(source.input(1)), self.value(source.input(2))
        if first is second or (self.transform is None and np.array_equal(first, second)):
            return first  # for any factor
        factor = np.clip(self._of_type(source.input(0), "VALUE"), 0, 1)
        if first.shape[:2] != (1, 1) or second.shape[:2] != (1, 1):
            self._bend(factor)
        return (1 - factor) * first + factor * second

    def _of_type(self, wanted: InputSocket, kind: str) -> np.ndarray:
        value = converted(self.value(wanted), wanted.socket.type, kind)
        return value[None, None] if value.ndim == 1 else value

    def _bend(self, value: np.ndarray) -> None:
        self.is_bent |= value.ndim == 3 and value.shape[:2] != (1, 1)

    def _texture(self, source: Source) -> np.ndarray:
        node = source.node
        stored, evaluate = self._pixels(node), color_of
        if source.socket.name == "Alpha":
            stored, evaluate = stored[..., 3:], alpha_of
        if stored.shape[:2] != (1, 1):
            transform = uv_transform_of(self.links, source)
            if self.transform not in (None, transform):
                raise NotSupportedError("node", node.name, "its UV transform is not that of the other images")
            self.transform = transform
            self.largest = tuple(map(max, self.largest, stored.shape[:2]))
            stored = np.zeros_like(stored[:1, :1]) if self._is_outside else self._resized(stored, transform)
        return evaluate(node, stored)

    def _resized(self, stored: np.ndarray, transform: UVTransform) -> np.ndarray:
        # A clipped or mirrored image counts as extended between its border and the outermost texels.
        extension = "REPEAT" if transform.extension == "repeat" else "EXTEND"
        return resized(stored, *self._size, extension, transform.is_smooth)

    def _light_path(self, source: Source) -> np.ndarray:
        """Light Path, which answers for shadow rays of any origin."""
        if not source.socket.name.startswith("Is "):
            raise NotSupportedError("node", source.node.name, f"its output '{source.socket.name}' is used")
        return np.array([float(source.socket.name == "Is Shadow Ray")])


@dataclass(frozen=True, eq=False)
class MaterialTransmittance:
    """A native `ColorTexture`, and messages about the material.

    Attributes
    ----------
    color : RGB that is let through everywhere, or None for an image.
    uv_transform : UV transform of the image.
    """

    transmittance: object
    color: tuple[float, ...] | None = None
    uv_transform: UVTransform | None = None
    messages: tuple[Message, ...] = ()


@functools.lru_cache(256)
def constant(*color: float) -> MaterialTransmittance:
    """Transmittance of one RGB color, the same object for the same color."""
    return MaterialTransmittance(native.ColorTexture(color), color)


BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


def transmittance_of(material, cache: SceneCache) -> MaterialTransmittance:
    """Transmittance of a material; None stands for Cycles' default, which is opaque."""
    if material is None:
        return constant(*BLACK)
    return cache.of_nodes("transmittance", material, lambda: _read(material, cache.check))


def _read(material, check: Callable[[], None] | None) -> MaterialTransmittance:
    if not (compat.uses_nodes(material) and compat.has_transparent_shadow(material)):
        return constant(*BLACK)
    surface = surface_of(material.node_tree)
    if surface is None:
        return constant(*BLACK)
    if not surface.socket.is_linked:
        if not surface.socket.node.inputs["Volume"].is_linked:
            return constant(*BLACK)
        text = f"The material '{material.name}' has a volume and no surface: it casts no shadow."
        return replace(constant(*WHITE), messages=(warning(material.name, text),))
    try:
        return _evaluate(surface, check)
    except NotSupportedError as error:
        text = f"The material '{material.name}' casts opaque shadows. {error}"
        return replace(constant(*BLACK), messages=(warning(material.name, text),))


def _evaluate(surface: InputSocket, check: Callable[[], None] | None) -> MaterialTransmittance:
    # Pixels of this material alone: they may take gigabytes.
    pixels, links = Pixels(), Links()
    probe = TexelEvaluator(pixels, PROBE, links=links, check=check)
    weight, transform = probe.value(surface), probe.transform
    if transform is None:
        return constant(*_color(weight))
    # At the texels of the largest image, or between them.
    finer = max(1, FINE_SIDE // max(probe.largest)) if probe.is_bent else 1
    size = tuple(side * finer for side in probe.largest)
    texels = _in_range(TexelEvaluator(pixels, size, links=links, check=check).value(surface))
    if (texels[..., :1] == texels).all():
        texels = texels[..., :1]
    texels = np.ascontiguousarray(texels, np.float32)
    outside = _color(TexelEvaluator(pixels, is_outside=True, links=links).value(surface))
    image = native.ColorTexture.from_image(texels, transform.extension, transform.is_smooth, outside)
    return MaterialTransmittance(image, uv_transform=transform)


def _in_range(transmittance: np.ndarray) -> np.ndarray:
    return np.clip(np.nan_to_num(transmittance), 0, 1)


def _color(transmittance: np.ndarray) -> list[float]:
    return np.broadcast_to(_in_range(transmittance)[0, 0], 3).tolist()
