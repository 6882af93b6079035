"""Light of a cube in an even world, near its edges and far from them, against photons in plain Python."""

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.native import native

from bent_shapes import cube, cut_texels
from plain_cube import returned

HALF = 40.0  # of a side, mean free paths
ALBEDO = 0.99
PHOTONS = 20_000


# Distance from an edge, mean free paths, and the bounds of the error. Pairs across an edge take the LDFs of balls.
@pytest.mark.parametrize(
    ("ior", "bounds"),
    [
        (1.0, [(0.6, -0.03, 0), (2, 0, 0.04), (4, -0.01, 0.02), (8, -0.02, 0.01), (36, -0.01, 0.01)]),
        (1.4, [(0.6, 0, 0.11), (2, 0, 0.1), (4, 0, 0.05), (8, -0.01, 0.02), (36, -0.01, 0.02)]),
    ],
)
def test_edges_of_a_cube_in_an_even_world(ior, bounds):
    """Means of texels at a distance from one edge and far from others; three standard errors of the photons besides.

    Measured from the edge on: -1, 2.3, .2, -.4, -.2 % at index 1, and 9, 8, 4, .2, .4 % at index 1.4.
    """
    mesh = cube()
    texels, coverage = cut_texels(mesh, 288, 192)
    surface = native.Surface(texels.native(), coverage.astype(np.float32))
    world = native.EnvironmentLight(np.ones((2, 4, 3), np.float32), np.eye(3))
    medium = [library(Medium(0.0, ior), curved=True)] * 3, [ALBEDO] * 3, [1 / HALF] * 3
    lights = [(world, [1.0, 1.0, 1.0], mesh.occluders())]
    luminance = native.bake_luminance([surface], [lights], *medium, rays=256, tolerance=2e-3)[0][..., 1]
    _, first, second = np.moveaxis(np.sort(1 - np.abs(texels.positions), -1) * HALF, -1, 0)
    for distance, low, high in bounds:
        truth, error = returned((0.0, HALF - distance, HALF), HALF, ALBEDO, ior, PHOTONS)
        near = (coverage > 0.5) & (np.abs(first - distance) < max(0.3 * distance, 0.5)) & (second > HALF / 2)
        assert near.sum() > 20
        excess = luminance[near].mean() / truth - 1
        assert low - 3 * error / truth < excess < high + 3 * error / truth
