"""Light added step by step gives the same result as all light together, in constant memory."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import beamspread
import numpy as np
import pytest
from beamspread.core.bake import spread_light
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.spread_light import TOLERANCE
from beamspread.core.material import Material
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SpotLight, SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh

from bakes import bake, square

SETTINGS = BakeSettings(quality="preview", samples=1, margin=0)
MATERIAL = Material(albedo=(0.95, 0.9, 0.8), mean_free_path=(0.01, 0.01, 0.005), anisotropy=0.6, ior=1.4)


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
    monkeypatch.setattr(spread_light, "MAX_STORED_BYTES", 0)
    return bake(*arguments)


def relative_error(result, truth):
    """Worst texel, relative to the brightest texels' mean of each channel."""
    return float((np.abs(result - truth) / truth.mean(axis=(0, 1))).max())


@pytest.mark.parametrize("lights", [lamps(9), suns(3) + lamps(3), suns(7), suns(2)], ids=["9", "3 + 3", "7", "2"])
@pytest.mark.parametrize("thickness", [0.0, 0.02], ids=["half-space", "slab"])
def test_as_it_comes_is_as_together(lights, thickness, monkeypatch):
    """Both keep the tolerance, here with all terms: the basis and rounding differ."""
    arguments = square(48), Illumination(lights), MATERIAL, thickness, SETTINGS
    together = bake(*arguments)
    assert relative_error(bake_as_it_comes(monkeypatch, *arguments), together) < 0.1 * TOLERANCE


