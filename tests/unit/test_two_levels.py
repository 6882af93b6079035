"""The fft solver where light spreads far: a coarse grid beside the texels, against texels alone and against direct."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from beamspread import Cancelled, Medium, _native, convolve, library
from scipy.ndimage import uniform_filter

import helpers
from helpers import travel

ALBEDO = (0.999, 0.9, 0.99)
SUN = (math.sin(1), 0.3 * math.sin(1), -math.cos(1))


@pytest.fixture(scope="module")
def ldf():
    return library(Medium(0.8, 1.4))


def sun(height, width):
    return np.array(SUN, np.float32) / np.linalg.norm(SUN).astype(np.float32)


def lamp(height, width):
    return helpers.lamp((height, width), x=-1 / 6, height=0.2 * max(width, height) / width)[1]


def light(height, width):
    """Noise, with shadows across which it falls to zero."""
    rng = np.random.default_rng(21)
    lit = np.kron(rng.random((height // 16 + 1, width // 16 + 1)) < 0.5, np.ones((16, 16)))[:height, :width]
    return (rng.random((height, width)) * lit).astype(np.float32)


def solve(ldf, shape, direction, mean_free_path, pitch=(1.0, 1.0), threads=0, progress=None, tolerance=1e-3, **options):
    paths = [mean_free_path, 0.7 * mean_free_path, 0.5 * mean_free_path]
    lights = _native.PlaneLight.of_channels(light(*shape), direction(*shape), 3)
    return _native.convolve(
        lights, [ldf] * 3, list(ALBEDO), paths, pitch, "fft", tolerance, threads, progress, **options
    )


def worst(result, expected):
    """Largest error of each channel, of its brightest texel."""
    return (np.abs(result - expected) / expected.max((0, 1))).max()


# Two levels differ from one by images of detail that the coarse grid doesn't resolve, and by the edges of the profile's
# bins, which no window smooths. Measured for half-spaces of ior 1 and 1.4 at 50 and 85 degrees: 1e-6 to 1e-5, and up to
# twice that where a lamp's basis sums dozens of kernels.
TOLERANCE = {sun: 2e-5, lamp: 4e-5}


@pytest.mark.parametrize("direction", [sun, lamp])
@pytest.mark.parametrize(
    ("shape", "pitch", "mean_free_path", "coarsening"),
    [
        ((301, 415), (1.0, 1.0), 3.0, 4),
        ((301, 415), (1.0, 1.0), 40.0, 8),
        ((301, 415), (1.0, 1.0), 3000.0, 4),
        ((290, 333), (1.0, 0.4), 40.0, 4),
        ((222, 403), (0.3, 1.0), 300.0, 4),
        ((37, 900), (1.0, 1.0), 40.0, 8),
    ],
)
def test_two_levels_equal_one(ldf, direction, shape, pitch, mean_free_path, coarsening):
    arguments = (ldf, shape, direction, mean_free_path, pitch)
    one, two = (solve(*arguments, coarsening=each, tolerance=2e-2) for each in (1, coarsening))
    assert not np.array_equal(one, two)
    assert worst(two, one) < TOLERANCE[direction]


@pytest.mark.parametrize(("direction", "memory"), [(sun, 700_000), (sun, 1_500_000), (lamp, 4_000_000)])
def test_tiles_on_two_levels_are_seamless(ldf, direction, memory):
    """All tiles share one coarse grid, and the remaining fine part ends within their halo."""
    arguments, options = (ldf, (500, 610), direction, 60.0), {"tolerance": 2e-2}
    whole = solve(*arguments, coarsening=4, **options)
    tiled = solve(*arguments, coarsening=4, memory=memory, **options)
    assert not np.array_equal(tiled, whole)
    assert worst(tiled, whole) < 1e-5
    assert worst(tiled, solve(*arguments, coarsening=1, **options)) < TOLERANCE[direction]


@pytest.mark.parametrize("mean_free_path", [20.0, 500.0])
@pytest.mark.parametrize("angle", [20, 75])
def test_two_levels_equal_direct(ldf, angle, mean_free_path):
    """Bound of docs/accuracy.md for one direction."""
    direction = travel(angle, 53)
    beams = light(120, 180)
    direct = convolve(beams, direction, ldf, ALBEDO, mean_free_path, 1.0, solver="direct")
    lights = _native.PlaneLight.of_channels(beams, direction.astype(np.float32), 3)
    two = _native.convolve(
        lights, [ldf] * 3, list(ALBEDO), [mean_free_path] * 3, (1.0, 1.0), "fft", 1e-3, 0, None, coarsening=4
    )
    assert worst(two, direct) < 4e-5


def test_two_levels_keep_the_tolerance_where_directions_change(ldf):
    """The promise of `convolve`, see `test_fft_keeps_the_tolerance_where_directions_change`."""
    shape, tolerance = (40, 130), 1e-3
    beams, directions = light(*shape), lamp(*shape)
    direct = convolve(beams, directions, ldf, ALBEDO, (60.0, 42.0, 30.0), 1.0, solver="direct")
    error = np.abs(solve(ldf, shape, lamp, 60.0, coarsening=4) - direct)
    assert np.all(error.sum((0, 1)) < 0.3 * tolerance * direct.sum((0, 1)))
    nearby = uniform_filter(direct, (17, 17, 0), mode="nearest")
    assert np.all(error < tolerance * nearby + 2e-5 * direct.max((0, 1)))


def test_a_level_is_added_where_it_pays(ldf):
    """True if light spreads farther than the plane, false if it ends within a few texels."""
    far, near = (ldf, (500, 500), sun, 40.0), (ldf, (200, 200), sun, 0.02)
    assert np.array_equal(solve(*far), solve(*far, coarsening=4))
    assert not np.array_equal(solve(*far), solve(*far, coarsening=1))
    assert np.array_equal(solve(*near), solve(*near, coarsening=1))


@pytest.mark.parametrize("direction", [sun, lamp])
def test_same_bits_for_any_number_of_threads(ldf, direction):
    runs = [solve(ldf, (210, 333), direction, 50.0, coarsening=4, threads=n) for n in (1, 2)]
    assert np.array_equal(*runs)


@pytest.mark.parametrize("stop_at", [0.0, 0.05, 0.6])
def test_cancel(ldf, stop_at):
    arguments = (ldf, (600, 700), sun, 50.0)
    with pytest.raises(Cancelled):
        solve(*arguments, progress=lambda fraction: fraction < stop_at)
    seen = []
    solve(*arguments, progress=lambda fraction: seen.append(fraction) or True)
    assert seen == sorted(seen)
    assert (seen[0], seen[-1]) == (0, 1)


def test_power_is_kept(ldf):
    """Even light over a plane much wider than light spreads: no level loses or doubles any."""
    size, path = 1200, 3.0
    beams = np.ones((size, size), np.float32)
    rest = ([ldf], [0.9], [path], (1.0, 1.0), "fft", 1e-3, 0, None)
    for coarsening in (4, 8):
        result = _native.convolve([_native.PlaneLight(beams, sun(0, 0), [1.0])], *rest, coarsening=coarsening)
        angle = math.degrees(math.acos(-sun(0, 0)[2]))
        assert result[size // 2, size // 2, 0] == pytest.approx(ldf.reflectance(angle, 0.9) / math.pi, rel=1e-4)


def test_bad_coarsening_is_named(ldf):
    for coarsening in (2, 5, 128):
        with pytest.raises(ValueError, match=f"'coarsening' is {coarsening}"):
            solve(ldf, (20, 20), sun, 1.0, coarsening=coarsening)


MEMORY = """
import numpy
from beamspread import Medium, _native, library

def peak():  # getrusage's also counts the process that started this one
    return int([line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")][0])

y, x = numpy.mgrid[:180, :180] - 90.0
field = numpy.stack([x, y, numpy.full_like(x, -20)], -1)
direction = (field / numpy.linalg.norm(field, axis=-1, keepdims=True)).astype(numpy.float32)
rest = [library(Medium(0.8, 1.4))], [0.9], [60.0], (1.0, 1.0), "fft", 1e-3, 0, None
before = peak()
light = _native.PlaneLight(numpy.ones((180, 180), numpy.float32), direction, [1.0])
_native.convolve([light], *rest, memory=32 << 20, coarsening=8)
print(peak() - before)
"""


def test_hundreds_of_small_spectra_keep_to_the_memory_they_are_given():
    """A huge page for each would take ten times as much."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    output = subprocess.run([sys.executable, "-c", MEMORY], env=environment, check=True, capture_output=True, text=True)
    assert int(output.stdout) < 100 << 10  # KiB
