"""A surface whose colour differs from place to place, though light transport knows one medium.

The medium has the mean colour. Light meets the texture twice, where it enters and where it leaves, by the powers `blur`
and 1 - blur of what each place is brighter than the mean. That is the convention of renderers, and no transport: light
between two places of different albedo takes on both. docs/method.md says how far off that is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .receiver import Chart, Receiver
from .sampling import bilinear

# Places along a texel, at most, where a finer texture is looked at.
MOST_PLACES = 4


def mean_color(receiver: Receiver, colors: Sequence[np.ndarray]) -> tuple[float, float, float]:
    """Of all charts, over their areas; `colors` are (grid height, grid width, 3) of each."""
    total, area = np.zeros(3), 0.0
    for chart, color in zip(receiver.charts, colors):
        weights = chart.grid.coverage * (chart.grid.pitch_x * chart.grid.pitch_y)
        total += np.einsum("hw,hwc->c", weights, color, dtype=float)
        area += float(weights.sum(dtype=float))
    return tuple((total / area).tolist())


def textured(receiver: Receiver, colors: Sequence[np.ndarray], blur: float) -> Receiver:
    """The receiver with factors on its grids of what comes in and what goes out, 1 in places of the mean colour.

    Parameters
    ----------
    colors : (grid height, grid width, 3) of each chart, not below 0.
    blur : 0: the texture lies on top, sharp; 1: all of it is blurred as light is.
    """
    mean = np.array(mean_color(receiver, colors))
    charts = []
    for chart, color in zip(receiver.charts, colors):
        # Where the mean is 0 all is black.
        relative = np.divide(color, mean, out=np.ones(color.shape), where=mean > 0)
        color_in, color_out = (np.float32(relative**power) for power in (blur, 1 - blur))
        charts.append(replace(chart, grid=replace(chart.grid, color_in=color_in, color_out=color_out)))
    return replace(receiver, charts=tuple(charts))


@dataclass(frozen=True, eq=False)
class Texture:
    """Colours on a receiver, for receivers of the same charts with any number of texels.

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
        return textured(receiver, [self._seen_by(*pair, receiver) for pair in pairs], self.blur)

    def _seen_by(self, chart: Chart, color: np.ndarray, other: Chart, receiver: Receiver) -> np.ndarray:
        """The colours of a chart at the texels of another's grid."""
        finer = max(self.receiver.width / receiver.width, self.receiver.height / receiver.height)
        count = int(np.clip(np.ceil(finer - 0.01), 1, MOST_PLACES))
        middles = (np.arange(count) + 0.5) / count
        total = np.zeros((other.grid.height * other.grid.width, 3), np.float32)
        for at in ((across, up) for across in middles for up in middles):
            x, y = chart.grid_places(other.uvs(receiver.width, receiver.height, at), self.receiver)
            total += bilinear(color, x, y)
        return (total / count**2).reshape(other.grid.height, other.grid.width, 3)
