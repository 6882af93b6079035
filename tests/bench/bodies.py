"""The solver `surface`: time over the number of samples, beside `fft` on a plane of as many texels, and errors.

Usage: tests/bench/run.sh bodies, or python bodies.py [SAMPLES]: the largest number of samples, a million without it.

A lamp above a ball, a wavy field and a plane; ior 1.4, albedo .95, .9 and .6, in each channel another path; tolerance
.005 as bakes have it. Seconds are CPU seconds of all threads, but for *wall*.
"""

import itertools
import math
import sys
import time
from pathlib import Path

import _native_test
import numpy as np
from beamspread import Medium, convolve, library
from beamspread.core.bake.spread_light import TOLERANCE
from beamspread.core.native import native

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bent_shapes import ball as round_mesh
from bent_shapes import hills, texels_of

ALBEDO = (0.95, 0.9, 0.6)
PATHS = np.array((1.0, 0.8, 0.6))
WHITE = [1.0, 1.0, 1.0]
MEDIUM = Medium(0.8, 1.4)
LARGE_ALBEDO = (0.99904, 0.9984, 0.99763)
"""Marble's, without anisotropy."""
RUNS = 4
"""Runs of which the least counts."""
PER_SECOND = 100_000 / 3
"""Samples per second that are asked for, with one lamp on two cores."""


def across(normal):
    helper = np.where(np.abs(normal[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    tangent = np.cross(helper, normal)
    return tangent / np.linalg.norm(tangent, axis=1, keepdims=True)


def ball(count):
    """Even spirals (Fibonacci) on a ball of radius 1."""
    number = np.arange(count) + 0.5
    z, azimuth = 1 - 2 * number / count, number * math.pi * (1 + math.sqrt(5))
    radius = np.sqrt(1 - z**2)
    normal = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], 1)
    return normal, normal, np.full(count, 4 * math.pi / count)


def grid(count):
    side = round(math.sqrt(count))
    line = (np.arange(side) + 0.5) / side * 2 - 1
    y, x = (values.ravel() for values in np.meshgrid(line, line, indexing="ij"))
    return x, y, (2 / side) ** 2


def waves(count):
    """A field of hills."""
    x, y, area = grid(count)
    normal = np.stack([-0.6 * np.cos(6 * x), 0.6 * np.sin(6 * y), np.ones_like(x)], 1)
    slope = np.linalg.norm(normal, axis=1)
    position = np.stack([x, y, 0.1 * np.sin(6 * x) + 0.1 * np.cos(6 * y)], 1)
    return position, normal / slope[:, None], area * slope


def plane(count):
    x, y, area = grid(count)
    position = np.stack([x, y, np.zeros_like(x)], 1)
    return position, np.tile((0.0, 0.0, 1.0), (len(x), 1)), np.full(len(x), area)


def under_lamp(body, count, tangent=across):
    """Samples, travel and irradiance under a lamp above the body, without shadows of others."""
    position, normal, area = body(count)
    tangent = tangent(normal)
    way = position - [0.5, 0.3, 2.0]
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], 1)
    travel = np.einsum("nij,nj->ni", frame, way / distance)
    irradiance = np.maximum(-travel[:, 2:], 0) / distance**2
    travel[irradiance[:, 0] == 0] = (0, 0, -1)
    samples = np.column_stack([position, normal, tangent, area]).astype(np.float32)
    return samples, travel.astype(np.float32), np.repeat(irradiance, 3, 1).astype(np.float32)


