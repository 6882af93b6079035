"""Bakes of textures in which light scatters, under lights of the scene, against photons (tests/plain_textured_walk.py).

L1 distances are of 24 x 24 texels, beyond the noise of the count. The convention for textures is off by 7 to 11 %.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.layers import arrive
from beamspread.core.bake.spread_light import spread_side
from beamspread.core.bake.spreading import Spreading
from beamspread.core.bake.textured_bake import with_factors
from beamspread.core.material import Material
from beamspread.core.progress import Progress
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight, WorldLight

from bakes import bake, square
from plain_textured_walk import exitance

G, SIDE, PITCH, PHOTONS = 0.8, 24, 0.01, 600_000
GRID, SETTINGS = square(SIDE, side=SIDE * PITCH), BakeSettings()
MATERIAL = Material(albedo=(0.5,) * 3, mean_free_path=(PITCH,) * 3, anisotropy=G)
COMMON = "Light", 1.0, (1.0, 1.0, 1.0), True
ROWS, COLUMNS = np.mgrid[:SIDE, :SIDE]
VEINS = 0.87 + 0.12 * np.abs(np.sin(0.5 * COLUMNS + 1.3 * np.sin(0.35 * ROWS)) * np.sin(0.3 * ROWS + 0.2 * COLUMNS))
HEIGHT = 8 * PITCH
RADIUS, POINTS = 6 * PITCH, 12  # of a lamp with a size


def from_lamp(place=(0.0, 0.0)):
    """Directions from a point above the plane, over the middle unless it has a place there."""
    x, y = (COLUMNS + 0.5 - SIDE / 2) * PITCH - place[0], (ROWS + 0.5 - SIDE / 2) * PITCH - place[1]
    way = np.stack([x, y, np.full_like(x, -HEIGHT)], -1)
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


def from_disk(number):
    """Directions from a point of a disk over the middle: the points spiral outward, each for as much of its area."""
    radius, turn = RADIUS * math.sqrt((number + 0.5) / POINTS), number * math.pi * (3 - math.sqrt(5))
    return from_lamp((radius * math.cos(turn), radius * math.sin(turn)))


def even(way):
    """Weight of a direction among those from all around."""
    return np.ones(way.shape[:2])


def from_flat(way):
    """Weight of a direction among those from a disk that faces the plane: both cosines over the squared distance."""
    return way[..., 2] ** 4


def from_sky(seed):
    """A direction of even light from all around at each texel."""
    squared, turn = np.random.default_rng(seed).random((2, SIDE, SIDE))
    sine, azimuth = np.sqrt(squared), 2 * np.pi * turn
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -np.sqrt(1 - squared)], -1)


SUN = 0.6, 0.0, -0.8
UP = tuple(map(tuple, np.eye(3).tolist()))
# Lights, directions of each part of the count, weights of these, and the bounds of the L1 distance and of the total.
CASES = {
    "sun": (SunLight(*COMMON, SUN), [np.broadcast_to(SUN, (SIDE, SIDE, 3))], even, 0.02, 0.005),
    "lamp": (PointLight(*COMMON, (0.0, 0.0, HEIGHT)), [from_lamp()], even, 0.02, 0.01),
    "lamp of a size": (
        AreaLight(*COMMON, (0.0, 0.0, HEIGHT), UP, 2 * RADIUS, 2 * RADIUS, True, math.pi),
        [*map(from_disk, range(POINTS))],
        from_flat,
        0.02,
        0.01,
    ),
    "sky": (
        WorldLight(*COMMON, np.ones((1, 1, 3), np.float32), UP),
        [*map(from_sky, range(12))],
        even,
        0.02,
        0.01,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_light_agrees_with_a_photon_count(name):
    """Each half of the count has its own directions of the sky or disk, so that the noise knows them."""
    light, ways, weight, bound, most = CASES[name]
    illumination = Illumination([light])
    count = (len(ways) + 1) // 2
    irradiance = arrive(GRID, illumination, SETTINGS)[0][..., 0]
    photons, halves = PHOTONS // 2 // count // 100_000 or 1, []
    for half, own in ((1, ways[::2]), (2, ways[1::2] or ways)):
        weights = [weight(way) for way in own]
        parts = [
            exitance(irradiance * part / sum(weights), way, VEINS, 1.0, G, 100_000 * photons, seed=100 * half + number)[
                0
            ]
            for number, (way, part) in enumerate(zip(own, weights, strict=True))
        ]
        halves.append(sum(parts) / math.pi)
    truth, noise = np.mean(halves, axis=0), np.abs(halves[0] - halves[1]).mean() / 2
    grid, albedo = GRID, np.repeat(VEINS[..., None], 3, axis=2).astype(np.float32)
    ours = bake(replace(grid, albedo=albedo), illumination, MATERIAL, 0.0, SETTINGS)[..., 0]
    assert distance(ours, truth, noise) < bound
    assert abs(ours.mean() / truth.mean() - 1) < most + 3 * noise / math.sqrt(truth.size) / truth.mean()
    assert distance(by_convention(albedo, illumination), truth, noise) > 0.06


def distance(ours, truth, noise):
    """Mean difference beyond the count's noise, over the mean."""
    return (np.abs(ours - truth).mean() - noise) / truth.mean()


def by_convention(albedo, illumination):
    """Luminance where the texture multiplies light in a medium of the mean reflectance."""
    sources = [library(Medium(G))] * 3
    (grid,), material = with_factors([replace(GRID, albedo=albedo)], MATERIAL, sources)
    return spread_side("reflected", [grid], Spreading(illumination, material, sources, SETTINGS), Progress())[0][..., 0]
