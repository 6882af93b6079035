"""Planes that are baked at once: side by side on one canvas, each as if it were alone."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from beamspread import Medium, _native, simulate
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.steps import NoiseSum
from beamspread.core.material import Material
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import STRATA, AreaLight, Field, FieldLight, PointLight, SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh

from bakes import bake, bake_together

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SETTINGS = BakeSettings(quality="preview")
PITCH = 0.002
CARD = Mesh(np.array([(0.1, 0.1, 0.1), (0.3, 0.1, 0.1), (0.3, 0.3, 0.1)]), np.array([(0, 1, 2)], np.uint32))

WHITE = 1.0, 1.0, 1.0
LIGHTS = {
    "sun": SunLight("Sun", 3.0, WHITE, True, (0.6, 0.0, -0.8)),
    "lamp": PointLight("Lamp", 1.0, (1.0, 0.8, 0.6), True, (0.2, 0.2, 0.3)),
    "area": AreaLight("Area", 3.0, WHITE, True, (0.2, 0.2, 0.4), AXES, 0.2, 0.2, False, math.pi),
    "world": WorldLight("World", 1.0, WHITE, True, np.random.default_rng(1).random((16, 32, 3), np.float32), AXES),
}


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(ior=1.4), angles=[0, 30, 60, 80], photons=2000)


def planks(count=10, side=50):
    """Planks of different sizes, tilted by up to 69 degrees, some of which face away from a low sun."""
    grids = []
    for number in range(count):
        cosine, sine = math.cos(0.2 * (number % 7)), math.sin(0.2 * (number % 7))
        origin = side * PITCH * (number // 4), side * PITCH * (number % 4), 0.0
        size = side - number, side - 2 * (number % 3)
        coverage = np.ones(size[::-1], np.float32)
        axes = (1.0, 0.0, 0.0), (0.0, cosine, sine), (0.0, -sine, cosine)
        grids.append(Grid(origin, *axes, PITCH, PITCH, *size, coverage))
    return grids


def together_and_alone(names, mean_free_path, grids=None, ior=1.4, thickness=0.0, **settings):
    grids = grids or planks()
    illumination = Illumination([LIGHTS[name] for name in names], CARD)
    material = Material((0.99, 0.9, 0.6), (mean_free_path, mean_free_path / 2, mean_free_path), 0.8, ior)
    rest = illumination, material, thickness, replace(SETTINGS, **settings)
    return bake_together(grids, *rest), [bake(grid, *rest) for grid in grids]


def largest_difference(first, second):
    """Relative to the brightest texel of all planes."""
    brightest = max(values.max() for values in second)
    return max(np.abs(a - b).max() for a, b in zip(first, second)) / brightest


@pytest.mark.parametrize(
    "names", [("sun",), ("lamp",), ("sun", "lamp"), ("area", "world", "lamp", "sun")], ids=",".join
)
@pytest.mark.parametrize("mean_free_path", [0.001, 0.02])
def test_planes_are_as_if_they_were_alone(names, mean_free_path):
    """A thousandth of the brightest is a fifth of the solver's tolerance: terms differ, and gaps cut kernels."""
    assert largest_difference(*together_and_alone(names, mean_free_path)) < 1e-3


def test_light_that_was_computed_elsewhere_is_that_of_each_plane():
    """Fields differ from plane to plane, and some parts of the hemisphere are dark on some planes."""
    random, grids = np.random.default_rng(3), planks()
    fields = []
    for grid in grids:
        radiance = random.random((len(STRATA), 4, 5, 3), np.float32)
        radiance[random.random(len(STRATA)) < 0.3] = 0
        fields.append(Field(grid.origin, grid.normal, radiance))
    light = FieldLight("Bounced light", 1.0, WHITE, False, tuple(fields))
    rest = (
        Illumination([light, LIGHTS["lamp"]], CARD),
        Material((0.99, 0.9, 0.6), (0.004,) * 3, 0.8, 1.4),
        0.0,
        SETTINGS,
    )
    assert largest_difference(bake_together(grids, *rest), [bake(grid, *rest) for grid in grids]) < 1e-3


