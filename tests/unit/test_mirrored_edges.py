"""Edges that return light as mirrors: against exact totals of an infinite plane, and against images made by hand."""

import math
from dataclasses import replace

import beamspread
import numpy as np
import pytest
from beamspread.core.bake.edges import texels_with_images, with_edges
from beamspread.core.bake.layers import arrive, mean_direction
from beamspread.core.bake.surface import MIRROR, Surface
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import STRATA, AreaLight, Field, FieldLight, PointLight, SunLight

from bakes import MATERIAL, SETTINGS, bake, bake_together, square

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SUN = SunLight("Sun", 2.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))
LAMP = PointLight("Lamp", 10.0, (1.0, 0.6, 0.3), True, (0.2, 0.1, 0.4))
AREA = AreaLight("Area", 10.0, (1.0, 1.0, 1.0), True, (0.2, 0.1, 0.4), AXES, 0.2, 0.2, False, math.pi)


def mirrored(edges_of=MATERIAL, **changes):
    """The square with mirrors as far as a medium spreads light."""
    ((grid,), messages) = with_edges([replace(square(), **changes)], Surface(edges_of, edges=MIRROR), "Plane")
    assert not messages
    assert grid.mirrored > 0
    return grid


@pytest.mark.parametrize("solver", ["fft", "direct"])
def test_an_evenly_lit_piece_is_as_bright_as_an_infinite_plane(solver):
    """Exact totals; kernels end where a ten-thousandth of the light is beyond, and the tolerance is .5 %."""
    settings = replace(SETTINGS, solver=solver)
    luminance = bake(mirrored(), Illumination([SUN]), MATERIAL, 0.0, settings)
    medium = MATERIAL.medium()
    (reflected, _) = native.exact_totals(medium, [0.0], list(MATERIAL.albedo))
    assert luminance == pytest.approx(np.broadcast_to(2 * reflected[0] / math.pi, luminance.shape), rel=3e-3)
    assert bake(square(), Illumination([SUN]), MATERIAL, 0.0, settings)[0, 0, 0] < 0.95 * luminance[0, 0, 0]


def tiled(values, images, signs=(1, 1)):
    """Images of (H, W, 3) values side by side, every other one flipped, with these signs of x and y in flipped ones."""
    flip = [values, values[:, ::-1] * (signs[0], 1, 1)]
    row = np.concatenate([flip[i % 2] for i in range(images)], axis=1)
    rows = [row, row[::-1] * (1, signs[1], 1)]
    return np.concatenate([rows[i % 2] for i in range(images)], axis=0)


def test_mirror_images_of_a_lamp_are_those_made_by_hand():
    """A fifth of the tolerance of the solver, .5 %, of the brightest texel."""
    grid, images = square(), 9
    irradiance, flow = arrive(grid, Illumination([LAMP]), SETTINGS)
    direction = mean_direction(flow)
    wanted = beamspread.luminance(
        tiled(irradiance, images),
        tiled(direction, images, (-1, -1)),
        MATERIAL,
        (grid.pitch_x, grid.pitch_y),
        quality=SETTINGS.quality,
    )
    middle = images // 2
    height, width = grid.height, grid.width
    wanted = wanted[middle * height : (middle + 1) * height, middle * width : (middle + 1) * width]
    found = bake(mirrored(), Illumination([LAMP]), MATERIAL, 0.0, SETTINGS)
    assert np.abs(found - wanted).max() < 1e-3 * wanted.max()


def test_lights_of_a_size_are_mirrored_as_lamps_are():
    """A small panel lights as a lamp that shines along a cosine; both are brighter at the edges by as much."""
    gain = [
        bake(mirrored(), Illumination([light]), MATERIAL, 0.0, SETTINGS)
        / bake(square(), Illumination([light]), MATERIAL, 0.0, SETTINGS)
        for light in (AREA, LAMP)
    ]
    assert gain[0].max() > 1.1
    assert gain[0] == pytest.approx(gain[1], rel=0.02)


def test_even_light_that_was_computed_elsewhere_makes_a_piece_as_bright_as_an_infinite_plane():
    """Radiance 1 from all directions; parts of the hemisphere are right to .5 %."""
    grid = mirrored()
    radiance = np.ones((len(STRATA), 3, 3, 3), np.float32)
    field = FieldLight("Bounced light", 1.0, (1.0, 1.0, 1.0), False, (Field(grid.origin, grid.normal, radiance),))
    luminance = bake(grid, Illumination([field]), MATERIAL, 0.0, SETTINGS)
    (reflectance, *_) = Surface(MATERIAL).reflectance()
    assert luminance == pytest.approx(np.full(luminance.shape, reflectance), rel=1e-2)


def test_mirror_images_that_would_take_too_much_memory_end_nearer_and_are_named():
    """A plane of 4096^2 texels keeps images within a quarter of its width on each side."""
    texels = np.ones((4096, 4096), np.float32)
    large = replace(square(4096), coverage=texels)
    wide = replace(MATERIAL, mean_free_path=(0.3, 0.3, 0.3))
    (grid,), messages = with_edges([large], Surface(wide, edges=MIRROR), "Plane")
    assert grid.mirrored == pytest.approx(0.25)
    assert texels_with_images(grid) == pytest.approx(2.25 * 4096**2, rel=1e-3)
    (message,) = messages
    assert "Mirrored light of 'Plane' ends 0.25 units beyond the edges" in message.text
    narrow = replace(MATERIAL, mean_free_path=(1e-4, 1e-4, 1e-4))
    assert not with_edges([large], Surface(narrow, edges=MIRROR), "Plane")[1]


def test_a_mirrored_plane_among_others_leaves_them_as_they_are():
    grids = [square() for _ in range(9)]
    open_ones = bake_together(grids, Illumination([LAMP]), MATERIAL, 0.0, SETTINGS)
    mixed = bake_together([mirrored(), *grids[1:]], Illumination([LAMP]), MATERIAL, 0.0, SETTINGS)
    assert all(np.abs(a - b).max() < 1e-3 * b.max() for a, b in zip(mixed[1:], open_ones[1:]))
    assert mixed[0].min() > open_ones[0].min()
