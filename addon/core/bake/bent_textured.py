"""Light in textures on faces that bend: paths walk in tangent planes, and their ratio corrects the convention.

The convention's luminance knows how the surface bends. The ratio of the paths with the texture to those of the
convention changes with the curvature in second order only: tangent planes suffice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..progress import Progress
from ..scene.bent_grid import BentGrid
from .beams import lights_before, rays_of, surveyed
from .directions import SURVEY_TEXELS, Fineness, Splitter
from .planes_image import PlanesImage
from .spreading import Spreading
from .tangent_planes import CORE, Middle, Points, TangentPlane, middles_of, side_by_side
from .textured import TexturedPlane, spread_length

HALO = 1.5
"""Width around a plane's part of the surface from which light comes, in lengths that light spreads. Larger: longer."""

MAX_ANGLES = 4
"""Largest number of angles from the normal. More: light turns less on surfaces that bend, and more noise."""

ANGLE_STEP = 20.0
"""Degrees between these angles. Smaller: as more angles."""

SHARP, FINEST = 0.85, 0.6
"""Texel of planes over a mean free path, and least one over that of the surface. Smaller: sharper textures, longer."""

MAX_ROW = 1 << 16
"""Most texels in a row of a receiver."""

MAX_RATIO = 4
"""Most texels of all planes over those at which light is gathered; if more, they become larger. Larger: more memory."""

ONE_AZIMUTH = 90.0
"""Degrees within which azimuths count as one: planes turn with the light. Larger: less noise, and light that turns."""

MOST_LIGHT = 2.0
"""Most light that leaves a texel, over that of the brightest color everywhere. Larger: brighter faults of few paths."""

MIN_GAP, MAX_GAP = 2, 8
"""Texels between points of a surface that stretched texels show. More: gaps in surfaces are lit."""


def ratio_on_planes(
    side: str, grid: BentGrid, luminance: NDArray, spreading: Spreading, progress: Progress
) -> NDArray[np.float32]:
    """Luminance (H, W, 3) of light on one side of a grid as its texels scatter it, over that of the convention."""
    effort, settings, material = spreading.effort, spreading.settings, spreading.material
    shown = grid.areas > 0
    target = _target(grid, effort.texels)
    points, halo = _points(target), HALO * spread_length(material.albedo, material.mean_free_path, spreading.sources)
    pitch = grid.pitch_x * float(np.sqrt(grid.texels / len(points)))
    pitch *= float(np.clip(SHARP * min(material.mean_free_path) / pitch, FINEST, 1))
    light = PointsLight(grid, target, spreading)
    middles = [light.aligned(middle) for middle in middles_of(points, CORE * halo)]
    planes = _planes(middles, points, pitch, halo, MAX_RATIO * effort.texels**2)
    texels = Points(*(values[shown] for values in (grid.middles, grid.normals, grid.tangents)))
    image = PlanesImage(*side_by_side(planes), texels, _gap(grid))
    means = _means(len(texels), len(points))
    arrays = (grid.albedo, grid.color_in, luminance)
    albedo, factor, convention = (image.values(means(values[shown])) for values in arrays)
    factor[factor <= 0] = 1  # beside the planes
    convention = np.where(image.is_read[..., None], np.maximum(convention, 0), 0)
    result, pitches = convention.copy(), (planes[0].pitch,) * 2
    plane = TexturedPlane(spreading.sources, albedo, factor, material.albedo, material.mean_free_path, pitches)
    # Results are means of several planes.
    scale = float(np.sqrt((image.noise_left**2).mean()))
    options = effort.noise / max(scale, 1e-6), effort.max_walks, settings.threads
    noise = plane.correct(result, light.beams(image, middles), side, *options, progress)
    if spreading.reports.texture:
        spreading.reports.texture(noise * scale)
    ratio = np.divide(result, convention, out=np.ones_like(result), where=convention > 0)
    # Light under the surface is smoother than the factors, which are as sharp as the texels. It can hardly exceed that
    # of the brightest color everywhere: few paths end in the dark, and their ratio may be any number.
    below = np.minimum(ratio * factor, MOST_LIGHT * grid.color_in[shown].max(axis=0) ** 2)
    ratios = np.ones_like(luminance)
    ratios[shown] = np.nan_to_num(image.read(below) / grid.color_in[shown], nan=1.0)
    return ratios


