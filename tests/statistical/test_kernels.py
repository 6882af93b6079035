"""Every implementation of the photon walk against the scalar one in double precision."""

import functools

import numpy as np
import pytest
from beamspread import Medium, exact_totals, simulate, walk_kernels
from scipy import stats

ALBEDOS = (0.05, 0.5, 0.9, 0.99, 0.9999)
MEDIA = [Medium(0.8), Medium(0.0, 1.4), Medium(0.95, 1.3), Medium(-0.4, 1.2, 3.0), Medium(0.8, 1.5, 0.5)]
ANGLE = 50.0
SEEDS = range(1, 9)
CONFIDENCE = 0.999

PHOTONS = 4_000
"""Per seed; as many for each kernel, because a library drops harmonics that are less than their noise."""


def harmonics(image):
    """Sums of the image times cos(m phi), m = 1 .. 8, phi around the centre."""
    x = np.arange(len(image)) - (len(image) - 1) / 2
    phi = np.arctan2(x[:, None], x[None, :])
    return [float((image * np.cos(m * phi)).sum()) for m in range(1, 9)]


def quantities(library):
    """Totals, light near O and harmonics of the image, for low and high orders."""
    medium = library.medium
    sides = ["reflected"] if np.isinf(medium.thickness) else ["reflected", "transmitted"]
    values = []
    for albedo in ALBEDOS:
        values.append(library.reflectance(ANGLE, albedo))
        if len(sides) == 2:
            values.append(library.transmittance(ANGLE, albedo))
        for side in sides:
            for scale in (0.1, 1.0):
                image = library.image(ANGLE, albedo, 12, 0.3 * scale / (1 - max(0.0, medium.g)), side=side)
                values += [image.sum(), image[4:8, 4:8].sum(), *harmonics(image)]
    return np.array(values, dtype=float)


@functools.cache
def sample(medium, kernel):
    return np.array([quantities(simulate(medium, [ANGLE], PHOTONS, seed=s, kernel=kernel)) for s in SEEDS])


@pytest.mark.parametrize("kernel", walk_kernels()[:-1])
@pytest.mark.parametrize("medium", MEDIA, ids=str)
def test_kernel_agrees_with_the_scalar_walk(medium, kernel):
    """Welch's t-test of every quantity at a confidence of 99.9 % for all of them together (Sidak).

    A single photon of a high order can carry much weight, which eight seeds don't tell: that makes the test a little
    conservative.
    """
    truth, ours = sample(medium, "scalar"), sample(medium, kernel)
    p = stats.ttest_ind(truth, ours, equal_var=False).pvalue
    allowed = 1 - CONFIDENCE ** (1 / p.size)
    assert p.min() > allowed, f"quantity {p.argmin()}: {truth.mean(0)[p.argmin()]} and {ours.mean(0)[p.argmin()]}"


@pytest.mark.parametrize("kernel", walk_kernels())
def test_light_prefers_no_azimuth(kernel):
    """Next to normal incidence no harmonic but m = 0 is left: t-test over 24 simulations, 99.9 % for all together.

    Square texels add harmonics to m = 0; these are measured at normal incidence, where a library has m = 0 only.
    """
    photons = 3_000 if kernel == "scalar" else 40_000

    def found(angle, seed):
        image = simulate(Medium(0.0), [angle], photons, seed=seed, kernel=kernel).image(angle, 0.3, 24, 0.25)
        return np.array(harmonics(image)[1:]) / image.sum()

    difference = [found(0.1, seed) - found(0.0, seed) for seed in range(24)]
    p = stats.ttest_1samp(difference, 0.0).pvalue
    assert p.min() > 1 - CONFIDENCE ** (1 / p.size), f"m = {p.argmin() + 2}"


@pytest.mark.parametrize("kernel", walk_kernels())
def test_kernels_walk_every_photon(kernel):
    """At an albedo next to 1 nothing is absorbed in a slab: reflectance and transmittance add up to the light that
    enters.

    Numbers of photons that fill no whole vectors, where one lost or walked twice would show. Within 5 standard errors,
    from the scatter between seeds (by chance one in 1e5 tests).
    """
    medium = Medium(0.0, 1.0, 1.0)
    for photons, seeds in ((1, 60), (33, 400)):
        runs = [simulate(medium, [0.0], photons, seed=seed, kernel=kernel) for seed in range(seeds)]
        totals = np.array([run.reflectance(0, 1 - 1e-12) + run.transmittance(0, 1 - 1e-12) for run in runs])
        error = totals.std(ddof=1) / np.sqrt(seeds)
        assert 5 * error < 1 / photons
        assert totals.mean() == pytest.approx(1, abs=5 * error)


@pytest.mark.parametrize("kernel", walk_kernels())
def test_rare_exits_far_from_the_boundary(kernel):
    """Light that was scattered about once and crosses a thick slab, against adding-doubling: 4 standard errors."""
    medium, albedo = Medium(0.0, 1.0, 6.0), 0.05
    library = simulate(medium, [0.0], 600_000, seed=3, kernel=kernel)
    exact = exact_totals(medium, [0.0], [albedo])[1][0, 0]
    error = library.standard_error(0, albedo, "transmitted")
    assert library.transmittance(0, albedo) == pytest.approx(exact, abs=4 * error)
    assert error < 0.02 * (exact - np.exp(-6.0))


def test_unknown_kernel_is_refused():
    with pytest.raises(ValueError, match=r"'kernel'.*'mmx'.*'scalar'"):
        simulate(Medium(), [0], 10, kernel="mmx")


def peak_harmonics(image):
    """The image's harmonics up to m = 60 on a ring ten texels wide, as a part of the ring's power."""
    x = np.arange(len(image)) - (len(image) - 1) / 2
    r, phi = np.hypot(x[:, None], x[None, :]), np.arctan2(x[:, None], x[None, :])
    ring = image * ((r > 18) & (r < 28))
    return [float((ring * np.cos(m * phi)).sum() / ring.sum()) for m in range(4, 61, 4)]


@pytest.mark.parametrize("kernel", walk_kernels()[:-1])
def test_kernel_resolves_a_grazing_peak_as_the_scalar_walk(kernel):
    """Every fourth harmonic of a beam at 85 degrees, nearly all of it scattered once: Welch's t-test as above.

    Such a peak is 5 degrees wide, exp(-m cos(theta)) falls to 1 in 190 at m = 60, and to a half at m = 8.
    """

    def found(name, seed):
        library = simulate(Medium(0.8), [85.0], 20_000, seed=seed, kernel=name)
        return peak_harmonics(library.image(85.0, 0.05, 60, 0.05))

    truth, ours = (np.array([found(name, seed) for seed in SEEDS]) for name in ("scalar", kernel))
    p = stats.ttest_ind(truth, ours, equal_var=False).pvalue
    assert p.min() > 1 - CONFIDENCE ** (1 / p.size), f"m = {4 + 4 * p.argmin()}"
    assert ours.mean(0)[6] > 0.05, "m = 28 has been dropped"
