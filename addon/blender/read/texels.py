"""Values of shader nodes at each texel of the images that they come from."""

from __future__ import annotations

import numpy as np

from .image_texture import NotUnderstoodError, Pixels, TexturePlace, alpha_of, color_of, place_of, resampled
from .node_links import End, Wanted
from .node_values import Evaluator, converted

# Where nodes turn an image into another, not in proportion, Cycles does so after interpolating it: images whose longer
# side is below this are evaluated between their texels, too.
FINE_SIDE = 1024

LINEAR = {f"ShaderNode{name}" for name in ("Invert", "RGBToBW", "SeparateColor", "SeparateRGB")} | {
    f"ShaderNode{name}" for name in ("CombineColor", "CombineRGB", "TexImage")
}


class Texels(Evaluator):
    """Evaluates nodes at each texel of their images, all of which must lie in the same place on the mesh.

    Values are (1, 1, channels), or (H, W, channels) where they come from images.
    """

    def __init__(self, pixels: Pixels, size: tuple[int, int] = (1, 1), is_outside: bool = False) -> None:
        """`size` of the result; `is_outside`: beyond the border of clipped images instead, where these are 0."""
        self._pixels = pixels
        self._size = size
        self._is_outside = is_outside
        self.place: TexturePlace | None = None
        self.largest = (1, 1)  # of the images seen
        self.is_bent = False  # whether an image passes a function that is not linear

    def number(self, wanted: Wanted) -> np.ndarray:
        return self._of_type(wanted, "VALUE")

    def color(self, wanted: Wanted) -> np.ndarray:
        return self._of_type(wanted, "RGBA")

    def _of_type(self, wanted: Wanted, kind: str) -> np.ndarray:
        value = converted(self.value(wanted), wanted.socket.type, kind)
        return value[None, None] if value.ndim == 1 else value

    def bent(self, *values: np.ndarray) -> None:
        self.is_bent |= any(value.ndim == 3 and value.shape[:2] != (1, 1) for value in values)

    def own_value(self, end: End) -> np.ndarray | None:
        if end.node.bl_idname == "ShaderNodeTexImage":
            return self._texture(end)
        if end.node.bl_idname == "ShaderNodeLightPath":
            return self._light_path(end)
        return None

    def computed(self, end: End) -> np.ndarray:
        value = super().computed(end)
        node = end.node
        is_sum = node.bl_idname == "ShaderNodeMath" and node.operation in ("ADD", "SUBTRACT") and not node.use_clamp
        if not (is_sum or node.bl_idname in LINEAR):
            self.bent(value)
        return value

    def _texture(self, end: End) -> np.ndarray:
        node = end.node
        stored, evaluate = self._pixels(node.image), color_of
        if end.socket.name == "Alpha":
            stored, evaluate = stored[..., 3:], alpha_of
        if stored.shape[:2] != (1, 1):
            place = place_of(end)
            if self.place not in (None, place):
                raise NotUnderstoodError(f"the node '{node.name}', which places its image otherwise than another, is")
            self.place = place
            self.largest = tuple(map(max, self.largest, stored.shape[:2]))
            stored = np.zeros_like(stored[:1, :1]) if self._is_outside else resampled(stored, place, self._size)
        return evaluate(node, stored)

    def _light_path(self, end: End) -> np.ndarray:
        """What shades is asked of shadow rays, whatever they left from."""
        if not end.socket.name.startswith("Is "):
            raise NotUnderstoodError(f"the output '{end.socket.name}' of the node '{end.node.name}' is")
        return np.array([float(end.socket.name == "Is Shadow Ray")])
