"""Estimates of the seconds that steps take, from facts that are known before anything is computed."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..ldf.curvatures import curvatures_for, curved_angles_for, curved_photons_for, transport_length
from ..ldf.library import PHOTONS, angles_for, is_known
from ..scene.bending import BALL, Bending
from ..scene.bent_grid import AnyGrid, BentGrid
from ..scene.lights import STRATA, AreaLight, Light, MeshLight, WorldLight
from .bake_settings import BakeSettings
from .edges import texels_with_images
from .layers import WITHOUT_MEDIUM, rays_without_medium
from .mean_light import mean_open_irradiance
from .spread_light import MIN_RAYS, backs_of, has_back, rays_per_texel
from .surface import Surface

# The rates are seconds of one thread, fitted to bakes by tests/bench/estimates.py. Larger: longer estimates.

# Speed of n threads is this power of n.
THREADS_POWER = 0.85

# Seconds of any bake, and of each plane.
ANY_BAKE, ANY_PLANE = 0.05, 2e-3

# Seconds per texel of the transforms for suns alone; for lamps of one direction at each texel, with an index of
# refraction above 1 and without; and for any other light.
SUNS, LAMPS, WIDE = 0.06e-6, (1.0e-6, 1.8e-6), (2.4e-6, 3.6e-6)
# Seconds of the choice of terms for other light.
CHOICE = 0.1, 0.3
# The same of each further plane.
CHOICE_OF_PLANE = 0.05
# Multiple of slabs of one mean free path with an index of refraction above 1; thicker ones come closer to 1.
THIN_SLAB = 6.0

# Seconds of a ray that is traced, in any case; besides, with the obstacles of `MANY_TRIANGLES`, towards lights all
# around, and towards others.
OPEN_RAY, BROAD_RAY, NARROW_RAY = 0.15e-6, 0.17e-6, 0.12e-6
# Seconds per texel and lamp of the rays to a lamp without a size, and for each doubling of `MANY_TRIANGLES`: their
# shadows have more borders.
LAMP_RAYS, LAMP_TRIANGLES = 0.3e-6, 1.0e-6
# Part of the latter on surfaces that bend: where tiles of texels are lit or shaded alike, few rays are traced.
BENT_TRIANGLES = 0.3
# Triangles of an average scene, whose shadow rays take these times. Fewer cast fewer shadows; more are traced longer.
MANY_TRIANGLES = 1000

# Seconds per texel and direction of the solver `adaptive`, and per pair of texels of `direct`; for suns and for others.
ADAPTIVE, DIRECT = (1e-6, 3e-6), (0.2e-9, 30e-9)

# Seconds of the solution on surfaces that bend: in any case, for the tables of its media; for each sample, and each
# channel of its own.
BENT, BENT_SAMPLE, BENT_CHANNEL = 1.1, 0.6e-6, 2.1e-6
# The same of a sample with a mean free path of a texel on a ball; they grow with these powers of the path, and of a
# surface's turning relative to a ball's, up to this one.
BENT_PATH, PATH_POWER, TURNING_POWER, MAX_TURNING = 0.3e-6, 1.1, 1.5, 5.0
# Multiples at an index of 1, where light that leaves depends on more functions: of samples, and of their paths.
PLAIN_SAMPLE, PLAIN_PATH = 2.7, 3.1
# Seconds of a sample for each ray to a light of a size, and of a texel for bounced light.
BENT_RAY, BENT_BOUNCED = 0.06e-6, 10e-6
# On slabs that bend, whose texels are all solved: for each sample, and each channel of its own there, with a mean free
# path of a texel; the powers of the path and of the turning.
SLAB_SAMPLE, SLAB_CHANNEL, SLAB_PATH_POWER, SLAB_TURNING_POWER = 4.5e-6, 10.5e-6, 0.55, 0.75
# Seconds of a texel beside a crease as long as the root of the area, for each channel and a mean free path of a texel;
# and the power of the path.
CREASE, CREASE_PATH = 30e-6, 1.5
# Part of a surface that bends that lamps and suns light, about.
LIT_BY_LAMPS = 0.5

# Seconds per texel of light in a texture's albedos: between 1.5e-6 where colors are alike and 20e-6 where they differ.
TEXTURED = 14e-6
# The same on surfaces that bend, in any case, and by the root of the number of texels.
BENT_TEXTURED, BENT_TEXTURED_ROOT = 3.5, 0.05

# Seconds of the simulation of an angle in final quality, in half-spaces; and in slabs up to a thickness in mean free
# paths, with whose root it grows beyond.
HALF_SPACE_ANGLE, SLAB_ANGLE, SLAB_THICKNESS = 6.0, 0.9, 5.0
# Seconds of the simulation of a photon on a curved surface, for each transport mean free path in mean free paths.
CURVED_PHOTON = 0.2e-6

# Seconds of the solution for bounced light: in any case, and per texel.
SPREAD_BOUNCED, SPREAD_BOUNCED_TEXEL = 0.15, 0.65e-6

# Seconds until Cycles has started, and of each triangle; of the light of a lamp, of bounced light, of a panorama of the
# world, and of a base color for each texel.
CYCLES_START, CYCLES_TRIANGLE = 1.5, 5e-6
CYCLES_LAMP, CYCLES_BOUNCED, CYCLES_WORLD, CYCLES_COLOR = 3.0, 2.0, 6.0, 5e-6

# Fraction of the light that comes from a world, or from glowing meshes, whose light is not known, about.
OF_WORLD, OF_MESHES = 0.5, 0.1

# Texels along a side at which the brightness of lights is compared. More: slower estimates.
SURVEY_TEXELS = 8

# Part of the rays to a light of a size that is traced where obstacles are and nothing else is known, about.
SOME_BLOCKED = 0.3
# Rays of a texel and its neighbors in the first pass, and noise beside obstacles: see native/scene/first_pass.cpp.
RAYS_AROUND, BLOCKED_NOISE, NOISE_POWER = 72, 1.5, 1.6

Shares = Mapping[str, float]
"""Part of the rays to each light of a size that a bake traces after its first pass, by the light's name."""

