"""CPU seconds of each step of bakes with bounced light, beside the same bakes without it.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/indirect.py [SIZE]

A floor below two balls, in the sun alone and under a sky too, with the settings that a scene has at first. The ratio is
that of both steps together to a bake without bounced light.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from beamspread import presets
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.bounced import BouncedLight
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.native import native
from beamspread.core.scene.lights import SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh, Occluder

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bakes import bake_job, square
from shapes import FACES, SQUARE, sphere

WHITE = (1.0, 1.0, 1.0)
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
MARBLE = presets()["marble"]
# Mean free paths in texels.
CASES = {
    "marble": (MARBLE, 0.25),
    "marble, larger": (MARBLE, 4.0),
    "no refraction": (replace(MARBLE, ior=1.0), 4.0),
}


def shape(name, vertices, triangles, albedo):
    reflector = native.Reflector(native.ColorTexture(albedo))
    return Occluder(name, Mesh(np.ascontiguousarray(vertices), triangles, reflectors=(reflector,)))


def shapes():
    points, triangles, _ = sphere(24)
    return [
        shape("Floor", SQUARE, FACES, (0.8, 0.7, 0.6)),
        shape("Red", points * 0.3 + (0.2, 0.0, 0.3), triangles, (0.8, 0.3, 0.2)),
        shape("Blue", points * 0.15 + (-0.4, 0.3, 0.15), triangles, (0.2, 0.3, 0.8)),
    ]


def bake(lights, material, size, steps):
    """CPU seconds of each step by name."""
    grid = square(size, 2.0)
    material = replace(material, mean_free_path=(material.mean_free_path[0] * grid.pitch_x,) * 3)
    job = replace(bake_job(lights, shapes(), Surface(material), BakeSettings(), grid), steps=())
    seconds = {}
    for step in steps:
        began = time.process_time()
        job = replace(job, steps=(step,)).run()
        seconds[step.name] = time.process_time() - began
    return seconds


def main():
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    sun = SunLight("Sun", 5.0, WHITE, True, (0.57, -0.48, -0.67))
    sky = WorldLight("Sky", 1.0, WHITE, True, np.ones((64, 128, 3), np.float32), IDENTITY)
    bounced = BouncedLight((4, 4, 4))
    print(f"{size} x {size} texels: CPU seconds")
    print("| light | medium | bounced light | baking | baking without it | ratio |\n|---|---|---|---|---|---|")
    for lights, name in [*(([sun], name) for name in CASES), ([sun, sky], "marble, larger")]:
        material, path = CASES[name]
        material = replace(material, mean_free_path=(path,) * 3)
        bake(lights, material, 32, BAKE_STEPS)  # loads the library
        alone = bake(lights, material, size, BAKE_STEPS)["Baking"]
        seconds = bake(lights, material, size, (bounced, *BAKE_STEPS))
        finding, baking = seconds[bounced.name], seconds["Baking"]
        ratio = (finding + baking) / alone
        light = " and ".join(light.name for light in lights)
        print(f"| {light} | {name} | {finding:.2f} | {baking:.2f} | {alone:.2f} | {ratio:.1f} |")


if __name__ == "__main__":
    main()
