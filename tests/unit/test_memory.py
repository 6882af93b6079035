"""A bake that would take more memory than allowed is refused, and one that takes much less is not."""

import subprocess
import sys
from pathlib import Path

import pytest

CHILD = """
import sys
from dataclasses import replace

import beamspread
import numpy as np
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.surface import Surface
from beamspread.core.errors import BakeError
from beamspread.core.material import Material
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight, WorldLight
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.polygons import Polygons

allowed, size, solver, names, color, anisotropy, ior, path, thickness, layer = eval(sys.argv[1])
noise = np.random.default_rng(0).random((64, 128, 3), np.float32)
if color == (1, 1, 1):
    noise[:] = noise[..., :1]
axes = (1, 0, 0), (0, 1, 0), (0, 0, 1)
made = {
    "sun": SunLight("Sun", 2.0, (1, 1, 1), True, (0.8, 0.0, -0.6)),
    "lamp": PointLight("Lamp", 3.0, color, True, (0.1, -0.2, 0.1)),
    "world": WorldLight("World", 1.0, (1, 1, 1), True, noise, axes),
}
corners = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
square = flatten(Polygons(corners, corners[:, :2] + 0.5, np.array([0, 4]), np.array([axes[2]], float)))
material = Material(albedo=(0.95, 0.9, 0.8), mean_free_path=(path,) * 3, anisotropy=anisotropy, ior=ior)
surface, settings = Surface(material, thickness), BakeSettings(solver=solver, quality="preview", layer=layer)
for medium in surface.media():
    beamspread.library(medium, quality="preview")


def status(key):
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(key)) * 1024


open("/proc/self/clear_refs", "w").write("5")  # the peak is that of now
before = status("VmRSS")
lights = Illumination([made[name] for name in names])
job = BakeJob("Plane", build_receiver(square, size, size), lights, surface, settings, BAKE_STEPS)
job.run()
peak = status("VmHWM") - before
job = replace(job, settings=replace(settings, memory_limit=int(allowed * peak)))
is_allowed = job.memory_bytes() < job.settings.memory_limit
try:
    is_allowed and job.run()
except BakeError as error:
    assert "memory" in str(error)
    is_allowed = False
print(peak, is_allowed)
"""

COLORED, WHITE = (1, 0.8, 0.6), (1, 1, 1)
ALL = "sun", "lamp", "world"


def peak_of(allowed, size, solver, names, color=COLORED, medium=(0.6, 1.4, 0.01, 0.0), layer="Combined"):
    """Bytes at the peak of a separate process, beyond those before the bake; True if it runs with `allowed` times that.

    `medium`: anisotropy, ior, mean free path and thickness, of a plane of side 1.
    """
    arguments = repr((allowed, size, solver, names, color, *medium, layer))
    done = subprocess.run([sys.executable, "-c", CHILD, arguments], capture_output=True, text=True, check=True)
    peak, is_allowed = done.stdout.split()
    return float(peak), is_allowed == "True"


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peaks are read as Linux tells them")
@pytest.mark.parametrize(
    "arguments",
    [
        (512, "fft", ("sun",)),
        (512, "fft", ("lamp",)),
        (512, "fft", ALL, WHITE),
        (512, "fft", ALL, COLORED, (0.95, 1.4, 0.004, 0.0)),
        (512, "fft", ("lamp", "world"), COLORED, (0.8, 1.0, 0.04, 0.0)),
        (48, "fft", ("world",), WHITE, (0.8, 1.4, 0.01, 0.01)),
        (512, "fft", ("sun",), COLORED, (0.8, 1.4, 0.004, 0.004)),
        (256, "fft", ("lamp",), COLORED, (0.8, 1.4, 0.004, 0.004)),
        (512, "adaptive", ("sun",)),
        (256, "adaptive", ("lamp",)),
        (64, "direct", ("lamp",)),
        (512, "fft", ALL, COLORED, (0.6, 1.4, 0.01, 0.0), "Irradiance"),
    ],
)
def test_a_bake_that_takes_more_memory_than_allowed_is_refused(arguments):
    _, is_allowed = peak_of(0.99, *arguments)
    assert not is_allowed


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peaks are read as Linux tells them")
@pytest.mark.parametrize(
    ("size", "medium", "least"), [(1280, (0.8, 1.0, 0.04, 0.0), 1e9), (1152, (0.6, 1.4, 0.01, 0.0), 5e8)]
)
def test_a_large_bake_that_takes_much_less_is_not_refused(size, medium, least):
    peak, is_allowed = peak_of(1.4, size, "fft", ("lamp", "world"), COLORED, medium)
    assert peak > least
    assert is_allowed


PLANES = """
import sys

sys.path.insert(0, {tests!r})
from dataclasses import replace

import numpy as np
from bakes import SETTINGS, bake, square
from beamspread.core.material import Material
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight, WorldLight

texture, side = {texture!r}, {side}
common = "Light", 1.0, (1.0, 1.0, 1.0), True
clouds = np.random.default_rng(0).random((64, 128, 1), np.float32).repeat(3, axis=-1)
axes = (1, 0, 0), (0, 1, 0), (0, 0, 1)
made = {{
    "sun": SunLight(*common, (0.6, 0.0, -0.8)),
    "lamp": PointLight(*common, (0.0, 0.0, 0.3)),
    "sky": WorldLight(*common, clouds, axes),
}}
light = made[{light!r}]
y, x = np.mgrid[:side, :side]
veins = (0.87 + 0.12 * np.abs(np.sin(0.05 * x + np.sin(0.035 * y))))[..., None] * (1, 0.98, 0.95)
veins = veins.astype(np.float32)


def status(key):
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(key)) * 1024


def run(size):
    grid = square(size, side=size / 1024)
    values = np.ascontiguousarray(veins[:size, :size])
    if texture == "scattered":
        grid = replace(grid, albedo=values)
    elif texture == "multiplied":
        values **= np.float32([1, 2, 3])  # light of one color in all texels would share its moments
        grid = replace(grid, color_in=values, color_out=values)
    material = Material(albedo=(0.9,) * 3, mean_free_path=(1 / 1024, 0.8 / 1024, 0.6 / 1024), anisotropy=0.8)
    bake(grid, Illumination([light]), material, 0.0, SETTINGS)


run(32)
before = status("VmRSS")
open("/proc/self/clear_refs", "w").write("5")
run(side)
print((status("VmHWM") - before) / (4 * side**2))
"""


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="peaks are read as Linux tells them")
@pytest.mark.parametrize("texture", ["scattered", "multiplied"])
@pytest.mark.parametrize("light", ["sun", "lamp", "sky"])
def test_colors_of_each_texel_take_few_planes(light, texture):
    """At most 12 planes of floats, one for each texel, beyond a bake of one color; the map has three of them."""
    peaks = []
    for used in ("none", texture):
        code = PLANES.format(tests=str(Path(__file__).parents[1]), light=light, texture=used, side=1024)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        peaks.append(float(done.stdout))
    assert peaks[1] - peaks[0] < 12
