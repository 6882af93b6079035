"""Rays of a grid: shadows against brute force, no noise without them, noise that falls fast, the same bits always."""

import math

import numpy as np
import pytest
from _native_test import irradiance
from beamspread import Cancelled
from beamspread.core.native import native

from shapes import FACES, SQUARE, make_grid, occluders

UP = (0.0, 0.0, 1.0)
FRAME = np.eye(3)
IMAGE = np.random.default_rng(5).random((16, 32, 3)).astype(np.float32)
LIGHTS = {
    "sun": native.SunLight((0.3, 0.2, -1), 0.2),
    "sphere": native.PointLight((0.3, 0.2, 1.0), 0.2, "sphere"),
    "spot": native.SpotLight((0.3, 0.2, 1.0), FRAME, 1.2, 0.5, "scaled", 0.2, "disk"),
    "area": native.AreaLight((0.3, 0.2, 1.0), FRAME, 0.6, 0.4),
    "narrow": native.AreaLight((0.0, 0.0, 1.0), FRAME, 0.6, 0.4, True, 0.6),
    "environment": native.EnvironmentLight(IMAGE, FRAME),
    "mesh": native.MeshLight(0.3 * SQUARE + (0.1, 0, 1), FACES, np.array([(1, 2, 3), (3, 1, 0)], np.float32)),
}


def receiver(texels=16, size=2.0):
    return native.ReceiverGrid(**make_grid(texels, size=(size, size)))


def card(scale=0.25, height=0.4, shift=(0.0, 0.0)):
    return occluders((scale * SQUARE + (*shift, height), FACES))


def wall(x, height):
    """The half plane right of x at a height."""
    return occluders((np.array([(x, -50, height), (50, -50, height), (50, 50, height), (x, 50, height)], float), FACES))


@pytest.mark.parametrize("name", LIGHTS)
def test_without_occluders_there_is_no_noise(name):
    """Any number of rays adds up to the same, which at texels' centres is the light's own irradiance; but for texels
    at the border of a spot that no ray of hundreds finds.
    """
    light, grid = LIGHTS[name], receiver(64)
    few, many = (native.gather_rays(grid, light, rays=rays, seed=rays)[0] for rays in (3, 32))
    np.testing.assert_allclose(few, many, rtol=1e-5, atol=1e-4 * many.max())
    for y, x in ((10, 50), (32, 32)):
        point = (-1 + (x + 0.5) / 32, -1 + (y + 0.5) / 32, 0)
        np.testing.assert_allclose(many[y, x], irradiance(light, point, UP), rtol=3e-3, atol=1e-4 * many.max())


@pytest.mark.parametrize("name", LIGHTS)
def test_without_occluders_few_rays_are_enough(name):
    """An occluder below the plane blocks no ray: without it, texels have as many rays, and the same bits."""
    alone, beside, all_rays = (
        native.gather_rays(receiver(), LIGHTS[name], caster, rays=64, even_rays=even, seed=2)
        for caster, even in ((None, 8), (card(height=-1.0), 8), (None, 0))
    )
    for found, expected in zip(alone, beside):
        np.testing.assert_array_equal(found, expected)
    assert (alone[1] != all_rays[1]).any()


@pytest.mark.parametrize("name", LIGHTS)
def test_a_ray_has_one_direction_toward_the_plane(name):
    irradiance, flow = native.gather_rays(receiver(), LIGHTS[name], card(), rays=1, seed=9)
    assert irradiance.dtype == flow.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(flow, axis=-1), irradiance.mean(axis=-1), rtol=1e-5)
    assert (irradiance >= 0).all()
    assert (flow[irradiance.any(axis=-1)][:, 2] < 0).all()


@pytest.mark.parametrize("name", LIGHTS)
def test_same_bits_for_any_number_of_threads(name):
    light, grid, casters = LIGHTS[name], receiver(40), card()
    one, three = (native.gather_rays(grid, light, casters, rays=7, threads=threads) for threads in (1, 3))
    for a, b in zip(one, three):
        np.testing.assert_array_equal(a, b)


def test_seeds_give_other_rays_of_the_same_mean():
    grid, light, casters = receiver(32), LIGHTS["area"], card()
    fields = np.stack([native.gather_rays(grid, light, casters, rays=4, seed=seed)[0] for seed in range(64)])
    assert (fields[0] != fields[1]).any()
    exact = native.gather_rays(grid, light, casters, rays=4096)[0]
    error = fields.mean(axis=0) - exact
    # Each texel's mean over the seeds, to 5 standard errors and the bias of a ratio of 4 rays.
    assert (np.abs(error) < 5 * fields.std(axis=0) / 8 + 0.01 * exact.max()).all()
    assert fields.mean() == pytest.approx(exact.mean(), rel=2e-3)


