"""Delay of the image in a window, and its error meanwhile.

    PYTHONPATH=build/stage build/venv/bin/python tests/bench/live.py [--resolution N]

In Blender's window under Xvfb: seconds from a change to the texture, and until the 3D View has drawn it. The processor
draws there, too; the time of drawing alone stands above. Then, without Blender, quick images beside bakes.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.surface import Surface
from beamspread.core.live.library_service import LibraryService
from beamspread.core.live.live_target import LiveTarget
from beamspread.core.live.renderer import SIDES, LiveRenderer, for_live
from beamspread.core.material import Material
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight
from beamspread.core.scene.occluders import Mesh
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.texture import BaseColor, Texture, TextureUse
from beamspread.core.target import Target

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from virtual_screen import virtual_screen

INSIDE = Path(__file__).resolve().parent / "in_blender" / "live.py"
WINDOW = ["--factory-startup", "--window-geometry", "0", "0", "640", "480"]

CORNERS = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
FLOOR = Polygons(CORNERS, CORNERS[:, :2] / 2 + 0.5, np.array([0, 4]), np.array([(0.0, 0, 1)]))
CARD = Mesh(np.array([(-0.2, -0.2, 0.15), (0.2, -0.2, 0.15), (0, 0.3, 0.15)]), np.array([(0, 1, 2)], np.uint32))
LIGHTS = {
    "a sun": SunLight("Sun", 3.0, (1.0, 1.0, 1.0), True, (0.6, 0.0, -0.8)),
    "a lamp, .1 above": PointLight("Low", 10.0, (1.0, 1.0, 1.0), True, (0.3, 0.2, 0.1)),
    "a lamp, .5 above": PointLight("Lamp", 10.0, (1.0, 1.0, 1.0), True, (0.3, 0.2, 0.5)),
}


def in_window(resolution):
    for shading in ("MATERIAL", "RENDERED"):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "results.json"
            command = [shutil.which("blender"), *WINDOW, "--python", str(INSIDE), "--", str(path), shading]
            with virtual_screen() as screen:
                done = subprocess.run([*command, str(resolution)], capture_output=True, text=True, env=screen)
            results = json.loads(path.read_text()) if path.exists() else {"error": done.stdout + done.stderr}
        if "error" in results:
            raise RuntimeError(results["error"])
        print(f"{shading}, {resolution} x {resolution}: seconds to the texture, to the drawn window, worst, exact")
        for name, row in results.items():
            numbers = " ".join(f"{row[key]:6.3f}" if key in row else 6 * " " for key in
                               ("stored", "drawn", "worst drawn", "exact"))  # fmt: skip
            print(f"  {name:28} {numbers}  {row.get('texels', '')}")


def veined(target, resolution):
    """The target with veins in whose albedos light scatters."""
    x = np.linspace(0, 1, resolution)
    veins = 0.5 + 0.5 * np.sin(40 * x + 6 * np.sin(9 * x[:, None]))
    colors = np.stack([0.35 + 0.5 * veins, 0.3 + 0.5 * veins, 0.2 + 0.5 * veins], -1).astype(np.float32)
    texture = Texture(build_receiver(flatten(FLOOR), resolution, resolution), (colors,), TextureUse())
    return replace(target, texture=texture, surface=target.surface.colored(BaseColor(texture)))


def beside_bakes(resolution):
    print("quick renderings beside bakes: sum of all errors over the sum, worst texel over the brightest, seconds")
    for ior in (1.4, 1.0):
        library(Medium(0.8, ior))
        for name, light in LIGHTS.items():
            material = Material(albedo=(0.99, 0.9, 0.6), mean_free_path=(0.02,) * 3, anisotropy=0.8, ior=ior)
            rest = Illumination([light], CARD), Surface(material), for_live(BakeSettings())
            target = LiveTarget(Target("Floor"), FLOOR, (resolution, resolution), resolution, *rest)
            for change, kind in ((lambda target, _: target, ""), (veined, ", veins")):
                print_errors(f"ior {ior}, {name}{kind}", change(target, resolution), (256, 128) if kind else SIDES)


def print_errors(name, target, sides):
    renderer = LiveRenderer(LibraryService())
    exact = renderer.exact(target).texture
    for side in sorted(sides, reverse=True):
        renderer.quick(target, side)
        start, cpu = time.perf_counter(), time.process_time()
        quick = renderer.quick(target, side).texture
        seconds = time.perf_counter() - start, time.process_time() - cpu
        error = np.abs(quick - exact)
        total, worst = (error.sum((0, 1)) / exact.sum((0, 1))).max(), (error / exact.max((0, 1))).max()
        row = f"{total:8.2%} {worst:8.2%} {seconds[0]:7.3f} wall {seconds[1]:7.3f} CPU"
        print(f"  {name:35} {side:4d}: {row}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--resolution", type=int, default=512)
    options = parser.parse_args()
    beside_bakes(options.resolution)
    in_window(options.resolution)


main()
