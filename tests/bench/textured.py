"""Cost of an albedo of each texel over one albedo: veins of .87 to .99, RGB, a mean free path for each channel.

Usage: tests/bench/run.sh textured, or python textured.py [SIDE].
"""

import sys
import time

import numpy as np
from beamspread import Medium, convolve, library

NOISE = 0.01


def veins(side: int) -> np.ndarray:
    """Albedos (side, side, 3)."""
    y, x = np.mgrid[:side, :side]
    bent = np.sin(0.05 * x + 1.3 * np.sin(0.035 * y)) * np.sin(0.03 * y + 0.02 * x)
    return (0.87 + 0.12 * np.abs(bent) ** 0.5)[..., None] * (1, 0.98, 0.95)


def lamp(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance and directions of a lamp half as high as the plane is wide."""
    y, x = np.mgrid[:side, :side] + 0.5 - side / 2
    way = np.stack([x, y, np.full_like(x, -side / 2)], -1)
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    return (side / 2) ** 3 / distance[..., 0] ** 3, way / distance


def seconds(*arguments: object, **options: object) -> tuple[float, float]:
    """CPU seconds of `convolve`, and the noise it reports, 0 without a map."""
    noises = [0.0]
    begin = time.process_time()
    convolve(*arguments, **options, report_noise=noises.append)
    return time.process_time() - begin, noises[-1]


def main() -> None:
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    even = np.ones((side, side)), (0.0, 0.6, -0.8)
    for ior in (1.0, 1.4):
        known = library(Medium(0.8, ior))
        for name, light in (("sun", even), ("lamp", lamp(side))):
            rest = known, (1.0, 0.8, 0.6), 1.0
            plain, _ = seconds(*light, rest[0], 0.9, *rest[1:])
            map_time, noise = seconds(*light, rest[0], veins(side), *rest[1:], noise=NOISE)
            print(
                f"{name}, ior {ior:g}: one albedo {plain:.2f} s, a map {map_time:.2f} s, {map_time / plain:.1f} times, "
                f"noise {noise:.3f}"
            )


if __name__ == "__main__":
    main()
