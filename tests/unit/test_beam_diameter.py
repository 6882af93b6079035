"""LDFs of beams that light a disk, against sums over fine texels of the pencil beam's."""

import math

import numpy as np
import pytest
from beamspread import LdfSample, Medium, convolve, simulate
from scipy.signal import fftconvolve


@pytest.fixture(scope="module")
def half_space():
    return simulate(Medium(0.8, 1.3), [0, 20, 40, 60], 4000)


@pytest.fixture(scope="module")
def slab():
    return simulate(Medium(0.5, 1.4, 2.0), [0, 20, 40, 60], 4000)


def disk_weights(radius, pitch):
    """Shares of a disk in texels around its centre, by 16 x 16 points in each."""
    reach = math.ceil(radius / pitch) + 1
    points = 16
    inside = ((np.arange(points) + 0.5) / points - 0.5) * pitch
    x = (np.arange(-reach, reach + 1)[:, None] * pitch + inside).ravel()
    lit = x[:, None] ** 2 + x[None, :] ** 2 < radius**2
    weights = lit.reshape(2 * reach + 1, points, 2 * reach + 1, points).mean(axis=(1, 3))
    return weights / weights.sum()


def summed(library, angle, albedo, size, pitch, diameter, fine, side="reflected"):
    """One pencil beam per texel of a grid `fine` times finer, over the disk."""
    image = library.image(angle, albedo, size * fine, pitch / fine, side=side).astype(np.float64)
    weights = disk_weights(diameter / 2, pitch / fine)
    shape = np.add(image.shape, weights.shape) - 1
    convolved = np.fft.irfft2(np.fft.rfft2(image, shape) * np.fft.rfft2(weights, shape), shape)
    reach = weights.shape[0] // 2
    convolved = convolved[reach : reach + size * fine, reach : reach + size * fine]
    return convolved.reshape(size, fine, size, fine).mean(axis=(1, 3))


# Errors of the sums themselves shrink with the fine texels: 1 % of a disk's border in 9, .1 % in 31 texels across.
@pytest.mark.parametrize(
    ("angle", "diameter", "pitch", "fine", "tolerance"),
    [
        (0, 0.05, 0.2, 31, 5e-4),  # far below the texel
        (45, 0.05, 0.2, 31, 5e-4),
        (45, 0.2, 0.2, 25, 1.5e-3),
        (45, 2.0, 0.2, 9, 1e-3),
        (60, 8.0, 0.4, 5, 1e-3),
        (45, 1.0, 10.0, 31, 5e-4),
    ],
)
def test_sum_of_pencil_beams(half_space, angle, diameter, pitch, fine, tolerance):
    size = 41
    # Within the window that no beam reaches from outside of it.
    inner = slice(12, 29)
    image = half_space.image(angle, 0.95, size, pitch, beam_diameter=diameter)[inner, inner]
    expected = summed(half_space, angle, 0.95, size, pitch, diameter, fine)[inner, inner]
    error = np.abs(image - expected)
    assert error.max() < tolerance * expected.max()
    assert error.sum() < 5e-4 * expected.sum()


def test_unscattered_light_becomes_a_disk(slab):
    """Through two mean free paths at 40 degrees: a sharp edge, which the texels share as the circle cuts them."""
    size, pitch, diameter, fine = 61, 0.1, 1.0, 15
    image = slab.image(40, 0.3, size, pitch, side="transmitted", beam_diameter=diameter)
    expected = summed(slab, 40, 0.3, size, pitch, diameter, fine, side="transmitted")
    # A fine texel across the border is 1/15 of a texel.
    assert np.abs(image - expected)[10:-10, 10:-10].max() < 0.07 * expected.max()
    assert np.abs(image - expected).sum() < 0.01 * expected.sum()