SKY = "*"
"""Name of an even sky among these."""

CYCLES_LIGHT, CYCLES_COLORS = "Finding light with Cycles", "Evaluating the base color"
"""Names of the steps by Cycles, see `Pace`."""


@dataclass(frozen=True)
class Workload:
    """Facts about the light on a receiver and about its medium.

    Attributes
    ----------
    texels : of all grids, with their mirror images.
    planes : number of grids.
    is_bent : True if the grid is one of faces that bend.
    suns, lamps : numbers of lights of one direction, and of one direction at each texel.
    broad_rays, narrow_rays : rays of each texel to lights from all around, and to other lights of a size.
    broad_traced, narrow_traced : number of those that are traced towards obstacles.
    bounced : True if bounced light may be added.
    pieces : into which a texel on surfaces that bend is divided, on average.
    bending : of a surface that bends.
    channels : number of those whose light is computed; those of one medium under light of one color share it.
    lit : part of a surface that bends that light reaches, about.
    triangles : number of those that block light; 0 without shadows.
    path : mean free path in texels, the longest of the channels; on surfaces that bend.
    ior : index of refraction.
    thickness : in mean free paths; infinite for a half-space.
    """

    texels: int
    planes: int = 1
    is_bent: bool = False
    suns: int = 0
    lamps: int = 0
    broad_rays: float = 0.0
    narrow_rays: float = 0.0
    broad_traced: float = 0.0
    narrow_traced: float = 0.0
    bounced: bool = False
    pieces: float = 1.0
    bending: Bending = BALL
    channels: int = 3
    lit: float = 1.0
    triangles: int = 0
    path: float = 1.0
    ior: float = 1.0
    thickness: float = math.inf

    @classmethod
    def of(
        cls,
        grids: Sequence[AnyGrid],
        lights: Sequence[Light],
        triangles: int,
        surface: Surface,
        settings: BakeSettings,
        bounced: bool = False,
        unknown: float = 0.0,
        shares: Shares | None = None,
        has_all_sides: bool = False,
    ) -> Workload:
        """The workload of a bake.

        `unknown`: fraction of all light, about, that comes from all around and is not among `lights`. `shares`: None
        if they are not known. `has_all_sides`: True if grids on planes stand for a surface that bends, behind which no
        light is.
        """
        is_bent = any(isinstance(grid, BentGrid) for grid in grids)
        load = cls(sum(map(texels_with_images, grids)), len(grids), is_bent, bounced=bounced, triangles=triangles)
        largest = max(grids, key=lambda grid: grid.texels)
        facing = lights if has_all_sides else [light for light in lights if not light.is_behind(largest)]
        all_rays, shared = _rays(largest, facing, surface, settings, unknown)
        around = all_rays * (unknown if shared else math.ceil(unknown))
        traced = traced_rays(around, _share_of(SKY, shares, triangles)) if around else 0.0
        load = replace(load, broad_rays=around, broad_traced=traced)
        for light, rays in shared:
            name = SKY if isinstance(light, WorldLight) and light.name not in (shares or {}) else light.name
            traced = traced_rays(rays, _share_of(name, shares, triangles)) if light.cast_shadow else MIN_RAYS
            if light.is_parallel:
                load = replace(load, suns=load.suns + 1)
            elif light.has_one_direction:
                load = replace(load, lamps=load.lamps + 1)
            elif isinstance(light, AreaLight | MeshLight | WorldLight):
                both = load.broad_rays + rays, load.broad_traced + traced
                load = replace(load, broad_rays=both[0], broad_traced=both[1])
            else:
                both = load.narrow_rays + rays, load.narrow_traced + traced
                load = replace(load, narrow_rays=both[0], narrow_traced=both[1])
        if is_bent:
            load = replace(load, pieces=largest.pieces, bending=largest.bending)
        material, is_unknown = surface.material, bounced or unknown > 0
        reaching = [light for light, _ in shared]
        is_around = is_unknown or any(isinstance(light, WorldLight) for light in reaching)
        paths = surface.thickness / max(material.mean_free_path) if surface.thickness else math.inf
        return replace(
            load,
            channels=3 if is_unknown else channels_of(surface, reaching),
            lit=1.0 if is_around else LIT_BY_LAMPS,
            path=max(material.mean_free_path) / max(largest.pitch_x, largest.pitch_y),
            ior=material.ior,
            thickness=paths,
        )

    def is_lit(self) -> bool:
        """True if light may reach the grids."""
        return bool(self.suns or self.lamps or self.broad_rays or self.narrow_rays or self.bounced)

    def seconds(self, settings: BakeSettings) -> float:
        """Seconds of the solution."""
        tracing = self.texels * (self._rays_of_lamps(settings) + self._rays_of_sizes())
        fixed = ANY_BAKE + ANY_PLANE * self.planes
        if settings.layer in WITHOUT_MEDIUM:
            return fixed + parallel_seconds(tracing, settings.threads)
        return fixed + parallel_seconds(tracing + self._spreading(settings), settings.threads)

    def _rays_of_lamps(self, settings: BakeSettings) -> float:
        doublings = max(math.log2(max(self.triangles, 1) / MANY_TRIANGLES), 0.0)
        traced = LAMP_TRIANGLES * (BENT_TRIANGLES if self.is_bent else 1.0) * settings.samples**2 / 16
        return (self.suns + self.lamps) * (LAMP_RAYS + traced * doublings)

    def _rays_of_sizes(self) -> float:
        broad, narrow = self.broad_traced, self.narrow_traced
        return OPEN_RAY * (broad + narrow) + self._shadows() * (BROAD_RAY * broad + NARROW_RAY * narrow)

    def _shadows(self) -> float:
        """Time of the shadow rays, relative to `MANY_TRIANGLES`; two are the receiver itself."""
        relative = math.log2(max(self.triangles, 2) / 2) / math.log2(MANY_TRIANGLES / 2)
        return min(relative, relative**1.5)

    def _spreading(self, settings: BakeSettings) -> float:
        """Seconds of the solver."""
        is_wide = self.broad_rays + self.narrow_rays > 0
        directions = self.lamps + self.broad_rays + self.narrow_rays + len(STRATA) * self.bounced
        if self.is_bent and settings.solver != "direct":
            turning = min(max(self.bending.turning, 1.0), MAX_TURNING)
            if math.isfinite(self.thickness):
                of_sample = (SLAB_SAMPLE + SLAB_CHANNEL * self.channels) * self.path**SLAB_PATH_POWER
                of_sample *= turning**SLAB_TURNING_POWER
            else:
                per_sample, per_path = (PLAIN_SAMPLE, PLAIN_PATH) if self.ior <= 1 else (1.0, 1.0)
                of_path = BENT_PATH * self.channels * self.path**PATH_POWER * turning**TURNING_POWER
                of_sample = per_sample * (BENT_SAMPLE + BENT_CHANNEL * self.channels) + per_path * of_path
            of_light = BENT_RAY * (self.broad_rays + self.narrow_rays) * self.pieces + BENT_BOUNCED * self.bounced
            of_creases = CREASE * self.bending.creases * self.channels * self.path**CREASE_PATH * self.texels**0.5
            return BENT + (of_sample * self.texels * self.pieces + of_creases) * self.lit + of_light * self.texels
        if settings.solver != "fft":
            sun, direction = ADAPTIVE if settings.solver == "adaptive" else DIRECT
            pairs = self.texels if settings.solver == "adaptive" else self.texels**2
            return pairs * (sun * self.suns + direction * directions)
        is_plain = self.ior <= 1
        slab = 1 + (THIN_SLAB - 1) / max(self.thickness, 1.0) if self.ior > 1 else 1.0
        bounced = self.bounced * (SPREAD_BOUNCED + SPREAD_BOUNCED_TEXEL * self.texels)
        if is_wide:
            choice = CHOICE[is_plain] + CHOICE_OF_PLANE * (self.planes - 1)
            return bounced + choice + slab * WIDE[is_plain] * self.texels
        return bounced + (slab * LAMPS[is_plain] if self.lamps else SUNS) * self.texels


