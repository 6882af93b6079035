"""Tangent planes of faces that bend: paths of light walk there as on a plane.

A plane shows the texels around its middle. One at D from the middle lies at the distance |D| in the azimuth of D, which
keeps areas on balls and planes. Directions turn from the texel's normal to the plane's by the shortest way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

MAX_ANGLE = 30.0
"""Angle between the normals of a middle and of points in its core, degrees. Larger: fewer planes, more distortion."""

CORE = 3.0
"""Radius of cores, over the distance that light goes. Larger: fewer planes; smaller: less distortion, longer."""

BLEND = 1.4
"""Radius of the part of a plane that results are read from, in cores. Larger: smoother between planes, longer."""

FACING = 0.0
"""Least cosine between the normals of a plane and of points that it shows. Smaller: light from farther around."""

MAX_STRETCH = 2.0
"""Most by which a surface that turns away is stretched, to keep its distance from the middle."""

CANDIDATES, MAX_PLANES = 16_384, 512
"""Points among which middles are chosen, and number of middles at most. More: slower; fewer planes: more distortion."""

DIGITS = 3
"""Digits of distances by which middles are chosen. On tubes and balls many points are as far, but for the last bits of
their normals, which differ between versions of Blender."""

MISMATCH_POWER = 4.0
"""Power of nearness to the plane's part of the surface by which points count. Larger: other layers count less."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a surface: positions float64 (N, 3), unit normals and tangents (N, 3)."""

    positions: NDArray
    normals: NDArray
    tangents: NDArray

    def __len__(self) -> int:
        return len(self.positions)

    def at(self, chosen: NDArray) -> Points:
        return Points(self.positions[chosen], self.normals[chosen], self.tangents[chosen])


@dataclass(frozen=True, eq=False)
class Middle:
    """Middle of a tangent plane, and the plane's frame, in which y is normal x x.

    Attributes
    ----------
    core : radius of the part of the surface that lies nearest, scene units.
    """

    position: NDArray
    normal: NDArray
    x_axis: NDArray
    core: float

    def distances(self, points: Points) -> NDArray:
        """Distances of points from the middle in space and in direction, the larger; 1 at the border of the core."""
        apart, turn = points.positions - self.position, points.normals - self.normal
        limit = 2 * np.sin(np.radians(MAX_ANGLE / 2))
        squares = (_dot(apart, apart) / self.core**2, _dot(turn, turn) / limit**2)
        return np.sqrt(np.maximum(*squares))

    def turns(self, points: Points) -> NDArray[np.complex64]:
        """Turns of directions along the surface from the frames of points to the plane's."""
        cosine, axis = _dot(points.normals, self.normal), np.cross(points.normals, self.normal)
        along_axis = _dot(axis, points.tangents) / np.maximum(1 + cosine, 1e-3)
        turned = points.tangents * cosine[:, None] + np.cross(axis, points.tangents) + axis * along_axis[:, None]
        turn = _dot(turned, self.x_axis) + 1j * _dot(turned, np.cross(self.normal, self.x_axis))
        return (turn / np.maximum(np.abs(turn), 1e-30)).astype(np.complex64)

    def aligned(self, points: Points, flow: NDArray) -> Middle:
        """The middle whose x runs along the mean flow (N,) of light along the surface, complex numbers, in its core."""
        near = self.distances(points) < 1
        mean = (flow[near] * self.turns(points.at(near))).sum()
        if not abs(mean) > 0:
            return self
        mean /= abs(mean)
        x_axis = mean.real * self.x_axis + mean.imag * np.cross(self.normal, self.x_axis)
        return replace(self, x_axis=x_axis / np.linalg.norm(x_axis))


def middles_of(points: Points, core: float) -> list[Middle]:
    """Middles whose cores cover all points."""
    chosen = points.at(np.linspace(0, len(points) - 1, min(len(points), CANDIDATES)).astype(int))
    nearest, middles = np.full(len(chosen), np.inf), []
    while len(middles) < MAX_PLANES:
        rounded = nearest.round(DIGITS)
        farthest = int(np.argmax(rounded))
        if rounded[farthest] <= 1:
            break
        axes = (np.asarray(values[farthest], float) for values in (chosen.normals, chosen.tangents))
        middles.append(Middle(chosen.positions[farthest], *axes, core))
        nearest = np.minimum(nearest, middles[-1].distances(chosen))
    return middles