def test_light_that_a_slab_returns_unscattered_stays_on_its_plane():
    """It lands up to twice the thickness away."""
    assert largest_difference(*together_and_alone(("sun",), 0.01, planks(8, side=30), ior=1.33, thickness=0.02)) < 1e-3


@pytest.mark.parametrize("mean_free_path", [0.3, 4.0, 300.0])
@pytest.mark.parametrize("memory", [1 << 30, 1 << 20])
def test_parts_that_touch_share_kernels_and_no_light(library, mean_free_path, memory):
    """The kernels of a part are cut where no two of its texels are apart, and in a small memory they come in turns."""
    random, parts = np.random.default_rng(7), [(0, 0, 60, 80), (0, 80, 55, 70), (60, 0, 58, 80), (60, 80, 60, 61)]
    beams = random.random((120, 150, 3), np.float32)
    beams[:60, :80] *= 1e4
    rest = [library] * 3, (0.99, 0.9, 0.6), [mean_free_path, mean_free_path / 3, mean_free_path], (1.0, 0.7)
    sun = np.array([0.6, 0.0, -0.8], np.float32)

    def solve(values, **options):
        lights = _native.PlaneLight.of_channels(values, sun, 3)
        return _native.convolve(lights, *rest, "fft", 1e-3, 0, None, **options)

    together = solve(beams, parts=parts, memory=memory)
    for y, x, height, width in parts:
        part = np.s_[y : y + height, x : x + width]
        alone = solve(np.ascontiguousarray(beams[part]), coarsening=1)
        assert np.abs(together[part] - alone).max() < 2e-5 * alone.max()


def test_a_dark_plane_stays_dark_beside_bright_ones():
    """No light crosses the gaps."""
    grids = planks()
    covered = replace(grids[4], coverage=np.zeros_like(grids[4].coverage))
    together, _ = together_and_alone(("lamp",), 0.001, [*grids[:4], covered, *grids[5:]])
    assert together[3].max() > 0.01
    assert together[4].max() < 1e-6 * together[3].max()


@pytest.mark.parametrize("solver", ["direct", "adaptive"])
def test_solvers_of_all_pairs_bake_planes_apart(solver):
    grids = planks(9, side=14)
    together, alone = together_and_alone(("lamp",), 0.002, grids, solver=solver)
    assert all(np.array_equal(a, b) for a, b in zip(together, alone))


def test_any_number_of_threads_gives_the_same_planes():
    one, _ = together_and_alone(("area", "lamp"), 0.02, planks(8, side=20), threads=1)
    three, _ = together_and_alone(("area", "lamp"), 0.02, planks(8, side=20), threads=3)
    assert all(np.array_equal(a, b) for a, b in zip(one, three))


def test_textures_and_texels_of_other_sizes_stay_with_their_planes():
    """Planks of two sizes of texels, one of them with a texture, alternate."""
    grids = planks(20)
    grids = [replace(grid, pitch_x=grid.pitch_x * (1 + number % 2 / 2)) for number, grid in enumerate(grids)]
    colors = np.random.default_rng(2).random((*grids[3].coverage.shape, 3), np.float32)
    grids[3] = replace(grids[3], color_in=colors, color_out=colors)
    assert largest_difference(*together_and_alone(("lamp",), 0.002, grids)) < 1e-3


def test_noise_of_a_dark_plane_beside_a_bright_one_shows_little():
    noise = NoiseSum()
    noise.add(1.0, 10.0, 0.01)
    noise.add(1.0, 0.0, 0.01)
    assert noise.relative() == pytest.approx(0.1 / 5)
    assert NoiseSum().relative() == 0


def test_the_bench_runs_in_small():
    bench = Path(__file__).resolve().parents[1] / "bench" / "planes.py"
    done = subprocess.run([sys.executable, str(bench), "64", "9"], capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) == 8
