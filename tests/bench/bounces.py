"""Paths of bounced light per CPU second, noise and time on scenes from open to closed.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/bounces.py [NODES]

The last column is the CPU time that a noise of 1 % of all light takes, as the variance falls in proportion to paths.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from beamspread.core.native import native
from beamspread.core.scene.lights import STRATA

from shapes import FACES, SQUARE, box, sphere

WHITE = (1.0, 1.0, 1.0)
AXES = {"x_axis": (1.0, 0.0, 0.0), "y_axis": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}
# Turns the square upright, toward -x.
UPRIGHT = np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)])


def mesh(vertices, triangles, *albedos, materials=None):
    reflectors = [native.Reflector(native.ColorTexture(tuple(np.broadcast_to(albedo, 3)))) for albedo in albedos]
    return native.OccluderMesh(np.ascontiguousarray(vertices), triangles, materials=materials, reflectors=reflectors)


def ball():
    points, triangles, _ = sphere(24)
    return mesh(points * 0.3 + (0, 0, 0.3), triangles, 0.8)


def floor():
    return mesh(SQUARE * 2, FACES, 0.5)


def sky():
    return native.EnvironmentLight(np.ones((32, 64, 3), np.float32), np.eye(3))


def open_floor():
    """A ball, a lamp."""
    scene = native.Occluders([floor(), ball()])
    return scene, [(native.PointLight((1.0, 1.0, 2.0)), (100.0,) * 3, scene)], 1.2


def table():
    """A ball in the sun and under the sky."""
    scene = native.Occluders([floor(), ball()])
    sun = native.SunLight((0.3, -1.0, -0.7), 0.01)
    return scene, [(sky(), WHITE, scene), (sun, (5.0,) * 3, scene)], 6.0


def closed_room():
    """Walls of six colors, a ball, 20 area lights."""
    rng = np.random.default_rng(1)
    walls = mesh(
        *box((-2, -2, 0), (2, 2, 2.5)),
        *rng.uniform(0.2, 0.9, (6, 3)),
        materials=np.repeat(np.arange(6), 2)[:, None].astype(np.uint32),
    )
    scene = native.Occluders([walls, ball()])
    places = rng.uniform((-1.8, -1.8, 1.2), (1.8, 1.8, 2.4), (20, 3)).tolist()
    colors = rng.uniform(2.0, 10.0, (20, 3))
    lamps = [native.AreaLight(place, np.eye(3), 0.5, 0.3, False, np.pi) for place in places]
    return scene, [(lamp, tuple(color), scene) for lamp, color in zip(lamps, colors.tolist())], 4.0


def window():
    """A room under the sky, whose wall has a window of 1.4 x 1.2 m."""
    corners, faces = box((-2, -2, 0), (2, 2, 2.5))
    is_wall = ~(corners[faces][..., 0] > 1.9).all(1)
    parts = [(0.65, 1.25, -1.35, 1.25), (0.65, 1.25, 1.35, 1.25), (0.7, 0.45, 0, 0.45), (0.7, 0.2, 0, 2.3)]
    frame = [mesh(SQUARE @ UPRIGHT * (1, y, z) + (2, at_y, at_z), FACES, 0.7) for y, z, at_y, at_z in parts]
    scene = native.Occluders([mesh(corners, faces[is_wall], 0.7), *frame])
    return scene, [(sky(), WHITE, scene)], 0.1


def main():
    nodes = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    print("| scene | paths | paths per CPU second | noise | CPU time | for 1 % |\n|---|---|---|---|---|---|")
    for make in (open_floor, table, closed_room, window):
        scene, lights, direct = make()
        grid = {"corner": (-1.0, -1.0, 1e-4), **AXES, "size": (2.0, 2.0), "nodes": (nodes, nodes)}
        began = time.process_time()
        found = native.bounced_light([grid], STRATA, lights, scene, direct, max_bounces=4, max_samples=32)
        seconds = time.process_time() - began
        paths, noise = found["paths"], found["noise"]
        wanted = seconds * (noise / 0.01) ** 2
        print(f"| {make.__name__} | {paths} | {paths / seconds:.2g} | {noise:.2%} | {seconds:.2f} s | {wanted:.2f} s |")


if __name__ == "__main__":
    main()
