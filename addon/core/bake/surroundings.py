"""Surroundings of a receiver, and the time in which bounced light is found there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.illumination import Illumination
from ..scene.lights import STRATA, WorldLight
from .estimate import SKY, Shares, parallel_seconds, share_of_rays
from .mean_light import irradiance_map, mean_irradiance, mean_open_irradiance

# Seconds of one thread until paths begin; and of a ray along a path in the open and, more, in closed rooms: in any
# case, and for each doubling of the triangles.
LEARNING, OPEN_RAY, ROOM_RAY = 0.2, (0.36e-6, 0.07e-6), (0.2e-6, 0.035e-6)

# Rays of a path in the open, and more of them in closed rooms.
OPEN_PATH, ROOM_PATH = 1.0, 1.7

# Paths of each part of the hemisphere at a node that bring the noise of light that is all bounced to one percent, on
# planes and on surfaces that bend, where no medium spreads it; and the fewest and the most that are traced.
PATHS, BENT_PATHS, PATH_LIMITS = 100.0, 65.0, (2.0, 128.0)
# Part of even light's square that counts as noise, beside the squares of the differences between directions; and the
# largest noise: paths are guided to spots that are brighter.
EVEN_NOISE, MOST_NOISE = 0.2, 1.4
# The medium's spread takes noise as the mean over a square does, about: half the side of that square, in spreads of
# the channel that spreads least.
SPREADS = 1.2

# The same of paths by Cycles, which nothing guides: on planes, where a filter helps, and on bent surfaces; the fewest
# and the most.
CYCLES_PATHS, CYCLES_BENT_PATHS, CYCLES_LIMITS = 50.0, 200.0, (4.0, 128.0)
# Seconds of one thread for each in the open, and more of them in closed rooms, where paths bounce this often, about.
CYCLES_PATH, CYCLES_BOUNCES = (3e-6, 7e-6), 4

# Bounced light in a closed room over the light of lamps without obstacles, about.
BOUNCED_PART = 0.4

# Planes of a receiver that are looked at, and texels along a side of each. More: slower estimates.
PLANES, TEXELS = 6, 8
# Texels along a side at which obstacles are looked for, and lights for which they are. More: surer, slower estimates.
SHARE_TEXELS, MAX_LIGHTS = 24, 8

DIRECTIONS = 128
"""Number of directions that are looked in; more tell the part more finely and take longer."""

LIFT = 1e-3
"""Height of the eye above a plane, relative to the plane's size."""


@dataclass(frozen=True)
class Surroundings:
    """How open a receiver is to its surroundings.

    Attributes
    ----------
    enclosed : part of the light that would arrive from objects under even light: 0 in the open, 1 in a closed room.
    lit : part of the lamps' light that nothing blocks.
    returned : mean and root mean square of bounced light over directions, relative to the mean of all light; None if
        they are not known.
    spikes : mean square of the light of lamps that paths meet through glass, relative to the square of all light.
    met : part of the paths that meet one.
    shares : `Shares` of the receiver, and of its other face if light there counts.
    """

    enclosed: float = 0.0
    lit: float = 1.0
    returned: tuple[float, float] | None = None
    spikes: float = 0.0
    met: float = 0.0
    shares: tuple[Shares, ...] = field(default=(), compare=False)

    @property
    def bounced(self) -> float:
        """Noise of bounced light relative to all light, up to a factor: more where few directions bring it."""
        if self.returned is None:
            return MOST_NOISE * self._bounced_part()
        mean, square = self.returned[0] ** 2, self.returned[1] ** 2
        return min(math.sqrt(max(square - mean, 0.0) + EVEN_NOISE * mean), MOST_NOISE)

    @property
    def bounced_in_cycles(self) -> float:
        """The same for light by Cycles, whose filter removes part of the noise of bright directions; no `spikes`."""
        return self._bounced_part() if self.returned is None else math.sqrt(math.prod(self.returned))

    def _bounced_part(self) -> float:
        """Part of all light that is bounced, about, in a room of usual colors."""
        bounced = BOUNCED_PART * self.enclosed
        return bounced / max(self.lit + bounced, 1e-9)

    def shares_on(self, side: int) -> Shares | None:
        """`Shares` of the receiver (0) or of its other face (1); None if they are not known."""
        if side < len(self.shares):
            return self.shares[side]
        return {} if self == OPEN else None


OPEN = Surroundings()


def bounced_seconds(
    triangles: int,
    around: Surroundings,
    nodes: float,
    is_bent: bool,
    threads: int,
    max_rays: float,
    spread: float = 0.0,
) -> float:
    """Seconds in which our own rays find bounced light at so many nodes.

    `spread`: half the side of a square whose mean has as much noise as light after the medium's spread, in nodes.
    """
    least, most = PATH_LIMITS
    wanted = (BENT_PATHS if is_bent else PATHS) * around.bounced**2 / (1.0 + spread**2)
    paths = nodes * len(STRATA) * min(max(wanted, least), most)
    rays = min(paths * (OPEN_PATH + ROOM_PATH * around.enclosed), max_rays)
    doublings = math.log2(1 + triangles)
    ray = sum(
        part * (fixed + more * doublings) for part, (fixed, more) in ((1.0, OPEN_RAY), (around.enclosed, ROOM_RAY))
    )
    return parallel_seconds(LEARNING + rays * ray, threads)


