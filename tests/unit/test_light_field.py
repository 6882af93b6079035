"""Light that adds up as it comes gives what it gives together, in memory that doesn't grow with it."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from beamspread.core.bake import luminance
from beamspread.core.bake.luminance import TOLERANCE, bake
from beamspread.core.bake.settings import BakeSettings
from beamspread.core.material.material import Material
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SpotLight, SunLight

SETTINGS = BakeSettings(quality="preview", samples=1, margin=0)
MATERIAL = Material(albedo=(0.95, 0.9, 0.8), mean_free_path=(0.01, 0.01, 0.005), anisotropy=0.6, ior=1.4)


def grid(size, side=1.0):
    """A square in the xy plane, centred on the origin."""
    pitch = {"pitch_x": side / size, "pitch_y": side / size}
    axes = {"x_axis": (1.0, 0.0, 0.0), "y_axis": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    coverage = np.ones((size, size), np.float32)
    return Grid((-side / 2, -side / 2, 0.0), **axes, **pitch, width=size, height=size, coverage=coverage)


def lamps(count, seed=1):
    random = np.random.default_rng(seed)
    places = np.stack([*random.uniform(-0.6, 0.6, (2, count)), random.uniform(0.05, 0.6, count)], 1)
    return [
        PointLight(f"Lamp {i}", float(random.uniform(1, 9)), tuple(random.random(3)), True, tuple(place))
        for i, place in enumerate(places)
    ]


def suns(count):
    angles = np.radians(np.linspace(10, 70, count))
    return [SunLight(f"Sun {a:.1f}", 2.0, (1.0, 0.5, a), True, (math.sin(a), 0.0, -math.cos(a))) for a in angles]


def bake_as_it_comes(monkeypatch, *arguments):
    monkeypatch.setattr(luminance, "MOST_WAITING", 0)
    return bake(*arguments)


def relative_error(result, truth):
    """Worst texel, relative to the brightest texels' mean of each channel."""
    return float((np.abs(result - truth) / truth.mean(axis=(0, 1))).max())


@pytest.mark.parametrize("lights", [lamps(9), suns(3) + lamps(3), suns(7), suns(2)], ids=["9", "3 + 3", "7", "2"])
@pytest.mark.parametrize("thickness", [0.0, 0.02], ids=["half-space", "slab"])
def test_as_it_comes_is_as_together(lights, thickness, monkeypatch):
    """Both keep to the tolerance, here of all terms: what differs is the basis and rounding."""
    arguments = grid(72), Illumination(lights), MATERIAL, thickness, SETTINGS
    together = bake(*arguments)
    assert relative_error(bake_as_it_comes(monkeypatch, *arguments), together) < 0.1 * TOLERANCE


def test_terms_are_chosen_for_what_comes(monkeypatch):
    """On planes of more than 192 x 192 texels few terms are kept, for four lamps that stand for all."""
    arguments = grid(256), Illumination(lamps(12)), MATERIAL, 0.0, SETTINGS
    together = bake(*arguments)
    assert relative_error(bake_as_it_comes(monkeypatch, *arguments), together) < 2 * TOLERANCE


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    results = [
        bake_as_it_comes(
            monkeypatch, grid(72), Illumination(lamps(5)), MATERIAL, 0.02, replace(SETTINGS, threads=threads)
        )
        for threads in (1, 2, 5)
    ]
    assert all(np.array_equal(results[0], result) for result in results)


def test_light_between_the_places_of_a_survey_counts(monkeypatch):
    """A spot that lights some 40 of 300 x 300 texels, beside lamps that stand for all."""
    frame = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    middle = (1.5 / 300, 1.5 / 300, 0.1)  # between texels 96 of which are looked at
    narrow = SpotLight("Narrow", 500.0, (1.0, 1.0, 1.0), True, middle, frame, math.radians(8), 0.0)
    lights = [*lamps(5), narrow]
    arguments = grid(300), Illumination(lights), MATERIAL, 0.0, SETTINGS
    together = bake(*arguments)
    result = bake_as_it_comes(monkeypatch, *arguments)
    assert together.max() > 20 * np.median(together)
    assert relative_error(result, together) < 2 * TOLERANCE * together.max() / together.mean()


def test_darkness_stays_dark(monkeypatch):
    behind = replace(lamps(1)[0], position=(0.0, 0.0, -1.0))
    assert not bake_as_it_comes(monkeypatch, grid(32), Illumination([behind]), MATERIAL, 0.0, SETTINGS).any()


MEMORY = """
import sys
sys.path.insert(0, sys.argv[2])
from test_light_field import *
luminance.MOST_WAITING = 0
bake(grid(512), Illumination(lamps(int(sys.argv[1]))), MATERIAL, 0.0, SETTINGS)
print([line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")][0])
"""


def test_memory_does_not_grow_with_the_lights():
    """130 lamps more would take 130 MiB on 512 x 512 texels if their light waited; that of terms differs."""
    folder = str(Path(__file__).parent)
    peaks = [
        int(subprocess.run([sys.executable, "-c", MEMORY, count, folder], capture_output=True, check=True).stdout)
        for count in ("20", "150")
    ]
    assert peaks[1] - peaks[0] < 32 * 1024
