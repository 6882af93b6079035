"""Bounced light by our own rays, at coarse nodes above the receiver or among the texels of a mesh that bends."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..messages import note, warning
from ..native import native
from ..progress import Progress
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.grid import Grid
from ..scene.lights import STRATA, BentField, Field, FieldLight
from .bake_settings import BakeSettings
from .job import BakeJob, Step
from .layers import WITHOUT_MEDIUM
from .mean_light import SHADOW_TEXELS, mean_irradiance, mean_open_irradiance
from .smoothing import SPLINE_VARIANCE, smoothing_variance
from .spread import spread_lengths
from .surface import Surface
from .surroundings import SPREADS, bounced_seconds

# Nodes along the longest side of a receiver, and the root of their number on a mesh that bends; more resolve bounced
# light more finely and take longer.
NODES = 64
# Most paths for each part of the hemisphere at a node; more leave less noise and take longer.
MAX_SAMPLES = 128
# Most rays along the paths of a receiver: a core traces some 300,000 a second in rooms. More leave less noise there and
# take longer.
MAX_RAYS = 12e6
# Most squares of that side that the nodes of all charts fill.
MAX_SQUARES = 2.0

# Height above the receiver at which light is gathered, in nodes; objects below it cast no shadow.
LIFT = 1e-3

# Allowed noise of bounced light, relative to all irradiance, and its multiple from which a message names it.
NOISE, NOISY = 0.01, 1.2
# Part of that noise where no medium spreads the light and each node shows, as in irradiance and direction.
# Smaller: less noise, and rooms take longer with its square.
BARE = 0.7
# Times as long as rooms then take.
BARE_TIME = 2.0

# Fraction of the unoccluded direct light below which bounced light is ignored. Leaks into a closed box are 1.3e-7.
NEGLIGIBLE = 1e-6
# Texels along a side from which that light is found.
FEW_TEXELS = 16
NOTHING_BOUNCES = warning(
    "", "Indirect light is left out: it is less than a millionth of what the lights send without obstacles."
)
BY_OWN_RAYS = note("", "Beamspread's own rays find the bounced light.")


@dataclass(frozen=True)
class BouncedLight(Step):
    """Adds the light that the scene's meshes return to the receiver.

    Attributes
    ----------
    max_bounces : largest number of surfaces that return light on its way, in all, diffusely and by a glossy lobe.
    nodes, tolerance, max_samples, max_rays : see `NODES`, `NOISE`, `MAX_SAMPLES` and `MAX_RAYS`.
    """

    max_bounces: tuple[int, int, int]
    nodes: int = NODES
    tolerance: float = NOISE
    max_samples: int = MAX_SAMPLES
    max_rays: float = MAX_RAYS

    name = "Finding bounced light"
    finds_light = True

    def seconds(self, job: BakeJob) -> float:
        triangles, nodes = job.illumination.triangle_count, node_count(job.lit_grids, self.nodes)
        spread = spread_in_nodes(job.surface, job.settings, job.grids, job.receiver.is_bent, self.nodes)
        seconds = bounced_seconds(
            triangles, job.surroundings, nodes, job.receiver.is_bent, job.settings.threads, self.max_rays, spread
        )
        return seconds * (BARE_TIME if _is_bare(job) else 1.0)

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        receiver, illumination, settings = job.receiver, job.illumination, job.settings
        grid = receiver.charts[0].grid
        surfaces, casters = illumination.reflecting(grid), illumination.caster(grid)
        lights = [
            (light.at(grid), light.rgb().tolist(), casters if light.cast_shadow else None)
            for light in illumination.lights
        ]
        grids = job.lit_grids
        nodes = bent_nodes_of(grids, self.nodes) if receiver.is_bent else charts_of(grids, self.nodes)
        bounced = native.bounced_light(
            nodes,
            STRATA,
            lights,
            surfaces,
            direct=mean_over(grids, lambda grid: mean_irradiance(grid, illumination, min(self.nodes, SHADOW_TEXELS))),
            tolerance=self.tolerance * (BARE if _is_bare(job) else 1.0),
            max_bounces=self.max_bounces,
            threads=settings.threads,
            spread=_spread(job),
            max_samples=self.max_samples,
            max_rays=self.max_rays,
            progress=progress,
        )
        if not bounced["irradiance"] > 0:
            return job
        in_the_open = mean_over(grids, lambda grid: mean_open_irradiance(grid, illumination.lights, FEW_TEXELS))
        if bounced["irradiance"] < NEGLIGIBLE * in_the_open:
            return replace(job, illumination=illumination.with_messages(NOTHING_BOUNCES))
        if bounced["noise"] > NOISY * self.tolerance:
            percent = 100 * bounced["noise"]
            text = f"Bounced light on '{job.name}' has {percent:.1f} % of noise, relative to all light there."
            illumination = illumination.with_messages(note(job.name, text))
        if receiver.is_bent:
            fields = tuple(
                BentField(of_grid.positions, of_grid.normals, of_grid.spacing, radiance, grid.is_back)
                for grid, of_grid, radiance in zip(grids, nodes, bounced["radiance"])
            )
        else:
            fields = tuple(
                Field(grid.origin, grid.normal, radiance) for grid, radiance in zip(grids, bounced["radiance"])
            )
        light = FieldLight("Bounced light", 1.0, (1.0, 1.0, 1.0), False, fields)
        return replace(job, illumination=illumination.lit_by([light]))


def _is_bare(job: BakeJob) -> bool:
    """True if no medium spreads the light."""
    return job.settings.layer in WITHOUT_MEDIUM


def _spread(job: BakeJob) -> float:
    """Half the side of a square, scene units, whose mean has as much noise as light after the medium's spread."""
    if _is_bare(job):
        return 0.0
    variance = smoothing_variance(job.receiver, job.surface, job.settings, NODES) - SPLINE_VARIANCE
    grids = [chart.grid for chart in job.receiver.charts]
    pitch = max(max(grid.width * grid.pitch_x, grid.height * grid.pitch_y) for grid in grids) / NODES
    return max(math.sqrt(math.pi * max(variance, 0.0)) * pitch, min(job.surface.material.mean_free_path))