def test_half_covered_sun_is_half_as_bright():
    """A wall's edge under the middle of a sun's disk: the visible part of the disk, by the segment of a circle."""
    angle, height, texels = 0.5, 1.0, 200
    grid = receiver(texels, 1.0)
    light = native.SunLight((0, 0, -1), angle)
    got = native.gather_rays(grid, light, wall(0.0, height), rays=256)[0][..., 0]
    x = (np.arange(texels) + 0.5) / texels - 0.5
    # Cosine-weighted light of the cone is even over the projected disk, whose radius is sin(angle / 2); the edge is
    # seen in the plane of directions through it, an ellipse arc on that disk: integrate the rows of directions.
    steps = (np.arange(2000) + 0.5) / 2000 * 2 - 1
    u, v = np.meshgrid(steps, steps)
    disk = u**2 + v**2 < 1
    u, v = u[disk] * math.sin(angle / 2), v[disk] * math.sin(angle / 2)
    across = np.sort(u / np.sqrt(1 - u**2 - v**2)) * height  # where a ray from x = 0 meets the wall's height
    wanted = np.searchsorted(across, -x) / len(across)
    np.testing.assert_allclose(got, np.tile(wanted, (texels, 1)), atol=0.04)
    np.testing.assert_allclose(got.mean(axis=0), wanted, atol=1e-3)