def share_of_rays(blocked: float | None) -> float:
    """Part of all rays that a texel takes after the first pass, of whose light a part is blocked.

    None: no light can arrive. Where all or nothing is blocked, the first rays are enough, about.
    """
    if blocked is None or not 0 < blocked < 1:
        return 0.0
    if blocked >= 0.5:
        return 1.0
    blocked = min(blocked + 1 / RAYS_AROUND, 0.5)
    return min((BLOCKED_NOISE * (2 * blocked) ** 0.25 / (2 * (1 - blocked))) ** NOISE_POWER, 1.0)


def traced_rays(rays: float, share: float) -> float:
    """Number of rays to a light that a texel traces towards obstacles, the first pass included."""
    return rays if rays <= MIN_RAYS else MIN_RAYS + share * rays


def _share_of(name: str, shares: Shares | None, triangles: int) -> float:
    """The share of a light; two triangles are the receiver itself."""
    if triangles <= 2:
        return 0.0
    return SOME_BLOCKED if shares is None else shares.get(name, SOME_BLOCKED if shares else 0.0)


def channels_of(surface: Surface, lights: Sequence[Light]) -> int:
    """Number of channels whose light is computed on surfaces that bend: those of one medium share it."""
    colors = [np.array(light.rgb()) for light in lights]
    is_colored = any(light.is_colored for light in lights) or any(
        not np.allclose(color * colors[0].sum(), colors[0] * color.sum(), rtol=1e-5) for color in colors
    )
    material = surface.material
    of_channels = material.mean_free_path, surface.base_color or material.albedo, material.channel_anisotropy
    return 3 if is_colored else len(set(zip(*of_channels)))


