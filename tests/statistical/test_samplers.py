"""Each sampler draws from the density that it states."""

import _native_test
import numpy as np
import pytest
from beamspread.core.native import native

# Quantile of chi-square with 39 degrees of freedom at 1 - .01 / 7 (Sidak, seven values of g).
CHI2_LIMIT = 70.9


@pytest.mark.parametrize("g", [-0.9, -0.3, 0.0, 1e-5, 0.3, 0.8, 0.97])
def test_henyey_greenstein(g):
    """Chi-square over 40 equally likely bins of the cosine, their edges from a numerical integral of the density."""
    fine = np.linspace(-1, 1, 2_000_001)
    density = 2 * np.pi * _native_test.henyey_greenstein_pdf(fine, g)
    cumulative = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)]) * (fine[1] - fine[0])
    assert cumulative[-1] == pytest.approx(1, abs=1e-6)
    assert np.trapz(density * fine, fine) == pytest.approx(g, abs=1e-6)
    samples = _native_test.henyey_greenstein_sample(g, np.random.default_rng(1).random(200_000))
    assert np.abs(samples).max() <= 1
    counts = np.histogram(np.interp(samples, fine, cumulative), bins=40, range=(0, 1))[0]
    assert ((counts - 5000.0) ** 2 / 5000).sum() < CHI2_LIMIT


def test_fresnel():
    """Normal incidence, Brewster's angle, total reflection and grazing: the formula's known values."""
    assert native.fresnel(1.0, 1.5) == pytest.approx(0.04)
    brewster = np.cos(np.arctan(1.5))
    r_s = ((1 - 1.5**2) / (1 + 1.5**2)) ** 2
    assert native.fresnel(brewster, 1.5) == pytest.approx(r_s / 2)
    assert native.fresnel(0.7, 1 / 1.5) == 1
    assert native.fresnel(0.0, 1.5) == pytest.approx(1)
    assert native.fresnel(0.3, 1.0) == 0
    theta = np.radians(40)
    inside = np.cos(np.arcsin(np.sin(theta) / 1.5))
    assert native.fresnel(inside, 1 / 1.5) == pytest.approx(native.fresnel(np.cos(theta), 1.5))
