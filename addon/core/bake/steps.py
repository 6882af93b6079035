"""Steps of a job: simulation, solution, and the memory that they take, about."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import BakeError
from ..ldf.library import SIMULATING, is_known, library
from ..messages import Message, note
from ..progress import Progress
from .bake_settings import MAX_SAMPLES, BakeSettings
from .bent_limits import bent_messages
from .edges import texels_with_images, with_edges
from .estimate import simulation_seconds, textured_seconds
from .finish import finished_texture
from .job import BakeJob, Step
from .layers import LAYERS, WITHOUT_MEDIUM, rays_without_medium
from .spread_light import rays_per_texel
from .spreading import FINAL_EFFORT, Reports
from .surface import Surface
from .textured_bake import noisy_note, why_multiplied

SUNS, NARROW, WIDE = range(3)
"""Kinds of light: suns alone; one direction at each texel; any other."""

BYTES = {
    "fft": ((50e6, 80), (400e6, 80), (400e6, 80)),
    "direct": ((50e6, 140), (100e6, 300), (250e6, 520)),
    "adaptive": ((50e6, 140), (100e6, 180), (250e6, 400)),
}
"""Fixed bytes and bytes per texel, by solver and kind of light, without the light that the fft solver keeps.

Peaks of processes with 256^2 to 2048^2 texels (tests/unit/test_memory.py), rounded up by a twentieth or more.
"""

OTHER_SOLVER = BYTES["direct"]
"""The same of a solver that is not listed: the most that a listed one takes per texel."""

TEXTURED_BYTES = 60e6, 100
"""The same that textures take in addition in which light scatters: albedos, factors, directions, paths."""

BENT_BYTES = 400e6, 2500
"""The same of surfaces that bend, per texel that shows them."""

BENT_TEXTURED_BYTES, MOST_TEXTURED_BYTES = 8500, 900e6
"""Bytes per texel of textures on these, and most bytes."""

PASS_BYTES = 50e6, 120
"""The same of irradiance and direction, without a medium."""

NARROW_SLAB, WIDE_SLAB = (200e6, 300), (800e6, 300)
"""Additional bytes of slabs with an ior above 1, for one mean free path or less; they fall as 1 / thickness."""


MAX_NOISE = 0.03
"""Noise of the light, relative to its mean, above which a bake names it. More: fewer notes."""


class NoiseSum:
    """Noise of the light on several planes: a dark one among bright ones shows little of its own."""

    def __init__(self) -> None:
        self._sums = np.zeros(3)

    def add(self, area: float, irradiance: float, variance: float) -> None:
        """Take a plane's mean irradiance and its variance."""
        self._sums += area, area * irradiance, area * variance

    def relative(self) -> float:
        """Standard error of the irradiance, root mean square over the planes and relative to its mean."""
        area, irradiance, variance = self._sums.tolist()
        return math.sqrt(area * variance) / irradiance if irradiance > 0 else 0.0


@dataclass(frozen=True)
class Simulate(Step):
    """Simulates the media of the surface, and caches them."""

    name = "Simulating the material"

    def seconds(self, job: BakeJob) -> float:
        is_bent = job.receiver.is_bent
        return simulation_seconds(to_simulate(job.surface, job.settings, is_bent), job.settings, is_bent)

    def kind(self, job: BakeJob) -> str:
        return self.stage(job)

    def stage(self, job: BakeJob) -> str:
        return SIMULATING[job.settings.quality]

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        is_bent, settings = job.receiver.is_bent, job.settings
        media = to_simulate(job.surface, settings, is_bent)
        for medium, part in zip(media, progress.split([1.0] * len(media))):
            library(medium, settings.quality, part, settings.threads, is_bent)
        return job