def workloads_of(
    grids: Sequence[AnyGrid], surface: Surface, settings: BakeSettings, shares: Sequence[Shares | None], **rest
) -> list[Workload]:
    """The workload of light on each side of the grids that counts; arguments as of `Workload.of`, `shares` of each."""
    sides = [grids, *([backs_of(grids)] if has_back(surface.thickness, settings) else [])]
    known = rest | {"surface": surface, "settings": settings}
    loads = [Workload.of(side, shares=of_side, **known) for side, of_side in zip(sides, shares)]
    return [load for load in loads if load.is_lit()] or loads[:1]


def _rays(
    grid: AnyGrid, lights: Sequence[Light], surface: Surface, settings: BakeSettings, unknown: float
) -> tuple[float, list[tuple[Light, float]]]:
    """Rays of each texel, and those to each light, which reaches the grid; lights share them by irradiance.

    `unknown`: as for `Workload.of`.
    """
    if settings.layer in WITHOUT_MEDIUM:
        rays = _traced(rays_without_medium(settings))
        return rays, [(light, rays) for light in lights]
    rays = rays_per_texel(grid, surface.material, settings)
    if len(lights) == 1 or not any(light.has_size for light in lights):
        return _traced(rays), [(light, _traced(rays * (1 - unknown))) for light in lights]
    means = [mean_open_irradiance(grid, [light], SURVEY_TEXELS) for light in lights]
    total = sum(means) / (1 - unknown) or 1.0
    return _traced(rays), [(light, _traced(rays * mean / total)) for light, mean in zip(lights, means)]


