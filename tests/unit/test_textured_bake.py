"""Bakes of planes whose texels have albedos of their own: what surrounds the planes, and which light stands for all."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, convolve, library
from beamspread.core.bake.directions import DirectionClasses, Splitter
from beamspread.core.bake.spreading import FINAL_EFFORT
from beamspread.core.bake.surface import Surface
from beamspread.core.bake.textured_bake import arriving_beams, continued
from beamspread.core.ldf.reflectance_table import exact_table, reflectance_table
from beamspread.core.material import Material
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight, WorldLight
from beamspread.core.scene.texture import BaseColor, Texture, TextureUse

from bakes import SETTINGS, bake, bake_job, bake_together, square

SIZE, PITCH, G = 32, 0.01, 0.8
MATERIAL = Material(albedo=(0.5,) * 3, mean_free_path=(PITCH,) * 3, anisotropy=G)
COMMON = "Light", 1.0, (1.0, 1.0, 1.0), True
DOWN = 0.0, 0.0, -1.0
SUN = SunLight(*COMMON, DOWN)
STRIPES = np.where(np.arange(SIZE) % 8 < 4, 0.95, 0.85)[None, :, None] * np.ones((SIZE, 1, 3), np.float32)
STRIPES = STRIPES.astype(np.float32)


def grid(albedo=STRIPES, **values):
    return replace(square(SIZE, side=SIZE * PITCH), albedo=albedo, **values)


def baked(of, lights=(SUN,), thickness=0.0):
    return bake(of, Illumination(lights), MATERIAL, thickness, SETTINGS)


def by_script(irradiance, albedo=STRIPES[..., 0], direction=DOWN):
    return convolve(irradiance, direction, library(Medium(G), "preview"), albedo, 1.0, 1.0)


def distance(ours, truth):
    return np.abs(ours - truth).mean() / truth.mean()


# Noise of 2 and 1 %, root mean square: mean distances are .8 of these, together below .02.
SAME = 0.02


def test_a_hole_is_dark_and_lets_light_leave():
    """A script gets the same by an irradiance of 0 in the hole and the albedo around it."""
    coverage = np.ones((SIZE, SIZE), np.float32)
    coverage[8:20, 8:20] = 0
    wild = STRIPES.copy()
    wild[8:20, 8:20] = 0.1  # nothing of it shows
    ours = baked(grid(wild, coverage=coverage))
    around = continued(STRIPES[..., 0], coverage > 0)
    assert distance(ours, by_script(coverage, around)) < SAME


def test_planes_have_albedos_of_their_own():
    """The second plane is darker; each is as if baked alone, though both share the convention's medium."""
    planes = [grid(), grid(STRIPES - np.float32(0.25), origin=(5.0, 0.0, 0.0))]
    together = bake_together(planes, Illumination([SUN]), MATERIAL, 0.0, SETTINGS)
    for plane, ours in zip(planes, together):
        # The dark one has the noise of its brightest walks.
        assert distance(ours, by_script(np.ones((SIZE, SIZE)), plane.albedo[..., 0])) < 2 * SAME


def test_base_colors_become_albedos_by_the_medium():
    table = reflectance_table(library(Medium(G), "preview"))
    colors = np.repeat(table.reflectance(STRIPES[..., :1]), 3, axis=2).astype(np.float32)
    ours = baked(replace(grid(None), base_color=colors))
    np.testing.assert_allclose(ours, baked(grid()), rtol=1e-3)


def test_mirrors_make_an_endless_pattern():
    """A sun straight above an endless pattern, that of a mirrored plane: as the middle of a large plane."""
    tiled = np.pad(STRIPES[..., 0], SIZE, mode="symmetric")
    ours = baked(grid(mirrored=SIZE * PITCH))
    truth = by_script(np.ones(tiled.shape), tiled)[SIZE:-SIZE, SIZE:-SIZE]
    assert distance(ours, truth) < SAME


def test_mirrors_repeat_where_light_goes_farther_than_the_plane():
    """Paths of 4 texels in a strip of 8: its mirror images have mirror images. By images of the plane alone the sum is
    off by 5 %.
    """
    material = replace(MATERIAL, mean_free_path=(4 * PITCH,) * 3)
    strip = grid(STRIPES[:, :8], width=8, coverage=np.ones((SIZE, 8), np.float32), mirrored=10.0)
    ours = bake(strip, Illumination([SUN]), material, 0.0, SETTINGS)
    tiled = np.pad(STRIPES[:, :8, 0], 5 * SIZE, mode="symmetric")
    truth = convolve(np.ones(tiled.shape), DOWN, library(Medium(G), "preview"), tiled, 4.0, 1.0)
    truth = truth[5 * SIZE : -5 * SIZE, 5 * SIZE : -5 * SIZE]
    assert ours.mean() == pytest.approx(truth.mean(), rel=0.02)


