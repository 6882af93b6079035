"""Adaptive against direct: beams, seconds, ratio and error, on the paper's Fig. 9 scene and on masks that are hard.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/adaptive.py [--size N] [--path TEXELS] [--tolerance T]
"""

import argparse
import math
import time

import beamspread
import numpy as np

SLANTED = (math.sin(math.radians(55)), 0.0, -math.cos(math.radians(55)))
ALBEDO = (0.6, 0.9, 0.3)


def masks(size):
    """Name -> irradiance."""
    y, x = np.mgrid[:size, :size]
    middle = size / 2 - 0.5
    random = np.random.default_rng(1).random((size, size))
    return {
        "fig. 9: obstacle": np.hypot(x - middle, y - middle) > 0.26 * size,
        "full": x >= 0,
        "full, odd size": (x >= 0)[1:, : -size // 4],
        "empty": x < 0,
        "one texel": (x == size // 3) & (y == size // 2),
        "checkerboard": (x + y) % 2,
        "checkerboard of 8": (x // 8 + y // 8) % 2,
        "stripes": x % 2,
        "thin slanted stripes": (x + 2 * y) % 17 == 0,
        "half of all, at random": random < 0.5,
        "gradient": 1 + x / size,
        "row": (x >= 0).reshape(1, -1)[:, : 10 * size],
    }


def lamp(size, height=0.3):
    """Irradiance and directions of a point lamp above the middle."""
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size - 0.5] * 2)
    field = np.stack([x, y, np.full_like(x, -height)], -1)
    distance = np.linalg.norm(field, axis=-1, keepdims=True)
    return height / distance[..., 0] ** 3, field / distance


def timed(runs, function):
    """Result, and the least CPU seconds of several runs."""
    seconds = []
    for _ in range(runs):
        start = time.process_time()
        result = function()
        seconds.append(time.process_time() - start)
    return result, min(seconds)


def compare(name, irradiance, direction, library, options):
    arguments = (np.asarray(irradiance, np.float32), direction, library, ALBEDO, options.path, 1.0)
    direct, direct_seconds = timed(1, lambda: beamspread.convolve(*arguments, solver="direct"))
    adaptive, seconds = timed(
        3, lambda: beamspread.convolve(*arguments, solver="adaptive", tolerance=options.tolerance)
    )
    error = np.abs(adaptive - direct.astype(np.float64))
    beams = len(beamspread.adaptive_beams(arguments[0], direction, tolerance=options.tolerance))
    total, peak = max(direct.sum(dtype=np.float64), 1e-300), max(direct.max(), 1e-300)
    print(
        f"{name:24} {np.count_nonzero(arguments[0]):7} {beams:7} {direct_seconds:8.3f} {seconds:8.4f} "
        f"{direct_seconds / seconds:7.1f} {error.sum() / total:9.1e} {error.max() / peak:9.1e}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=240)
    parser.add_argument("--path", type=float, default=5.0, help="mean free path in texels")
    parser.add_argument("--tolerance", type=float, default=1e-3)
    options = parser.parse_args()
    library = beamspread.library(beamspread.Medium(g=0.8), "preview")
    print(f"{'':24}   lit   beams   direct s  adaptive   ratio  L1 error  worst / peak")
    for name, mask in masks(options.size).items():
        compare(name, mask, SLANTED, library, options)
    light, direction = lamp(options.size // 3)
    compare("lamp, a ninth of the size", light, direction, library, options)


if __name__ == "__main__":
    main()
