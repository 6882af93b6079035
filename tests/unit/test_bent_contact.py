"""Things that touch a mesh that bends: the floor below a block, paper on it."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.native import native

from bent_shapes import cube, texels_of
from shapes import FACES, SQUARE, rotation

HALF, SIZE = 0.25, 96
BLOCK = cube(HALF)
WORLD = native.EnvironmentLight(np.ones((2, 4, 3), np.float32), np.eye(3))
TURNS = {"upright": np.eye(3), "turned": rotation(4)}


def turned(mesh, axes, shift):
    return replace(mesh, vertices=mesh.vertices @ axes.T + shift, normals=mesh.normals @ axes.T)


def irradiance(block, *others, light=WORLD):
    texels = texels_of(block, SIZE)
    return texels, native.gather_rays(texels.native(), light, block.occluders(*others), rays=32)[0][..., 0]


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-6, 1e-5])
def test_the_underside_of_a_block_on_a_floor_is_dark(gap, turn):
    """Rays start a thousandth of a texel above a face, here at 2e-5 m, and would miss a floor that is nearer."""
    axes = TURNS[turn]
    block = turned(BLOCK, axes, axes @ (0, 0, HALF + gap))
    texels, alone = irradiance(block)
    _, on_floor = irradiance(block, (60 * SQUARE @ axes.T, FACES))
    below = texels.inside & (texels.normals @ axes[:, 2] < -0.5)
    assert (alone[below] > 3).all()
    assert not on_floor[below].any()
    sides = texels.inside & (abs(texels.normals @ axes[:, 2]) < 0.5)
    # The floor hides half of the sky. A texel of 32 rays has 18 % of noise, their mean below 1 %.
    assert on_floor[sides].mean() == pytest.approx(alone[sides].mean() / 2, rel=0.02)


@pytest.mark.parametrize("height", [-1e-6, 0.0, 1e-6, 1e-5])
def test_paper_shades_the_block_that_it_lies_on(height):
    """Below the face, and in it, it shades nothing, as a decal."""
    paper = 0.5 * HALF * SQUARE + (0, 0, HALF + height), FACES
    texels, lit = irradiance(BLOCK, paper, light=native.SunLight((0, 0, -1), 0.0))
    top = texels.inside & (texels.normals[..., 2] > 0.5)
    away = abs(texels.positions[..., :2]).max(axis=-1)
    assert (lit[top & (away > 0.5 * HALF)] == 1).all()
    assert (lit[top & (away < 0.5 * HALF)] == (height <= 0)).all()
