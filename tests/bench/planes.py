"""Cost of many planes in one image, relative to one plane with as many texels: planks under each kind of light.

Usage: tests/bench/run.sh planes, or python planes.py [SIDE] [PLANKS] [MEAN FREE PATHS, texels ...].
"""

import math
import sys
import time

import numpy as np
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.material import Material
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WHITE = 1.0, 1.0, 1.0
LIGHTS = {
    "sun": SunLight("Sun", 3.0, WHITE, True, (0.6, 0.0, -0.8)),
    "lamp": PointLight("Lamp", 1000.0, WHITE, True, (0.3, 0.3, 0.4)),
    "area": AreaLight("Area", 1000.0, WHITE, True, (0.3, 0.3, 0.4), AXES, 0.1, 0.1, False, math.pi),
    "world": WorldLight("World", 1.0, WHITE, True, np.random.default_rng(1).random((64, 128, 3), np.float32), AXES),
}
CARD = Mesh(np.array([(0, 0, 0.1), (0.1, 0, 0.1), (0.1, 0.1, 0.1)], float), np.array([(0, 1, 2)], np.uint32))


def planks(count: int) -> Polygons:
    """Squares of a floor of 1 m, at seven heights, with the same places in the image."""
    along = math.ceil(math.sqrt(count))
    places = np.array([divmod(number, along) for number in range(count)], float)
    uvs = (places[:, None] + 0.05 + 0.9 * SQUARE).reshape(-1, 2) / along
    heights = np.repeat(0.001 * (np.arange(count) % 7), 4)
    corners = np.column_stack([uvs, heights])
    return Polygons(corners, uvs, np.arange(0, 4 * count + 1, 4), np.tile((0.0, 0.0, 1.0), (count, 1)))


def seconds(count: int, side: int, names: tuple[str, ...], mean_free_path: float) -> float:
    """CPU seconds of a bake."""
    receiver = build_receiver(flatten(planks(count)), side, side)
    surface = Surface(Material((0.99, 0.9, 0.6), (mean_free_path,) * 3, 0.8, 1.4))
    light = Illumination([LIGHTS[name] for name in names], CARD)
    job = BakeJob("Planks", receiver, light, surface, BakeSettings(margin=4, quality="preview"), BAKE_STEPS)
    start = time.process_time()
    job.run()
    return time.process_time() - start


def main(side: int = 2048, count: int = 484, *paths: float) -> None:
    seconds(1, 64, ("sun",), 0.01)  # reads the library
    for path in paths or (0.2, 1.0):
        for names in (("sun",), ("lamp",), ("area",), ("area", "world")):
            alone, many = (seconds(number, side, names, path / side) for number in (1, count))
            print(
                f"{path:g} texels, {' and '.join(names)}: {alone:.2f} s, {count} planes {many / alone:.1f} times that"
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *map(float, sys.argv[3:]))
