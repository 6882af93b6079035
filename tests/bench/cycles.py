"""Time and error per texel of one picture by the solvers, by SciPy's convolutions and by Cycles.

    PYTHONPATH=build/stage build/venv/bin/python tests/bench/cycles.py [--plot FILE.png]

The scene of blend_examples/cycles_slab.py: a half-space of g .8 and albedo .6 .9 .3, a sun at 55 degrees, a straight
shadow border; 1024 x 1024 texels of a quarter of a mean free path. Prints a markdown table.

Error: root mean square over the texels within 18 mean free paths of the border, over their mean, green (albedo .9).
Cycles: its noise, for bakes are unbiased and the picture does not change along the border. It falls with one over the
square root of the samples, which two runs of 1152 texels check; the time for 1 % at 1024 x 1024 follows from that.
All others: the distance from the border in blend_examples/cycles_edge.csv, a run of 36 minutes, less the noise of that
file, which hides smaller errors. The noise of the simulated library is part of it.

Seconds are CPU seconds of all threads. Kernels for SciPy are made beforehand and not counted; `direct`, whose time goes
with the square of the number of texels, is extrapolated from 256 x 256.
"""

import argparse
import csv
import math
import subprocess
import tempfile
import time
from pathlib import Path

import beamspread as bs
import matplotlib as mpl
import numpy as np
import scipy.signal

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[2]
EDGE = ROOT / "blend_examples" / "cycles_edge.csv"
INSIDE = ROOT / "tests" / "bench" / "in_blender" / "cycles_noise.py"
SIZE, PITCH, ALBEDO = 1024, 0.25, (0.6, 0.9, 0.3)
DIRECT_SIZE = 256
TRAVEL = math.sin(math.radians(55)), 0.0, -math.cos(math.radians(55))
CYCLES_SAMPLES = 512, 4096
GOAL = 0.01
GREEN = 1
PHOTONS = 1_000, 10_000, 100_000


def timed(function, runs=3):
    """Its result, and the least CPU seconds."""
    seconds = []
    for _ in range(runs):
        start = time.process_time()
        result = function()
        seconds.append(time.process_time() - start)
    return result, min(seconds)


def read_edge():
    """Mean and standard error of L / E in green, by column of texels from the border's left to its right."""
    with EDGE.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    rows = [row for row in rows if row["direction"] == "toward"]
    return np.array([float(row["g"]) for row in rows]), np.array([float(row["g_se"]) for row in rows])


def resolution():
    """The smallest error that the reference shows at two standard errors: of a mean of n squares sqrt(2 / n) of it."""
    mean, noise = read_edge()
    return math.sqrt(2 * math.sqrt(2 / len(mean)) * np.mean(noise**2)) / mean.mean()


def edge_error(luminance):
    """Middle row of a baked (H, W, 3), across the border."""
    mean, noise = read_edge()
    first = (luminance.shape[1] - len(mean)) // 2
    profile = luminance[luminance.shape[0] // 2, first : first + len(mean), GREEN]
    square = np.mean((profile - mean) ** 2) - np.mean(noise**2)
    return max(math.sqrt(max(square, 0.0)) / mean.mean(), resolution())


def half_lit(size):
    lit = np.zeros((size, size), np.float32)
    lit[:, : size // 2] = 1
    return lit


def bake(library, size=SIZE, **options):
    return bs.convolve(half_lit(size), TRAVEL, library, ALBEDO, 1.0, PITCH, **options)


def kernels(library):
    """Luminance of one lit texel, as far as it can matter: (2 SIZE - 1, 2 SIZE - 1, 3)."""
    one = np.zeros((2 * SIZE - 1, 2 * SIZE - 1), np.float32)
    one[SIZE - 1, SIZE - 1] = 1
    return bs.convolve(one, TRAVEL, library, ALBEDO, 1.0, PITCH)


def with_scipy(convolve, kernel):
    """One call of `scipy.signal` per channel; returns the part that lies over the texture."""
    lit = half_lit(SIZE)
    return np.stack(
        [convolve(lit, kernel[..., c], mode="full")[SIZE - 1 : -SIZE + 1, SIZE - 1 : -SIZE + 1] for c in range(3)],
        axis=-1,
    )


def run_cycles():
    """[(samples, CPU seconds for 1024 x 1024, error)] of each run, and the error's exponent."""
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "noise.npz")
        start = ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(INSIDE), "--"]
        subprocess.run([*start, path, *map(str, CYCLES_SAMPLES)], check=True, capture_output=True)
        with np.load(path) as stored:
            results = {name: stored[name] for name in stored.files}
    runs = []
    for samples in CYCLES_SAMPLES:
        texels = results[f"luminance{samples}"][..., GREEN]
        variance = np.nanmean(np.nanvar(texels, axis=0, ddof=1))
        seconds = float(results[f"seconds{samples}"]) * SIZE**2 / texels.size
        runs.append((samples, seconds, math.sqrt(variance) / np.nanmean(texels)))
    (n0, _, e0), (n1, _, e1) = runs
    return runs, math.log(e1 / e0) / math.log(n1 / n0)


