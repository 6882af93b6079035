"""Light in balls and round hollow balls against truths that this project's engine did not compute."""

import csv
import functools
from pathlib import Path

import numpy as np
from beamspread import Medium, simulate
from scipy import stats

CONFIDENCE = 0.999
TABLE = Path(__file__).parents[1] / "reference" / "ball_reflectance.csv"


@functools.cache
def rows():
    with TABLE.open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def test_totals_of_balls_and_hollows():
    """All 156 totals of an independent simulation, normal deviates at a confidence of 99.9 % for all (Sidak)."""
    angles, curvatures = ({row[key] for row in rows()} for key in ("angle_deg", "curvature_per_mfp"))
    library = simulate(Medium(0.8), sorted(angles), 200_000, seed=5, curvatures=sorted(curvatures))
    worst = stats.norm.isf((1 - CONFIDENCE ** (1 / len(rows()))) / 2)
    for row in rows():
        at = row["angle_deg"], row["albedo"]
        error = library.standard_error(*at, curvature=row["curvature_per_mfp"])
        assert error < 0.01 * row["reflectance"], row
        difference = library.reflectance(*at, row["curvature_per_mfp"]) - row["reflectance"]
        assert abs(difference) < worst * np.hypot(error, row["standard_error_at_most"]), row
