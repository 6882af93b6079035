"""Time that shadows without rays save, by light, occluders and grid size; rays per second of lights with a size.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/gather.py [--sizes N ...]
"""

import argparse
import time

import numpy as np
from beamspread.core.native import native

LIGHTS = {
    "lamp": native.PointLight((0.3, 0.2, 1.5)),
    "spot": native.SpotLight((0.3, 0.2, 1.5), np.eye(3), 1.5, 0.3),
    "sun": native.SunLight((0.3, 0.2, -1)),
}


def card():
    """One triangle over a tenth of the plane."""
    return np.array([(-0.3, -0.3, 0.4), (0.3, -0.3, 0.4), (0, 0.3, 0.5)])


def sphere(count):
    """About that many triangles that touch each other."""
    steps = round(np.sqrt(count / 2))
    zenith, azimuth = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, steps + 1), indexing="ij")
    x, y, z = np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)
    points = 0.3 * np.stack([x, y, z], -1) + (0, 0, 0.4)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.stack([a, b, c, a, c, d], 2).reshape(-1, 3)


def leaves(count):
    """Loose triangles over the whole plane, with an area of about twice the plane's."""
    rng = np.random.default_rng(1)
    middles = rng.uniform((-1, -1, 0.1), (1, 1, 0.8), (count, 1, 3))
    return (middles + rng.normal(0, 1.5 / np.sqrt(count), (count, 3, 3))).reshape(-1, 3)


SCENES = {
    "none": None,
    "one card": card(),
    "sphere of 1e3": sphere(1000),
    "sphere of 1e5": sphere(100_000),
    "1e3 leaves": leaves(1000),
    "1e5 leaves": leaves(100_000),
}


def seconds(grid, light, occluders, find_shadows):
    """The least CPU seconds of three runs."""
    times = []
    for _ in range(3):
        start = time.process_time()
        native.gather_rays(grid, light, occluders, find_shadows=find_shadows)
        times.append(time.process_time() - start)
    return min(times)


SIZED = {
    "sun of .1": native.SunLight((0.3, 0.2, -1), 0.1),
    "sphere": native.PointLight((0.3, 0.2, 1.5), 0.2, "sphere"),
    "area": native.AreaLight((0.3, 0.2, 1.5), np.eye(3), 0.6, 0.4),
    "disk": native.AreaLight((0.3, 0.2, 1.5), np.eye(3), 0.6, 0.6, True),
    "spread": native.AreaLight((0.3, 0.2, 1.5), np.eye(3), 0.6, 0.4, False, 1.0),
    "sky": native.EnvironmentLight(np.ones((512, 1024, 3), np.float32), np.eye(3)),
}


def print_ray_rates(grid, rays=16):
    """Million rays per second and core for lights with a size, without the time to build occluders."""
    print(f"{'10^6 rays/CPU s':23}" + "".join(f"{name:>10}" for name in SIZED))
    for name, vertices in SCENES.items():
        triangles = None if vertices is None else np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
        occluders = None if vertices is None else native.Occluders([native.OccluderMesh(vertices, triangles)])
        row = f"{name:23}"
        for light in SIZED.values():
            start = time.process_time()
            native.gather_rays(grid, light, occluders, rays=rays)
            row += f"{512 * 512 * rays / (time.process_time() - start) / 1e6:10.2f}"
        print(row, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=[512, 1024])
    for size in parser.parse_args().sizes:
        grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2 / size, 2 / size, size, size)
        print(f"{size} x {size}, CPU s     " + "".join(f"{name:>8}{'all rays':>10}{'ratio':>7}" for name in LIGHTS))
        for name, vertices in SCENES.items():
            occluders = None
            if vertices is not None:
                triangles = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
                occluders = native.Occluders([native.OccluderMesh(vertices, triangles)])
            row = f"{name:23}"
            for light in LIGHTS.values():
                found, traced = (seconds(grid, light, occluders, find_shadows) for find_shadows in (True, False))
                row += f"{found:8.3f}{traced:10.3f}{traced / found:7.1f}"
            print(row, flush=True)
    print_ray_rates(native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2 / 512, 2 / 512, 512, 512))


if __name__ == "__main__":
    main()