def test_both_sides_of_a_slab_count():
    """Light on the back crosses, or not: as scripts of each side together."""
    thickness, below = 3 * PITCH, SunLight(*COMMON, (0.0, 0.0, 1.0))
    ours = baked(grid(), [SUN, below], thickness)
    even, ldf = np.ones((SIZE, SIZE)), library(Medium(G, 1.0, 3.0), "preview")
    sides = [convolve(even, DOWN, ldf, STRIPES[..., 0], 1.0, 1.0, side=side) for side in ("reflected", "transmitted")]
    assert distance(ours, sum(sides)) < SAME


def test_a_job_from_a_file_is_the_same():
    texture_grid = grid(None)
    job = bake_job([SUN], surface=Surface(MATERIAL), grid=texture_grid)
    color = BaseColor(Texture(job.receiver, (STRIPES,), TextureUse(is_albedo=True)))
    job = job.colored(color)
    again = pickle.loads(pickle.dumps(job))
    np.testing.assert_array_equal(job.run().texture, again.run().texture)
    # The surface has the color of the mean albedo, by exact totals.
    mean = exact_table(Medium(G)).reflectance(STRIPES[..., 0]).mean()
    assert job.surface.base_color[0] == pytest.approx(mean, rel=1e-3)


def test_samples_have_no_texture_and_say_so():
    job = bake_job([SUN], settings=replace(SETTINGS, distributions="angular"), grid=grid(None))
    color = BaseColor(Texture(job.receiver, (STRIPES,), TextureUse()))
    (message,) = job.colored(color).illumination.messages
    assert "LDF samples have one albedo" in str(message)
    (chart,) = job.colored(color).receiver.charts
    assert chart.grid.base_color is None
    assert chart.grid.color_in is not None


def test_few_beams_have_all_the_light_of_a_scene():
    """Two suns keep their directions; a lamp and the sky share at most sixteen."""
    slanted = SunLight(*COMMON, (0.6, 0.0, -0.8))
    sky = WorldLight(*COMMON, np.ones((1, 1, 3), np.float32), tuple(map(tuple, np.eye(3).tolist())))
    lamp = PointLight(*COMMON, (0.0, 0.0, 0.05))
    lights = [SUN, slanted, lamp, sky]
    beams = arriving_beams(grid(), Illumination(lights), SETTINGS, FINAL_EFFORT)
    assert 4 <= len(beams) <= 18
    ways = np.array([way for _, way in beams])
    for sun in (SUN, slanted):
        assert (ways @ np.array(sun.direction)).max() > 1 - 1e-6
    total = sum(light.sum() for light, _ in beams)
    alone = [arriving_beams(grid(), Illumination([light]), SETTINGS, FINAL_EFFORT) for light in lights]
    assert total == pytest.approx(sum(light.sum() for beams in alone for light, _ in beams), rel=1e-5)
    # Even light from all around has two thirds of its irradiance's flow.
    flow = sum(light.sum() / 3 * way for light, way in alone[3]) / (sum(light.sum() for light, _ in alone[3]) / 3)
    assert flow == pytest.approx((0, 0, -2 / 3), abs=0.03)


def test_weights_of_directions_are_those_of_their_exact_angles():
    """NumPy's single precision has other last bits where an array follows another in memory: bakes would differ."""
    random = np.random.default_rng(3)
    way = random.normal(size=(64, 64, 3))
    way[..., 2] = -np.abs(way[..., 2])
    way = (way / np.linalg.norm(way, axis=-1, keepdims=True)).astype(np.float32)
    weights = list(DirectionClasses((20.0, 70.0), (0.0,), False).weights(way))
    low, high = (math.cos(math.radians(angle)) for angle in (70, 20))
    steep = np.clip((-way[..., 2].astype(float) - low) / (high - low), 0, 1).astype(np.float32)
    # A unit in the last place of 1: exact angles, rounded to 1e-7 degrees, may be next to a number halfway.
    np.testing.assert_allclose(weights[0], steep, rtol=0, atol=6e-8)
    np.testing.assert_allclose(weights[1], 1 - steep, rtol=0, atol=6e-8)


def test_a_splitter_without_light_has_no_beams():
    dark = np.zeros((4, 4)), np.broadcast_to(np.array(DOWN), (4, 4, 3))
    splitter = Splitter.of([dark])
    splitter.add(0, np.zeros((4, 4, 3)), dark[1])
    assert splitter.beams == []


def test_unknown_texels_continue_those_beside():
    values, known = np.full((9, 13), 7.0), np.zeros((9, 13), bool)
    values[:, :4], known[:, :4] = 1.0, True
    np.testing.assert_array_equal(continued(values, known), 1.0)
    assert math.isclose(continued(values, np.ones_like(known)).max(), 7.0)
