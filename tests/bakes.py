"""Grids and bakes without Blender that several test modules share."""

import numpy as np
from beamspread.core.bake import layers
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.material import Material
from beamspread.core.scene.chart import Chart, ChartIsland
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.receiver import Receiver

SETTINGS = BakeSettings(quality="preview", samples=2, margin=0)
MATERIAL = Material(albedo=(0.9, 0.9, 0.9), mean_free_path=(0.01, 0.01, 0.01), anisotropy=0.0)


def square(size=24, side=1.0, height=None, origin=None):
    """A grid of square texels in the xy plane, `side` metres wide, around the world's origin unless it has its own."""
    height, pitch = height or size, side / size
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    corner = (-side / 2, -pitch * height / 2, 0.0) if origin is None else origin
    return Grid(corner, *axes, pitch, pitch, size, height, np.ones((height, size), np.float32))


def bake(grid, *arguments, **options):
    """Luminance of one grid; other arguments as for `layers.bake`."""
    return layers.bake([grid], *arguments, **options)[0]


bake_together = layers.bake


def bake_job(lights, occluders=None, surface=None, settings=SETTINGS, grid=None):
    """A bake of one chart that is the whole texture."""
    grid = grid or square()
    receiver = Receiver(grid.coverage, (Chart(grid, (ChartIsland(grid.coverage, (0, 0)),)),))
    return BakeJob(
        "Plane", receiver, Illumination(lights, occluders), surface or Surface(MATERIAL), settings, BAKE_STEPS
    )
