"""What tests of several modules share."""

import csv
from pathlib import Path

import numpy as np


def travel(angle, azimuth=0.0):
    """Unit vectors (..., 3) along which light travels in a plane's frame: degrees from the normal, and from +u."""
    theta, beta = np.broadcast_arrays(np.radians(angle), np.radians(azimuth))
    return np.stack([np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), -np.cos(theta)], -1)


def adding_doubling_table():
    """Rows of reference/adding_doubling.csv, which its README describes: {column: number}."""
    with (Path(__file__).parent / "reference" / "adding_doubling.csv").open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
