"""Bakes one receiver: beams of each light, spread by the material's LDF, summed to luminance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import BakeError
from .margin import extend_margin
from .material import Material, check_thickness
from .progress import Progress, stages
from .receiver import Receiver
from .samples import load_source
from .scene import Grid, Light, Mesh

# Shares of the time that a bake takes, roughly: simulating an LDF not in the cache, beams and solving of one light.
LIBRARY_WEIGHT, BEAMS_WEIGHT, SOLVE_WEIGHT = 2.0, 1.0, 3.0
LIGHT_WEIGHT = BEAMS_WEIGHT + SOLVE_WEIGHT

# Of the solvers, see `convolve`: half a per cent in the worst texel is not seen, and below the noise of libraries.
TOLERANCE = 5e-3

# Lights solved together; each keeps its irradiance and directions in memory until then.
MOST_LIGHTS_AT_ONCE = 4


@dataclass(frozen=True)
class BakeSettings:
    """How to bake.

    Attributes
    ----------
    solver : "fft", "direct" or "adaptive".
    samples : visibility is sampled at samples x samples points per texel.
    margin : texels added around the chart.
    quality : of the LDF, "final" or "preview".
    distributions : "library", simulated from the material, or the method by which the samples in `sample_folder` are
        interpolated: "angular", "adaptive" or "planar". Samples stand for anisotropy, index of refraction and
        thickness of every material.
    threads : 0 for all.
    """

    solver: str = "fft"
    samples: int = 4
    margin: int = 16
    quality: str = "final"
    distributions: str = "library"
    sample_folder: str = ""
    threads: int = 0


def bake(
    grid: Grid,
    lights: Sequence[Light],
    occluders: Mesh,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Progress | None = None,
) -> np.ndarray:
    """Luminance of a translucent plane.

    Parameters
    ----------
    grid : where light arrives, scene units.
    occluders : triangles that throw shadows, world.
    material : with its mean free path in the units of the grid.
    thickness : in the units of the grid, 0 for a half-space.
    progress : called with 0..1, returns False to stop.

    Returns
    -------
    float32 (grid.height, grid.width, 3), exitance / pi in W/(m^2 sr), row 0 at the bottom.

    Raises
    ------
    MaterialError
        A property outside its range.
    BakeError
        Samples that are missing, damaged, or don't reach the albedos and angles of the scene.
    Cancelled
        `progress` returned False.
    """
    material.check()
    check_thickness(thickness)
    media_progress, *light_progress = stages(progress, [LIBRARY_WEIGHT] + [BEAMS_WEIGHT, SOLVE_WEIGHT] * len(lights))
    if settings.distributions == "library":
        libraries = _libraries(material, thickness, settings.quality, media_progress)
    else:
        libraries = [load_source(settings.sample_folder, settings.distributions)] * 3
    luminance = None
    # Lights of one colour, which comes last, so that the channels share the work on their beams.
    waiting, waiting_color = [], None
    for number, (light, beams_progress, solve_progress) in enumerate(
        zip(lights, light_progress[::2], light_progress[1::2]), 1
    ):
        beams, direction, strength = unit_beams(grid, light, occluders.ray_caster(grid), settings, beams_progress)
        if beams.any() and any(strength):
            beams *= strength.max()
            waiting.append((beams, direction))
            waiting_color = strength / strength.max()
        next_color = np.asarray(lights[number].color, np.float32) if number < len(lights) else None
        if waiting and (
            next_color is None
            or len(waiting) == MOST_LIGHTS_AT_ONCE
            or not np.allclose(next_color, waiting_color * next_color.max(), rtol=1e-5)
        ):
            spread = _spread(waiting, libraries, material, grid, settings, solve_progress)
            if (waiting_color != 1).any():
                spread *= waiting_color
            luminance = spread if luminance is None else np.add(luminance, spread, out=luminance)
            waiting = []
    return np.zeros((grid.height, grid.width, 3), np.float32) if luminance is None else luminance


def bake_texture(
    receiver: Receiver,
    lights: Sequence[Light],
    occluders: Mesh,
    material: Material,
    thickness: float,
    settings: BakeSettings,
    progress: Progress | None = None,
) -> np.ndarray:
    """`bake` on the receiver's grid, brought to the texture and extended into the margin: (height, width, 3)."""
    luminance = bake(receiver.grid, lights, occluders, material, thickness, settings, progress)
    if not np.isfinite(luminance).all():
        raise BakeError("The bake produced values that are not numbers: check the strengths of the lights.")
    return extend_margin(receiver.to_texels(luminance), receiver.coverage > 0, settings.margin)


def light_beams(
    grid: Grid, light: Light, occluders, settings: BakeSettings, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance (H, W, 3) in W/m^2 with colour, cosine, visibility and coverage, and the direction of travel.

    The direction is a unit vector in the plane frame: (3,) for a sun, (H, W, 3) otherwise. `occluders` is a native
    `Occluders` or None.
    """
    beams, direction, strength = unit_beams(grid, light, occluders, settings, progress)
    return beams[..., None] * strength, direction


def unit_beams(
    grid: Grid, light: Light, occluders, settings: BakeSettings, progress: Progress | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Irradiance (H, W) of the light at strength 1, direction as `light_beams` says, and strength times colour (3,)."""
    from .._load import native

    irradiance, direction = native.gather_beams(
        grid.native_grid(),
        light.unit_light(),
        occluders if light.cast_shadow else None,
        samples=settings.samples,
        threads=settings.threads,
        progress=progress,
        clearance=grid.clearance,
    )
    irradiance *= grid.coverage
    return irradiance, direction, np.asarray(light.color, np.float32) * np.float32(light.strength)


def _libraries(material: Material, thickness: float, quality: str, progress: Progress | None) -> list:
    """The LDF library of each channel; channels of the same medium share one."""
    from .._load import native
    from .library import library

    depths = [thickness / length if thickness else math.inf for length in material.mean_free_path]
    channels = list(zip(material.channel_anisotropy, depths))
    distinct = sorted(set(channels))
    by_channel = {}
    for (g, depth), stage in zip(distinct, stages(progress, [1.0] * len(distinct))):
        medium = native.Medium(g=g, ior=material.ior, thickness=depth)
        by_channel[g, depth] = library(medium, quality=quality, progress=stage)
    return [by_channel[channel] for channel in channels]


def _spread(lights, libraries, material: Material, grid: Grid, settings: BakeSettings, progress):
    from .convolve import convolve_lights

    shared = all(library is libraries[0] for library in libraries)
    try:
        return convolve_lights(
            lights,
            libraries[0] if shared else libraries,
            material.albedo,
            material.mean_free_path,
            (grid.pitch_x, grid.pitch_y),
            solver=settings.solver,
            tolerance=TOLERANCE,
            threads=settings.threads,
            progress=progress,
        )
    except ValueError as error:
        if settings.distributions == "library":
            raise
        raise BakeError(f"The LDF samples in '{settings.sample_folder}' don't reach this far: {error}.") from error
