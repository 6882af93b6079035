"""AngularSpace: its maps against their definition and against each other; the brightest point."""

import math

import numpy as np
import pytest
from beamspread import AngularSpace, LdfSample
from hypothesis import given
from hypothesis import strategies as st

coordinate = st.floats(-1e3, 1e3)


def space(u=1.5, v=-0.5, height=3.0):
    return AngularSpace((0, 0), (u, v), height)


def test_known_places():
    """Q is 3 above H: a place 3 away is seen under 45 degrees, and phi runs from +u over +v."""
    u = 1.5 + np.array([0, 3, 0, -3, 0, 3 * math.sqrt(3)])
    v = -0.5 + np.array([0, 0, 3, 0, -3, 0])
    phi, psi = space().to_angular(u, v)
    assert phi == pytest.approx(np.radians([0, 0, 90, 180, 270, 0]))
    assert psi == pytest.approx(np.radians([0, 45, 45, 45, 45, 60]))


def test_the_origin_takes_no_part():
    assert AngularSpace((7, 8), (1, 2), 3).to_angular(4, 5) == AngularSpace((0, 0), (1, 2), 3).to_angular(4, 5)


# psi loses digits the farther out a place is, as tan does toward 90 degrees: 1e-16 (1 + (r / h)^2) h in r.
@given(coordinate, coordinate, coordinate, coordinate, st.floats(1.0, 1e3))
def test_planar_and_back(u, v, hu, hv, height):
    at = AngularSpace((0, 0), (hu, hv), height)
    back = at.to_planar(*at.to_angular(u, v))
    assert back == pytest.approx((u, v), rel=0, abs=1e-9)


@given(st.floats(0, 2 * math.pi, exclude_max=True), st.floats(1e-3, 1.57), coordinate, coordinate, st.floats(1.0, 1e3))
def test_angular_and_back(phi, psi, hu, hv, height):
    at = AngularSpace((0, 0), (hu, hv), height)
    again, zenith = at.to_angular(*at.to_planar(phi, psi))
    assert zenith == pytest.approx(psi, rel=0, abs=1e-9)
    turn = abs(again - phi)
    assert min(turn, 2 * math.pi - turn) < 1e-9
    assert 0 <= again < 2 * math.pi


def test_next_to_the_cut():
    phi, _ = space(0, 0).to_angular(1.0, -1e-300)
    assert 0 <= phi < 2 * math.pi


def test_arrays_broadcast_and_numbers_give_numbers():
    u, v = np.linspace(-5, 5, 7), np.linspace(-2, 2, 4)[:, None]
    phi, psi = space().to_angular(u, v)
    assert phi.shape == psi.shape == (4, 7)
    back_u, back_v = space().to_planar(phi, psi)
    assert back_u == pytest.approx(np.broadcast_to(u, (4, 7)), abs=1e-12)
    assert back_v == pytest.approx(np.broadcast_to(v, (4, 7)), abs=1e-12)
    phi, psi = space().to_angular(1, 2)
    assert isinstance(phi, float)
    assert phi == space().to_angular([1], [2])[0][0]
    with pytest.raises(ValueError, match="shape"):
        space().to_angular(np.zeros(2), np.zeros(3))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: AngularSpace((0, math.nan), (0, 0), 1), "'origin' is nan"),
        (lambda: AngularSpace((0, 0), (math.inf, 0), 1), "'brightest' is inf"),
        (lambda: AngularSpace((0, 0), (0, 0), 0), "'height' is 0"),
        (lambda: AngularSpace((0, 0), (0, 0), -1), "'height' is -1"),
        (lambda: AngularSpace((0, 0), (0, 0), math.inf), "'height' is inf"),
        (lambda: space().to_angular(1e16, 0), "'u, v' is 1e\\+16; allowed: points within 1e15 heights"),
        (lambda: space().to_angular(0, math.inf), "'u, v' is inf"),
        (lambda: space().to_angular(math.nan, 0), "'u, v' is nan"),
        (lambda: space().to_angular(1j, 0), "'u' is complex128"),
        (lambda: space().to_angular("a", 0), "'u' is <U1"),
        (lambda: space().to_angular(0, np.ma.masked_less([0.0, 1.0], 0.5)), "'v' is an array with masked values"),
        (lambda: space().to_planar([1j], 0), "'phi' is complex128"),
        (lambda: space().to_planar(math.inf, 0.1), "'phi' is inf"),
        (lambda: space().to_planar(0, math.pi / 2), "'psi' is 1.57"),
        (lambda: space().to_planar(0, -0.1), "'psi' is -0.1"),
        (lambda: space().to_planar(0, [0.1, math.nan]), "'psi' is nan"),
    ],
)
def test_bad_arguments(call, message):
    with pytest.raises(ValueError, match=message):
        call()


# --- the brightest point --------------------------------------------------------------------------------------------


def peak(u0, width, size=61, pitch=0.1, noise=0.0, seed=0):
    """A Gaussian around (u0, 0); noise: standard deviation relative to the peak."""
    x = (np.arange(size) + 0.5 - size / 2) * pitch
    image = 0.02 * np.exp(-((x[None, :] - u0) ** 2 + x[:, None] ** 2) / (2 * width**2))
    image += noise * np.random.default_rng(seed).normal(size=image.shape) * np.sqrt(0.02 * image)
    return LdfSample(np.maximum(image, 0), pitch, 30, 0.9)


@pytest.mark.parametrize("size", [60, 61])
@pytest.mark.parametrize("u0", [0.0, 0.13, -0.48, 1.0])
def test_brightest_point_of_a_peak(size, u0):
    """To a hundredth of a texel where a top of 13 texels shows how it bends."""
    assert peak(u0, 2.0, size).brightest == pytest.approx((u0, 0), abs=0.001)


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.2])
def test_brightest_point_despite_noise(noise):
    """Within a tenth of the peak's width, where the brightest texel of .2 noise is anywhere in its top."""
    found = [peak(0.5, 1.0, noise=noise, seed=seed).brightest for seed in range(10)]
    assert found == pytest.approx(np.tile([0.5, 0.0], (10, 1)), abs=0.1)


@pytest.mark.parametrize("size", [20, 21])
def test_brightest_point_of_a_pencil_beam(size):
    """1 / r ahead brighter than behind: its top is one texel, or the four around O."""
    x = np.arange(size) + 0.5 - size / 2
    r = np.maximum(np.hypot(x[None, :], x[:, None]), 0.3)
    image = 0.005 * (1 + 0.5 * x[None, :] / r) / r
    assert LdfSample(image, 1.0, 45, 0.9).brightest == (0, 0)


def test_brightest_point_of_nothing():
    assert LdfSample(np.zeros((5, 4)), 1.0, 45, 0.9).brightest == (0, 0)
    assert LdfSample(np.ones((1, 1)), 1.0, 45, 0.9).brightest == (0, 0)
