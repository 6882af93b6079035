"""The direct solver's memory, progress and cancelling; its results are the truth that other tests compare with."""

import math
import subprocess
import sys

import numpy as np
import pytest
from beamspread import Cancelled, Medium, convolve, simulate

from helpers import lamp

# A lamp on a plane of 512 x 512 texels, stopped as soon as it adds beams up. Peak memory in MB.
BIG_LAMP = """
import resource
import numpy as np
from beamspread import Cancelled, Medium, convolve, simulate

size = 512
x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size - 0.5] * 2)
field = np.stack([x, y, np.full_like(x, -0.3)], -1)
direction = (field / np.linalg.norm(field, axis=-1, keepdims=True)).astype(np.float32)
library = simulate(Medium(0.8), [0, 15, 30, 45, 60, 75, 88], 5000)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    convolve(np.ones((size, size), np.float32), direction, library, 0.9, 5.0, 1.0, "direct",
             progress=lambda fraction: fraction == 0)
except Cancelled:
    print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(0.8), [0, 30, 60, 85], 5000)


def test_memory_is_bounded():
    """64 MB of kernels, as much of their integrals and of beams: kernels of all row offsets would be 2.6 GB."""
    run = subprocess.run([sys.executable, "-c", BIG_LAMP], capture_output=True, text=True, check=True)
    assert float(run.stdout) < 400


def test_progress_does_not_stand_still(library):
    """A second's work on one core, reported twenty times a second: no step of a half, and none backward."""
    light, direction = lamp(64)
    seen = []
    convolve(light, direction, library, 0.9, 5.0, 1.0, "direct", progress=lambda f: seen.append(f) or True)
    assert seen[0] == 0
    assert seen[-1] == 1
    assert min(np.diff(seen)) >= 0
    assert max(np.diff(seen)) < 0.5


@pytest.mark.parametrize("stop_at", [0.0, 1e-9, 0.5])
def test_cancelling_stops_at_once(library, stop_at):
    """Not one more report after the one that was answered by no; while kernels are made, and later."""
    light, direction = lamp(64)
    answers = []

    def report(fraction):
        answers.append(fraction < stop_at)
        return answers[-1]

    with pytest.raises(Cancelled):
        convolve(light, direction, library, 0.9, 5.0, 1.0, "direct", progress=report)
    assert answers.count(False) == 1


def test_rows_of_one_texel_and_of_many_bands(library):
    """Mirrored light gives the mirrored result, for more rows than have their kernels made at a time."""
    light = np.random.default_rng(3).random((37, 5)).astype(np.float32)
    theta = math.radians(50)
    up, down = ((0, s * math.sin(theta), -math.cos(theta)) for s in (1, -1))
    result = convolve(light, up, library, 0.9, 3.0, 1.0, "direct")
    mirrored = convolve(light[::-1].copy(), down, library, 0.9, 3.0, 1.0, "direct")
    assert np.allclose(result[::-1], mirrored, rtol=1e-6, atol=0)