@dataclass(frozen=True)
class Solve(Step):
    """Computes the result from the light and the surface."""

    name = "Baking"

    def seconds(self, job: BakeJob) -> float:
        textured = textured_seconds(textured_texels(job), job.settings.threads, job.receiver.is_bent)
        return textured + sum(load.seconds(job.settings) for load in job.workloads)

    def kind(self, job: BakeJob) -> str:
        return self.kind_for(job.settings)

    @classmethod
    def kind_for(cls, settings: BakeSettings) -> str:
        """Name of solutions with these settings, see `Pace`."""
        return f"{cls.name} {settings.layer} {settings.solver}"

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        material, settings = job.surface.material, job.settings
        if needs_medium(settings):
            material = job.surface.resolve(settings.quality, None, settings.threads)
        grids, messages = with_edges([chart.grid for chart in job.receiver.charts], job.surface, job.name)
        job = replace(job, illumination=job.illumination.with_messages(*messages))
        noise, bends, textures = NoiseSum(), [0.0], [0.0]
        values = LAYERS[settings.layer](
            grids,
            job.illumination,
            material,
            job.surface.thickness,
            settings,
            progress,
            self._bytes_for_light(job),
            Reports(noise.add, bends.append, textures.append),
        )
        if job.receiver.is_bent:
            limits = bent_messages(job.name, job.surface, settings, max(bends))
            job = replace(job, illumination=job.illumination.with_messages(*limits))
        if max(textures) > FINAL_EFFORT.noise:
            job = replace(job, illumination=job.illumination.with_messages(noisy_note(job.name, max(textures))))
        if noise.relative() > MAX_NOISE:
            job = replace(job, illumination=job.illumination.with_messages(_noisy(job, noise.relative())))
        if not all(np.isfinite(on_grid).all() for on_grid in values):
            text = "The bake produced values that are not numbers."
            raise BakeError(text, "Check the strengths of the lights.")
        return replace(job, texture=finished_texture(job.receiver, values, material, settings))

    def memory_bytes(self, job: BakeJob) -> float:
        texels, lights, surface = job.receiver.coverage.size, job.illumination.lights, job.surface
        if not needs_medium(job.settings):
            return pass_bytes(texels)
        if job.receiver.is_bent:
            fixed, per_texel = BENT_BYTES
            # Paths through a texture follow the solver, after which they have its memory.
            least = min(BENT_TEXTURED_BYTES * textured_texels(job), MOST_TEXTURED_BYTES)
            return fixed + max(per_texel * job.receiver.charts[0].grid.texels, least)
        mirrored, _ = with_edges([chart.grid for chart in job.receiver.charts], surface, job.name)
        texels = max(texels, *map(texels_with_images, mirrored))
        is_narrow = not job.finds_light and all(light.has_one_direction for light in lights)
        kind = (SUNS if all(light.is_parallel for light in lights) else NARROW) if is_narrow else WIDE
        is_slab = surface.thickness > 0 and surface.material.ior > 1
        paths = surface.thickness / max(surface.material.mean_free_path) if is_slab else math.inf
        fixed, per_texel = TEXTURED_BYTES if textured_texels(job) else (0.0, 0.0)
        return bake_bytes(texels, job.settings.solver, kind, paths) + fixed + per_texel * texels

    def _bytes_for_light(self, job: BakeJob) -> int:
        """Memory that is left for the light that the fft solver keeps, bytes; 0: no limit."""
        return max(1, int(job.memory_limit - self.memory_bytes(job))) if job.memory_limit else 0


BAKE_STEPS = (Simulate(), Solve())
"""Steps of a job whose light and colors are known."""


def _noisy(job: BakeJob, noise: float) -> Message:
    text = (
        f"Direct light on '{job.name}' has {100 * noise:.0f} % of noise, relative to all light there. Few rays find it."
    )
    # The noise of light that few rays find falls with the root of their number.
    wanted = _rays(job, job.settings.samples) * (noise / MAX_NOISE) ** 2
    enough = (samples for samples in range(job.settings.samples + 1, MAX_SAMPLES + 1) if _rays(job, samples) >= wanted)
    samples = next(enough, None)
    if samples is not None:
        return note(job.name, text, f"Raise Samples to {samples}.")
    return note(job.name, text, "Widen the gaps through which it comes: more samples would not be enough.")


def _rays(job: BakeJob, samples: int) -> int:
    """How many rays of each texel go to a light of a size: a power of two, see native/scene/ray_gather.h."""
    settings = replace(job.settings, samples=samples)
    if settings.layer in WITHOUT_MEDIUM:
        rays = rays_without_medium(settings)
    else:
        rays = rays_per_texel(job.receiver.charts[0].grid, job.surface.material, settings)
    return 1 << (rays.bit_length() - 1)


def textured_texels(job: BakeJob) -> int:
    """Texels in which light scatters by albedos of their own, also by those that a step of the job will find."""
    grids = [chart.grid for chart in job.receiver.charts]
    if any(step.finds_albedos for step in job.steps) and not why_multiplied(job.settings):
        return sum(grid.texels for grid in grids)
    return sum(grid.texels for grid in grids if grid.base_color is not None or grid.albedo is not None)


def needs_medium(settings: BakeSettings) -> bool:
    """True if the result depends on the material."""
    return settings.layer not in WITHOUT_MEDIUM


def to_simulate(surface: Surface, settings: BakeSettings, is_bent: bool = False) -> list:
    """The media that a bake has to simulate first, which takes long; those of a surface that bends also for curves."""
    uses_library = settings.distributions == "library" or surface.base_color is not None
    if not (needs_medium(settings) and uses_library):
        return []
    return [medium for medium in surface.media() if not is_known(medium, settings.quality, is_bent)]


def bake_bytes(texels: int, solver: str, light: int, mean_free_paths: float) -> float:
    """Peak memory of a bake, bytes, without the light that the fft solver keeps.

    Parameters
    ----------
    light : SUNS, NARROW or WIDE.
    mean_free_paths : thickness of a slab with an ior above 1, or inf.
    """
    fixed, per_texel = BYTES.get(solver, OTHER_SOLVER)[light]
    if solver == "fft" and light != SUNS:
        slab, slab_per_texel = WIDE_SLAB if light == WIDE else NARROW_SLAB
        thinness = 1 / max(mean_free_paths, 1.0)
        fixed += slab * thinness
        per_texel += slab_per_texel * thinness
    return fixed + per_texel * texels


def pass_bytes(texels: int) -> float:
    """Peak memory of a bake of irradiance or direction, bytes."""
    fixed, per_texel = PASS_BYTES
    return fixed + per_texel * texels
