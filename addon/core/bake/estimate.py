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

# What a bake keeps for each texel, whatever the solver: the grid, light with its directions, the result with margin.
BYTES = {"fft": 250, "direct": 270, "adaptive": 270}


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


def bake_bytes(width: int, height: int, solver: str) -> int:
    return width * height * BYTES[solver]


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
