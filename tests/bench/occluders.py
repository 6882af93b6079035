"""Occluders: time and memory to build and trace many triangles, as copies and as instances; cost of see-through ones.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/occluders.py [--quick]

Every line is a process of its own: seconds of wall clock to build, seconds for a lamp and for a sun on 512 x 512 texels
with 16 rays each, traced from every texel, and the peak of the process's memory.
"""

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from beamspread.core.native import native

LIGHTS = native.PointLight((0.3, 0.2, 1.5)), native.SunLight((0.3, 0.2, -1))


def sphere(triangles):
    """About that many triangles, radius 1."""
    steps = max(2, round(np.sqrt(triangles / 4)))
    zenith, azimuth = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, 2 * steps + 1))
    points = np.stack([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], -1)
    corner = (np.arange(2 * steps)[:, None] * (steps + 1) + np.arange(steps)).ravel()
    a, b, c, d = corner, corner + 1, corner + steps + 2, corner + steps + 1
    return points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)


def spheres(count, triangles, transmittances=()):
    """In random places above the floor, with an area of about a quarter of the floor's in all."""
    rng = np.random.default_rng(1)
    linear = np.eye(3) * 0.5 / np.sqrt(count)
    places = np.stack([np.column_stack([linear, at]) for at in rng.uniform((-1, -1, 0.1), (1, 1, 0.8), (count, 3))])
    vertices, faces = sphere(triangles)
    materials = np.zeros((len(faces), 1), np.uint32) if transmittances else None
    uvs = np.ascontiguousarray(3 * vertices[faces][..., :2].reshape(-1, 6), np.float32) if transmittances else None
    return native.OccluderMesh(vertices, faces, places.reshape(count, 12), list(transmittances), materials, uvs)


def grey(level):
    return native.ColorTexture((level,) * 3)


def leaf():
    """Four tenths of an image of 1024 x 1024 are opaque."""
    texels = (np.random.default_rng(2).random((1024, 1024, 1)) > 0.4).astype(np.float32)
    return native.ColorTexture.from_image(texels)


COPIES, INSTANCES = 1 << 62, 0
CASES = {
    "1000 of 10 000, instances": lambda part: (spheres(1000 // part, 10_000), INSTANCES),
    "1000 of 10 000, copies": lambda part: (spheres(1000 // part, 10_000), COPIES),
    "100 000 of 100, instances": lambda part: (spheres(100_000 // part, 100), INSTANCES),
    "100 000 of 100, copies": lambda part: (spheres(100_000 // part, 100), COPIES),
    "500 000 of 16, instances": lambda part: (spheres(500_000 // part, 16), INSTANCES),
    "500 000 of 16, copies": lambda part: (spheres(500_000 // part, 16), COPIES),
    "100 of 1000, opaque": lambda part: (spheres(100, 1000), COPIES),
    "100 of 1000, half opaque": lambda part: (spheres(100, 1000, [grey(0.5)]), COPIES),
    "100 of 1000, leaves": lambda part: (spheres(100, 1000, [leaf()]), COPIES),
}


def run(name, part):
    mesh, max_copied = CASES[name](part)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    occluders = native.Occluders([mesh], max_copied=max_copied)
    times = [time.perf_counter() - start]
    grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 1 / 256, 1 / 256, 512, 512)
    for light in LIGHTS:
        start = time.perf_counter()
        native.gather_rays(grid, light, occluders, find_shadows=False)
        times.append(time.perf_counter() - start)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 2**20
    print(f"{name:28}{occluders.triangle_count:12d}" + "".join(f"{one:9.2f}" for one in times) + f"{grown:10.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the spheres")
    parser.add_argument("--case", help="only this one, in this process")
    options = parser.parse_args()
    part = 10 if options.quick else 1
    if options.case:
        run(options.case, part)
        return
    print(f"{'':28}{'triangles':>12}{'build':>9}{'lamp':>9}{'sun':>9}{'GiB':>10}", flush=True)
    for name in CASES:
        rest = ["--quick"] if options.quick else []
        subprocess.run([sys.executable, str(Path(__file__)), "--case", name, *rest], check=True)


if __name__ == "__main__":
    main()
