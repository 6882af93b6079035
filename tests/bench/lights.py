"""Many point lamps of random colours over a floor, beside one of them: time, transforms, error, memory.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/lights.py [--quick]

A bake as the add-on runs it, from gathering the light to luminance, once its library is in the cache.
"""

import argparse
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import _native_test
import numpy as np
from beamspread import Medium, library, presets
from beamspread.core.bake import layers as bakes
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.native import native
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight
from beamspread.core.scene.occluders import Mesh
from scipy.ndimage import uniform_filter

SIDE = 1.0  # of the floor, metres
SETTINGS = BakeSettings()


def floor(size):
    corner = (-SIDE / 2, -SIDE / 2, 0.0)
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return Grid(corner, *axes, SIDE / size, SIDE / size, size, size, np.ones((size, size), np.float32))


def cards(count):
    """Triangles in random places above the floor."""
    if count == 0:
        return None
    rng = np.random.default_rng(3)
    middle = rng.uniform((-0.5, -0.5, 0.02), (0.5, 0.5, 0.2), (count, 1, 3))
    corners = middle + rng.normal(0, 0.03, (count, 3, 3))
    corners[..., 2] = np.abs(corners[..., 2])
    return Mesh(corners.reshape(-1, 3), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3))


def lamps(count):
    rng = np.random.default_rng(5)
    places = rng.uniform((-0.45, -0.45, 0.05), (0.45, 0.45, 0.3), (count, 3))
    return [
        PointLight(f"Lamp {i}", 10.0, tuple(rng.uniform(0.1, 1, 3)), True, tuple(place))
        for i, place in enumerate(places.tolist())
    ]


def bake(size, lights, material, shadows=0):
    """Luminance, wall clock and CPU seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = bakes.bake([floor(size)], Illumination(lights, cards(shadows)), material, 0.0, SETTINGS)[0]
    return result, time.perf_counter() - wall, time.process_time() - cpu


def transforms(size, lights, material):
    """Number of terms that the solver chooses for the light."""
    grid = floor(size)
    arriving = []
    for light in lights:
        irradiance = np.ascontiguousarray(native.gather_rays(grid.native(), light.native())[0][..., 0])
        position = np.subtract(light.position, grid.origin)
        arriving.append(_native_test.light_from_point(irradiance, position.tolist(), light.rgb().tolist()))
    libraries = [library(Medium(g, material.ior)) for g in material.channel_anisotropy]
    rest = list(material.albedo), list(material.mean_free_path), (grid.pitch_x, grid.pitch_y)
    return _native_test.transforms(arriving, libraries, *rest, bakes.TOLERANCE)


def compare(size, count, material):
    lights = lamps(count)
    hardest = max(transforms(size, [light], material) for light in lights)
    together = transforms(size, lights, material) / 3
    print(f"  transforms: {together:.0f} per channel, {hardest} of the hardest of them alone")
    for shadows in (0, 30):
        one = np.mean([bake(size, [light], material, shadows)[1:] for light in lights[:20]], axis=0)
        result, wall, cpu = bake(size, lights, material, shadows)
        print(f"  {shadows} cards: all {wall:.2f} s, {cpu:.2f} s of CPU; one of them {one[0]:.2f} s, {one[1]:.2f} s")
        print(f"    all together are {wall / one[0]:.1f} times one")
        apart = sum(bake(size, [light], material, shadows)[0].astype(float) for light in lights)
        worst = (np.abs(result - apart) / uniform_filter(apart, (17, 17, 0), mode="nearest")).max()
        print(f"    beside the sum of all apart: worst texel off by {worst:.1e} of those around, of {bakes.TOLERANCE}")


MEMORY = """
import sys
sys.path.insert(0, {folder!r})
import lights
_, wall, cpu = lights.bake({size}, lights.lamps({count}), lights.presets()["marble"], 30)
print(wall, cpu)
print([line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")][0])
"""


def memory(size, counts):
    """Peak memory of a separate process."""
    print(f"\nmarble, {size} x {size}: lamps, wall clock and CPU seconds, peak memory of the process, 30 cards")
    for count in counts:
        code = MEMORY.format(folder=str(Path(__file__).parent), size=size, count=count)
        output = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
        wall, cpu, kilobytes = map(float, output.split())
        print(f"  {count:5d}: {wall:6.1f} s, {cpu:6.1f} s, {kilobytes / 2**20:5.2f} GiB")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a quarter of the size")
    smaller = 4 if parser.parse_args().quick else 1
    marble = presets()["marble"]
    for ior in (marble.ior, 1.0):
        print(f"\n60 lamps over marble with ior {ior:g}, {512 // smaller} x {512 // smaller}")
        compare(512 // smaller, 60, replace(marble, ior=ior))
    memory(1024 // smaller, [1, 50, 200, 400])


if __name__ == "__main__":
    main()