def rms(light, casters, rays, block=1):
    """Noise of means over blocks of texels, relative to the brightest."""
    grid = receiver(32, 1.0)
    exact = native.gather_rays(grid, light, casters, rays=4096, seed=99)[0][..., 0]
    noisy = native.gather_rays(grid, light, casters, rays=rays, seed=1)[0][..., 0]
    error = (noisy - exact).reshape(32 // block, block, 32 // block, block).mean(axis=(1, 3))
    return math.sqrt((error**2).mean()) / exact.max()


@pytest.mark.parametrize("name", ["sun", "sphere", "area", "environment", "mesh"])
def test_noise_falls_faster_than_at_random(name):
    """Random rays: -1/2. A border through the four dimensions of texel and light: -5/8 (Owen 1997); 2 % to spare."""
    light, casters = LIGHTS[name], card(0.2, 0.5, (0.1, 0.1))
    slope = math.log(rms(light, casters, 256) / rms(light, casters, 4)) / math.log(64)
    assert slope < -0.6


@pytest.mark.parametrize("name", ["sphere", "area", "environment"])
def test_errors_of_neighbours_cancel(name):
    """Blocks of 4 x 4 texels: their errors would be a quarter if they were independent; .2 to .21 is measured."""
    light, casters = LIGHTS[name], card(0.2, 0.5, (0.1, 0.1))
    assert rms(light, casters, 16, block=4) < 0.23 * rms(light, casters, 16)


def test_light_and_transmission_are_of_each_channel():
    """A colored sky gives the same light below a card as its channels alone, within the noise of 1024 rays."""
    grid, casters = receiver(8), card()
    whole = native.gather_rays(grid, LIGHTS["environment"], casters, rays=1024)[0]
    for channel in range(3):
        image = np.repeat(IMAGE[..., channel : channel + 1], 3, axis=2)
        alone = native.gather_rays(grid, native.EnvironmentLight(image, FRAME), casters, rays=1024)[0]
        np.testing.assert_allclose(whole[..., channel], alone[..., 0], rtol=0.03)
    assert LIGHTS["environment"].is_colored


def test_a_card_takes_its_form_factor_of_an_even_sky():
    """An even sky less the form factor of the card (Lambert), which the card as a lamp measures."""
    grid = receiver(16)
    sky = native.EnvironmentLight(np.ones((1, 1, 3), np.float32), FRAME)
    got = native.gather_rays(grid, sky, card(0.5, 0.3), rays=1024)[0][..., 0]
    lamp = native.AreaLight((0, 0, 0.3), FRAME, 1, 1)
    covered = native.gather_rays(grid, lamp)[0][..., 0] * 4
    np.testing.assert_allclose(got, math.pi - covered, atol=0.02 * math.pi)
    assert got.mean() == pytest.approx((math.pi - covered).mean(), rel=1e-3)


def test_a_glowing_mesh_does_not_shade_itself():
    """Its own faces stand among the occluders, also where single precision is coarse."""
    corners = 0.3 * SQUARE + (0.1, 0, 1)
    mesh = native.MeshLight(corners, FACES, np.ones((2, 3), np.float32))
    grid = receiver()
    open_light = native.gather_rays(grid, mesh)[0]
    for shift in (0.0, 300.0):
        origin = (0.0, 0.0, shift)
        blocked = native.gather_rays(grid, mesh, occluders((corners, FACES), origin=origin))[0]
        np.testing.assert_allclose(blocked, open_light, rtol=1e-6)


def test_a_lamp_in_the_plane_and_behind():
    grid = receiver()
    behind = native.PointLight((0, 0, -0.5), 0.4, "sphere")
    assert native.gather_rays(grid, behind, card())[0].max() == 0
    half = native.PointLight((0, 0, 0), 0.4, "sphere")
    irradiance, _ = native.gather_rays(grid, half, rays=64)
    assert np.isfinite(irradiance).all()
    # Inside of it light comes from everywhere.
    assert irradiance[8, 8, 0] == pytest.approx(1 / (4 * math.pi * 0.16), rel=1e-5)


def test_progress_and_cancel():
    grid, seen = receiver(), []
    native.gather_rays(grid, LIGHTS["sun"], progress=seen.append, threads=1)
    assert seen[0] == 0
    assert seen[-1] == 1
    with pytest.raises(Cancelled):
        native.gather_rays(grid, LIGHTS["sun"], progress=lambda _: False)


@pytest.mark.parametrize(("name", "value"), [("rays", 0), ("rays", 4097), ("clearance", -1.0), ("clearance", math.inf)])
def test_bad_arguments_are_named(name, value):
    with pytest.raises(ValueError, match=f"argument '{name}' is .*; allowed: "):
        native.gather_rays(receiver(), LIGHTS["sun"], **{name: value})


def test_a_first_pass_keeps_light_and_spares_rays():
    """Rays of all texels against those of shadows' borders alone: in the open both are exact, in all within noise."""
    light, grid, casters = LIGHTS["sphere"], receiver(96), card()
    whole, _ = native.gather_rays(grid, light, casters, rays=256)
    spared = native.gather_rays(grid, light, casters, rays=256, even_rays=8)
    again = native.gather_rays(grid, light, casters, rays=256, even_rays=8, threads=1)
    assert all(np.array_equal(one, other) for one, other in zip(spared, again))
    bare, _ = native.gather_rays(grid, light, rays=16)
    is_open = np.isclose(whole, bare, rtol=1e-5)
    assert 0.5 < is_open.mean() < 0.95
    np.testing.assert_allclose(spared[0][is_open], bare[is_open], rtol=1e-4)
    # A texel in the penumbra has noise below 1e-2; 72 rays of a texel and its neighbors miss as little light.
    assert spared[0].sum() == pytest.approx(whole.sum(), rel=5e-4)
    assert np.abs(spared[0] - whole).max() < 0.04 * bare.max()


def test_noise_is_even_where_obstacles_block_much_and_little_of_the_sky():
    """Texels have rays by the blocked part of the sky; equal numbers leave a third of the noise where it is small.

    A texel's share is that of the form factors of the cards (Lambert). The total is that of all rays from all texels
    within 1e-3: where no first ray of a texel and its neighbors meets a card, as little as 7e-4 of it counts as open.
    """
    grid = receiver(64)
    sky = native.EnvironmentLight(np.ones((1, 1, 3), np.float32), FRAME)
    places = ((-0.6, 0.0, 0.12, 0.5), (0.6, 0.0, 0.35, 0.2))  # x, y, half a side, height
    cards = occluders(*((scale * SQUARE + (x, y, z), FACES) for x, y, scale, z in places))
    lamps = [native.AreaLight((x, y, z), FRAME, 2 * scale, 2 * scale) for x, y, scale, z in places]
    areas = [4 * scale**2 for _, _, scale, _ in places]
    covered = sum(4 * area * native.gather_rays(grid, lamp)[0][..., 0] for lamp, area in zip(lamps, areas)) / math.pi
    few = {"rays": 128, "even_rays": 16}
    bakes = [native.gather_rays(grid, sky, cards, **few, seed=seed)[0][..., 0] / math.pi for seed in range(8)]
    noise = np.std(bakes, axis=0, ddof=1) / (1 - covered)
    little, half = ((covered > low) & (covered < high) for low, high in ((0.02, 0.06), (0.4, 0.6)))
    assert min(little.sum(), half.sum()) > 30
    ratio = math.sqrt((noise[little] ** 2).mean() / (noise[half] ** 2).mean())
    assert 0.6 < ratio < 1.2
    whole = native.gather_rays(grid, sky, cards, rays=1024)[0] / math.pi
    assert np.mean(bakes) == pytest.approx(whole.mean(), rel=1e-3)
