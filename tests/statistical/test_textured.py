"""Albedos that differ from texel to texel, against photons that walk through them (tests/plain_textured_walk.py).

L1 distances are of 24 x 24 texels, beyond the noise of the count, whose variance comes from two halves of the photons.
"""

import numpy as np
import pytest
from beamspread import Medium, convolve, library

from plain_textured_walk import exitance

G, SIDE, PHOTONS = 0.8, 24, 600_000


def veins():
    """Albedos .87 to .99 that change over some texels."""
    y, x = np.mgrid[:SIDE, :SIDE]
    bent = np.sin(0.5 * x + 1.3 * np.sin(0.35 * y)) * np.sin(0.3 * y + 0.2 * x)
    return 0.87 + 0.12 * np.abs(bent)


def checker(dark, bright, size):
    y, x = np.mgrid[:SIDE, :SIDE]
    return np.where((x // size + y // size) % 2, bright, dark)


def lamp_above(height):
    """Irradiance and directions of a lamp over the middle, `height` texels high."""
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) - SIDE / 2
    way = np.stack([x, y, np.full_like(x, -height)], -1)
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    return height**3 / distance[..., 0] ** 3, way / distance


def half_lit():
    return np.where(np.arange(SIDE) < SIDE // 2, 1.0, 0.02) * np.ones((SIDE, 1))


CASES = {
    "veins, even": (veins(), np.ones((SIDE, SIDE)), (0.0, 0.0, -1.0), 1.0, 0.02),
    "veins, shadow at 60 degrees": (veins(), half_lit(), (0.75**0.5, 0.0, -0.5), 1.0, 0.02),
    "veins, texels of .25": (veins(), np.ones((SIDE, SIDE)), (0.0, 0.6, -0.8), 0.25, 0.02),
    "checker of 4": (checker(0.7, 0.99, 4), np.ones((SIDE, SIDE)), (0.0, 0.0, -1.0), 1.0, 0.05),
    "checker of 8, to black": (checker(0.0, 0.95, 8), np.ones((SIDE, SIDE)), (0.0, 0.0, -1.0), 0.5, 0.05),
    "veins, lamp": (veins(), *lamp_above(8.0), 1.0, 0.02),
    "veins, low lamp in half of a shadow": (veins(), half_lit() * lamp_above(6.0)[0], lamp_above(6.0)[1], 1.0, 0.02),
    "checker of 4, low lamp": (checker(0.7, 0.99, 4), *lamp_above(5.0), 1.0, 0.05),
    "checker of 8, low lamp": (checker(0.7, 0.99, 8), *lamp_above(5.0), 1.0, 0.05),
}


def compare(albedo, irradiance, travel, pitch, bound, thickness=np.inf, side="reflected"):
    """Our total over the truth, and the L1 distance beyond noise, which must be within the bound."""
    face = int(side == "transmitted")
    halves = [exitance(irradiance, travel, albedo, pitch, G, PHOTONS // 2, thickness, seed)[face] for seed in (1, 2)]
    truth = np.mean(halves, axis=0)
    noise = np.abs(halves[0] - halves[1]).mean() / 2
    ldf = library(Medium(G, 1.0, thickness))
    ours = np.pi * convolve(irradiance, travel, ldf, albedo, 1.0, pitch, noise=0.005, side=side)[..., 0]
    distance = (np.abs(ours - truth).mean() - noise) / truth.mean()
    total = ours.mean() / truth.mean() - 1
    print(f"L1 {distance:.4f}, total {total:+.4f}, noise {noise / truth.mean():.4f}")
    assert distance < bound
    return total, noise / np.sqrt(truth.size) / truth.mean()


@pytest.mark.parametrize("name", CASES)
def test_light_agrees_with_a_photon_count(name):
    """2 % on veins, also under a lamp, whose directions are 72 in all, and 5 % on checkers. Totals within .5 %."""
    total, error = compare(*CASES[name])
    assert abs(total) < 0.005 + 3 * error


def test_light_through_a_slab():
    """The far face of a slab of three mean free paths; the unscattered light is taken away: it crosses at one place."""
    albedo, irradiance = veins(), np.ones((SIDE, SIDE))
    truth = exitance(irradiance, (0.0, 0.0, -1.0), albedo, 1.0, G, PHOTONS, 3.0)[1]
    ours = np.pi * convolve(
        irradiance, (0, 0, -1.0), library(Medium(G, 1.0, 3.0), "preview"), albedo, 1.0, 1.0, side="transmitted"
    )[..., 0] - np.exp(-3.0)
    print(np.abs(ours - truth).mean() / truth.mean(), ours.mean() / truth.mean() - 1)
    assert abs(ours.mean() / truth.mean() - 1) < 0.01
    assert np.abs(ours - truth).mean() < 0.04 * truth.mean()
