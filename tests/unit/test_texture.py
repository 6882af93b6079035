"""Textures of the base colour: the mean in the medium, the rest on the way in and out."""

import math
from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.bake.layers import arrive
from beamspread.core.material import Material
from beamspread.core.scene.chart import Chart, ChartIsland
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import Receiver, build_receiver
from beamspread.core.scene.texture import mean_color, textured

from bakes import SETTINGS, bake, square

SIZE = 24
MATERIAL = Material(albedo=(0.9, 0.8, 0.7), mean_free_path=(0.02, 0.02, 0.02), anisotropy=0.0)
AXES = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
COMMON = ("Light", 2.0, (1.0, 0.5, 2.0), True)
LIGHTS = {
    "sun": SunLight(*COMMON, (0.6, 0.0, -0.8)),
    "point": PointLight(*COMMON, (0.2, 0.1, 0.7)),
    "area": AreaLight(*COMMON, (0.1, 0.0, 0.8), AXES, 0.5, 0.5, False, math.pi),
}
RANDOM = np.random.default_rng(1)


@pytest.fixture
def grid():
    return square(SIZE)


def luminance(grid, light, **settings):
    return bake(grid, Illumination([LIGHTS[light]]), MATERIAL, 0.0, replace(SETTINGS, **settings))


# The adaptive solver takes each ray of an area light for a light of its own, which takes long and shows nothing new.
@pytest.mark.parametrize(
    ("light", "solver"), [*((light, "fft") for light in LIGHTS), ("sun", "adaptive"), ("point", "adaptive")]
)
def test_light_comes_in_by_the_color_of_each_texel(grid, light, solver):
    """Channel by channel it is as if only a part of each texel were there to be lit."""
    parts = RANDOM.random((SIZE, SIZE, 3), np.float32)
    parts[:, : SIZE // 2, 0] = 0
    found = luminance(replace(grid, color_in=parts), light, solver=solver)
    for channel in range(3):
        covered = luminance(replace(grid, coverage=parts[..., channel].copy()), light, solver=solver)[..., channel]
        assert found[..., channel] == pytest.approx(covered, rel=0.02, abs=0.01 * covered.max())


@pytest.mark.parametrize("light", LIGHTS)
def test_mirror_images_let_in_the_same_colors(grid, light):
    parts = RANDOM.random((SIZE, SIZE, 3), np.float32)
    mirrored = replace(grid, mirrored=0.3)
    found = luminance(replace(mirrored, color_in=parts), light)
    for channel in range(3):
        covered = luminance(replace(mirrored, coverage=parts[..., channel].copy()), light)[..., channel]
        assert found[..., channel] == pytest.approx(covered, rel=1e-3, abs=1e-3 * covered.max())


@pytest.mark.parametrize("light", LIGHTS)
def test_light_that_a_slab_returns_unscattered_has_the_color_of_where_it_entered(grid, light):
    parts = RANDOM.random((SIZE, SIZE, 3), np.float32)
    slab = replace(MATERIAL, ior=1.4), 0.04

    def on_slab(changed):
        return bake(changed, Illumination([LIGHTS[light]]), *slab, SETTINGS)

    found = on_slab(replace(grid, color_in=parts))
    for channel in range(3):
        covered = on_slab(replace(grid, coverage=parts[..., channel].copy()))[..., channel]
        assert found[..., channel] == pytest.approx(covered, rel=1e-3, abs=1e-3 * covered.max())


@pytest.mark.parametrize("light", LIGHTS)
def test_grey_is_the_same_in_every_channel(grid, light):
    grey = np.repeat(RANDOM.random((SIZE, SIZE, 1), np.float32), 3, axis=2)
    covered = luminance(replace(grid, coverage=grey[..., 0].copy()), light)
    assert luminance(replace(grid, color_in=grey), light) == pytest.approx(covered, rel=0.02, abs=0.01 * covered.max())


def test_light_goes_out_by_the_color_of_each_texel(grid):
    out = RANDOM.random((SIZE, SIZE, 3), np.float32)
    assert luminance(replace(grid, color_out=out), "sun") == pytest.approx(luminance(grid, "sun") * out)


def test_irradiance_does_not_depend_on_it(grid):
    dark = np.zeros((SIZE, SIZE, 3), np.float32)
    plain, _ = arrive(grid, Illumination([LIGHTS["sun"]]), SETTINGS)
    assert np.array_equal(arrive(replace(grid, color_in=dark), Illumination([LIGHTS["sun"]]), SETTINGS)[0], plain)


class TestTextured:
    def receiver(self, grid):
        half = grid.coverage.copy()
        half[:, SIZE // 2 :] = 0
        return Receiver(half, (Chart(replace(grid, coverage=half), (ChartIsland(half, (0, 0)),)),))

    def colors(self):
        colors = np.full((SIZE, SIZE, 3), (0.2, 0.4, 0.0), np.float32)
        colors[: SIZE // 2] = (0.6, 0.4, 0.0)
        colors[:, SIZE // 2 :] = 1
        return colors

    def test_the_mean_is_over_covered_texels(self, grid):
        assert mean_color(self.receiver(grid), [self.colors()]) == pytest.approx((0.4, 0.4, 0.0))

    @pytest.mark.parametrize("blur", [0.0, 0.5, 0.8, 1.0])
    def test_in_and_out_together_are_the_color_over_the_mean(self, grid, blur):
        (chart,) = textured(self.receiver(grid), [self.colors()], blur).charts
        ways = chart.grid.color_in * chart.grid.color_out
        assert ways[0, 0] == pytest.approx([1.5, 1, 1])
        assert ways[-1, 0] == pytest.approx([0.5, 1, 1])
        assert chart.grid.color_in[0, 0, 0] == pytest.approx(1.5**blur)

    def test_no_detail_is_no_change(self, grid):
        (chart,) = textured(self.receiver(grid), [np.full((SIZE, SIZE, 3), 0.3, np.float32)], 0.5).charts
        assert chart.grid.color_in == pytest.approx(1)
        assert chart.grid.color_out == pytest.approx(1)


@pytest.mark.parametrize("slant", [0.0, 0.3])
def test_uvs_and_positions_of_a_grid_are_those_of_the_mesh(slant):
    """P = (u + slant v, 2 v, 5) on 0..0.8 x 0.1..0.9: orthogonal texels, or a grid of its own."""
    uvs = np.array([(0, 0.1), (0.8, 0.1), (0.8, 0.9), (0, 0.9)])
    corners = np.stack([uvs[:, 0] + slant * uvs[:, 1], 2 * uvs[:, 1], np.full(4, 5.0)], axis=1)
    polygons = Polygons(corners, uvs, np.array([0, 4]), np.array([(0.0, 0.0, 1.0)]))
    (chart,) = build_receiver(flatten(polygons), 40, 30).charts
    assert (chart.islands[0].texel_to_grid is None) == (slant == 0)
    for at in ((0.5, 0.5), (0.1, 0.7)):
        found, positions = chart.uvs(40, 30, at), chart.grid.positions(at)
        u, v = np.moveaxis(found, -1, 0)
        expected = np.stack([u + slant * v, 2 * v, np.full(u.shape, 5.0)], axis=-1)
        assert positions == pytest.approx(expected, abs=1e-6)
