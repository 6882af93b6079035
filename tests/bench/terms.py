"""The choice of terms where directions change: transforms, time and errors over lights that are hard for it.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/terms.py [SIZE]

Errors against all terms, of the worst texel relative to the mean of the 17 x 17 around and of the sum, both as parts of
what is allowed; CPU seconds of the choice together with the transforms.
"""

import sys
import time

import numpy as np
from beamspread import Medium, _native, library
from scipy.ndimage import uniform_filter

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

# Places in widths of the plane.
LAMPS = {
    "lamp": [(0.1, -0.2, 0.1)],
    "high": [(0.1, 0.05, 0.4)],
    "aside": [(0.3, 0.0, 0.1)],
    "grazing": [(-0.2, 0.1, 0.01)],
    "outside": [(0.8, 0.1, 0.02)],
    "beside": [(0.2, -0.2, 0.02)],
    "two lamps": [(-0.02, -0.2, 0.05), (0.22, 0.15, 0.05)],
}


def travel(theta, beta):
    field = [np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), -np.cos(theta)]
    return np.stack(field, -1).astype(np.float32)


def lamp(x, y, height):
    across = (np.arange(SIZE) + 0.5) / SIZE - 0.5
    field = np.stack([*np.meshgrid(across - x, across - y), np.full((SIZE, SIZE), -height)], -1)
    distance = np.linalg.norm(field, axis=-1, keepdims=True)
    return (height / distance[..., 0] ** 3).astype(np.float32), (field / distance).astype(np.float32)


def noise(rng, waves):
    """Smooth noise of standard deviation 1."""
    frequencies = np.hypot(*np.meshgrid(*[np.fft.fftfreq(SIZE) * SIZE] * 2))
    spectrum = np.fft.fft2(rng.normal(size=(SIZE, SIZE))) * np.exp(-0.5 * (frequencies / waves) ** 2)
    smooth = np.fft.ifft2(spectrum).real
    return smooth / smooth.std()


def beams(kind, rng):
    if kind in LAMPS:
        return [lamp(*place) for place in LAMPS[kind]]
    if kind == "smooth":  # few texels have extreme angles
        directions = travel(np.radians(np.clip(45 + 20 * noise(rng, 3), 0, 89)), 2 * noise(rng, 3))
    else:
        side = {"texels": 1, "blocks": 8}[kind]
        shape = SIZE // side, SIZE // side
        theta, beta = np.radians(rng.uniform(0, 89, shape)), rng.uniform(0, 2 * np.pi, shape)
        directions = np.kron(travel(theta, beta), np.ones((side, side, 1), np.float32))
    return [(np.ones((SIZE, SIZE), np.float32), directions)]


def mask(kind, rng):
    lit = np.zeros((SIZE, SIZE), np.float32)
    if kind == "texels":
        lit[rng.random(lit.shape) < 0.3] = 1
    elif kind == "blocks":
        lit = np.kron(rng.random((8, 8)) < 0.6, np.ones((SIZE // 8, SIZE // 8))).astype(np.float32)
    else:
        part = {"none": np.s_[:], "half": np.s_[:, : SIZE // 2], "stripes": np.s_[:, ::8], "corner": np.s_[:33, :33]}
        lit[part[kind]] = 1
    return lit


def main():
    libraries = {ior: library(Medium(0.8, ior)) for ior in (1.0, 1.4)}
    print(f"{SIZE} x {SIZE} RGB: transforms, CPU seconds, worst texel and sum over what is allowed")
    for ior, albedo, kind, shadows, path in CASES:
        rng = np.random.default_rng(31)
        lit = mask(shadows, rng)
        lights = [_native.PlaneLight(irradiance * lit, way, [1, 1, 1]) for irradiance, way in beams(kind, rng)]
        rest = [libraries[ior]] * 3, list(albedo), [path, 0.7 * path, 0.5 * path], (1.0, 1.0)
        exact = _native.convolve(lights, *rest, "fft", 1e-7, 0, None)
        nearby = uniform_filter(exact, (17, 17, 0), mode="nearest")
        print(f"ior {ior}, albedo {albedo}, {kind}, shadows {shadows}, mean free path {path}")
        for tolerance in (1e-2, 5e-3, 1e-3):
            count = _native.transforms(lights, *rest, tolerance)
            start = time.process_time()
            error = np.abs(_native.convolve(lights, *rest, "fft", tolerance, 0, None) - exact)
            cost = time.process_time() - start
            worst = (error / (tolerance * nearby + 1e-5 * exact.max((0, 1)))).max()
            total = (error.sum((0, 1)) / exact.sum((0, 1))).max() / tolerance
            print(f"  tolerance {tolerance:5g}: {count:4d}, {cost:6.2f} s, {worst:.2f}, {total:.3f}")


if __name__ == "__main__":
    main()
