"""Interpolation of samples: weights and grids on made-up images, each method on the law that it is exact for."""

import math
from itertools import product

import numpy as np
import pytest
from beamspread import LdfSample, interpolate

PITCH = 0.2


def places(size=41):
    x = (np.arange(size) + 0.5 - size / 2) * PITCH
    return np.meshgrid(x, x)


def random_samples(angles=(0, 30), albedos=(0.5, 0.9), gs=(None,), shape=(6, 9)):
    rng = np.random.default_rng(3)
    return [LdfSample(rng.random(shape) / 40, PITCH, *at[:2], 1.0, at[2]) for at in product(angles, albedos, gs)]


def made_of(law, angles=(0.0,), albedos=(0.9,), gs=(0.8,), diameter=0.0):
    return [LdfSample(law(math.radians(t), a, g), PITCH, t, a, diameter, g) for t, a, g in product(angles, albedos, gs)]


@pytest.mark.parametrize("method", ["angular", "adaptive", "planar"])
def test_a_sample_comes_out_as_it_is(method):
    samples = random_samples(gs=(0.1, 0.8))
    for sample in samples:
        same = interpolate(samples, sample.angle, sample.albedo, sample.g, method)
        assert np.array_equal(same.image, sample.image)
        assert (same.angle, same.albedo, same.g) == (sample.angle, sample.albedo, sample.g)
        assert (same.pitch, same.beam_diameter) == (PITCH, 1.0)


def test_planar_is_bilinear():
    a, b, c, d = (s.image for s in random_samples())
    result = interpolate(random_samples(), 7.5, 0.8, method="planar")
    expected = 0.75 * 0.25 * a + 0.75 * 0.75 * b + 0.25 * 0.25 * c + 0.25 * 0.75 * d
    assert result.image == pytest.approx(expected, rel=1e-6)
    assert (result.angle, result.albedo, result.g) == (7.5, 0.8, None)


def test_planar_is_trilinear_with_g():
    images = np.array([s.image for s in random_samples(gs=(0.0, 0.8))]).reshape(2, 2, 2, 6, 9)
    weights = np.einsum("i,j,k->ijk", [0.75, 0.25], [0.25, 0.75], [0.5, 0.5])
    result = interpolate(random_samples(gs=(0.0, 0.8)), 7.5, 0.8, 0.4, method="planar")
    assert result.image == pytest.approx(np.einsum("ijk,ijkyx->yx", weights, images), rel=1e-6)
    assert result.g == 0.4


@pytest.mark.parametrize("method", ["angular", "adaptive", "planar"])
def test_the_order_and_other_cells_do_not_count(method):
    samples = random_samples(angles=(0, 30, 40, 60), albedos=(0.2, 0.5, 0.9))
    cell = [s for s in samples if s.angle in (30, 40) and s.albedo in (0.5, 0.9)]
    expected = interpolate(cell, 33, 0.6, method=method).image
    shuffled = [samples[i] for i in np.random.default_rng(1).permutation(len(samples))]
    assert np.array_equal(interpolate(shuffled, 33, 0.6, method=method).image, expected)


def test_one_axis_is_enough():
    row = random_samples(albedos=(0.9,), gs=(0.3,))
    assert interpolate(row, 15, 0.9).g == 0.3
    assert interpolate(row, 15, 0.9, 0.3).albedo == 0.9
    column = random_samples(angles=(20,))
    assert interpolate(column, 20, 0.7).angle == 20
    assert np.array_equal(interpolate(column[:1], 20, 0.5).image, column[0].image)


def other(sample, **changes):
    values = {name: getattr(sample, name) for name in ("image", "pitch", "angle", "albedo", "beam_diameter", "g")}
    return LdfSample(**(values | changes))


