"""Totals of an LDF as rows of text, for the terminal and for the picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..native import native


def describe(medium) -> str:
    """A medium in a few words."""
    depth = "half-space" if math.isinf(medium.thickness) else f"slab of {medium.thickness:g} mean free paths"
    return f"g {medium.g:g}, ior {medium.ior:g}, {depth}"


def specular(medium, angle_deg: float) -> float:
    """Part of the light that is reflected at the surface before it enters."""
    return float(native.fresnel(math.cos(math.radians(angle_deg)), medium.ior))


def totals_table(library, angle_deg: float, albedos: Sequence[float]) -> list[tuple[str, ...]]:
    """Reflectance and, of a slab, transmittance for each albedo, with standard errors; the first row is the head."""
    is_slab = math.isfinite(library.medium.thickness)
    rows = [("albedo", "reflectance", "+-", *(("transmittance", "+-") if is_slab else ()))]
    for albedo in albedos:
        row = (f"{albedo:g}", *_value(library.reflectance, library, angle_deg, albedo, "reflected"))
        if is_slab:
            row += _value(library.transmittance, library, angle_deg, albedo, "transmitted")
        rows.append(row)
    return rows


def _value(total, library, angle_deg: float, albedo: float, side: str) -> tuple[str, str]:
    error = library.standard_error(angle_deg, albedo, side=side)
    return f"{total(angle_deg, albedo):.5f}", f"{error:.1g}"


def text_table(rows: Sequence[tuple[str, ...]]) -> str:
    """Columns in line: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = [
        "  ".join(
            cell.rjust(width) if place else cell.ljust(width) for place, (cell, width) in enumerate(zip(row, widths))
        )
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)
