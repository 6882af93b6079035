"""Light through small openings, against closed forms: none of it is lost, and its noise is known.

A visible opening is a polygon, whose irradiance at a point has a closed form (Lambert 1760; Baum et al. 1989, Eq. 6).
Errors of blocks of 12 x 12 texels have noise: that of a texel, some 5 to 50 % at 256 rays, over 12 and more.
"""

import numpy as np
import pytest
from beamspread import Cancelled
from beamspread.core.native import native

from shapes import FACES

TEXELS, BLOCK, HALF = 96, 12, 2.0
UP = (0.0, 0.0, 1.0)
SKY = native.EnvironmentLight(np.ones((4, 8, 3), np.float32), np.eye(3))
RAYS = {"rays": 256, "even_rays": 16}


def receiver(texels=TEXELS, half=HALF):
    return native.ReceiverGrid((-half, -half, 0), (1, 0, 0), (0, 1, 0), UP, *[2 * half / texels] * 2, texels, texels)


def quad(*corners):
    return native.OccluderMesh(np.array(corners, float), FACES)


def level(x0, x1, y0, y1, z):
    return quad((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))


def upright(x, y0, y1, z0, z1):
    return quad((x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1))


def box(size, height, *, open_to_x=False):
    """Walls of a room around the receiver."""
    mirror = np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1]], float)
    faces = [upright(x, -size, size, -0.1, height) for x in ((-size,) if open_to_x else (-size, size))]
    for y in (-size, size):
        corners = np.array([(y, -size, -0.1), (y, size, -0.1), (y, size, height), (y, -size, height)]) @ mirror
        faces.append(native.OccluderMesh(corners, FACES))
    return faces


def irradiance_from(points, corners):
    """Irradiance (N,) on level points (N, 3) from a polygon above them, of radiance 1."""
    towards = np.asarray(corners, float)[None] - points[:, None]
    towards /= np.linalg.norm(towards, axis=2, keepdims=True)
    following = np.roll(towards, -1, axis=1)
    normals = np.cross(towards, following)
    sines = np.linalg.norm(normals, axis=2)
    angles = np.arctan2(sines, (towards * following).sum(axis=2))
    return abs((angles * normals[..., 2] / np.maximum(sines, 1e-300)).sum(axis=1)) / 2


def mean_over_texels(function, texels=TEXELS, half=HALF, steps=3):
    centers = -half + (np.arange(steps * texels) + 0.5) * 2 * half / (steps * texels)
    x, y = np.meshgrid(centers, centers)
    values = function(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1))
    return values.reshape(texels, steps, texels, steps).mean(axis=(1, 3))


