"""Textured surfaces on a medium of one color.

The medium has the mean color. The texture multiplies light twice, where it enters and where it leaves, by the powers
`blur` and 1 - blur of the color relative to the mean. This is the convention of renderers and no light transport, in
which light between two points would take on the albedos of both. docs/method.md has the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..messages import Message, warning
from .chart import Chart
from .receiver import Receiver
from .sampling import bilinear, sample_positions

# Largest number of samples of a finer texture along each side of a texel. More: less aliasing, more time.
MAX_SAMPLES = 4
# Largest base color without a warning; rounding and interpolation may exceed 1 a little.
BRIGHTEST = 1.001


def mean_color(receiver: Receiver, colors: Sequence[np.ndarray]) -> tuple[float, float, float]:
    """Mean color of all charts, weighted by area; `colors` are (grid height, grid width, 3) of each."""
    total, area = np.zeros(3), 0.0
    for chart, color in zip(receiver.charts, colors):
        weights = chart.grid.weights
        total += np.einsum("hw,hwc->c", weights, color, dtype=float)
        area += float(weights.sum(dtype=float))
    return tuple((total / area).tolist())


def textured(receiver: Receiver, colors: Sequence[np.ndarray], blur: float) -> Receiver:
    """The receiver with factors of entering and leaving light on its grids; the mean color has the factor 1.

    Parameters
    ----------
    colors : (grid height, grid width, 3) of each chart, not below 0.
    blur : 0: the texture stays sharp; 1: it is blurred like the light.
    """
    mean = np.array(mean_color(receiver, colors))
    charts = []
    for chart, color in zip(receiver.charts, colors):
        # A mean of 0 means black everywhere.
        relative = np.divide(color, mean, out=np.ones(color.shape), where=mean > 0)
        color_in, color_out = (np.float32(relative**power) for power in (blur, 1 - blur))
        charts.append(replace(chart, grid=replace(chart.grid, color_in=color_in, color_out=color_out)))
    return replace(receiver, charts=tuple(charts))


@dataclass(frozen=True, eq=False)
class Texture:
    """Colors on a receiver, for receivers with the same charts and any number of texels.

    Attributes
    ----------
    colors : float32 (grid height, grid width, 3) of each of its charts, not below 0.
    blur : see `textured`.
    """

    receiver: Receiver
    colors: tuple[np.ndarray, ...]
    blur: float

    def on(self, receiver: Receiver) -> Receiver:
        """The receiver with the texture."""
        pairs = zip(self.receiver.charts, self.colors, receiver.charts)
        return textured(receiver, [self._resampled(*pair, receiver) for pair in pairs], self.blur)

    def _resampled(self, chart: Chart, color: np.ndarray, target: Chart, receiver: Receiver) -> np.ndarray:
        """The colors of a chart on the grid of `target`, the same chart of `receiver`."""
        finer = max(self.receiver.width / receiver.width, self.receiver.height / receiver.height)
        count = int(np.clip(np.ceil(finer - 0.01), 1, MAX_SAMPLES))
        total = np.zeros((target.grid.height * target.grid.width, 3), np.float32)
        for at in sample_positions(count):
            total += bilinear(color, *chart.places_of(target, at, self.receiver, receiver))
        return (total / count**2).reshape(target.grid.height, target.grid.width, 3)


@dataclass(frozen=True, eq=False)
class BaseColor:
    """Base color of each texel of a surface, or the reason why it is unknown.

    Attributes
    ----------
    texture : colors, at most 1; None if they are unknown.
    warnings : messages about the colors.
    unknown : sentence that names the node that only Cycles can evaluate; "" if there is none.
    """

    texture: Texture | None = None
    warnings: tuple[Message, ...] = ()
    unknown: str = ""

    @classmethod
    def of(cls, colors: Sequence[np.ndarray], receiver: Receiver, blur: float, object_name: str) -> BaseColor:
        """From colors on a receiver, as `Texture` has them; a warning if they are above 1."""
        warnings = ()
        if max(color.max(initial=0) for color in colors) > BRIGHTEST:
            text = f"The Base Color of '{object_name}' is above 1 in places, which reflects more light than arrives."
            warnings = (warning(object_name, text, "It is cut to 1."),)
        return cls(Texture(receiver, tuple(color.clip(0, 1) for color in colors), blur), warnings)

    @cached_property
    def mean(self) -> tuple[float, float, float] | None:
        """Mean color, which the medium has; None if the colors are unknown."""
        return None if self.texture is None else mean_color(self.texture.receiver, self.texture.colors)
