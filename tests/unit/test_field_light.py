"""Light computed elsewhere: its strata, its interpolation, and bakes of it against the light that it stands for."""

import re
from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.bake.bake_settings import IRRADIANCE, BakeSettings
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.layers import arrive
from beamspread.core.bake.steps import Solve, Step
from beamspread.core.bake.surface import Surface
from beamspread.core.ldf.library import library
from beamspread.core.material import Material
from beamspread.core.native import native
from beamspread.core.scene.chart import Chart, ChartIsland
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import DIRECTIONS, STRATA, WEIGHTS, AreaLight, Field, FieldLight, SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh
from beamspread.core.scene.receiver import Receiver

from bakes import SETTINGS, bake, bake_job, square
from shapes import FACES

WHITE = 1.0, (1.0, 1.0, 1.0), True


def grid_of(height, width, origin=(1.0, 2.0, 3.0)):
    return square(width, 0.1 * width, height, origin)


def light_of(grid, radiance):
    return FieldLight("Bounced", *WHITE, (Field(grid.origin, grid.normal, radiance.astype(np.float32)),))


def totals(grid, light):
    """Irradiance and flow of the light on each texel."""
    return arrive(grid, Illumination([light]), BakeSettings())


def test_strata_share_the_hemisphere_and_directions_are_in_their_middle():
    count = 400_000
    squared, turn = np.random.default_rng(1).random((2, count))
    begin, reach, first, part = STRATA.T[:, :, None]
    inside = (begin <= squared) & (squared < begin + reach) & (first <= turn) & (turn < first + part)
    assert (inside.sum(axis=0) == 1).all()
    stratum = inside.argmax(axis=0)
    counts = np.bincount(stratum, minlength=len(STRATA))
    # Five standard deviations of a binomial count, and of a mean: within one stratum cosines differ by at most .2.
    expected = count * WEIGHTS
    assert (np.abs(counts - expected) < 5 * np.sqrt(expected)).all()
    cosine = np.bincount(stratum, weights=np.sqrt(1 - squared)) / counts
    assert (np.abs(cosine + DIRECTIONS[:, 2]) < 5 * 0.2 / np.sqrt(expected)).all()
    np.testing.assert_allclose(np.linalg.norm(DIRECTIONS, axis=1), 1, rtol=1e-6)
    azimuth = np.arctan2(-DIRECTIONS[:, 1], -DIRECTIONS[:, 0]) / (2 * np.pi) % 1
    np.testing.assert_allclose(azimuth, STRATA[:, 2] + STRATA[:, 3] / 2, atol=1e-6)
    # Even light flows nowhere.
    np.testing.assert_allclose(WEIGHTS @ DIRECTIONS[:, :2], 0, atol=1e-7)


@pytest.mark.parametrize(("texels", "nodes"), [(64, 16), (50, 7), (9, 9), (5, 1), (5, 2), (4, 8)])
def test_interpolation_is_exact_for_straight_lines(texels, nodes):
    """In float32: within 1e-5 of the largest value."""
    line = 2 + 3 * (np.arange(nodes) + 0.5) / nodes if nodes > 1 else np.array([2.0])
    expected = 2 + 3 * (np.arange(texels) + 0.5) / texels if nodes > 1 else np.full(texels, 2.0)
    radiance = np.zeros((len(STRATA), nodes, 1, 3))
    radiance[:] = line[:, None, None]
    grid = grid_of(texels, 3)
    irradiance, _ = totals(grid, light_of(grid, radiance))
    np.testing.assert_allclose(irradiance[:, 1, 0], np.pi * expected, rtol=1e-5)


def test_irradiance_and_flow_of_a_sloping_field():
    grid = grid_of(40, 60)
    slope = (np.arange(15) + 0.5) / 15
    radiance = np.zeros((len(STRATA), 10, 15, 3))
    radiance[3], radiance[20] = slope[:, None] * (1, 2, 3), 0.5
    irradiance, flow = totals(grid, light_of(grid, radiance))
    x = ((np.arange(60) + 0.5) / 60)[None, :, None]
    one, other = np.pi * WEIGHTS[3], np.pi * WEIGHTS[20]
    expected = np.broadcast_to(one * x * (1, 2, 3) + other * 0.5, (40, 60, 3))
    np.testing.assert_allclose(irradiance, expected, rtol=1e-4)
    expected = one * 2 * x * DIRECTIONS[3] + other * 0.5 * DIRECTIONS[20]
    np.testing.assert_allclose(flow, np.broadcast_to(expected, (40, 60, 3)), rtol=1e-4, atol=1e-6)


