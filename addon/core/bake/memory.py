"""Memory that a bake takes, about, so that one that would take too much is refused before it starts."""

from __future__ import annotations

import os

SUNS, NARROW, WIDE = range(3)
"""Kinds of light: suns alone; one direction at each texel; any other."""

BYTES = {
    "fft": ((50e6, 80), (400e6, 80), (600e6, 80)),
    "direct": ((50e6, 140), (100e6, 300), (250e6, 520)),
    "adaptive": ((50e6, 140), (100e6, 180), (250e6, 400)),
}
"""Fixed bytes and bytes per texel, by solver and kind of light, without the light that the fft solver keeps.

Peaks of processes with 256^2 to 2048^2 texels (tests/unit/test_memory.py), rounded up by a twentieth or more.
"""

OTHER_SOLVER = BYTES["direct"]
"""The same of a solver that is not listed: the most that a listed one takes per texel."""

PASS_BYTES = 50e6, 120
"""The same of irradiance and direction, without a medium."""

NARROW_SLAB, WIDE_SLAB = (200e6, 300), (800e6, 300)
"""Additional bytes of slabs with an ior above 1, for one mean free path or less; they fall as 1 / thickness."""


def bake_bytes(texels: int, solver: str, light: int, mean_free_paths: float) -> float:
    """Peak memory of a bake, bytes, without the light that the fft solver keeps.

    Parameters
    ----------
    light : SUNS, NARROW or WIDE.
    mean_free_paths : thickness of a slab with an ior above 1, or inf.
    """
    fixed, per_texel = BYTES.get(solver, OTHER_SOLVER)[light]
    if solver == "fft" and light != SUNS:
        slab, slab_per_texel = WIDE_SLAB if light == WIDE else NARROW_SLAB
        thinness = 1 / max(mean_free_paths, 1.0)
        fixed += slab * thinness
        per_texel += slab_per_texel * thinness
    return fixed + per_texel * texels


def pass_bytes(texels: int) -> float:
    """Peak memory of a bake of irradiance or direction, bytes."""
    fixed, per_texel = PASS_BYTES
    return fixed + per_texel * texels


def machine_bytes() -> int:
    """Memory of the machine, bytes; 0 if it can't be asked."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 0
