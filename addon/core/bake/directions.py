"""Few directions that stand for all light on a plane.

A light of about one direction keeps it. All others are split between angles from the normal and azimuths, by weights
that are linear in between: in the cosine of the angle, in which the reflectance bends least, and in the azimuth.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

NARROW = 2.0
"""Directions within this many degrees count as one. Larger: fewer paths, and light that goes another way."""

RANGE = 0.05
"""Fraction of the light that may lie beyond the outermost directions of paths. Larger: nearer to most of the light."""

STEP = 14.0
"""Degrees between angles from the normal where there may be more than two. Larger: fewer paths, as above."""

ANGLES = 4
"""Largest number of angles from the normal. More: light goes its own way, more noise and memory."""

AZIMUTHS = 4
"""Azimuths where light comes from all around. More: as more angles."""

NEAR_STEP, NEAR_ANGLES, NEAR_AZIMUTHS = 9.0, 6, 12
"""The same below near lamps, whose directions change along the length that light spreads."""

NEAR = 0.1
"""That change, radians, from which lamps are near. Larger: fewer paths, and light below lamps that goes another way."""

MAX_OWN = 3
"""Largest number of lights with a direction of their own. More: longer; fewer: suns that share directions."""

STEEP = 6.0
"""Angle from the normal, degrees, up to which azimuths do not count. Larger: fewer paths."""

NEAR_PART = 2
"""Texels along a side at which light is split over those below near lamps. Larger: less memory, blurred shadows."""

SURVEY_TEXELS = 48
"""Texels along a side at which directions of light are surveyed. More: slower, finer."""

DIGITS = 7
"""Digits of directions that count. More: last bits that depend on the C library of the process."""

ANGLE_DIGITS = 1
"""Digits of the angles, degrees, between which light is split. More: last bits of the light that change a few paths."""

Beams = list[tuple[NDArray[np.float32], NDArray[np.float64]]]
"""Irradiance (H, W, 3), of any size, and the direction of travel of each."""


@dataclass(frozen=True)
class Fineness:
    """How finely directions of light are split.

    Attributes
    ----------
    angles, step : largest number of angles from the normal, and degrees between them where there may be more than two.
    one_azimuth : azimuths within this many degrees count as one.
    azimuths : number of them where light comes from all around; elsewhere they are as dense, and at least three.
    """

    angles: int = ANGLES
    step: float = STEP
    one_azimuth: float = NARROW
    azimuths: int = AZIMUTHS


FAR_LIGHT = Fineness()
NEAR_LIGHT = Fineness(NEAR_ANGLES, NEAR_STEP, azimuths=NEAR_AZIMUTHS)


@dataclass(frozen=True)
class DirectionClasses:
    """Directions between which light is split.

    Attributes
    ----------
    angles : from the normal, degrees, ascending: one or more.
    azimuths : degrees, ascending.
    is_whole : True if the azimuths go around.
    """

    angles: tuple[float, ...]
    azimuths: tuple[float, ...]
    is_whole: bool

    @classmethod
    def of(
        cls,
        powers: Sequence[NDArray],
        ways: Sequence[NDArray],
        fineness: Fineness = FAR_LIGHT,
    ) -> DirectionClasses:
        """Classes between which nearly all of the light lies, whose power (N,) and directions (N, 3) are given."""
        power, way = np.concatenate(powers), np.concatenate(ways)
        angle, azimuth = _angles(way)
        angles = _nodes(angle, power, fineness.angles, fineness.step)
        if angles[-1] < STEEP:
            return cls(angles, (0.0,), False)
        return cls(angles, *_azimuth_nodes(azimuth, power * np.sin(np.radians(angle)), fineness))

    @classmethod
    def mean(cls, powers: Sequence[NDArray], ways: Sequence[NDArray]) -> DirectionClasses:
        """One class, of the mean direction."""
        mean = np.einsum("n,nc->c", np.concatenate(powers), np.concatenate(ways), dtype=float)
        angle, azimuth = _angles(mean / np.linalg.norm(mean))
        return cls((float(angle),), (float(azimuth),), False)

    def ways(self) -> list[NDArray[np.float64]]:
        """Unit vectors along which the light of each class travels, z < 0."""
        theta, phi = (
            values.ravel() for values in np.meshgrid(*map(np.radians, (self.angles, self.azimuths)), indexing="ij")
        )
        sine = np.sin(theta)
        return list(np.round(np.stack([sine * np.cos(phi), sine * np.sin(phi), -np.cos(theta)], -1), DIGITS))

    def weights(self, way: NDArray) -> Iterator[NDArray]:
        """Weights (...) of each class for directions (..., 3); they add up to 1."""
        angle, azimuth = _angles(way)
        around = [self._around(azimuth, number).astype(np.float32) for number in range(len(self.azimuths))]
        for number in range(len(self.angles)):
            of_angle = _weight(_steepness(angle), _steepness(self.angles), number).astype(np.float32)
            for of_azimuth in around:
                yield of_angle * of_azimuth

    def _around(self, values: NDArray, number: int) -> NDArray:
        nodes = self.azimuths
        if self.is_whole:
            turn = (values - nodes[number] + 180) % 360 - 180
            return np.maximum(1 - np.abs(turn) * (len(nodes) / 360), 0)
        middle = (nodes[0] + nodes[-1]) / 2
        return _weight((values - middle + 180) % 360 - 180, [node - middle for node in nodes], number)


def direction_of(power: NDArray, way: NDArray) -> NDArray | None:
    """The direction of light of about one direction, from powers (...) and directions (..., 3); None for others."""
    total = float(power.sum(dtype=float))
    if not total > 0:
        return None
    mean = np.einsum("n,nc->c", power.ravel(), way.reshape(-1, 3), dtype=float) / total
    length = float(np.linalg.norm(mean))
    return np.round(mean / length, DIGITS) if length > np.cos(np.radians(NARROW)) else None


def is_near(surveys: Iterable[tuple[NDArray, NDArray]], size: Sequence[float], spread: float) -> bool:
    """True if lights with these powers (..., H, W) and directions (..., H, W, 3) on a plane are near it.

    `size`: height and width of the plane, `spread`: length that light spreads in its medium, in the same unit.
    """
    change = total = 0.0
    for power, way in surveys:
        for axis, length in zip((-2, -1), size):
            between = (np.delete(power, 0, axis) + np.delete(power, -1, axis)) / 2
            turned = np.linalg.norm(np.diff(way, axis=axis - 1), axis=-1) * (power.shape[axis] / length)
            change += float((between * turned).sum(dtype=float))
            total += float(between.sum(dtype=float))
    return change * spread > NEAR * total


def survey_of(light: NDArray, way: NDArray) -> tuple[NDArray, NDArray]:
    """Powers (H, W) and directions (H, W, 3) at few texels of irradiance (H, W, 3) and directions (3,) or (H, W, 3)."""
    few = tuple(slice(None, None, max(count // SURVEY_TEXELS, 1)) for count in light.shape[:2])
    return light[few].sum(-1), np.broadcast_to(way, light.shape)[few]


def beams_of(lights: Iterable[tuple[NDArray, NDArray]], near: bool = False) -> Beams:
    """Light of a few directions that stands for all lights: irradiance (H, W, 3), and directions (3,) or (H, W, 3)."""
    lights = list(lights)
    splitter = Splitter.of([survey_of(*light) for light in lights], fineness=NEAR_LIGHT if near else FAR_LIGHT)
    for number, light in enumerate(lights):
        splitter.add(number, *light)
    return splitter.beams


class Splitter:
    """Splits lights, one after the other, between directions that a survey has chosen.

    Attributes
    ----------
    beams : the light so far.
    """

    def __init__(self, own: dict[int, NDArray], classes: DirectionClasses | None) -> None:
        """`own`: direction of the lights, by number, that have one of their own."""
        self._own, self._classes = own, classes
        self._beams: dict[object, tuple[NDArray, NDArray]] = {}

    @classmethod
    def of(
        cls,
        surveys: Sequence[tuple[NDArray, NDArray]],
        max_own: int = MAX_OWN,
        is_split: bool = True,
        fineness: Fineness = FAR_LIGHT,
    ) -> Splitter:
        """From powers (...) and directions (..., 3) of each light; not `is_split`: others have their mean one."""
        directions = [direction_of(*survey) for survey in surveys]
        narrow = [number for number, way in enumerate(directions) if way is not None]
        narrow.sort(key=lambda number: -float(surveys[number][0].sum()))
        own = {number: directions[number] for number in narrow[:max_own]}
        rest = [survey for number, survey in enumerate(surveys) if number not in own and survey[0].any()]
        if not rest:
            return cls(own, None)
        powers, ways = [power.ravel() for power, _ in rest], [way.reshape(-1, 3) for _, way in rest]
        if not is_split:
            return cls(own, DirectionClasses.mean(powers, ways))
        return cls(own, DirectionClasses.of(powers, ways, fineness))

    @property
    def beams(self) -> Beams:
        return [(np.ascontiguousarray(light, np.float32), way) for light, way in self._beams.values()]

    def add(self, number: int, light: NDArray, way: NDArray) -> None:
        """Add irradiance (H, W, 3) of the light with this number, with its directions (3,) or (H, W, 3)."""
        if number in self._own:
            self._put(("own", number), light, self._own[number])
        elif self._classes is not None:
            for index, (weight, of_class) in enumerate(zip(self._classes.weights(way), self._classes.ways())):
                if np.any(weight):
                    self._put(index, light * weight[..., None], of_class)

    def _put(self, key: object, light: NDArray, way: NDArray) -> None:
        if key in self._beams:
            self._beams[key][0][...] += light
        elif np.any(light):
            self._beams[key] = np.array(light, np.float32), way


def _angles(way: NDArray) -> tuple[NDArray, NDArray]:
    """Angles from the normal and azimuths, degrees, of directions (..., 3) of travel."""
    # Last bits of NumPy's functions depend on where its arrays lie in memory.
    x, y, z = (np.asarray(way[..., axis], float) for axis in range(3))
    angle = np.degrees(np.arccos(np.clip(-z, 0, 1)))
    return angle.round(DIGITS), np.degrees(np.arctan2(y, x)).round(DIGITS)


def _steepness(angle: ArrayLike) -> NDArray:
    """The quantity in which weights are linear, for angles from the normal in degrees; it ascends."""
    return -np.cos(np.radians(angle)).round(DIGITS + 2)  # of numbers below 1, where angles have two digits more


def _nodes(values: NDArray, weights: NDArray, most: int, step: float) -> tuple[float, ...]:
    """One value, or some from the least to the largest between which nearly all of the weight lies."""
    low, high = _quantiles(values, weights)
    if high - low < NARROW:
        return _rounded([(low + high) / 2])
    count = min(max(round((high - low) / step) + 1, 2), most)
    return _rounded(np.linspace(low, high, count))


def _quantiles(values: NDArray, weights: NDArray) -> tuple[float, float]:
    order = np.argsort(values)
    below = np.cumsum(weights[order], dtype=float)
    if not below[-1] > 0:
        return 0.0, 0.0
    at = np.searchsorted(below, below[-1] * np.array([RANGE, 1 - RANGE]))
    low, high = values[order][np.minimum(at, len(values) - 1)]
    return float(low), float(high)


def _azimuth_nodes(values: NDArray, weights: NDArray, fineness: Fineness) -> tuple[tuple[float, ...], bool]:
    """Azimuths, degrees, ascending; True if they go around."""
    turns = np.exp(1j * np.radians(values))
    middle = float(np.degrees(np.angle((weights * turns).sum())))
    low, high = _quantiles((values - middle + 180) % 360 - 180, weights)
    if high - low < fineness.one_azimuth:
        return _rounded([middle + (low + high) / 2]), False
    if high - low <= 180:
        count = max(round((high - low) * fineness.azimuths / 360) + 1, 3)
        return _rounded(middle + np.linspace(low, high, count)), False
    return _rounded(middle + np.linspace(0, 360, fineness.azimuths, endpoint=False)), True


def _rounded(angles: Iterable[float]) -> tuple[float, ...]:
    return tuple(round(float(angle), ANGLE_DIGITS) for angle in angles)


def _weight(values: NDArray, nodes: Sequence[float], number: int) -> NDArray:
    """Weight of a node: linear between neighbors, and 1 in all beyond the ends."""
    return np.interp(values, nodes, np.eye(len(nodes))[number]) if len(nodes) > 1 else np.ones_like(values)
