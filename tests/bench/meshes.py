"""Planes, islands, UV maps and outlines of large meshes: CPU seconds, and memory for each corner of the faces.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/meshes.py [--quick]
"""

import argparse
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.islands import check_map
from beamspread.core.scene.planes import find_planes
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.unwrap import unwrap

RESOLUTION = 1024


def measured(name, function):
    start = time.process_time()
    result = function()
    print(f"  {name:42} {time.process_time() - start:7.2f} s", flush=True)
    return result


def quads(points):
    """Polygons of a grid of points (rows, columns, 3), with their columns and rows as UVs."""
    rows, columns = points.shape[:2]
    uvs = np.stack(np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows)), -1)
    corners, uvs = (
        np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=2).reshape(-1, at.shape[2])
        for at in (points, uvs)
    )
    normals = np.zeros((len(corners) // 4, 3))
    return Polygons(corners, uvs, np.arange(0, len(corners) + 1, 4), normals)


def square(side):
    x, y = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0, 1, side + 1))
    return quads(np.stack([x, y, 0 * x], -1))


def folded(planes, across, along):
    """A sheet with edges of 90 degrees, each plane `across` faces wide and `along` long."""
    x, y = np.meshgrid(np.linspace(0, planes, planes * across + 1), np.linspace(0, planes / 10, along + 1))
    return quads(np.stack([x, y, np.abs(x % 2 - 1)], -1))


def disk(corners):
    """One face with its texels."""
    angles = 2 * np.pi * np.arange(corners) / corners
    circle = np.stack([np.cos(angles), np.sin(angles)], -1)
    points = np.column_stack([circle, np.zeros(corners)])
    return Polygons(points, 0.5 + 0.5 * circle, np.array([0, corners]), np.array([[0, 0, 1.0]]))


def star(corners):
    """One face with edges across the whole image."""
    angles, radii = 2 * np.pi * np.arange(corners) / corners, np.where(np.arange(corners) % 2, 0.02, 0.49)
    uvs = 0.5 + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], -1)
    return Polygons(np.column_stack([uvs, np.zeros(corners)]), uvs, np.array([0, corners]), np.array([[0, 0, 1.0]]))


def slivers(count):
    """Triangles from side to side of the image, beside each other."""
    places = np.arange(count) / count
    triangle = (0, 0), (1 / count, 0), (0, 1)
    uvs = np.stack([np.stack([places + part, 0 * places + row], -1) for part, row in triangle], 1)
    corners = uvs.reshape(-1, 2)
    normals = np.zeros((count, 3))
    return Polygons(np.pad(corners, ((0, 0), (0, 1))), corners, np.arange(0, 3 * count + 1, 3), normals)


def charts(polygons, side=RESOLUTION):
    return build_receiver(flatten(polygons), side, side)


CHILD = """
import sys
import meshes
polygons, work = meshes.square({side}), meshes.{work}
def peak():
    return 1024 * int([line for line in open("/proc/self/status") if line.startswith("VmHWM")][0].split()[1])
before = peak() - sum(part.nbytes for part in (polygons.corners, polygons.uvs, polygons.starts, polygons.normals))
work(polygons)
print((peak() - before) / len(polygons.corners))
"""


def memory(side):
    print(f"memory for each corner of {side**2} faces, their arrays included; a bake counts with 600 bytes")
    for work in ("check_map", "flatten", "charts", "unwrap"):
        code = f"sys_path = __import__('sys').path; sys_path.insert(0, {sys.path[0]!r})\n"
        code += CHILD.format(side=side, work=work)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        print(f"  {work:42} {float(done.stdout):7.0f} bytes", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the faces")
    smaller = 10 if parser.parse_args().quick else 1

    sheet = folded(100, 10, 10)
    print(f"{sheet.count} faces of 100 planes")
    measured("find_planes", lambda: find_planes(sheet, 1e-6))
    uvs = measured("unwrap", lambda: unwrap(sheet))
    measured("check_map", lambda: check_map(replace(sheet, uvs=uvs)))
    measured("flatten and build_receiver", lambda: charts(replace(sheet, uvs=uvs)))

    side = int(np.sqrt(1_000_000 / smaller))
    print(f"{side**2} faces of one plane")
    measured("check_map", lambda: check_map(square(side)))
    measured("find_planes", lambda: find_planes(square(side), 1e-6))
    measured("flatten and build_receiver", lambda: charts(square(side)))
    measured("unwrap", lambda: unwrap(square(side)))

    corners = 100_000 // smaller
    print(f"an outline of {corners} corners")
    measured("flatten and build_receiver", lambda: charts(disk(corners)))
    measured("unwrap", lambda: unwrap(disk(corners)))
    print(f"a star of {corners} edges across an image of 4096 x 4096")
    measured("flatten and build_receiver", lambda: charts(star(corners), 4096))
    print(f"{side**2} slivers across the image")
    measured("check_map", lambda: check_map(slivers(side**2)))
    memory(side)


if __name__ == "__main__":
    main()