def bounced_seconds_of_cycles(around: Surroundings, nodes: float, is_bent: bool) -> float:
    """Seconds in which Cycles finds bounced light at so many nodes, besides its start."""
    noise = around.bounced_in_cycles**2
    plain, spiky = (_paths_of_cycles(square, is_bent) for square in (noise, noise + around.spikes))
    # Light that no path of the first round meets does not show as noise.
    missed = math.exp(-CYCLES_LIMITS[0] * nodes * len(STRATA) * around.met)
    paths = missed * plain + (1.0 - missed) * spiky
    fixed, more = CYCLES_PATH
    return parallel_seconds((fixed + more * around.enclosed**CYCLES_BOUNCES) * paths * nodes * len(STRATA), 0)


def _paths_of_cycles(noise: float, is_bent: bool) -> float:
    """Paths by Cycles of each part of the hemisphere at a node; `noise`: square of that of one path."""
    least, most = CYCLES_LIMITS
    return min(max((CYCLES_BENT_PATHS if is_bent else CYCLES_PATHS) * noise, least), most)


def surroundings_of(
    grids: Sequence[AnyGrid], illumination: Illumination, has_unknown_sky: bool = False
) -> Surroundings:
    """The surroundings of a receiver, by few rays; `has_unknown_sky`: True if light of a sky is still to be found."""
    grids = sorted(grids, key=lambda grid: -grid.texels)[:PLANES]
    shares = _shares(grids[0], illumination)
    sky = illumination.with_lights([_sky()])
    open_sky = [mean_open_irradiance(grid, sky.lights, TEXELS) for grid in grids]
    open_light = [mean_open_irradiance(grid, illumination.lights, TEXELS) for grid in grids]
    seen = sum(mean_irradiance(grid, sky, TEXELS) for grid in grids) / (sum(open_sky) or 1.0)
    lit = sum(mean_irradiance(grid, illumination, TEXELS) for grid in grids) / (sum(open_light) or 1.0)
    return Surroundings(min(max(1.0 - seen, 0.0), 1.0), min(max(lit, seen * has_unknown_sky), 1.0), shares=(shares,))


def _shares(grid: AnyGrid, illumination: Illumination) -> Shares:
    """`Shares` of the brightest lights with a size but narrow suns, and of an even sky."""
    wide = [light for light in illumination.lights if light.has_size and not light.is_parallel]
    lights = sorted(wide, key=lambda light: -light.strength)
    shares = {}
    for name, light in [(SKY, _sky()), *((light.name, light) for light in lights[:MAX_LIGHTS])]:
        shown, arriving = (
            irradiance_map(grid, illumination, light, has_shadows, SHARE_TEXELS) for has_shadows in (False, True)
        )
        parts = np.where(shown > 0, 1 - arriving / np.where(shown > 0, shown, 1.0), np.nan)
        shares[name] = float(np.mean([share_of_rays(None if np.isnan(part) else part) for part in parts.ravel()]))
    return shares


def _sky() -> WorldLight:
    rows = tuple(map(tuple, np.eye(3).tolist()))
    return WorldLight("", 1.0, (1.0, 1.0, 1.0), True, np.ones((1, 1, 3), np.float32), rows)


def enclosed_part(own: np.ndarray, normal: np.ndarray | None, low: np.ndarray, high: np.ndarray) -> float:
    """`Surroundings.enclosed` without meshes, seen from the middle of the receiver: each object is the box around it.

    Boxes inside of the receiver's own do not count.

    Parameters
    ----------
    own : corners (M, 3) of the receiver.
    normal : of a flat receiver, above which light arrives; None where it arrives from all around.
    low, high : corners (N, 3) of the boxes, along the axes of the world.
    """
    size = float(np.ptp(own, axis=0).max())
    is_other = (low < own.min(0) - LIFT * size).any(1) | (high > own.max(0) + LIFT * size).any(1)
    if not is_other.any():
        return 0.0
    directions = directions_of(normal)
    eye = own.mean(0) + (0.0 if normal is None else LIFT * size * normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        planes = (np.stack([low, high])[:, is_other] - eye)[:, :, None] / directions  # (2, boxes, directions, 3)
    # 0 / 0: the eye lies in a face along which it looks.
    enters = np.nan_to_num(planes.min(0), nan=-math.inf, neginf=-math.inf, posinf=math.inf).max(-1)
    leaves = np.nan_to_num(planes.max(0), nan=math.inf, neginf=-math.inf, posinf=math.inf).min(-1)
    return float(((leaves >= enters) & (leaves > 0)).any(0).mean())


def directions_of(normal: np.ndarray | None, count: int = DIRECTIONS, turned: float = 0.0) -> np.ndarray:
    """Directions (count, 3) from which even light arrives: around a normal, or from all around without one.

    `turned`: angle by which they are turned around it, radians.
    """
    part, turn = (np.arange(count) + 0.5) / count, np.arange(count) * math.pi * (3 - math.sqrt(5)) + turned
    if normal is None:
        x_axis, y_axis, z_axis = np.eye(3)
        height, radius = 1 - 2 * part, 2 * np.sqrt(part * (1 - part))
    else:
        z_axis = normal
        x_axis = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
        x_axis /= np.linalg.norm(x_axis)
        y_axis, height, radius = np.cross(normal, x_axis), np.sqrt(1 - part), np.sqrt(part)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1) @ np.stack([x_axis, y_axis, z_axis])


def corners_of(grid: AnyGrid) -> np.ndarray:
    """World positions (N, 3) of the corners of a grid, or of the box around one that bends."""
    if isinstance(grid, BentGrid):
        return grid.corners()
    across, up = grid.width * grid.pitch_x * np.array(grid.x_axis), grid.height * grid.pitch_y * np.array(grid.y_axis)
    return np.array(grid.origin) + np.array([0 * up, across, up, across + up])