def test_no_negatives_and_no_overshoot_at_steps():
    grid = grid_of(64, 64)
    radiance = np.zeros((8, 8, 3)) + 0.1
    radiance[:, 4:], radiance[3, 1] = 5.0, 40.0
    radiance[:, 0] = 0.0001
    for part in range(0, len(STRATA), 5):
        alone = np.zeros((len(STRATA), 8, 8, 3))
        alone[part] = radiance
        irradiance, _ = totals(grid, light_of(grid, alone))
        assert irradiance.min() >= 0
        # Only beyond the outermost nodes, where it goes on in a straight line, may it pass the largest.
        assert irradiance[4:-4, 4:-4].max() <= 40 * np.pi * WEIGHTS[part] * 1.0001


def test_dark_nodes_don_t_darken_their_neighbours():
    grid = grid_of(64, 64)
    radiance = np.ones((len(STRATA), 16, 16, 3))
    radiance[:, 6:10, 6:10] = 0  # inside a box that covers rows and columns 24 to 40
    irradiance, _ = totals(grid, light_of(grid, radiance))
    box = np.zeros((64, 64), bool)
    box[24:40, 24:40] = True
    np.testing.assert_allclose(irradiance[~box], np.pi, rtol=1e-5)
    assert irradiance[30:34, 30:34].max() == 0


def test_a_bake_can_stop():
    grid = grid_of(64, 64)
    light = light_of(grid, np.ones((len(STRATA), 4, 4, 3)))
    asked = []
    with pytest.raises(native.Cancelled):
        arrive(grid, Illumination([light]), BakeSettings(), lambda fraction: asked.append(fraction) or False)
    assert len(asked) == 1


def test_no_light_flows_upward():
    """Light that falls steeply is not extrapolated below zero beyond the outermost nodes."""
    grid = grid_of(64, 64)
    radiance = np.random.default_rng(2).random((len(STRATA), 8, 8, 3)) ** 8
    radiance[:, :, 0] = radiance[:, 0] = 0
    irradiance, flow = totals(grid, light_of(grid, radiance))
    assert irradiance.min() >= 0
    assert flow[..., 2].max() <= 0


def test_other_planes_get_nothing():
    light = light_of(grid_of(8, 8), np.ones((len(STRATA), 2, 2, 3)))
    other = grid_of(8, 8, origin=(0.0, 0.0, 0.0))
    assert light.is_behind(other)
    assert not light.is_behind(grid_of(8, 8))
    assert not totals(other, light)[0].any()


