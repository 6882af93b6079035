"""Rims: texels that a plane's edge cuts show the luminance of their part inside."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.bake.finish import lit_rims
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import SunLight

from bakes import MATERIAL, SETTINGS, bake, bake_job, square

SIDE, FINE = 24, 10
SUN = SunLight("Sun", 2.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))


def grid_of(edges, per_texel=1):
    """A square from the first to the last of the edges, texels, on a grid with so many texels along each of those."""
    low, high = edges
    corners = np.array([(low, low), (high, low), (high, high), (low, high)]) * per_texel
    size = SIDE * per_texel
    return replace(square(size), coverage=native.coverage(corners, np.array([4], np.uint32), size, size))


def luminance(grid, material):
    return bake(grid, Illumination([SUN]), material, 0.0, SETTINGS)


# The first errors are of rims as they are solved. All are relative to the brightest texel.
@pytest.mark.parametrize(("edges", "solved", "lit"), [((2.3, 21.6), 0.13, 0.025), ((2.9, 21.3), 0.26, 0.06)])
def test_rims_have_the_luminance_of_their_part_inside(edges, solved, lit):
    """The truth: ten times finer texels, of which none is cut, and the mean of those inside each coarse one."""
    coarse, fine = grid_of(edges), grid_of(edges, FINE)
    inside, blocks = fine.coverage > 0.5, (SIDE, FINE, SIDE, FINE)
    errors = []
    for path in (0.05, 0.5, 3.0):
        for anisotropy in (0.0, 0.8):
            material = replace(MATERIAL, mean_free_path=(path / SIDE,) * 3, anisotropy=anisotropy)
            truth = (luminance(fine, material)[..., 0] * inside).reshape(blocks).sum(axis=(1, 3))
            truth /= np.maximum(inside.reshape(blocks).sum(axis=(1, 3)), 1)
            before = luminance(coarse, material)
            after = lit_rims(before, coarse.coverage, [path / (1 - anisotropy)] * 3)
            # Edges without corners, where two edges cut a texel.
            edge = [line[SIDE // 2, [2, 21]] for line in (truth, before[..., 0], after[..., 0])]
            errors.append([np.abs(values - edge[0]) / truth.max() for values in edge[1:]])
            np.testing.assert_array_equal(after[coarse.coverage > 0.99], before[coarse.coverage > 0.99])
    assert np.mean(errors, axis=(0, 2))[0] > solved
    assert np.mean(errors, axis=(0, 2))[1] < lit


def test_a_bake_has_them_and_irradiance_needs_none():
    grid = grid_of((2.3, 21.6))
    material = replace(MATERIAL, mean_free_path=(0.001,) * 3)
    job = bake_job([SUN], grid=grid)
    job = replace(job, surface=replace(job.surface, material=material))
    texture = job.run().texture
    np.testing.assert_array_equal(
        texture, lit_rims(luminance(grid, material), grid.coverage, [0.024] * 3) * (grid.coverage > 0)[..., None]
    )
    # Within .024 texels light stays near: the rim is as bright as the rest.
    assert texture[12, 2, 0] == pytest.approx(texture[12, 12, 0], rel=0.03)
    irradiance = replace(job, settings=replace(job.settings, layer="Irradiance")).run().texture
    np.testing.assert_allclose(irradiance[grid.coverage > 0], 2.0, rtol=1e-5)


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_planes_without_cut_texels_or_without_whole_ones_stay(value):
    values = np.random.default_rng(1).random((4, 5, 3), np.float32)
    coverage = np.full((4, 5), value or 0.5, np.float32)
    assert lit_rims(values, coverage, [1.0] * 3) is values