SAMPLES = random_samples()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: interpolate([], 0, 0.5), "'samples' is empty"),
        (lambda: interpolate([None], 0, 0.5), "'samples' is with None"),
        (lambda: interpolate(SAMPLES, 31, 0.6), "'angle' is 31; allowed: 0 <= angle <= 30, the span of the samples"),
        (lambda: interpolate(SAMPLES, -1, 0.6), "'angle' is -1"),
        (lambda: interpolate(SAMPLES, math.nan, 0.6), "'angle' is nan"),
        (lambda: interpolate(SAMPLES, 10, 0.95), "'albedo' is 0.95; allowed: 0.5 <= albedo <= 0.9"),
        (lambda: interpolate(SAMPLES, 10, 0.6, 0.5), "'g' is 0.5; allowed: None"),
        (lambda: interpolate(random_samples(gs=(0.3, 0.6)), 10, 0.6), "'g' is None; allowed: 0.3 <= g <= 0.6"),
        (lambda: interpolate(random_samples(gs=(0.3, 0.6)), 10, 0.6, 0.7), "'g' is 0.7; allowed: 0.3 <= g <= 0.6"),
        (lambda: interpolate(SAMPLES[:3], 10, 0.6), "without one at angle 30, albedo 0.9"),
        (lambda: interpolate([*SAMPLES, SAMPLES[0]], 10, 0.6), "two of the same angle, albedo and g"),
        (lambda: interpolate([*SAMPLES[:3], other(SAMPLES[3], pitch=1.0)], 10, 0.6), "of pitch 0.2 and 1"),
        (lambda: interpolate([*SAMPLES[:3], other(SAMPLES[3], beam_diameter=2)], 10, 0.6), "of beam_diameter 1 and 2"),
        (lambda: interpolate([*SAMPLES[:3], other(SAMPLES[3], g=0.1)], 10, 0.6), "with and without g"),
        (lambda: interpolate([*SAMPLES[:3], other(SAMPLES[3], image=np.ones((3, 3)))], 10, 0.6), "9 x 6 and of 3 x 3"),
        (lambda: interpolate(SAMPLES, 10, 0.6, method="best"), "'method' is 'best'"),
        (lambda: interpolate(SAMPLES, 10, 0.6, height=0), "'height' is 0"),
        (lambda: interpolate(SAMPLES, 10, 0.6, method="planar", height=1), "'height' is 1"),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


# --- angular --------------------------------------------------------------------------------------------------------


def shifted_peak(theta, albedo, g):
    """A Gaussian whose brightest point moves in proportion to the angle, .8 at 30 degrees."""
    u, v = places()
    return 0.05 * albedo * np.exp(-((u - 0.8 * theta / math.radians(30)) ** 2 + v**2) / 2)


def test_angular_moves_the_brightest_point():
    """The planar blend of two peaks is wider and lower; aligned, they are one. Bilinear lookup costs pitch^2 / 8."""
    samples = made_of(shifted_peak, angles=(0, 30), albedos=(0.4, 0.8))
    exact = shifted_peak(math.radians(12), 0.5, 0.8)
    result = interpolate(samples, 12, 0.5)
    assert result.brightest == pytest.approx((0.32, 0), abs=0.005)
    assert np.abs(result.image - exact).max() < 1.5 * PITCH**2 / 8 * exact.max()
    planar = interpolate(samples, 12, 0.5, method="planar")
    assert np.abs(planar.image - exact).max() > 5 * np.abs(result.image - exact).max()


def test_angular_keeps_the_power():
    """The total of the blend is the blend of the totals, but for the 5e-4 of the peak that the border cuts off."""
    samples = made_of(shifted_peak, angles=(0, 30), albedos=(0.4, 0.8))
    result = interpolate(samples, 12, 0.5)
    expected = sum(w * s.power for w, s in zip((0.45, 0.15, 0.3, 0.1), samples))
    assert result.power == pytest.approx(expected, rel=5e-4)


def test_one_height_for_all_cancels_out():
    samples = made_of(shifted_peak, angles=(0, 30))
    reference = interpolate(samples, 12, 0.9).image
    for height in (0.3, 100.0, 1e4):
        assert interpolate(samples, 12, 0.9, height=height).image == pytest.approx(reference, rel=1e-5)


# --- adaptive -------------------------------------------------------------------------------------------------------


def test_adaptive_is_exact_between_angles():
    """log g = A + B s^2 + s C u with s = tan(theta / 2): even in u even in the angle, odd odd."""

    def law(theta, albedo, g):
        u, v = places()
        s, r = math.tan(theta / 2), np.hypot(u, v)
        return 0.1 * np.exp(-r + s**2 * (1 - r) + 1.5 * s * u)

    for angles, angle in (((0, 60), 35), ((20, 50), 33)):
        result = interpolate(made_of(law, angles), angle, 0.9, method="adaptive")
        assert result.image == pytest.approx(law(math.radians(angle), 0.9, 0.8), rel=1e-5)