def test_even_light_bakes_as_a_white_world_does():
    """32 directions stand for the hemisphere: the luminance agrees within 1 %, the world's own noise included."""
    grid = grid_of(24, 24)
    material = Material(albedo=(0.9, 0.8, 0.5), mean_free_path=(0.1, 0.1, 0.1), anisotropy=0.8, ior=1.4)
    settings = BakeSettings(samples=8)
    field = light_of(grid, np.ones((len(STRATA), 4, 4, 3)))
    world = WorldLight("World", *WHITE, np.ones((8, 16, 3), np.float32), ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    baked, expected = (bake(grid, Illumination([light]), material, 0.0, settings) for light in (field, world))
    np.testing.assert_allclose(baked.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.01)
    np.testing.assert_allclose(baked, expected, rtol=0.03)


@pytest.mark.parametrize("is_sun", [False, True])
def test_light_of_a_lamp_comes_from_its_position(is_sun):
    grid = replace(grid_of(10, 20), x_axis=(0.0, 1.0, 0.0), y_axis=(-1.0, 0.0, 0.0))
    radiance = np.ones((1, 5, 10, 3), np.float32) * (1, 2, 3)
    source = {"direction": (0.0, 0.6, -0.8)} if is_sun else {"position": (0.95, 2.45, 5.0)}
    light = FieldLight("Lamp", *WHITE, (Field(grid.origin, grid.normal, radiance),), **source)
    irradiance, flow = totals(grid, light)
    np.testing.assert_allclose(irradiance, np.pi * np.broadcast_to((1, 2, 3), (10, 20, 3)), rtol=1e-5)
    direction = flow / (2 * np.pi)
    if is_sun:
        np.testing.assert_allclose(direction, np.broadcast_to((0.6, 0.0, -0.8), (10, 20, 3)), atol=1e-6)
    else:
        # Straight above the fifth texel of the first row, and 1 beside the lamp.
        np.testing.assert_allclose(direction[0, 4], (0, 0, -1), atol=1e-6)
        np.testing.assert_allclose(direction[0, 14], np.array((1, 0, -2)) / 5**0.5, atol=1e-6)


def test_a_job_bakes_the_light_that_it_finds():
    """Found once for the whole receiver, before anything says that the job is dark, and cancelled with it."""
    grid = grid_of(8, 8)
    receiver = Receiver(grid.coverage, (Chart(grid, (ChartIsland(grid.coverage, (0, 0)),)),))
    seen = []

    class FindLight(Step):
        finds_light = True

        def run(self, job, progress):
            seen.append(job.receiver)
            progress.check(0.5)
            light = light_of(grid, np.ones((len(STRATA), 2, 2, 3)))
            return replace(job, illumination=job.illumination.lit_by([light]))

    surface = Surface(Material(albedo=(0.9,) * 3, mean_free_path=(0.1,) * 3))
    settings, steps = BakeSettings(layer=IRRADIANCE), (FindLight(), Solve())
    job = BakeJob("Floor", receiver, Illumination([]), surface, settings, steps)
    assert job.messages() == []
    np.testing.assert_allclose(job.run().texture, np.pi, rtol=1e-5)
    assert seen == [receiver]
    with pytest.raises(native.Cancelled):
        job.run(lambda _fraction: False)


def test_noise_counts_all_light():
    """A lamp that is seen through a hole lacks rays; other light hides its noise in proportion."""
    grid = square(48, 4.0)
    lamp = AreaLight("Lamp", 1.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 2.0), np.eye(3), 1.0, 1.0, False, np.pi)
    hole = [(-3, -0.05, -3, 3), (0.05, 3, -3, 3), (-0.05, 0.05, -3, -0.05), (-0.05, 0.05, 0.05, 3)]
    corners = np.array([[(x0, y0, 1), (x1, y0, 1), (x1, y1, 1), (x0, y1, 1)] for x0, x1, y0, y1 in hole], float)
    ceiling = Mesh(corners.reshape(-1, 3), np.concatenate([FACES + 4 * i for i in range(len(hole))]))

    def noise(*lights):
        """Reported irradiance, and the noise that the job names, %."""
        job = bake_job(lights, ceiling, settings=replace(SETTINGS, layer=IRRADIANCE), grid=grid)
        (text,) = [message.text for message in job.run().messages() if message.text.startswith("Direct light")]
        return float(re.search(r"(\d+) %", text).group(1))

    stored = light_of(grid, np.full((len(STRATA), 2, 2, 3), 1e-3))
    assert stored.mean_irradiance(grid) == pytest.approx(np.pi * 1e-3, rel=1e-6)
    assert stored.mean_irradiance(square(8, 2.0)) == 0
    direct = totals_through(lamp, ceiling, grid)
    # Each is rounded to 1 %.
    alone, together = noise(lamp), noise(lamp, stored)
    assert together == pytest.approx(alone * direct / (direct + np.pi * 1e-3), abs=1.0)
    assert together < 0.7 * alone


def totals_through(lamp, occluders, grid):
    return float(arrive(grid, Illumination([lamp], occluders), replace(SETTINGS, samples=8))[0].mean())


def test_reflectance_of_a_surface():
    """Reflectance of the library under even light: its calibration is right to .1 %, the sum over eight angles to .3
    %.
    """
    material = Material(albedo=(0.9, 0.5, 0.99), mean_free_path=(0.1,) * 3, anisotropy=0.8, ior=1.4)
    expected = [library(native.Medium(g=0.8, ior=1.4)).diffuse_reflectance(albedo) for albedo in material.albedo]
    np.testing.assert_allclose(Surface(material).reflectance(), expected, rtol=4e-3)
    assert Surface(material, base_color=(0.1, 0.2, 0.3)).reflectance() == [0.1, 0.2, 0.3]


@pytest.mark.parametrize("faintest", [1e-22, 1e-44])
def test_the_faintest_light_has_a_direction(faintest):
    """Values whose squares underflow in single precision, and values that underflow themselves."""
    grid = grid_of(24, 24)
    radiance = np.full((len(STRATA), 4, 4, 3), faintest) * np.random.default_rng(2).random((len(STRATA), 1, 1, 1))
    radiance[:, :, :2] = 1.0
    material = Material(albedo=(0.9,) * 3, mean_free_path=(0.1,) * 3, anisotropy=0.0, ior=1.0)
    field = light_of(grid, radiance)
    baked = bake(grid, Illumination([field]), material, 0.0, BakeSettings(quality="preview"))
    assert np.isfinite(baked).all()
    assert baked[:, 0].min() > 0


SLOPING = Material(albedo=(0.9, 0.8, 0.5), mean_free_path=(0.1, 0.2, 0.05), anisotropy=0.8, ior=1.0)