def timed(function, *arguments, **options):
    """Result, wall seconds and CPU seconds."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = function(*arguments, **options)
    return result, time.perf_counter() - wall, time.process_time() - cpu


class Run:
    """A solution with its seconds."""

    def __init__(self, ldf, light, texels, albedo=ALBEDO, **options):
        samples, travel, irradiance = light
        paths = texels * PATHS * math.sqrt(samples[:, 9].mean())
        arguments = samples, [ldf] * 3, list(albedo), list(paths)
        options = {"tolerance": TOLERANCE, "max_angle": 89.0} | options
        field, wall, cpu = timed(_native_test.SurfaceField, *arguments, **options)
        _, add_wall, add_cpu = timed(field.add, travel, irradiance, WHITE)
        self.luminance, solve_wall, solve_cpu = timed(field.solve)
        self.wall, self.cpu = wall + add_wall + solve_wall, cpu + add_cpu + solve_cpu
        self.parts = f"{cpu:.2f} + {add_cpu:.2f} + {solve_cpu:.2f} s"
        self.bytes, self.sources = field.moment_bytes, field.mean_sources


def growth(ldf, counts):
    print(
        "\nseconds to prepare, add a lamp and solve; wall seconds over those asked for; "
        "bytes of a sample's moments, its sources"
    )
    for body in (ball, waves):
        for texels in (0.1, 1.0, 4.0, 16.0):
            for count in counts:
                run = Run(ldf, under_lamp(body, count), texels)
                print(
                    f"  {body.__name__:5s} path {texels:4g} texels, {count:8d} samples: {run.parts}, "
                    f"wall {run.wall:.2f} s = {run.wall * PER_SECOND / count:.2f}, {run.bytes} bytes, "
                    f"{run.sources:.0f} sources",
                    flush=True,
                )


def baked(ldf, counts):
    print(
        "\nbakes of textures, where smooth light is interpolated: CPU and wall seconds with tables of the medium, "
        "share of texels that are solved"
    )
    lamp = native.PointLight((0.5, 0.3, 2.0), 0.0, "sphere")
    card = (
        np.array([(-0.2, 0.0, 1.3), (0.4, 0.0, 1.3), (0.4, 0.5, 1.3), (-0.2, 0.5, 1.3)]),
        np.uint32([(0, 1, 2), (0, 2, 3)]),
    )
    lights = {
        "lamp": [(lamp, WHITE, None)],
        "behind a card": [(lamp, WHITE, native.Occluders([native.OccluderMesh(*card)]))],
    }
    for count in counts:
        side = round(math.sqrt(count))
        ball_side = round(math.sqrt(count / 2))
        bodies = {"hills": hills(side), "ball": texels_of(round_mesh(96, 48), 2 * ball_side, ball_side)}
        for (name, texels), path in itertools.product(bodies.items(), (1.0, 4.0, 16.0)):
            paths = list(path * PATHS * math.sqrt(texels.areas[texels.areas > 0].mean()))
            for light, rays in lights.items():
                shares = []
                _, wall, cpu = timed(
                    native.bake_luminance,
                    [native.Surface(texels.native())],
                    [rays],
                    [ldf] * 3,
                    list(ALBEDO),
                    paths,
                    report_solved=shares.extend,
                )
                print(
                    f"  {name:5s} path {path:4g} texels, {texels.inside.sum():8d} texels, {light}: "
                    f"{cpu:.2f}, {wall:.2f} s, {shares[0]:.0%}",
                    flush=True,
                )


def beside_fft(ldf, count):
    print(f"\na plane of {count} samples, CPU seconds over those of fft; worst texel against it")
    light = under_lamp(plane, count, lambda normal: np.tile((1.0, 0.0, 0.0), (len(normal), 1)))
    side = round(math.sqrt(count))
    travel, irradiance = light[1].reshape(side, side, 3), np.ascontiguousarray(light[2][:, 0].reshape(side, side))
    for texels in (0.1, 1.0, 4.0):
        run = Run(ldf, light, texels)
        paths = tuple(texels * PATHS * 2 / side)
        expected, _, cpu = timed(convolve, irradiance, travel, ldf, ALBEDO, paths, 2 / side, tolerance=TOLERANCE)
        expected = expected.reshape(-1, 3)
        worst = (np.abs(run.luminance - expected).max(axis=0) / expected.max(axis=0)).max()
        print(
            f"  path {texels:4g} texels: {run.cpu:.2f} s, {run.cpu / cpu:.1f} times {cpu:.2f} s; {worst:.1e}",
            flush=True,
        )


def large(ldf, count):
    print(
        f"\nbodies of marble, {count} samples, so large that a texel is 6 and 60 mean free paths: CPU seconds with and "
        "without the tables of the medium, over those of fft on a plane"
    )
    side = round(math.sqrt(count))
    flat = under_lamp(plane, count, lambda normal: np.tile((1.0, 0.0, 0.0), (len(normal), 1)))
    travel, irradiance = flat[1].reshape(side, side, 3), np.ascontiguousarray(flat[2][:, 0].reshape(side, side))
    for texels in (0.16, 0.016):
        paths = tuple(texels * PATHS * 2 / side)
        cpu = min(
            timed(convolve, irradiance, travel, ldf, LARGE_ALBEDO, paths, 2 / side, tolerance=TOLERANCE)[2]
            for _ in range(RUNS)
        )
        for body in (plane, waves, ball):
            light = flat if body is plane else under_lamp(body, count)
            first, *others = [Run(ldf, light, texels, LARGE_ALBEDO).cpu for _ in range(RUNS)]
            print(
                f"  {body.__name__:5s} path {texels:4g} texels: {first:.2f}, {min(others):.2f} s, "
                f"{first / cpu:.1f} and {min(others) / cpu:.1f} times {cpu:.2f} s",
                flush=True,
            )


def errors(ldf, count):
    print(f"\n{count} samples against all pairs: worst sample of the brightest, and sum; seconds of both")
    for body in (ball, waves):
        light = under_lamp(body, count)
        for texels in (0.3, 3.0, 30.0):
            truth = Run(ldf, light, texels, is_direct=True)
            run = Run(ldf, light, texels)
            worst = (np.abs(run.luminance - truth.luminance).max(axis=0) / truth.luminance.max(axis=0)).max()
            total = run.luminance.sum() / truth.luminance.sum() - 1
            print(
                f"  {body.__name__:5s} path {texels:4g} texels: {worst:.1e}, {total:+.1e}; "
                f"{run.cpu:.2f} s, {truth.cpu:.2f} s",
                flush=True,
            )


def main(largest=1_000_000):
    curved = library(MEDIUM, "preview", curved=largest >= 10_000)  # planes alone for a quick try
    print(f"LDFs of {len(curved.curvatures)} curvatures")
    growth(curved, [count for count in (10_000, 100_000, 1_000_000) if count < largest] + [largest])
    baked(curved, [100_000, 1_000_000] if largest >= 1_000_000 else [largest])
    beside_fft(curved, min(largest, 1_000_000))
    large(library(Medium(0.0, 1.5), curved=largest >= 10_000), min(largest, 512**2))
    errors(curved, min(largest, 20_000))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
