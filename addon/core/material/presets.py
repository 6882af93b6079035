"""Measured materials, read from data/materials.csv, which says what its numbers are."""

from __future__ import annotations

import csv
from pathlib import Path

from .material import Material

PRESET_FILE = Path(__file__).resolve().parents[2] / "data" / "materials.csv"
METRES_PER_MM = 1e-3
# Jensen's table prints absorption to two decimals per mm; where it says 0, half its last digit is assumed, because an
# albedo of 1 has no solution in an infinite medium.
UNRESOLVED_ABSORPTION_PER_MM = 0.005
SOURCES = {
    "Jensen2001": "Jensen et al. 2001, diffusion fit",
    "Narasimhan2006": "Narasimhan et al. 2006, diluted in water and scaled back to the undiluted liquid; ior of water",
}


def presets() -> dict[str, Material]:
    """Measured materials by name: mean free path 1 / (sigma_s + sigma_a), albedo sigma_s / (sigma_s + sigma_a).

    Narasimhan et al. 2006 measured sigma_s, sigma_a and g of liquids per channel: those materials have an
    `anisotropy_rgb`. Jensen et al. 2001 fitted a diffusion model, which gives only the reduced scattering
    coefficient sigma_s (1 - g) and leaves g unknown: there it is taken as that of an isotropic medium, anisotropy 0,
    which looks the same from a few mean free paths away. Each material's `source` says which it is.
    """
    with PRESET_FILE.open(newline="", encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return {row["name"]: _preset(row) for row in rows}


def _preset(row: dict[str, str]) -> Material:
    scattering = [float(row[f"sigma_s_{channel}"]) for channel in "rgb"]
    measured = [float(row[f"sigma_a_{channel}"]) for channel in "rgb"]
    absorption = [value if value > 0 else UNRESOLVED_ABSORPTION_PER_MM for value in measured]
    anisotropy = tuple(float(row[f"g_{channel}"]) for channel in "rgb") if row["g_r"] else None
    source = SOURCES[row["source"]]
    if anisotropy is None:
        source += ": reduced scattering taken as isotropic (anisotropy 0), as g is unknown"
    if absorption != measured:
        source += f"; absorption below the table's digits, {UNRESOLVED_ABSORPTION_PER_MM} per mm assumed"
    extinction = [s + a for s, a in zip(scattering, absorption)]
    return Material(
        albedo=tuple(s / t for s, t in zip(scattering, extinction)),
        mean_free_path=tuple(METRES_PER_MM / t for t in extinction),
        anisotropy=0.0 if anisotropy is None else sum(anisotropy) / len(anisotropy),
        ior=float(row["ior"]),
        source=source,
        anisotropy_rgb=anisotropy,
    )