def uneven(nodes, seed=3):
    """Light of all parts, so noisy that straight lines beyond the border fall below 0, with an object's inside."""
    radiance = 1e-3 + np.random.default_rng(seed).random((len(STRATA), nodes, nodes, 3)) ** 4
    radiance[:, 3:5, 2:4] = 0.0
    return radiance


@pytest.mark.parametrize(("texels", "nodes"), [(48, 8), (30, 9), (6, 12)])
def test_moments_at_nodes_are_those_of_all_rays(texels, nodes):
    """All parts in one light are summed at the nodes; each in a light of its own is added ray by ray.

    The same terms, hence the same luminance but for rounding of single precision, in sums of some hundred rays.
    """
    random = np.random.default_rng(4)
    colors = random.random((2, texels, texels, 3)).astype(np.float32)
    coverage = random.random((texels, texels)).astype(np.float32)
    grid = replace(grid_of(texels, texels), coverage=coverage, color_in=colors[0], color_out=colors[1])
    source = library(native.Medium(g=0.8, ior=1.0))
    pitch = [grid.pitch_y, grid.pitch_x]
    field = native.LightField(
        (texels, texels), [source] * 3, SLOPING.albedo, SLOPING.mean_free_path, pitch, 88.0, 0.02, True
    )
    radiance = uneven(nodes).astype(np.float32)
    solid, strength = (np.pi * WEIGHTS).astype(np.float32), [2.0, 0.5, 1.0]
    together = [(native.FieldLight(radiance, solid, DIRECTIONS), strength, None)]
    apart = [
        (native.FieldLight(radiance[i : i + 1], solid[i : i + 1], DIRECTIONS[i : i + 1]), strength, None)
        for i in range(len(STRATA))
    ]
    by_nodes, by_rays = (field.luminance(grid.surface(), lights) for lights in (together, apart))
    assert by_rays.min() >= 0
    assert by_rays.max() > 0
    np.testing.assert_allclose(by_nodes, by_rays, atol=2e-6 * by_rays.max(), rtol=0)


def test_terms_of_smooth_light_are_few_and_enough():
    """Against a solver that adds all rays, within a thousandth of the mean; with all terms 2e-6 are left."""
    grid = replace(grid_of(40, 40), coverage=np.tri(40, dtype=np.float32))
    radiance = np.random.default_rng(5).random((len(STRATA), 4, 4, 3))
    light = Illumination([light_of(grid, radiance)])
    by_fft, by_direct = (
        bake(grid, light, SLOPING, 0.0, BakeSettings(quality="preview", solver=solver)) for solver in ("fft", "direct")
    )
    np.testing.assert_allclose(by_fft, by_direct, atol=1e-3 * by_direct.mean(), rtol=0)


@pytest.mark.parametrize("name", ["lamp", "sun"])
def test_terms_of_smooth_light_are_enough_in_the_shadow_of_a_bright_light(name):
    """The other light, 150 times as strong, would hide errors of faint light that is alone in its shadow.

    Against a solver that adds all rays: a twentieth of a bake's tolerance of 5e-3, root mean square, relative to the
    geometric mean of both lights, is 3.1e-3 of the faint one. Relative to all light it would be ten times as much.
    """
    grid = replace(grid_of(40, 40), coverage=np.tri(40, dtype=np.float32))
    faint = light_of(grid, np.random.default_rng(5).random((len(STRATA), 4, 4, 3)))
    above = np.array(grid.origin) + (2.0, 2.0, 4.0)
    lamp = AreaLight("Lamp", 2e4, (1.0, 1.0, 1.0), True, above, np.eye(3), 1.0, 1.0, False, np.pi)
    sun = SunLight("Sun", 200.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))
    lid = Mesh(np.float64([(-99, -99, 0), (99, -99, 0), (99, 99, 0), (-99, 99, 0)]) + above - (0, 0, 1), FACES)
    light = Illumination([{"lamp": lamp, "sun": sun}[name], faint], lid)
    by_fft, by_direct = (
        bake(grid, light, SLOPING, 0.0, BakeSettings(quality="preview", solver=solver)) for solver in ("fft", "direct")
    )
    error = np.sqrt(np.mean((by_fft - by_direct) ** 2)) / by_direct.mean()
    assert error < 3.1e-3


def test_threads_change_no_bit():
    grid = grid_of(40, 50)
    light = Illumination([light_of(grid, uneven(8))])
    results = [bake(grid, light, SLOPING, 0.0, BakeSettings(quality="preview", threads=n)) for n in (1, 3)]
    np.testing.assert_array_equal(*results)
