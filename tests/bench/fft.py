"""The fft solver, counted in padded real transforms of about twice the plane's size (T), beside other libraries.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/fft.py [--quick]

Times are CPU seconds of all threads, the least of several runs, so that other load does not count; T is measured beside
each time that it divides.
"""

import argparse
import math
import os
import subprocess
import sys
import time

import _native_test
import beamspread
import numpy as np
from beamspread import _native
from scipy import fft as scipy_fft
from scipy.ndimage import uniform_filter
from scipy.signal import fftconvolve, oaconvolve

SUN = (math.sin(math.radians(50)), 0.0, -math.cos(math.radians(50)))
THREADS = os.cpu_count()


def seconds(runs, function, *arguments, **options):
    best = math.inf
    for _ in range(runs):
        start = time.process_time()
        function(*arguments, **options)
        best = min(best, time.process_time() - start)
    return best


def padded_size(size):
    """Twice the size or a faster one: lines whole pages apart share few lines of the cache."""
    return _native_test.fast_size(2 * size)


def transform_seconds(size):
    """T for a plane of this size."""
    values = np.random.default_rng(0).random((padded_size(size),) * 2, np.float32)
    return seconds(5, _native_test.real_transform, values)


def shadows(size):
    """Three fifths of the squares of a chessboard are lit."""
    lit = np.random.default_rng(1).random((16, 16)) < 0.6
    return np.kron(lit, np.ones((size // 16, size // 16), np.float32))


def lamp(size, x=0.0, y=0.0, height=0.1):
    """Irradiance and directions of a point lamp, lengths in widths of the plane."""
    across = (np.arange(size, dtype=np.float32) + 0.5) / size - 0.5
    field = np.stack([*np.meshgrid(across - x, across - y), np.full((size, size), -height, np.float32)], -1)
    distance = np.linalg.norm(field, axis=-1, keepdims=True)
    return height / distance[..., 0] ** 3, field / distance


def transforms(size):
    """DUCC as it is compiled here, SciPy's and FFTW, one padded real transform in single precision."""
    import pyfftw

    padded = padded_size(size)
    values = np.random.default_rng(0).random((padded, padded), np.float32)
    spectrum = pyfftw.empty_aligned((padded, padded // 2 + 1), np.complex64)
    aligned = pyfftw.empty_aligned(values.shape, np.float32)
    print(f"\none real transform, {padded} x {padded}, single precision, CPU seconds")
    instruction_set = _native_test.fft_instruction_sets()[0]
    print(f"  DUCC ({instruction_set})       {seconds(3, _native_test.real_transform, values):8.3f}")
    print(f"  SciPy               {seconds(3, scipy_fft.rfft2, values, workers=THREADS):8.3f}")
    for effort in ("FFTW_ESTIMATE", "FFTW_MEASURE"):
        start = time.perf_counter()
        plan = pyfftw.FFTW(aligned, spectrum, axes=(0, 1), flags=(effort,), threads=THREADS)
        planning = time.perf_counter() - start
        aligned[:] = values
        print(f"  {effort:20s}{seconds(3, plan):8.3f}, and {planning:.1f} s to plan")


def sun(size, library):
    light = shadows(size)
    print(f"\nsun, {size} x {size} RGB, shadows; 4 T are one transform of the light and three back")
    for path in (0.3, 1.0, 4.0):
        arguments = light, SUN, library, (0.6, 0.9, 0.3), (path, 0.7 * path, 0.5 * path), 1.0
        cost = seconds(2, beamspread.convolve, *arguments)
        unit = transform_seconds(size)
        print(f"  mean free path {path:4.1f} texels: {cost:7.2f} s = {cost / unit:5.1f} T")


def far(size, library):
    """Light that spreads farther than the plane, without and with a coarser grid; three albedos, three kernels."""
    light, arguments = shadows(size), ((0.999, 0.998, 0.997), (40.0, 28.0, 20.0))
    unit = transform_seconds(size)
    print(f"\nsun, {size} x {size} RGB, ior 1.4, albedo .999, mean free path 40 texels")
    lights = _native.PlaneLight.of_channels(light, np.array(SUN, np.float32), 3)
    for name, coarsening in (("padded by all of the reach", 1), ("as the solver chooses", 0)):
        rest = [library] * 3, *map(list, arguments), (1.0, 1.0), "fft", 1e-3, 0, None
        cost = seconds(2, _native.convolve, lights, *rest, coarsening=coarsening)
        print(f"  {name:28s}: {cost:7.2f} s = {cost / unit:5.1f} T")


MEMORY = """
import time, numpy, beamspread
size, path = {size}, {path}
{light}
library = beamspread.library(beamspread.Medium(0.8, 1.4))
wall, cpu = time.perf_counter(), time.process_time()
beamspread.convolve(*light, library, 0.999, (path, 0.7 * path, 0.5 * path), 1.0)
print(time.perf_counter() - wall, time.process_time() - cpu)
print([line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")][0])
"""

SUN_LIGHT = """
squares = numpy.random.default_rng(1).random((16, 16)) < 0.6
light = numpy.kron(squares, numpy.ones((size // 16,) * 2, numpy.float32)), {sun}
"""

# Row by row, as arrays of the whole plane would count.
LAMP_LIGHT = """
across = (numpy.arange(size, dtype=numpy.float32) + 0.5) / size - 0.5
light = numpy.empty((size, size), numpy.float32), numpy.empty((size, size, 3), numpy.float32)
for irradiance, direction, y in zip(*light, across):
    direction[:] = numpy.stack([across, numpy.full_like(across, y), numpy.full_like(across, -0.1)], -1)
    distance = numpy.linalg.norm(direction, axis=-1)
    irradiance[:] = 0.1 / distance**3
    direction /= distance[:, None]
"""


def memory(sizes):
    """Peak memory of a separate process, input and result included."""
    print("\nRGB, gray irradiance, ior 1.4, albedo .999: peak memory of the process, wall clock and CPU seconds")
    lights = {"sun": SUN_LIGHT.format(sun=SUN), "lamp": LAMP_LIGHT}
    for size in sizes:
        for name, path in (("sun", 4.0), ("sun", 40.0), ("lamp", 4.0)):
            code = MEMORY.format(size=size, path=path, light=lights[name])
            output = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
            wall, cpu, kilobytes = map(float, output.split())
            print(
                f"  {size:6d}, {name:4}, mean free path {path:4.1f}: {kilobytes / 2**20:5.2f} GiB, {wall:6.1f} s, "
                f"{cpu:6.1f} s"
            )


def scipy_sun(size, library):
    """The same kernels, given to SciPy as an image."""
    light = shadows(size)
    path, reach = 4.0, 255
    one = np.zeros((2 * reach + 1, 2 * reach + 1), np.float32)
    one[reach, reach] = 1
    arguments = SUN, library, (0.6, 0.9, 0.3), path, 1.0
    kernels = beamspread.convolve(one, *arguments, solver="direct")
    ours, cost = None, math.inf
    for _ in range(2):
        start = time.process_time()
        ours = beamspread.convolve(light, *arguments)
        cost = min(cost, time.process_time() - start)
    print(f"\nsun, {size} x {size} RGB, beside SciPy with kernels of {2 * reach + 1} texels made beforehand")
    print(f"  ours         {cost:7.2f} s, kernels included")
    for function in (fftconvolve, oaconvolve):
        start = time.process_time()
        theirs = np.stack([function(light, kernels[..., c], mode="same") for c in range(3)], -1)
        took = time.process_time() - start
        print(
            f"  {function.__name__:12s} {took:7.2f} s; largest difference {abs(theirs - ours).max() / ours.max():.1e}"
        )


def lamps(size, libraries):
    """Errors against nearly all terms of the basis; the worst texel's relative to the 17 x 17 around.

    Two lamps, each the mirror image of the other, need the same terms; beside one in the middle, whose light is less
    grazing at the borders, each of them may need more.
    """
    light, aside, mirrored = lamp(size), lamp(size, 0.2, -0.1), lamp(size, -0.2, 0.1)
    sets = {"middle": [light], "aside": [aside], "mirrored": [aside, mirrored], "both": [light, aside]}
    options = {"tolerance": 5e-3}
    print(f"\npoint lamp at a tenth of the width, {size} x {size} RGB, tolerance {options['tolerance']}")
    for ior, albedo in ((1.0, 0.9), (1.4, 0.99)):
        for paths in ((1.0, 1.0, 1.0), (4.0, 4.0, 4.0), (1.0, 0.7, 0.5)):
            rest = libraries[ior], albedo, paths, 1.0
            exact = beamspread.convolve(*light, *rest, tolerance=1e-5)
            error = np.abs(beamspread.convolve(*light, *rest, **options) - exact)
            worst = (error / uniform_filter(exact, (17, 17, 0), mode="nearest")).max()
            unit = transform_seconds(size)
            cost = dict.fromkeys(sets, math.inf)
            for _ in range(5):  # turn by turn, for the same luck
                for name, lights in sets.items():
                    cost[name] = min(cost[name], seconds(1, beamspread.convolve_lights, lights, *rest, **options))
            one = cost["middle"]
            print(
                f"  ior {ior}, albedo {albedo}, paths {paths}: {one:6.2f} s = {one / unit:5.1f} T, "
                f"L1 {error.sum() / exact.sum():.1e}, worst {worst:.1e}\n"
                f"    a lamp aside costs {cost['aside'] / one:.2f} times that, it and its mirror image "
                f"{cost['mirrored'] / cost['aside']:.2f} times one of them, it and the lamp in the middle "
                f"{cost['both'] / cost['aside']:.2f} times the one, {cost['both'] / one:.2f} times the other"
            )


def budgets(size, libraries):
    """The less memory, the more tiles, and the more often their borders are transformed."""
    print(
        f"\npoint lamp, {size} x {size} RGB, mean free paths 4, 2.8 and 2 texels: CPU seconds with less and less memory"
    )
    for ior, albedo in ((1.0, 0.9), (1.4, 0.999)):
        lights = _native.PlaneLight.of_channels(*lamp(size), 3)
        rest = [libraries[ior]] * 3, [albedo] * 3, [4.0, 2.8, 2.0], (1.0, 1.0), "fft", 5e-3, 0, None
        costs = [seconds(2, _native.convolve, lights, *rest, memory=size**2 * per_texel) for per_texel in (320, 80, 20)]
        print(f"  ior {ior}: " + ", ".join(f"{cost:.2f} s" for cost in costs) + " with 320, 80, 20 bytes per texel")


def check(size, library):
    """Full rank is as good as direct, where that is feasible."""
    arguments = *lamp(size), library, (0.6, 0.9, 0.3), 1.0, 1.0
    direct = beamspread.convolve(*arguments, solver="direct")
    error = np.abs(beamspread.convolve(*arguments, tolerance=1e-5) - direct)
    print(f"\nfull rank against direct, lamp, {size} x {size}: L1 {error.sum() / direct.sum():.1e}")


def growth(sizes, library):
    print("\ngrowth, sun and lamp (tolerance 0.005), CPU seconds over N^2 log N, relative to the first")
    first = None
    for size in sizes:
        costs = []
        for light in ((shadows(size), SUN), lamp(size)):
            arguments = *light, library, 0.9, 1.0, 1.0
            costs.append(seconds(2, beamspread.convolve, *arguments, tolerance=5e-3) / (size**2 * math.log(size)))
        first = first or costs
        print(f"  {size:6d}: {costs[0] / first[0]:.2f} {costs[1] / first[1]:.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="quarter of the size")
    smaller = 4 if parser.parse_args().quick else 1
    libraries = {ior: beamspread.library(beamspread.Medium(0.8, ior)) for ior in (1.0, 1.4)}
    print(f"{THREADS} threads")
    transforms(4096 // smaller)
    sun(4096 // smaller, libraries[1.0])
    far(4096 // smaller, libraries[1.4])
    memory([8192 // smaller, 16384 // smaller])
    scipy_sun(2048 // smaller, libraries[1.0])
    check(96, libraries[1.0])
    lamps(2048 // smaller, libraries)
    budgets(2048 // smaller, libraries)
    growth([n // smaller for n in (512, 1024, 2048, 4096, 8192)], libraries[1.0])


if __name__ == "__main__":
    main()
