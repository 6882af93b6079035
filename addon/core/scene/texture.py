"""Textured surfaces: each texel has an albedo of its own, or the texture multiplies the light of a medium of one color.

The second way is the convention of renderers and no light transport. The medium has the mean color. The texture
multiplies light twice, where it enters and where it leaves, by the powers `blur` and 1 - blur of the color relative to
the mean. docs/method.md has the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..material import MAX_ALBEDO
from ..messages import Message, note, warning
from .chart import Chart
from .receiver import Receiver
from .sampling import bilinear, sample_positions

SCATTERED, MULTIPLIED = "SCATTERED", "MULTIPLIED"
"""Ways in which a texture colors a surface: light scatters in it texel by texel, or is multiplied by it."""

# Largest number of samples of a finer texture along each side of a texel. More: less aliasing, more time.
MAX_SAMPLES = 4
# Mean albedo below which a bake says that a texture counts as albedo: it looks almost black. Larger: more notes.
DARK_ALBEDO = 0.7

# Largest base color without a warning; rounding and interpolation may exceed 1 a little.
BRIGHTEST = 1.001


@dataclass(frozen=True)
class TextureUse:
    """How a texture colors a surface.

    Attributes
    ----------
    method : SCATTERED or MULTIPLIED.
    blur : see `textured`; of MULTIPLIED.
    is_albedo : True if the texture has albedos in place of base colors; of SCATTERED.
    """

    method: str = SCATTERED
    blur: float = 0.5
    is_albedo: bool = False

    @property
    def is_scattered(self) -> bool:
        return self.method == SCATTERED


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


def scattering(receiver: Receiver, values: Sequence[np.ndarray], is_albedo: bool) -> Receiver:
    """The receiver whose texels have these albedos, or base colors: (grid height, grid width, 3) of each chart."""
    name = "albedo" if is_albedo else "base_color"
    pairs = zip(receiver.charts, values)
    charts = [replace(chart, grid=replace(chart.grid, **{name: np.float32(value)})) for chart, value in pairs]
    return replace(receiver, charts=tuple(charts))


@dataclass(frozen=True, eq=False)
class Texture:
    """Colors on a receiver, for receivers with the same charts and any number of texels.

    Attributes
    ----------
    colors : float32 (grid height, grid width, 3) of each of its charts, not below 0; albedos if its use says so.
    """

    receiver: Receiver
    colors: tuple[np.ndarray, ...]
    use: TextureUse

    def on(self, receiver: Receiver) -> Receiver:
        """The receiver with the texture."""
        pairs = zip(self.receiver.charts, self.colors, receiver.charts)
        colors = self.colors
        if receiver is not self.receiver:
            colors = [self._resampled(*pair, receiver) for pair in pairs]
        if self.use.is_scattered:
            return scattering(receiver, colors, self.use.is_albedo)
        return textured(receiver, colors, self.use.blur)

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
    def of(cls, colors: Sequence[np.ndarray], receiver: Receiver, use: TextureUse, object_name: str) -> BaseColor:
        """From colors on a receiver, as `Texture` has them; a warning if they are above 1."""
        texture = Texture(receiver, tuple(color.clip(0, MAX_ALBEDO if use.is_albedo else 1) for color in colors), use)
        largest = max(color.max(initial=0) for color in colors)
        if use.is_albedo and largest >= 1:
            text = f"The texture of '{object_name}' has scattering albedos of 1 or more, which absorb nothing."
            return cls(texture, (warning(object_name, text, f"They are cut to {MAX_ALBEDO}."),))
        if use.is_albedo and max(mean_color(receiver, texture.colors)) < DARK_ALBEDO:
            text = f"The texture of '{object_name}' is read as scattering albedo, so the surface is dark."
            return cls(texture, (note(object_name, text, "If it shows colors, set Color to Base Color."),))
        if largest > BRIGHTEST:
            text = f"The Base Color of '{object_name}' is above 1 in places, which reflects more light than arrives."
            return cls(texture, (warning(object_name, text, "It is cut to 1."),))
        return cls(texture)

    @cached_property
    def mean(self) -> tuple[float, float, float] | None:
        """Mean color, or mean albedo; None if the colors are unknown."""
        return None if self.texture is None else mean_color(self.texture.receiver, self.texture.colors)