@pytest.mark.parametrize("diameter", [0.0, 1e-7, 1e-3, 0.3, 5.0, 400.0])
@pytest.mark.parametrize("side", ["reflected", "transmitted"])
def test_power_stays_the_same(slab, diameter, side):
    total = slab.reflectance(50, 0.9) if side == "reflected" else slab.transmittance(50, 0.9)
    for size, pitch in ((9, 1500.0), (400, 30.0)):
        image = slab.image(50, 0.9, size, pitch, side=side, beam_diameter=diameter)
        assert image.sum(dtype=np.float64) * pitch**2 == pytest.approx(total, rel=1e-5)


@pytest.mark.parametrize("size", [20, 21])
@pytest.mark.parametrize("pitch", [0.05, 3.0])
def test_tends_to_the_pencil_beam(half_space, size, pitch):
    pencil = half_space.image(30, 0.9, size, pitch)
    previous = math.inf
    for fraction in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6):
        image = half_space.image(30, 0.9, size, pitch, beam_diameter=fraction * pitch)
        difference = np.abs(image - pencil).sum() / pencil.sum()
        assert difference < max(0.5 * previous, 3e-5)  # rounding
        previous = difference


def test_a_wide_beam_is_even_inside(half_space):
    """Far inside a disk much wider than light spreads, exitance is that of an evenly lit plane."""
    diameter = 2000.0
    image = half_space.image(0, 0.5, 5, 1.0, beam_diameter=diameter)
    expected = half_space.reflectance(0, 0.5) / (math.pi * diameter**2 / 4)
    assert image == pytest.approx(expected, rel=1e-4)


def test_even_in_v_and_round_at_normal_incidence(half_space):
    image = half_space.image(40, 0.9, 31, 0.3, beam_diameter=2.0)
    assert image == pytest.approx(image[::-1], rel=1e-5)
    image = half_space.image(0, 0.9, 31, 0.3, beam_diameter=2.0)
    assert image == pytest.approx(image.T, rel=1e-4)


def test_samples_take_their_diameter_with_them(half_space):
    sample = LdfSample.from_library(half_space, 40, 0.9, 21, 0.3, beam_diameter=2.0)
    assert sample.beam_diameter == 2.0
    assert np.array_equal(sample.image, half_space.image(40, 0.9, 21, 0.3, beam_diameter=2.0))


@pytest.mark.parametrize("diameter", [-1.0, math.nan, math.inf])
def test_bad_diameters(half_space, diameter):
    with pytest.raises(ValueError, match="'beam_diameter' is"):
        half_space.image(40, 0.9, 21, 0.3, beam_diameter=diameter)


@pytest.mark.parametrize("ior", [1.2, 1.4])
def test_light_on_slabs_is_the_sum_of_its_beams(ior):
    """Around all the places where a thin slab's light comes from, which solvers see around one of them.

    With 16 steps of radius per octave around that one it is 2e-3, which is how well the disk is known that each beam
    lights; with four of them, as bins have, 1e-2 and 2e-2.
    """
    angle, albedo, size, pitch = 40, 0.9, 96, 0.005
    slab = simulate(Medium(0.8, ior, 0.3), [0, 20, 40, 60], 20000)
    x = (np.arange(size) - size / 2) * pitch
    spots = np.exp(-0.5 * (x[:, None] ** 2 + (x + 0.12) ** 2) / 0.03**2)
    spots /= spots.sum()
    irradiance = fftconvolve(spots, disk_weights(2 * pitch, pitch), mode="same") / pitch**2
    direction = np.array([math.sin(math.radians(angle)), 0, -math.cos(math.radians(angle))], np.float32)
    light = np.maximum(irradiance, 0).astype(np.float32)
    luminance = convolve(light, direction, slab, albedo, 1.0, pitch, tolerance=1e-4)[..., 0]
    beam = slab.image(angle, albedo, 2 * size + 1, pitch, beam_diameter=4 * pitch)
    expected = fftconvolve(spots, beam, mode="full")[size : 2 * size, size : 2 * size]
    assert np.abs(np.pi * luminance - expected).max() < 5e-3 * expected.max()