def blocks(values):
    return values.reshape(TEXELS // BLOCK, BLOCK, TEXELS // BLOCK, BLOCK).mean(axis=(1, 3))


def hole(width):
    """A room 2 m high, whose ceiling has a square hole."""
    w, size, z = width / 2, 2.2, 2.0
    ceiling = [level(-size, -w, -size, size, z), level(w, size, -size, size, z)]
    ceiling += [level(-w, w, -size, -w, z), level(-w, w, w, size, z)]
    corners = [(-w, -w, z), (w, -w, z), (w, w, z), (-w, w, z)]
    return SKY, native.Occluders(ceiling + box(size, z)), lambda points: irradiance_from(points, corners)


def window():
    """A room 2.5 m high with a window of 1.4 x 1.2 m in one wall."""
    size, height, y, z0, z1 = 2.2, 2.5, 0.7, 0.9, 2.1
    wall = [upright(size, -size, -y, -0.1, height), upright(size, y, size, -0.1, height)]
    wall += [upright(size, -y, y, -0.1, z0), upright(size, -y, y, z1, height)]
    corners = [(size, -y, z0), (size, y, z0), (size, y, z1), (size, -y, z1)]
    room = native.Occluders([level(-size, size, -size, size, height), *wall, *box(size, height, open_to_x=True)])
    return SKY, room, lambda points: irradiance_from(points, corners)


def slit(width=0.02):
    """A glowing wall of 4 x 2 m, half a metre behind a screen with an upright slit."""
    frame = np.array([(1, 0, 0), (0, 0, 1), (0, 1, 0)], float)
    glowing = native.AreaLight((0, 3, 1.0), frame, 4.0, 2.0)
    w, far, y = width / 2, 30.0, 2.5
    screen = [quad((x0, y, -1), (x1, y, -1), (x1, y, far), (x0, y, far)) for x0, x1 in ((-far, -w), (w, far))]

    def exact(points):
        scale = (3 - points[:, 1]) / (y - points[:, 1])
        x0, x1 = (np.clip(points[:, 0] + (x - points[:, 0]) * scale, -2, 2) for x in (-w, w))
        parts = [
            irradiance_from(points[i : i + 1], [(a, 3, 0), (b, 3, 0), (b, 3, 2), (a, 3, 2)])[0]
            for i, (a, b) in enumerate(zip(x0, x1))
        ]
        return np.array(parts) / (4 * 4.0 * 2.0)  # Blender's radiance of a lamp of 1 W: 1 / (4 area)

    return glowing, native.Occluders(screen), exact


# Light, exact irradiance; allowed errors of the total and of blocks.
CASES = {
    "keyhole .02 m": (hole(0.02), 0.01, 0.02),
    "keyhole .04 m": (hole(0.04), 0.01, 0.02),
    "hole .06 m": (hole(0.06), 0.005, 0.01),
    "hole .1 m": (hole(0.1), 0.005, 0.01),
    "hole .25 m": (hole(0.25), 0.005, 0.01),
    "hole .6 m": (hole(0.6), 0.005, 0.01),
    "window": (window(), 0.005, 0.01),
    "slit": (slit(), 0.01, 0.02),
}


@pytest.mark.parametrize("name", CASES)
def test_no_light_is_lost_behind_an_opening(name):
    """Total and L1 of blocks; each texel finds some of its light."""
    (light, casters, exact), of_total, of_blocks = CASES[name]
    wanted = mean_over_texels(exact)
    got = native.gather_rays(receiver(), light, casters, **RAYS, seed=1)[0].mean(axis=2)
    assert got.sum() == pytest.approx(wanted.sum(), rel=of_total)
    assert abs(blocks(got) - blocks(wanted)).sum() < of_blocks * blocks(wanted).sum()
    assert not (got[wanted > 1e-3 * wanted.max()] == 0).any()


def test_light_through_a_keyhole_has_no_bias():
    """The mean of 32 seeds on few texels, where the first rays of some find nothing; four standard errors."""
    light, casters, exact = hole(0.04)
    wanted = mean_over_texels(exact, 48, 0.4).sum()
    sums = [
        native.gather_rays(receiver(48, 0.4), light, casters, rays=64, even_rays=16, seed=seed)[0].mean(axis=2).sum()
        for seed in range(32)
    ]
    assert abs(np.mean(sums) - wanted) < 4 * np.std(sums) / len(sums) ** 0.5
    assert np.std(sums) / len(sums) ** 0.5 < 0.15 * wanted


def test_dim_light_has_no_bias():
    """The dark part of a penumbra, where texels have few rays, in each of 16 seeds; four standard errors of the mean.

    Noise of such a texel is some 30 to 60 % of its light, over 200 texels and 16 seeds.
    """
    lamp = native.AreaLight((0, 0, 2.0), np.eye(3), 1.0, 1.0)
    card, grid = native.Occluders([level(-0.5, 0.5, -0.5, 0.5, 0.8)]), receiver(96, 1.2)
    wanted = native.gather_rays(grid, lamp, card, rays=1024, seed=99)[0].mean(axis=2)
    dim = (wanted > 0) & (wanted < 0.1 * wanted.max())
    assert dim.sum() > 200
    sums = [
        native.gather_rays(grid, lamp, card, rays=128, even_rays=16, seed=seed)[0].mean(axis=2)[dim].sum()
        for seed in range(16)
    ]
    error = np.std(sums) / len(sums) ** 0.5
    assert error < 0.02 * wanted[dim].sum()
    # The light that is wanted has an error of .1 %: the noise of 1024 rays over 200 texels.
    assert abs(np.mean(sums) - wanted[dim].sum()) < 4 * error + 1e-3 * wanted[dim].sum()


def test_the_sun_of_a_panorama_through_a_window():
    """A sun of one texel in a dim sky, of which a patch of the floor is lit: beside all rays from each texel."""
    image = np.full((32, 64, 3), 0.1, np.float32)
    image[20, 30] = 3000.0
    light, room = native.EnvironmentLight(image, np.eye(3)), window()[1]
    wanted = native.gather_rays(receiver(), light, room, rays=4096, seed=5)[0].mean(axis=2)
    got = native.gather_rays(receiver(), light, room, **RAYS, seed=1)[0].mean(axis=2)
    assert got.sum() == pytest.approx(wanted.sum(), rel=0.01)
    assert abs(blocks(got) - blocks(wanted)).sum() < 0.02 * blocks(wanted).sum()
    assert not (got[wanted > 0.1 * wanted.max()] == 0).any()


def test_a_bright_card_behind_leaves():
    """A lamp over a dense layer of leaves, which lets through a tenth: beside all rays from each texel."""
    generator = np.random.default_rng(1)
    centers = generator.uniform((-2, -2, 0.4), (2, 2, 0.6), (1500, 3))
    leaves = native.Occluders([quad(*(center + 0.09 * generator.normal(size=(4, 3)))) for center in centers])
    lamp = native.AreaLight((0, 0, 1.5), np.eye(3), 1.0, 1.0)
    wanted = native.gather_rays(receiver(), lamp, leaves, rays=1024, seed=5)[0].mean(axis=2)
    got = native.gather_rays(receiver(), lamp, leaves, **RAYS, seed=1)[0].mean(axis=2)
    assert got.sum() == pytest.approx(wanted.sum(), rel=0.01)
    assert abs(blocks(got) - blocks(wanted)).sum() < 0.02 * blocks(wanted).sum()


def test_noise_that_is_reported_is_that_of_the_image():
    """It counts two halves of the rays as independent: that of low-discrepancy rays is at most as large."""
    light, casters, exact = window()
    surface = native.Surface(receiver())
    reported = []
    got, _ = native.bake_arrival(
        surface,
        [(light, (1, 1, 1), casters)],
        rays=256,
        report_noise=lambda irradiance, variance: reported.append(variance**0.5 / irradiance),
    )
    wanted = mean_over_texels(exact)
    noise = np.sqrt(((got.mean(axis=2) - wanted) ** 2).mean()) / wanted.mean()
    assert 0.6 * reported[0] < noise < 1.1 * reported[0]


@pytest.mark.parametrize("opening", [hole(0.02), hole(0.1), slit()], ids=["keyhole", "hole", "slit"])
def test_light_through_gaps_is_the_same_for_any_number_of_threads(opening):
    light, casters, _ = opening
    one, three = (
        native.gather_rays(receiver(48), light, casters, **RAYS, seed=3, threads=threads)[0] for threads in (1, 3)
    )
    assert (one > 0).mean() > 0.9
    np.testing.assert_array_equal(one, three)


def test_a_search_for_light_can_be_cancelled():
    """Progress stands still while single texels search, and is asked for all the same."""
    light, casters, _ = slit(0.004)
    calls = []

    def stop(fraction):
        calls.append(fraction)
        return calls.count(fraction) < 3

    with pytest.raises(Cancelled):
        native.gather_rays(receiver(192), light, casters, **RAYS, seed=1, progress=stop)
    assert calls[-1] == 0.5  # the first pass is over, and the second not begun
