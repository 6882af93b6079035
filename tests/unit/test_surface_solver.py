"""The solver `surface` on planes, where `fft` knows the result."""

import _native_test
import numpy as np
import pytest
from beamspread import Medium, convolve, library

SIDE, PITCH = 48, 1e-3
ALBEDO = (0.9, 0.95, 0.6)


def flat_samples():
    """Texels of a plane as float32 (N, 10): position, normal, tangent, area."""
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    samples = np.zeros((SIDE * SIDE, 10), np.float32)
    samples[:, 0], samples[:, 1] = (x.ravel() + 0.5) * PITCH, (y.ravel() + 0.5) * PITCH
    samples[:, 5] = samples[:, 6] = 1
    samples[:, 9] = PITCH**2
    return samples


@pytest.mark.parametrize("texels", [0.03, 0.3, 3.0, 30.0])
def test_a_plane_of_samples_is_solved_as_by_fft(texels):
    """Samples are disks instead of squares: up to 1.6 % of the brightest where the medium spreads about a texel."""
    ldf, path = library(Medium(0.8, 1.0)), texels * PITCH
    irradiance = np.zeros((SIDE, SIDE), np.float32)
    irradiance[12:30, 15:33] = 1
    travel = np.array([np.sin(0.7), 0, -np.cos(0.7)], np.float32)
    expected = convolve(irradiance, travel, ldf, ALBEDO, path, PITCH)
    field = _native_test.SurfaceField(flat_samples(), [ldf] * 3, list(ALBEDO), [path] * 3)
    rays = np.ascontiguousarray(np.broadcast_to(travel, (SIDE * SIDE, 3)))
    field.add(rays, np.ascontiguousarray(np.repeat(irradiance.reshape(-1, 1), 3, axis=1)), [1.0, 1.0, 1.0])
    solved = field.solve().reshape(SIDE, SIDE, 3)
    bound = 0.02 if texels < 1 else 0.005
    assert np.abs(solved - expected).max() <= bound * expected.max()
    assert solved.sum() == pytest.approx(expected.sum(), rel=bound)