def _planes(middles: Sequence[Middle], points: Points, pitch: float, halo: float, most: int) -> list[TangentPlane]:
    """Planes of texels of a pitch, or of larger ones if these are more than `most`."""
    planes = [TangentPlane.of(middle, points, pitch, halo) for middle in middles]
    texels = sum(width * height for width, height in (plane.size for plane in planes))
    if texels <= most:
        return planes
    pitch *= float(np.sqrt(texels / most))
    return [TangentPlane.of(middle, points, pitch, halo) for middle in middles]


def _target(grid: BentGrid, side: int) -> BentGrid:
    """All texels that show the mesh in one row, or a square of at most `side` texels of them, evenly chosen."""
    if grid.texels <= min(side**2, MAX_ROW):
        return grid.coarse(side)
    side = min(side, math.isqrt(grid.texels))
    row = grid.coarse(side)
    names = "middles", "steps_x", "steps_y", "normals", "tangents", "areas", "coverage"
    arrays = (getattr(row, name) for name in names)
    return replace(row, **{name: a.reshape(side, side, *a.shape[2:]) for name, a in zip(names, arrays)})


def _points(grid: BentGrid) -> Points:
    """The texels of a coarse grid."""
    return Points(*(values.reshape(-1, 3) for values in (grid.middles, grid.normals, grid.tangents)))


def _gap(grid: BentGrid) -> int:
    """Texels between points where texels are long."""
    shown = grid.areas > 0
    longest = np.maximum(*(np.linalg.norm(steps[shown], axis=1) for steps in (grid.steps_x, grid.steps_y)))
    return int(np.clip(np.ceil(np.quantile(longest, 0.95) / grid.pitch_x) + 1, MIN_GAP, MAX_GAP))


def _means(texels: int, count: int) -> Callable[[NDArray], NDArray]:
    """Function of values (texels, C): their means (count, C) around the texels that `BentGrid.coarse` chooses."""
    if texels == count:
        return lambda values: values
    chosen = np.linspace(0, texels - 1, count).astype(int)
    owner = np.searchsorted((chosen[1:] + chosen[:-1] + 1) // 2, np.arange(texels), "right")
    sizes = np.bincount(owner, minlength=count)
    return lambda values: np.stack([np.bincount(owner, channel, count) / sizes for channel in values.T], -1)


class PointsLight:
    """Light on points of a surface, as a few directions in tangent planes."""

    def __init__(self, grid: BentGrid, target: BentGrid, spreading: Spreading) -> None:
        """`target`: the points."""
        survey, settings, effort = grid.coarse(SURVEY_TEXELS), spreading.settings, spreading.effort
        self._target, self._settings, self._effort = target, settings, effort
        self._lights = lights_before(grid, spreading.illumination)
        self._survey = _points(survey)
        self._surveys = surveyed(survey, self._lights, settings, effort)

    def aligned(self, middle: Middle) -> Middle:
        """The middle with its x along the light: light that comes from one place has one azimuth in many planes."""
        flow = np.zeros(len(self._survey), complex)
        for power, way in self._surveys:
            flow += (power * (way[:, 0] + 1j * way[:, 1])).reshape(-1, len(flow)).sum(axis=0)
        return middle.aligned(self._survey, flow)

    def beams(self, image: PlanesImage, middles: Sequence[Middle]) -> list[tuple[NDArray, NDArray]]:
        """Irradiance (H, W, 3) of each direction on the image of planes."""
        nearest = np.argmin([middle.distances(self._survey) for middle in middles], axis=0)
        turns = np.empty(len(self._survey), np.complex64)
        for number, middle in enumerate(middles):
            turns[nearest == number] = middle.turns(self._survey.at(nearest == number))
        surveys = [(power, _turned(way, np.tile(turns, len(power) // len(turns)))) for power, way in self._surveys]
        effort = self._effort
        fineness = Fineness(MAX_ANGLES, ANGLE_STEP, ONE_AZIMUTH)
        splitter = Splitter.of(surveys, effort.max_own, effort.is_split, fineness)
        for number, light in enumerate(self._lights.lights):
            for part, way in rays_of(self._target, light, self._lights, self._settings, self._effort):
                power, ways = (values.reshape(-1, 3)[image.points] for values in (part, way))
                splitter.add(number, power[None], _turned(ways, image.turns)[None])
        return [(image.light(light[0]), way) for light, way in splitter.beams]


def _turned(way: NDArray, turns: NDArray) -> NDArray[np.float32]:
    """Directions (N, 3) after turns around z."""
    flat = (way[:, 0] + 1j * way[:, 1]) * turns
    return np.stack([flat.real, flat.imag, way[:, 2]], -1).astype(np.float32)
