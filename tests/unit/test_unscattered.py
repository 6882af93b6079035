"""Light that a slab returns unscattered from its far boundary, which every solver adds to scattered light."""

import math

import numpy as np
import pytest
from beamspread import Medium, convolve, simulate

from helpers import travel

THICKNESS, IOR = 0.5, 1.4


@pytest.fixture(scope="module")
def slab():
    return simulate(Medium(0.8, IOR, THICKNESS), [0, 20, 40, 60, 80, 88], 1000)


def exits(angle, count=4):
    """Distances in mean free paths and powers, by Snell, Fresnel and Beer, one reflection after the other."""
    outside = math.radians(angle)
    inside = math.asin(math.sin(outside) / IOR)
    s = (math.cos(outside) - IOR * math.cos(inside)) / (math.cos(outside) + IOR * math.cos(inside))
    p = (IOR * math.cos(outside) - math.cos(inside)) / (IOR * math.cos(outside) + math.cos(inside))
    fresnel = (s * s + p * p) / 2
    crossing = math.exp(-THICKNESS / math.cos(inside))
    for k in range(1, count + 1):
        power = (1 - fresnel) ** 2 * fresnel ** (2 * k - 1) * crossing ** (2 * k)
        yield 2 * k * THICKNESS * math.tan(inside), power


def overlap(shift, size):
    """Part of a texel at the middle that each texel of a line holds, once shifted."""
    return np.maximum(0, 1 - np.abs(np.arange(size) - size // 2 - shift))


@pytest.mark.parametrize("solver", ["fft", "direct", "adaptive"])
@pytest.mark.parametrize(("angle", "azimuth"), [(0, 0), (35, 20), (60, -130)])
def test_the_position_where_it_leaves(slab, solver, angle, azimuth):
    """Albedo 0: nothing else does. Exits of less than 1e-6 of the incident power are left out."""
    path, pitch, size = 2.0, (0.3, 0.2), 41
    light = np.zeros((size, size), np.float32)
    light[size // 2, size // 2] = 5
    result = convolve(light, travel(angle, azimuth), slab, 0, path, pitch, solver=solver)
    expected = np.zeros((size, size))
    for distance, power in exits(angle):
        along_x = path * distance * math.cos(math.radians(azimuth)) / pitch[0]
        along_y = path * distance * math.sin(math.radians(azimuth)) / pitch[1]
        expected += 5 * power / math.pi * np.outer(overlap(along_y, size), overlap(along_x, size))
    assert expected.max() > 1e-3
    assert result[..., 1] == pytest.approx(expected, abs=2e-5 * expected.max() + 3e-6)


@pytest.mark.parametrize("threads", [1, 2])
def test_unscattered_light_of_a_lamp(slab, threads):
    """The power of a lit line of texels is kept; the bits don't depend on the threads."""
    x, y = np.meshgrid(np.linspace(-2, 2, 150), np.linspace(-2, 2, 150))
    direction = np.stack([x, y, np.full_like(x, -1)], -1)
    direction = (direction / np.linalg.norm(direction, axis=-1, keepdims=True)).astype(np.float32)
    light = np.where(np.hypot(x, y) < 1.6, 1, 0).astype(np.float32)
    result = convolve(light, direction, slab, 0, 1.0, 0.1, threads=threads)
    lit = np.degrees(np.arccos(-direction[light > 0][:, 2]))
    expected = sum(sum(power for _, power in exits(angle)) for angle in lit) / math.pi
    assert result[..., 0].sum(dtype=np.float64) == pytest.approx(expected, rel=1e-4)
    assert result.tobytes() == convolve(light, direction, slab, 0, 1.0, 0.1, threads=3 - threads).tobytes()


@pytest.mark.parametrize("medium", [Medium(0.8), Medium(0.8, 1.4), Medium(0.8, 1.0, THICKNESS)], ids=str)
def test_none_without_a_reflecting_boundary(medium):
    library = simulate(medium, [0, 45, 60], 100)
    light = np.ones((5, 5), np.float32)
    assert not convolve(light, travel(50, 0), library, 0, 1.0, 1.0).any()


def test_light_displaced_beyond_the_plane_is_lost(slab):
    light = np.ones((3, 70), np.float32)
    assert not convolve(light, travel(60, 90), slab, 0, 1e8, 1.0).any()