@pytest.mark.parametrize("g", [0.0, 0.8])
def test_adaptive_is_exact_between_albedos_of_a_pencil_beam(g):
    """g = albedo exp(-kappa r) / r with the diffusion exponent kappa."""

    def law(theta, albedo, g):
        r = np.hypot(*places()) + 0.01
        return 0.02 * albedo * np.exp(-math.sqrt(3 * (1 - albedo) * (1 - g * albedo)) * r) / r

    samples = made_of(law, albedos=(0.2, 0.999), gs=(g,))
    for albedo in (0.3, 0.6, 0.95):
        result = interpolate(samples, 0, albedo, method="adaptive")
        assert result.image == pytest.approx(law(0, albedo, g), rel=1e-5)


def test_adaptive_is_exact_between_albedos_inside_a_wide_beam():
    """Exitance like the spherical albedo of van de Hulst (1980)."""

    def law(theta, albedo, g):
        s = math.sqrt((1 - albedo) / (1 - g * albedo))
        return np.full((9, 9), 0.3 * (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s))

    samples = made_of(law, albedos=(0.2, 0.99), diameter=1e3)
    assert interpolate(samples, 0, 0.7, method="adaptive").image == pytest.approx(law(0, 0.7, 0.8), rel=1e-5)


def test_adaptive_scales_between_anisotropies():
    """g = f(r (1 - g)) (1 - g)^2, the similarity of media: the blend is f at the geometric mean of the scales."""

    def law(theta, albedo, g):
        u, v = places(81)
        return 0.5 * (1 - g) ** 2 * np.exp(-(((1 - g) * np.hypot(u, v)) ** 2) / 0.5)

    samples = made_of(law, gs=(0.5, 0.75))
    g = 1 - math.sqrt(0.5 * 0.25)
    result = interpolate(samples, 0, 0.9, g, method="adaptive")
    exact = law(0, 0.9, g)
    assert np.abs(result.image - exact).max() < 0.01 * exact.max()
    assert result.power == pytest.approx(samples[0].power, rel=1e-2)


def test_adaptive_with_a_black_sample():
    shape = 0.1 * np.exp(-np.hypot(*places()))
    samples = [LdfSample(a * shape, PITCH, 0, a, 0, 0.8) for a in (0.0, 0.5)]
    assert interpolate(samples, 0, 0.25, method="adaptive").image == pytest.approx(0.25 * shape, rel=1e-5)
    black = [LdfSample(np.zeros((5, 5)), PITCH, t, 0.5) for t in (0, 30)]
    for method in ("angular", "adaptive", "planar"):
        assert not interpolate(black, 10, 0.5, method=method).image.any()


@pytest.mark.parametrize("photons", [1e4, 1e6])
@pytest.mark.parametrize("diameter", [0.0, 2.0])
def test_adaptive_of_noisy_samples(photons, diameter):
    """Means of logarithms of counts would be biased, or minus infinity; the power stays within 3 %, its noise 1 %."""

    def law(theta, albedo, g):
        u, v = places(101)
        r = np.hypot(u, v)
        return 0.3 / math.pi * np.exp(-r * math.sqrt(2 - theta) + 0.5 * math.tan(theta / 2) * u)

    rng = np.random.default_rng(4)
    angles = (0, 50)
    clean = made_of(law, angles, diameter=diameter)
    noisy = [other(s, image=rng.poisson(s.image * PITCH**2 * photons) / PITCH**2 / photons) for s in clean]
    expected = interpolate(clean, 30, 0.9, method="adaptive")
    result = interpolate(noisy, 30, 0.9, method="adaptive")
    assert result.power == pytest.approx(expected.power, rel=0.03)

    def blocks(sample):
        return sample.image[:100, :100].reshape(5, 20, 5, 20).sum(axis=(1, 3))

    assert np.abs(blocks(result) - blocks(expected)).sum() < (0.1 if photons < 1e5 else 0.02) * expected.image.sum()


def test_all_methods_take_images_that_are_not_square():
    samples = random_samples(shape=(4, 11))
    for method in ("angular", "adaptive", "planar"):
        assert interpolate(samples, 10, 0.7, method=method).image.shape == (4, 11)
