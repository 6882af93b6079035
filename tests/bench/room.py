"""A room under a sky with a sun, 20 area lights and a million triangles: time, memory, noise of the luminance.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/room.py [SIZE]

Noise is the difference of two bakes with other rays, over the square root of two, relative to the mean of 17 x 17
texels.
"""

import resource
import sys
import time

import numpy as np
from beamspread import library, presets
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.spread_light import spread
from beamspread.core.bake.spreading import Spreading
from beamspread.core.bake.surface import channel_media
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, WorldLight
from beamspread.core.scene.occluders import Mesh, Occluder
from scipy.ndimage import uniform_filter

SIDE = 4.0  # of the floor, metres
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def floor(size):
    corner = (-SIDE / 2, -SIDE / 2, 0.0)
    return Grid(corner, *IDENTITY, SIDE / size, SIDE / size, size, size, np.ones((size, size), np.float32))


def sky(height=512):
    """Brighter towards the horizon, with a sun of half a degree that gives as much light as all of it."""
    elevation = (np.arange(height) + 0.5) / height * np.pi - np.pi / 2
    azimuth = np.pi - (np.arange(2 * height) + 0.5) / height * np.pi
    z, x = np.sin(elevation)[:, None], np.cos(elevation)[:, None] * np.cos(azimuth)
    y = np.cos(elevation)[:, None] * np.sin(azimuth)
    radiance = np.where(z > 0, 0.3 + 0.7 * (1 - z) ** 3, 0.05)[..., None] * [0.5, 0.7, 1.0]
    sun = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])
    in_sun = (sun[0] * x + sun[1] * y + sun[2] * z) > np.cos(np.radians(0.5))
    radiance = radiance + in_sun[..., None] * 1.5 / (in_sun.sum() * (np.pi / height) ** 2)
    return WorldLight("World", 1.0, (1.0, 1.0, 1.0), True, radiance.astype(np.float32), IDENTITY)


def areas(count=20):
    rng = np.random.default_rng(1)
    return [
        AreaLight(
            f"Area {i}", 10.0, tuple(rng.uniform(0.2, 1, 3)), True, tuple(place), IDENTITY, 0.5, 0.3, False, np.pi
        )
        for i, place in enumerate(rng.uniform((-1.8, -1.8, 1.2), (1.8, 1.8, 2.5), (count, 3)).tolist())
    ]


def balls(count=100, rings=71):
    """Spheres of 2 rings^2 triangles each that stand on the floor."""
    rng = np.random.default_rng(2)
    polar = np.linspace(0, np.pi, rings + 1)[:, None]
    turn = np.linspace(0, 2 * np.pi, rings, endpoint=False)
    unit = np.stack(np.broadcast_arrays(np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)), -1)
    at = np.arange((rings + 1) * rings).reshape(rings + 1, rings)
    right = np.roll(at, -1, axis=1)
    quads = [(at[:-1], at[1:], right[1:]), (at[:-1], right[1:], right[:-1])]
    faces = np.concatenate([np.stack(quad, -1).reshape(-1, 3) for quad in quads]).astype(np.uint32)
    radii, places = rng.uniform(0.03, 0.15, count), rng.uniform(-1.9, 1.9, (count, 2))
    parts = [
        Mesh(radius * unit.reshape(-1, 3) + (x, y, radius), faces) for radius, (x, y) in zip(radii, places.tolist())
    ]
    return [Occluder(f"Ball {i}", part) for i, part in enumerate(parts)]


def bake(size, seed, shapes):
    started = time.perf_counter()
    lights = [sky(), *areas()]
    marble = presets()["marble"]
    sources = [library(medium) for medium in channel_media(marble, 0.0)]
    spreading = Spreading(Illumination(lights, shapes), marble, sources, BakeSettings(), seed=seed)
    result = spread([floor(size)], spreading)[0]
    return result, time.perf_counter() - started


def main():
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    shapes = balls()
    count = sum(len(one.mesh.triangles) for one in shapes)
    print(f"{count} triangles, {size} x {size} texels, 20 area lights and the sky")
    first, seconds = bake(size, 0, shapes)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    second, _ = bake(size, 1, shapes)
    around = uniform_filter(first + second, (17, 17, 1)) / 2
    noise = np.abs(first - second) / np.sqrt(2) / around
    rms, most = np.sqrt((noise**2).mean()), np.quantile(noise, 0.99)
    print(f"{seconds:.1f} s, {peak:.2f} GiB; noise rms {rms:.2%}, 99 % below {most:.2%}")


if __name__ == "__main__":
    main()
