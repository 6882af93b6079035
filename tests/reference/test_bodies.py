"""The Monte Carlo of bodies (plain_bodies.py) against other truths, and its tables against itself."""

import csv
from pathlib import Path

import numpy as np
import pytest
from beamspread import Medium, exact_totals

from body_tables import ALBEDOS, BODIES, body_table, body_totals
from plain_bodies import Ball, Field, walk

PHOTONS = 1 << 18


class BallAt(Ball):
    """A thin beam that meets a ball at `angle_deg` from its normal."""

    def __init__(self, radius, angle_deg):
        super().__init__(radius)
        angle = np.radians(angle_deg)
        self.point, self.beam_area = (radius * np.sin(angle), 0, radius * np.cos(angle)), 1.0

    def enter(self, rng, count):
        return tuple(np.full(count, value) for value in self.point), (0.0, 0.0, -1.0)


class HollowBallAt(BallAt):
    """The same from the inside of a hollow ball."""

    def enter(self, rng, count):
        (x, y, z), beam = super().enter(rng, count)
        return (x, y, -z), beam

    def leave(self, x, y, z, wx, wy, wz):
        along = x * wx + y * wy + z * wz
        square = along * along - np.maximum(x * x + y * y + z * z - self.radius**2, 0)
        return np.where((along < 0) & (square >= 0), -along - np.sqrt(np.maximum(square, 0)), np.inf)


def thin_beams():
    """Rows of ball_reflectance.csv: {curvature: {angle: {albedo: (reflectance, standard error)}}}."""
    result = {}
    with (Path(__file__).parent / "ball_reflectance.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            curvature, angle, albedo, value, error = (float(number) for number in row.values())
            result.setdefault(curvature, {}).setdefault(angle, {})[albedo] = value, error
    return result


def deviation(body, g, expected, seed):
    """Differences of the totals in standard errors of both; `expected`: {albedo: (value, standard error)}."""
    albedos = sorted(expected)
    _, (total, error) = walk(body, g, albedos, PHOTONS, seed)
    value, value_error = np.array([expected[albedo] for albedo in albedos]).T
    return np.abs(total - value) / np.hypot(error, value_error)


@pytest.mark.parametrize("curvature", sorted(thin_beams()))
def test_thin_beams_on_balls(curvature):
    """152 numbers: the largest of as many normal deviates exceeds 4.2 once in 250 times."""
    for angle, expected in thin_beams()[curvature].items():
        if curvature == 0:
            body = Field("plane", 1, 50, angle_deg=angle)
        else:
            body = (BallAt if curvature > 0 else HollowBallAt)(1 / abs(curvature), angle)
        assert deviation(body, 0.8, expected, seed=3).max() < 4.2, angle


def test_the_plane_of_the_table():
    exact = exact_totals(Medium(0.8, 1.0), [50.0], list(ALBEDOS))[0][0]
    for albedo, value in zip(ALBEDOS, exact):
        total, error = body_totals("plane")[albedo]
        # A table of exact totals is as good as 1.2e-5.
        assert abs(total - value) < 4 * error + 1.2e-5


@pytest.mark.parametrize("name", BODIES)
def test_another_seed_gives_the_same_table(name):
    """Totals, and the bins' squared deviations: 5 of their standard deviations."""
    body, g = BODIES[name]
    (mean, error), _ = values = walk(body, g, ALBEDOS, PHOTONS if "torus" in name else 2 * PHOTONS, seed=99)
    for index, albedo in enumerate(ALBEDOS):
        total, total_error = body_totals(name)[albedo]
        assert abs(values[1][0][index] - total) < 5 * np.hypot(values[1][1][index], total_error)
        known, known_error = body_table(name)[albedo]
        bright = known > 0.05 * known.max()
        z2 = (mean[index] - known)[bright] ** 2 / (error[index] ** 2 + known_error**2)[bright]
        # Errors from few batches have heavy tails: the mean of z^2 is (n - 1) / (n - 3).
        assert z2.mean() < 1.2 + 5 * np.sqrt(3 / len(z2))


def test_totals_are_precise():
    """Errors of totals .3 %, of bins as bright as a third of the brightest 1 %."""
    for name in BODIES:
        for albedo in ALBEDOS:
            total, error = body_totals(name)[albedo]
            assert error < 0.003 * total, name
            mean, error = body_table(name)[albedo]
            bright = mean > 0.33 * mean.max()
            assert (error < 0.01 * mean)[bright].all(), name