def spread_in_nodes(
    surface: Surface, settings: BakeSettings, grids: Sequence[AnyGrid], is_bent: bool, nodes: int = NODES
) -> float:
    """About what `_spread` finds with the medium's library, in distances of nodes; `nodes` as in `node_count`."""
    if settings.layer in WITHOUT_MEDIUM:
        return 0.0
    sizes = [(grid.width * grid.pitch_x, grid.height * grid.pitch_y) for grid in grids]
    cell = math.sqrt(sum(x * y for x, y in sizes)) / nodes if is_bent else _sizes_and_cell(grids, nodes)[1]
    return SPREADS * min(spread_lengths(surface)) / cell


def mean_over(grids: Sequence[AnyGrid], value_of: Callable[[AnyGrid], float]) -> float:
    """Mean of a value of each grid, weighted by area."""
    areas = [grid.width * grid.pitch_x * grid.height * grid.pitch_y for grid in grids]
    return float(np.average([value_of(grid) for grid in grids], weights=areas))


def bent_nodes_of(grids: Sequence[BentGrid], nodes: int) -> list:
    """The native `BentNodes` of grids that bend, about `nodes` x `nodes` of each."""
    return [native.BentNodes(grid.native(), nodes**2) for grid in grids]


def charts_of(grids: Sequence[Grid], nodes: int) -> list[dict]:
    """Rectangles of nodes slightly above grids, `nodes` along the longest side, for the native tracer."""
    sizes, cell = _sizes_and_cell(grids, nodes)
    charts = []
    for grid, size in zip(grids, sizes):
        lift = grid.clearance + LIFT * cell + 1e-6 * float(np.abs(grid.origin).max())
        charts.append(
            {
                "corner": (np.array(grid.origin) + lift * np.array(grid.normal)).tolist(),
                "x_axis": list(map(float, grid.x_axis)),
                "y_axis": list(map(float, grid.y_axis)),
                "normal": list(map(float, grid.normal)),
                "size": size,
                "nodes": [max(1, round(length / cell)) for length in size],
            }
        )
    return charts


def node_count(grids: Sequence[AnyGrid], nodes: int = NODES) -> float:
    """Number of nodes of grids, about; `nodes` as in `bent_nodes_of` and `charts_of`."""
    if any(isinstance(grid, BentGrid) for grid in grids):
        return len(grids) * nodes**2
    sizes, cell = _sizes_and_cell(grids, nodes)
    return sum(max(x / cell, 1.0) * max(y / cell, 1.0) for x, y in sizes)


def _sizes_and_cell(grids: Sequence[Grid], nodes: int) -> tuple[list[tuple[float, float]], float]:
    """Sides of grids, and the distance of their nodes, scene units."""
    sizes = [(grid.width * grid.pitch_x, grid.height * grid.pitch_y) for grid in grids]
    return sizes, max(*map(max, sizes), math.sqrt(sum(x * y for x, y in sizes) / MAX_SQUARES)) / nodes
