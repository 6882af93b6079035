"""The image of all tangent planes: values of points are spread into it, and results are read from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .tangent_planes import BLEND, Points, TangentPlane
from .textured import continued


@dataclass(frozen=True, eq=False)
class PlanesImage:
    """The image.

    Attributes
    ----------
    planes : its parts.
    shape : rows and columns.
    texels : the points for which results are read.
    gap : texels between points of the surface, at most; wider gaps are no surface.
    """

    planes: Sequence[TangentPlane]
    shape: tuple[int, int]
    texels: Points
    gap: int

    @cached_property
    def points(self) -> NDArray:
        """Numbers of the points of all planes, one plane after the other; points of several are there repeatedly."""
        return np.concatenate([plane.points for plane in self.planes])

    @cached_property
    def turns(self) -> NDArray[np.complex64]:
        """Turns of directions from the frames of `points` to those of their planes."""
        return np.concatenate([plane.turns for plane in self.planes])

    def light(self, values: NDArray) -> NDArray[np.float32]:
        """Irradiance (H, W, C), from that at `points` (N, C); 0 where there is no surface."""
        image = self._spread(values, self._is_surface)
        image[~self._is_surface] = 0
        return image

    def values(self, of_points: NDArray) -> NDArray[np.float32]:
        """Values (H, W, C), from those of all points; they go on beyond the surface."""
        image = self._spread(of_points[self.points], np.ones(self.shape, bool))
        is_even = (of_points == of_points[0]).all(axis=0)
        image[..., is_even] = of_points[0, is_even]  # without last digits of means
        return image

    def read(self, image: NDArray) -> NDArray:
        """Means (N, C) of an image (H, W, C) at the texels; NaN where no plane shows one."""
        flat = image.reshape(-1, image.shape[-1])
        sums = np.full((len(self.texels), flat.shape[1]), np.nan)
        sums[self.noise_left > 0] = 0
        for chosen, weight, cells, parts in self._readings:
            sums[chosen] += (flat[cells] * (parts * weight)[..., None]).sum(axis=0)
        return sums

    @cached_property
    def is_read(self) -> NDArray:
        """True for texels of the image (H, W) that results are read from."""
        read = np.zeros(self.shape[0] * self.shape[1], bool)
        for _, _, cells, _ in self._readings:
            read[cells.ravel()] = True
        return read.reshape(self.shape)

    @cached_property
    def noise_left(self) -> NDArray:
        """Noise of results (N,) over that of the image, since several planes show a texel; 0 where none does."""
        squares = np.zeros(len(self.texels))
        for chosen, weight, _, _ in self._readings:
            squares[chosen] += weight**2
        return np.sqrt(squares)

    @cached_property
    def _readings(self) -> list[tuple[NDArray, NDArray, NDArray, NDArray]]:
        """For each plane: numbers (N,) of the texels that it shows, their weights, and `_near` of them."""
        weights, sums = [], np.zeros(len(self.texels))
        for plane in self.planes:
            weights.append(np.maximum(1 - (plane.middle.distances(self.texels) / BLEND) ** 2, 0) ** 2)
            sums += weights[-1]
            weights[-1] = np.flatnonzero(weights[-1]), weights[-1][weights[-1] > 0]
        return [
            (chosen, weight / sums[chosen], *self._near(plane.places_of(self.texels.at(chosen))))
            for plane, (chosen, weight) in zip(self.planes, weights)
        ]

    def _near(self, places: NDArray) -> tuple[NDArray, NDArray]:
        """The four texels around each of some places (N, 2), and their weights, both (4, N)."""
        first = np.floor(places - 0.5).astype(int)
        part = places - 0.5 - first
        corners = [(x, y) for x in (0, 1) for y in (0, 1)]
        cells = [(first[:, 1] + y) * self.shape[1] + first[:, 0] + x for x, y in corners]
        weights = [np.abs(1 - x - part[:, 0]) * np.abs(1 - y - part[:, 1]) for x, y in corners]
        return np.stack(cells), np.stack(weights)

    @cached_property
    def _shares(self) -> tuple[NDArray, NDArray, NDArray]:
        """Texels that the points of `points` are spread to, their weights, both (4, N), and sums of weights."""
        cells, weights = self._near(np.concatenate([plane.places for plane in self.planes]))
        weights *= np.concatenate([plane.weights for plane in self.planes])
        return cells, weights, np.bincount(cells.ravel(), weights.ravel(), self.shape[0] * self.shape[1])

    def _spread(self, values: NDArray, wanted: NDArray) -> NDArray[np.float32]:
        """Means of values of `points` (N, C) as an image (H, W, C), known at texels of the surface that are wanted."""
        cells, weights, sums = self._shares
        image = np.empty((*self.shape, values.shape[1]), np.float32)
        for c in range(values.shape[1]):
            channel = np.bincount(cells.ravel(), (weights * values[:, c]).ravel(), len(sums))
            image[..., c] = np.divide(channel, sums, out=channel, where=sums > 0).reshape(self.shape)
        known = sums.reshape(self.shape) > 0
        for part in (plane.part for plane in self.planes):
            if (wanted[part] & ~known[part]).any():
                image[part] = continued(image[part], known[part])
        return image

    @cached_property
    def _is_surface(self) -> NDArray:
        known, surface = (self._shares[2] > 0).reshape(self.shape), np.zeros(self.shape, bool)
        for plane in self.planes:
            surface[plane.part] = closed(known[plane.part], self.gap)
        return surface


def closed(known: NDArray, gap: int) -> NDArray:
    """Known texels (H, W), and gaps between them of up to so many texels."""
    reach = (gap + 1) // 2
    grown = _around(np.pad(known, 2 * reach), reach) > 0
    inner = slice(2 * reach, -2 * reach)
    return (_around(~grown, reach) == 0)[inner, inner]


def _around(values: NDArray, reach: int) -> NDArray:
    """Sums of values (H, W) up to so many texels away along both axes."""
    for axis in (0, 1):
        total = np.cumsum(np.pad(values, [(reach + 1, reach) if axis == a else (0, 0) for a in (0, 1)]), axis=axis)
        count = values.shape[axis]
        ends = np.arange(2 * reach + 1, 2 * reach + 1 + count)
        values = np.take(total, ends, axis=axis) - np.take(total, ends - 2 * reach - 1, axis=axis)
    return values