def human(seconds):
    for unit, length in (("days", 86400), ("h", 3600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.2g} s"


def shown(error):
    return f"< {error:.1%}" if error <= resolution() else f"{error:.1%}"


def draw(path, solvers, simulated, cycles, goal_seconds):
    figure, axes = plt.subplots(figsize=(10, 4.5), dpi=100, layout="constrained")
    for name, seconds, error in solvers:
        axes.plot(seconds, error, "o", label=name.replace("`", ""))
    axes.plot(*zip(*simulated), "kx", label="fft after simulating 1e3, 1e4, 1e5 photons per angle")
    seconds, errors = [run[1] for run in cycles], [run[2] for run in cycles]
    axes.plot(seconds, errors, "rs", label="Cycles, measured on fewer texels")
    axes.plot([seconds[0], goal_seconds], [errors[0], GOAL], "r:", label="Cycles, extrapolated")
    axes.set(xscale="log", yscale="log", xlabel="CPU seconds, 1024 x 1024", ylabel="error per texel")
    axes.axhline(resolution(), color="gray", lw=0.8)
    axes.text(seconds[0], resolution() * 1.05, "the reference shows no smaller ones", fontsize=8)
    axes.grid(which="both", alpha=0.3)
    figure.legend(loc="outside right upper", fontsize=8)
    figure.savefig(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", default=str(ROOT / "build" / "error_over_time.png"))
    options = parser.parse_args()

    medium = bs.Medium(g=0.8, ior=1.0)
    library = bs.library(medium)
    kernel = kernels(library)
    rows = []
    fft, fft_seconds = timed(lambda: bake(library))
    _, direct_seconds = timed(lambda: bake(library, DIRECT_SIZE, solver="direct"), 1)
    direct_seconds *= (SIZE / DIRECT_SIZE) ** 4
    adaptive, adaptive_seconds = timed(lambda: bake(library, solver="adaptive"), 1)
    rows.append(("`fft`", fft_seconds, edge_error(fft)))
    rows.append(("`adaptive`, tolerance 1e-3", adaptive_seconds, edge_error(adaptive)))
    for name in ("fftconvolve", "oaconvolve"):
        image, seconds = timed(lambda name=name: with_scipy(getattr(scipy.signal, name), kernel), 2)
        rows.append((f"SciPy `{name}`, kernels given", seconds, edge_error(image)))
    # The whole border is within the smaller texture, the light from beyond it is not: the error is that of fft.
    rows.append(("`direct`, extrapolated from 256 x 256", direct_seconds, edge_error(fft)))

    simulated = []
    for photons in PHOTONS:
        made, seconds = timed(lambda photons=photons: bs.simulate(medium, library.angles, photons), 1)
        simulated.append((seconds + fft_seconds, edge_error(bake(made))))

    cycles, exponent = run_cycles()
    _, seconds, error = cycles[-1]
    goal_seconds = seconds * (error / GOAL) ** 2

    print("| 1024 x 1024, RGB, sun with a shadow border | CPU time | error per texel | over `fft` |\n|---|---|---|---|")
    for name, spent, deviation in rows:
        print(f"| {name} | {human(spent)} | {shown(deviation)} | {spent / fft_seconds:.2g} |")
    for count, spent, deviation in cycles:
        name = f"Cycles, {count} samples, scaled from 1152 texels"
        print(f"| {name} | {human(spent)} | {deviation:.1%} | {spent / fft_seconds:.2g} |")
    print(f"| Cycles, extrapolated | {human(goal_seconds)} | {GOAL:.0%} | {goal_seconds / fft_seconds:.2g} |")
    print(f"\nCycles' error goes with the samples to the power {exponent:.2f}.")
    for (spent, deviation), photons in zip(simulated, PHOTONS):
        print(f"Simulated just now with {photons} photons per angle, then `fft`: {human(spent)}, {shown(deviation)}")
    draw(options.plot, rows, simulated, cycles, goal_seconds)
    print(f"Plot: {options.plot}")


main()