def _traced(rays: float) -> float:
    """Rays that are traced where so many are wanted: a power of two."""
    return 2.0 ** math.floor(math.log2(max(rays, MIN_RAYS)))


def simulation_seconds(media: Sequence, settings: BakeSettings, is_bent: bool = False) -> float:
    """Seconds in which media are simulated, for surfaces that bend also on curves."""
    return sum(parallel_seconds(_simulation(medium, settings.quality, is_bent), settings.threads) for medium in media)


def _simulation(medium, quality: str, is_bent: bool) -> float:
    per_angle = min(SLAB_ANGLE * math.sqrt(max(medium.thickness / SLAB_THICKNESS, 1.0)), HALF_SPACE_ANGLE)
    plane = per_angle * len(angles_for(medium)) * PHOTONS[quality] / PHOTONS["final"]
    if not is_bent:
        return plane
    beams = len(curvatures_for(medium)) * len(curved_angles_for(medium))
    photon = CURVED_PHOTON * transport_length(medium) * medium.ior**2
    return plane * (not is_known(medium, quality)) + photon * beams * curved_photons_for(medium, quality)


def parallel_seconds(seconds: float, threads: int) -> float:
    """Seconds of work that takes one thread this long; `threads`: 0 for all."""
    return seconds / (threads or os.cpu_count() or 1) ** THREADS_POWER


def textured_seconds(texels: int, threads: int, is_bent: bool = False) -> float:
    """Seconds in which light is found in the albedos of texels."""
    if is_bent and texels:
        return parallel_seconds(BENT_TEXTURED + BENT_TEXTURED_ROOT * math.sqrt(texels), threads)
    return parallel_seconds(TEXTURED * texels, threads)


def cycles_light_seconds(world: bool, lamps: int, bounced: float, triangles: int) -> float:
    """Seconds in which Cycles renders the world, finds light of lamps, and in so many more bounced light."""
    lights = CYCLES_WORLD * world + CYCLES_LAMP * lamps + CYCLES_BOUNCED * (bounced > 0)
    return CYCLES_START + parallel_seconds(lights, 0) + bounced + CYCLES_TRIANGLE * triangles


def cycles_color_seconds(texels: int) -> float:
    """Seconds in which Cycles evaluates a base color."""
    return CYCLES_START + parallel_seconds(CYCLES_COLOR * texels, 0)
