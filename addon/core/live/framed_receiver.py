"""A receiver in its image: texels around its charts continue the charts' values."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..bake.margin import WHOLE
from ..scene.receiver import Receiver


class FramedReceiver:
    """A receiver with the texels around its charts, which continue the charts' values.

    Attributes
    ----------
    margin : number of texels around the charts.
    inside, region : bool (height, width), texels of the charts; the same with their margin.
    """

    def __init__(self, receiver: Receiver, margin: int) -> None:
        self.receiver = receiver
        self.margin, self.inside = margin, receiver.inside()
        whole = receiver.coverage > WHOLE
        source = _nearest_texels(whole if whole.any() else self.inside, margin + 2)
        self._source = None if whole.all() else source
        self.region = _dilated(self.inside, margin)

    @cached_property
    def color_out(self) -> np.ndarray | None:
        """Float32 (height, width, 3): factors of light that leaves, continued around the charts; None without any."""
        factors = [chart.grid.color_out for chart in self.receiver.charts]
        return None if factors[0] is None else self.continued(self.receiver.to_texture(factors))

    def continued(self, texture: np.ndarray) -> np.ndarray:
        """The texture with the values of texels wholly inside a chart at the texels around them."""
        if self._source is None:
            return texture
        return texture.reshape(-1, 3)[self._source].reshape(texture.shape)


def _nearest_texels(known: np.ndarray, rings: int) -> np.ndarray:
    """Int (H, W): the index of a known texel near each texel of the next `rings`, its own index for all others."""
    indices = np.arange(known.size).reshape(known.shape)
    source = np.where(known, indices, -1)
    for _ in range(rings):
        if (source >= 0).all():
            break
        padded = np.pad(source, 1, constant_values=-1)
        height, width = known.shape
        for dy in (0, 1, 2):
            for dx in (0, 1, 2):
                neighbor = padded[dy : dy + height, dx : dx + width]
                np.copyto(source, neighbor, where=(source < 0) & (neighbor >= 0))
    return np.where(source < 0, indices, source)


def _dilated(mask: np.ndarray, rings: int) -> np.ndarray:
    """Bool (H, W): texels of the mask and of `rings` around it."""
    for _ in range(rings):
        if mask.all():
            break
        padded = np.pad(mask, 1)
        up_down = padded[:-2] | padded[1:-1] | padded[2:]
        mask = up_down[:, :-2] | up_down[:, 1:-1] | up_down[:, 2:]
    return mask
