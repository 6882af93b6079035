"""The bodies of reference/bodies.csv, and the tables' numbers."""

import csv
import functools
from pathlib import Path

import numpy as np

from plain_bodies import Ball, Block, Cylinder, Field, Hollow, Shell, Torus

HERE = Path(__file__).parent / "reference"
BODY_TABLE, TOTAL_TABLE = HERE / "bodies.csv", HERE / "bodies_totals.csv"
ALBEDOS = (0.6, 0.9, 0.95, 0.97)
# Body and anisotropy. Names end in the radius in transport mean free paths, which are 5 mean free paths at g .8.
BODIES = {
    "plane": (Field("plane", 1, 50, angle_deg=50), 0.8),
    "ball_4": (Ball(20), 0.8),
    "ball_6": (Ball(30), 0.8),
    "ball_20": (Ball(100), 0.8),
    "cylinder_6": (Cylinder(30), 0.8),
    "cylinder_20": (Cylinder(100), 0.8),
    "cylinder_slant_6": (Cylinder(30, slant_deg=45), 0.8),
    "cylinder_isotropic_6": (Cylinder(6), 0.0),
    "hollow_6": (Hollow(30), 0.8),
    "hollow_20": (Hollow(100), 0.8),
    "hollow_followed_6": (Hollow(30, is_followed=True), 0.8),
    "shell_6": (Shell(30, 5), 0.8),
    "block_12": (Block(60), 0.8),
    "torus_6": (Torus(30, 70), 0.8),
    "saddle_6": (Field("saddle", 30, 30), 0.8),
    "saddle_20": (Field("saddle", 100, 60), 0.8),
    "bowl_20": (Field("bowl", 100, 60), 0.8),
    "dome_6": (Field("dome", 30, 30), 0.8),
}


def photons_for(name):
    """Enough for .3 % of totals and 1 % of bright bins; flights in a torus are slow."""
    return 10_000_000 if name.startswith("torus") else 30_000_000


@functools.cache
def body_table(name):
    """Exitance per irradiance of the beam and its standard error: {albedo: two arrays, one value per bin}."""
    with BODY_TABLE.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["body"] == name]
    return {
        albedo: [np.array([float(row[f"{kind}_{albedo}"]) for row in rows]) for kind in ("exitance", "standard_error")]
        for albedo in ALBEDOS
    }


@functools.cache
def body_totals(name):
    """Share of the incident light that leaves after scattering, and its standard error: {albedo: two numbers}."""
    with TOTAL_TABLE.open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["body"] == name]
    return {float(row["albedo"]): (float(row["reflectance"]), float(row["standard_error"])) for row in rows}
