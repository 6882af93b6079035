"""The choice of terms where directions change: transforms, time and errors for difficult lights.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/terms.py [SIZE]

Errors against all terms, of the worst texel relative to the mean of the 17 x 17 around and of the sum, both as
fractions of the allowed error; CPU seconds of the choice together with the transforms.
"""

import sys
import time
from pathlib import Path

import _native_test
import numpy as np
from beamspread import Medium, _native, library
from scipy.ndimage import uniform_filter

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers import lights_of, lit_texels

SIZE = int(sys.argv[1]) if len(sys.argv) > 1 else 512

# ior, albedo, light, shadows, mean free path in texels
CASES = [
    (1.0, (0.9, 0.9, 0.9), "lamp", "none", 4.0),
    (1.0, (0.9, 0.9, 0.9), "lamp", "blocks", 1.0),
    (1.0, (0.6, 0.9, 0.3), "high", "blocks", 3.0),
    (1.0, (0.6, 0.9, 0.3), "grazing", "blocks", 0.4),
    (1.0, (0.6, 0.9, 0.3), "outside", "none", 200.0),
    (1.0, (0.9, 0.9, 0.9), "aside", "corner", 115.0),
    (1.0, (0.9, 0.9, 0.9), "beside", "half", 200.0),
    (1.0, (0.6, 0.9, 0.3), "blocks", "none", 20.0),
    (1.0, (0.6, 0.9, 0.3), "smooth", "half", 5.0),
    (1.4, (0.99, 0.99, 0.99), "lamp", "none", 4.0),
    (1.4, (0.99, 0.99, 0.99), "lamp", "blocks", 1.0),
    (1.4, (0.999, 0.99, 0.9), "blocks", "half", 0.13),
    (1.4, (0.999, 0.9, 0.5), "smooth", "texels", 1.9),
    (1.4, (0.99, 0.9, 0.3), "two lamps", "stripes", 0.11),
    (1.4, (0.999, 0.99, 0.9), "texels", "corner", 30.0),
    (1.4, (0.99, 0.9, 0.3), "grazing", "half", 15.0),
    (1.4, (0.99, 0.9, 0.3), "grazing", "half", 62.0),
]


def main():
    libraries = {ior: library(Medium(0.8, ior)) for ior in (1.0, 1.4)}
    print(f"{SIZE} x {SIZE} RGB: transforms, CPU seconds, worst texel and sum over what is allowed")
    for ior, albedo, kind, shadows, path in CASES:
        rng = np.random.default_rng(31)
        lit = lit_texels(shadows, SIZE, rng)
        lights = [
            _native.PlaneLight(irradiance * lit, way, [1, 1, 1]) for irradiance, way in lights_of(kind, SIZE, rng)
        ]
        rest = [libraries[ior]] * 3, list(albedo), [path, 0.7 * path, 0.5 * path], (1.0, 1.0)
        exact = _native.convolve(lights, *rest, "fft", 1e-7, 0, None)
        nearby = uniform_filter(exact, (17, 17, 0), mode="nearest")
        print(f"ior {ior}, albedo {albedo}, {kind}, shadows {shadows}, mean free path {path}")
        for tolerance in (1e-2, 5e-3, 1e-3):
            count = _native_test.transforms(lights, *rest, tolerance)
            start = time.process_time()
            error = np.abs(_native.convolve(lights, *rest, "fft", tolerance, 0, None) - exact)
            cost = time.process_time() - start
            worst = (error / (tolerance * nearby + 1e-5 * exact.max((0, 1)))).max()
            total = (error.sum((0, 1)) / exact.sum((0, 1))).max() / tolerance
            print(f"  tolerance {tolerance:5g}: {count:4d}, {cost:6.2f} s, {worst:.2f}, {total:.3f}")


if __name__ == "__main__":
    main()
