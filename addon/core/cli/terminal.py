"""Text for the terminal: totals of an LDF as a table, and a progress bar."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Sequence

from ..native import native

WIDTH = 30


def describe(medium) -> str:
    """Description of a medium in a few words."""
    depth = "half-space" if math.isinf(medium.thickness) else f"slab of {medium.thickness:g} mean free paths"
    return f"g {medium.g:g}, ior {medium.ior:g}, {depth}"


def specular(medium, angle_deg: float) -> float:
    """Fraction of the light that is reflected before it enters."""
    return float(native.fresnel(math.cos(math.radians(angle_deg)), medium.ior))


def totals_table(library, angle_deg: float, albedos: Sequence[float]) -> list[tuple[str, ...]]:
    """Table of reflectance, and transmittance of a slab, with standard errors: the head, then a row per albedo."""
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
    """The rows as aligned columns: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = [
        "  ".join(
            cell.rjust(width) if column else cell.ljust(width) for column, (cell, width) in enumerate(zip(row, widths))
        )
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


class ProgressBar:
    """Progress callback and context manager that draws a bar on a terminal and erases it at the end.

    Parameters
    ----------
    title : name of the job.
    stream : stream to draw on, if it is a terminal. Default: stderr, so that results can be piped.
    """

    def __init__(self, title: str, stream=None) -> None:
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._visible = self._stream.isatty()
        self._drawn = ""
        self._start = time.monotonic()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_exception) -> None:
        if self._drawn:
            self._stream.write("\r" + " " * len(self._drawn) + "\r")
            self._stream.flush()

    def __call__(self, fraction: float) -> bool:
        if self._visible:
            seconds = int(time.monotonic() - self._start)
            filled = int(WIDTH * fraction)
            bar = "#" * filled + "." * (WIDTH - filled)
            line = f"{self._title} [{bar}] {int(100 * fraction):3d} %  {seconds // 60}:{seconds % 60:02d}"
            if line != self._drawn:
                self._stream.write("\r" + line)
                self._stream.flush()
                self._drawn = line
        return True