@dataclass(frozen=True, eq=False)
class TangentPlane:
    """A plane at a part of a surface, as a part of an image of all planes.

    Attributes
    ----------
    corner : column and row in the image, from which places count.
    low : least column and row, from the middle.
    size : columns and rows.
    points : int (N,), numbers of the points that it shows.
    places : float (N, 2), columns and rows in the image.
    weights : float32 (N,), how much the points count where they meet others.
    turns : complex64 (N,), turns of directions along the surface from a point's frame to the plane's.
    """

    middle: Middle
    pitch: float
    low: NDArray
    size: tuple[int, int]
    points: NDArray
    places: NDArray
    weights: NDArray[np.float32]
    turns: NDArray[np.complex64]
    corner: tuple[int, int] = (0, 0)

    @classmethod
    def of(cls, middle: Middle, points: Points, pitch: float, halo: float) -> TangentPlane:
        """The plane with texels of a pitch, and with the surface up to a distance around its part.

        Beyond the surface's border the plane goes on as far: paths meet no other plane there.
        """
        apart = points.positions - middle.position
        length = np.sqrt(_dot(apart, apart))
        reach = length[middle.distances(points) < BLEND].max(initial=0.0) + halo
        chosen = np.flatnonzero((length <= reach) & (_dot(points.normals, middle.normal) > FACING))
        shown = points.at(chosen)
        places, mismatch = _places(middle, shown, pitch)
        low = np.floor(np.maximum(places.min(axis=0) - halo / pitch, -reach / pitch)) - 1
        size = np.ceil(np.minimum(places.max(axis=0) + halo / pitch, reach / pitch)) + 2 - low
        weights = np.float32((pitch / (pitch + mismatch)) ** MISMATCH_POWER)
        facts = tuple(size.astype(int).tolist()), chosen, places - low, weights, middle.turns(shown)
        return cls(middle, pitch, low, *facts)

    def moved(self, corner: tuple[int, int]) -> TangentPlane:
        """The plane at another part of the image."""
        return replace(self, corner=corner, places=self.places - self.corner + corner)

    def places_of(self, points: Points) -> NDArray:
        """Columns and rows (N, 2) in the image of points."""
        return _places(self.middle, points, self.pitch)[0] - self.low + self.corner

    @property
    def part(self) -> tuple[slice, slice]:
        """The plane's rows and columns of the image."""
        return tuple(slice(first, first + count) for first, count in zip(self.corner[::-1], self.size[::-1]))


def _places(middle: Middle, points: Points, pitch: float) -> tuple[NDArray, NDArray]:
    """Columns and rows (N, 2) from the middle, and how far points lie beside a surface that bends evenly, (N,)."""
    apart = points.positions - middle.position
    height = _dot(apart, middle.normal)
    flat = apart - height[:, None] * middle.normal
    length, across = np.sqrt(_dot(apart, apart)), np.sqrt(_dot(flat, flat))
    stretch = length / np.maximum(across, length / MAX_STRETCH + 1e-300)
    axes = middle.x_axis, np.cross(middle.normal, middle.x_axis)
    places = np.stack([_dot(flat, axis) for axis in axes], -1) * (stretch / pitch)[:, None]
    # A chord leaves a surface that bends evenly by the same angle at both ends.
    return places, np.abs(height + _dot(apart, points.normals)) / 2


def side_by_side(planes: Sequence[TangentPlane]) -> tuple[list[TangentPlane], tuple[int, int]]:
    """The planes in one image, and its rows and columns."""
    sizes = [plane.size for plane in planes]
    width = max(*(columns for columns, _ in sizes), int(1.1 * np.sqrt(sum(a * b for a, b in sizes))))
    corners = [(0, 0)] * len(sizes)
    column = row = height = 0
    for number in sorted(range(len(sizes)), key=lambda number: (-sizes[number][1], number)):
        if column + sizes[number][0] > width:
            column, row, height = 0, row + height, 0
        corners[number] = column, row
        column, height = column + sizes[number][0], max(height, sizes[number][1])
    return [plane.moved(corner) for plane, corner in zip(planes, corners)], (row + height, width)


def _dot(a: NDArray, b: NDArray) -> NDArray:
    """Products (N,) of vectors (N, 3) with others, or with one: the same last digits everywhere."""
    return (a * b).sum(axis=-1)
