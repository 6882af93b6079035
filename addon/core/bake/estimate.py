"""About how long the parts of a bake take, and how much memory it needs; for progress and for warnings beforehand."""

from __future__ import annotations

import os

# Of all processors together, on one whose cores are as those that docs/performance.md was measured on.
SIMULATION_SECONDS = {"preview": 3.0, "final": 130.0}

# Of the fft solver, per texel and light, in seconds of one processor.
FFT_SECONDS = 1.5e-6

# Of a ray to a light of a size, on one processor (docs/performance.md, room: 3 to 4 million a second on two).
RAY_SECONDS = 6e-7

# Of the direct solver, per pair of texels: for light of its own direction at each, and of one for all as a sun's.
DIRECT_SECONDS, DIRECT_SUN_SECONDS = 3e-8, 3e-10

# Bytes of memory beside the host's, whatever the size, and for each texel: where suns alone shine, where all light
# comes from one direction at each texel, and where other light does; but for what the fft solver keeps of light, which
# it counts when it has chosen its terms. Peaks of processes with 256^2 to 2048^2 texels, a sun, a lamp, a world and a
# lamp (tests/unit/test_estimate.py), and a twentieth more or over, for Blender's image.
SUNS, NARROW, WIDE = range(3)
BYTES = {
    "fft": ((50e6, 80), (400e6, 80), (600e6, 80)),
    "direct": ((50e6, 140), (100e6, 300), (250e6, 520)),
    "adaptive": ((50e6, 140), (100e6, 180), (250e6, 400)),
}

# What arrives alone, without a medium.
PASS_BYTES = 50e6, 120

# Slabs with an ior above 1 take so much more, over their thickness in mean free paths if that is above 1: light between
# their sides takes many harmonics. Of light of one direction, and other.
NARROW_SLAB, WIDE_SLAB = (200e6, 300), (800e6, 300)


def processors(threads: int = 0) -> int:
    return threads or os.cpu_count() or 1


def simulation_seconds(quality: str, threads: int = 0) -> float:
    """Of the medium in one channel."""
    return SIMULATION_SECONDS[quality] / processors(threads)


def solver_seconds(width: int, height: int, suns: int, others: int, solver: str, threads: int = 0) -> float:
    """Of so many lights on so many texels; at least, where lights have a size."""
    texels = width * height
    if solver == "direct":
        return (DIRECT_SUN_SECONDS * suns + DIRECT_SECONDS * others) * texels**2 / processors(threads)
    return FFT_SECONDS * texels * (1 + suns + others) / processors(threads)


def ray_seconds(texels: int, rays: int, threads: int = 0) -> float:
    """Of so many rays from each texel."""
    return RAY_SECONDS * texels * rays / processors(threads)


def bake_bytes(texels: int, solver: str, light: int, mean_free_paths: float) -> float:
    """The most memory that a bake takes, about, but for what is kept of light.

    `mean_free_paths` : thickness of a slab with an ior above 1, or inf.
    """
    fixed, each = BYTES[solver][light]
    if solver == "fft" and light != SUNS:
        more, more_each = WIDE_SLAB if light == WIDE else NARROW_SLAB
        thinness = 1 / max(mean_free_paths, 1.0)
        fixed += more * thinness
        each += more_each * thinness
    return fixed + each * texels


def pass_bytes(texels: int) -> float:
    """The same of what arrives alone."""
    fixed, each = PASS_BYTES
    return fixed + each * texels


def machine_bytes() -> int:
    """Memory of the machine; 0 where it can't be asked."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 0


def in_words(seconds: float) -> str:
    """Rounded as one would say it."""
    if seconds < 60:
        return f"{max(1, round(seconds))} s"
    if seconds < 3600:
        return f"{round(seconds / 60)} min"
    if seconds < 48 * 3600:
        return f"{seconds / 3600:.0f} h"
    return f"{seconds / 86400:.0f} days"