def test_terms_are_chosen_for_the_survey(monkeypatch):
    """On planes of more than 192 x 192 texels few terms are kept, for four lamps that stand for all."""
    arguments = square(256), Illumination(lamps(12)), MATERIAL, 0.0, SETTINGS
    together = bake(*arguments)
    assert relative_error(bake_as_it_comes(monkeypatch, *arguments), together) < 2 * TOLERANCE


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    results = [
        bake_as_it_comes(
            monkeypatch, square(48), Illumination(lamps(5)), MATERIAL, 0.02, replace(SETTINGS, threads=threads)
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
    arguments = square(300), Illumination(lights), MATERIAL, 0.0, SETTINGS
    together = bake(*arguments)
    result = bake_as_it_comes(monkeypatch, *arguments)
    assert together.max() > 20 * np.median(together)
    assert relative_error(result, together) < 2 * TOLERANCE * together.max() / together.mean()


def test_darkness_stays_dark(monkeypatch):
    behind = replace(lamps(1)[0], position=(0.0, 0.0, -1.0))
    assert not bake_as_it_comes(monkeypatch, square(32), Illumination([behind]), MATERIAL, 0.0, SETTINGS).any()


ASIDE = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # an area light that shines towards -x
WALL = Mesh(
    np.array([(0.1, -0.3, 0.0), (0.1, 0.2, 0.0), (0.1, 0.2, 0.2), (0.1, -0.3, 0.2)]),
    np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
)


def panel(size=0.8, middle=(0.9, 0.0, 0.6), power=20.0):
    color = (1.0, 0.8, 0.5)
    return AreaLight("Panel", power, color, True, middle, ASIDE, size, size, False, math.pi)


def split(light, count):
    """The panel as count x count small ones."""
    places = (np.arange(count) + 0.5) / count - 0.5
    return [
        panel(light.size_x / count, tuple(np.add(light.position, (0.0, light.size_x * y, light.size_y * z))), share)
        for share in [light.strength / count**2]
        for y in places
        for z in places
    ]


def test_directions_of_a_low_wide_light_are_kept():
    """A panel against itself in 100 parts, each its own light: the parts have one direction each, but for .06 rad.

    The difference grows with the square of that angle: some 3e-4 of the luminance. Rays make 2e-3 of noise in the
    penumbra, where ten parts make steps. The mean direction alone would be far less exact.
    """

    def bake_one(lights):
        return bake(square(64), Illumination(lights, WALL), MATERIAL, 0.0, replace(SETTINGS, samples=4))

    truth, whole = bake_one(split(panel(), 10)), bake_one([panel()])
    error = np.abs(whole - truth) / truth.mean(axis=(0, 1))
    assert error.mean() < 3e-3
    assert np.quantile(error, 0.99) < 3e-2
    mirrored = bake_one([replace(panel(), position=(-0.9, 0.0, 0.6), frame=(*ASIDE[:2], (-1.0, 0.0, 0.0)))])
    assert np.abs(mirrored - truth).mean() > 0.2 * truth.mean()


@pytest.mark.parametrize("solver", ["direct", "adaptive"])
def test_solvers_that_take_lights_apart_agree(solver, monkeypatch):
    """Ray by ray, each a light of one direction per texel: the same rays, so the difference is the solvers'
    tolerance.
    """
    for name in ("MAX_RAYS", "MIN_RAYS"):
        monkeypatch.setattr(spread_light, name, 2)
    arguments = square(16), Illumination([sky()], WALL), MATERIAL, 0.0
    settings = replace(SETTINGS, samples=4)
    apart = bake(*arguments, replace(settings, solver=solver))
    assert relative_error(bake(*arguments, settings), apart) < 4 * TOLERANCE


def test_rays_return_unscattered_from_a_slab_as_lights_do(monkeypatch):
    """A fifth of a mean free path thick, where some per cent of the light returns from the far side unscattered."""
    for name in ("MAX_RAYS", "MIN_RAYS"):
        monkeypatch.setattr(spread_light, name, 2)
    settings = replace(SETTINGS, samples=4)
    arguments = square(8), Illumination([sky()]), replace(MATERIAL, mean_free_path=(0.05, 0.05, 0.05)), 0.01
    apart = bake(*arguments, replace(settings, solver="direct"))
    assert relative_error(bake(*arguments, settings), apart) < 4 * TOLERANCE


def sky():
    """Blue, with a red quarter."""
    radiance = np.full((16, 32, 3), (0.1, 0.2, 0.4), np.float32)
    radiance[8:, :8] = (2.0, 0.2, 0.1)
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return WorldLight("World", 1.0, (1.0, 1.0, 1.0), True, radiance, identity)


def test_light_of_many_colors_and_directions_has_the_power_of_its_parts():
    """A sky over an open plane: beams from everywhere, summed by angle of incidence, against the library itself."""
    result = bake(square(48, side=4.0), Illumination([sky()]), MATERIAL, 0.0, SETTINGS)
    luminance_in_the_middle = result[16:32, 16:32].mean(axis=(0, 1))
    medium = beamspread.Medium(g=MATERIAL.anisotropy, ior=MATERIAL.ior)
    library = beamspread.library(medium, quality="preview")
    elevation = (np.arange(16) + 0.5) / 16 * np.pi - np.pi / 2
    steps = np.linspace(0, np.pi / 2, 8 * 64 + 1)
    middles = (steps[1:] + steps[:-1]) / 2
    share = np.sin(steps[1:]) ** 2 / 2 - np.sin(steps[:-1]) ** 2 / 2  # of cos(theta) over a ring, by 2 pi
    assert elevation[8] > 0
    for channel, albedo in enumerate(MATERIAL.albedo):
        reflected = [library.reflectance(90 - float(np.degrees(angle)), albedo) for angle in middles]
        radiance = sky().radiance[8:, :, channel].mean()
        expected = 2 * np.pi * radiance * float(np.dot(reflected, share)) / np.pi
        assert luminance_in_the_middle[channel] == pytest.approx(expected, rel=1e-2)


def test_a_narrow_sun_counts_as_one_direction():
    """The widest sun of one direction, at 75 degrees, against its rays: the error grows with the square of the
    angle.
    """
    angle = math.radians(75)
    travel, widest = (math.sin(angle), 0.0, -math.cos(angle)), native.SunLight.max_parallel_angle
    sun = SunLight("Sun", 1.0, (1.0, 1.0, 1.0), True, travel, widest)
    one = bake(square(48), Illumination([sun], WALL), MATERIAL, 0.0, SETTINGS)
    rays = bake(square(48), Illumination([replace(sun, angle=1.0001 * sun.angle)], WALL), MATERIAL, 0.0, SETTINGS)
    difference = np.abs(one - rays) / rays.mean(axis=(0, 1))
    assert 0 < difference.mean() < 2e-3


def test_a_black_medium_stays_black():
    black = replace(MATERIAL, albedo=(0.0, 0.0, 0.0))
    assert not bake(square(32), Illumination([sky(), panel()], WALL), black, 0.0, SETTINGS).any()


def test_colored_glass_colors_light_of_a_size():
    """A pane above the whole plane: each channel has its part of the light without the pane, but for noise of rays."""
    pane = np.array([(-3, -3, 0.2), (3, -3, 0.2), (3, 3, 0.2), (-3, 3, 0.2)], float)
    color, faces = (0.8, 0.4, 0.1), np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    glass = Mesh(pane, faces, (native.ColorTexture(color),), np.zeros(2, np.uint32))
    for light in (panel(0.3, (0.4, 0.0, 0.6)), sky()):
        dimmed, whole = (
            bake(square(24), Illumination([light], mesh), MATERIAL, 0.0, replace(SETTINGS, samples=4))
            for mesh in (glass, None)
        )
        assert dimmed.mean(axis=(0, 1)) == pytest.approx(whole.mean(axis=(0, 1)) * color, rel=2e-2)


MEMORY = """
import sys
sys.path[:0] = sys.argv[2:]
from test_light_field import *
spread_light.MAX_STORED_BYTES = 0
bake(square(512), Illumination(lamps(int(sys.argv[1]))), MATERIAL, 0.0, SETTINGS)
print([line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")][0])
"""


def test_memory_does_not_grow_with_the_lights():
    """65 lamps more would take 65 MiB on 512 x 512 texels if their light waited; that of terms differs."""
    folders = [str(folder) for folder in Path(__file__).parents[:2]]
    peaks = [
        int(subprocess.run([sys.executable, "-c", MEMORY, count, *folders], capture_output=True, check=True).stdout)
        for count in ("20", "85")
    ]
    assert peaks[1] - peaks[0] < 32 * 1024
