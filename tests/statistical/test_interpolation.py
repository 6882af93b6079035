"""Interpolated LDFs against a library's own, which test_maps.py compares with brute-force Monte Carlo.

Errors are the largest difference relative to the brightest texel; the simulation's noise is one to two percent of it.
"""

import beamspread
import numpy as np
import pytest
from beamspread import LdfSample, Medium, interpolate

SIZE = 101


@pytest.fixture(scope="module")
def half_space():
    return beamspread.simulate(Medium(0.8), [0, 15, 20, 30, 40, 45, 50, 60], 120_000)


def sample(library, angle, albedo, diameter, pitch):
    return LdfSample.from_library(library, angle, albedo, SIZE, pitch, diameter)


def errors(library, angles, albedos, angle, albedo, diameter, pitch):
    samples = [sample(library, t, a, diameter, pitch) for t in angles for a in albedos]
    exact = sample(library, angle, albedo, diameter, pitch).image
    return {
        method: np.abs(interpolate(samples, angle, albedo, method=method).image - exact).max() / exact.max()
        for method in ("planar", "angular", "adaptive")
    }


@pytest.mark.parametrize(
    ("radius", "shift"), [(0.3, 0.25), (0.5, 0.38), (1.0, 0.57), (2.0, 0.68)], ids=lambda x: f"{x:g}"
)
def test_the_brightest_point_of_a_finite_beam_shifts(half_space, radius, shift):
    """45 degrees, in transport mean free paths; the values are the final library's, whose top 1 % is .1 to .5 wide."""
    transport = 1 / (1 - 0.8)
    found = sample(half_space, 45, 0.999, 2 * radius * transport, 0.04 * radius * transport).brightest
    assert found[0] / transport == pytest.approx(shift, abs=0.05)
    assert sample(half_space, 45, 0.999, 0.0, 0.2).brightest == (0, 0)


# Paper, Fig. 6: 0 and 30 degrees, albedo .999. Beams as wide as the paper's texel (1 unit) and wider.
@pytest.mark.parametrize(("diameter", "pitch"), [(1.0, 1.0), (3.0, 0.4), (6.0, 0.4), (10.0, 1.0), (20.0, 1.0)])
def test_adaptive_in_the_setting_of_the_paper(half_space, diameter, pitch):
    error = errors(half_space, (0, 30), (0.999,), 15, 0.999, diameter, pitch)
    assert error["adaptive"] < 0.025
    assert error["adaptive"] < 0.5 * error["angular"]


@pytest.mark.parametrize("diameter", [0.0, 1.0, 3.0, 10.0])
@pytest.mark.parametrize(
    ("angles", "angle", "bound"), [((0, 60), 30, 0.04), ((20, 60), 40, 0.05), ((30, 60), 50, 0.04), ((0, 30), 20, 0.03)]
)
@pytest.mark.parametrize("albedo", [0.6, 0.999])
def test_adaptive_between_angles(half_space, angles, angle, bound, albedo, diameter):
    error = errors(half_space, angles, (albedo,), angle, albedo, diameter, 0.4)
    assert error["adaptive"] < bound
    assert error["adaptive"] < 0.6 * min(error["angular"], error["planar"])


@pytest.mark.parametrize("diameter", [0.0, 1.0, 3.0, 10.0])
@pytest.mark.parametrize(
    ("albedos", "albedo", "bound"), [((0.2, 0.999), 0.6, 0.18), ((0.6, 0.9), 0.8, 0.05), ((0.8, 0.95), 0.9, 0.03)]
)
def test_adaptive_between_angles_and_albedos(half_space, albedos, albedo, bound, diameter):
    error = errors(half_space, (30, 60), albedos, 45, albedo, diameter, 0.4)
    assert error["adaptive"] < bound
    assert error["adaptive"] < 0.4 * min(error["angular"], error["planar"])
