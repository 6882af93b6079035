"""The colours that nodes give a receiver, by Cycles: it evaluates them all."""

from __future__ import annotations

import os

import numpy as np

from ...core.bake.margin import extend_margin
from ...core.errors import BakeError
from ...core.progress import Progress
from ...core.scene.receiver import Receiver
from ...core.target import Target
from .cycles_light import START_SECONDS, CopyForCycles
from .process import run

# In a texel of a small texture; of larger ones fewer, down to the least, so that it takes seconds.
MOST_SAMPLES, LEAST_SAMPLES, ALL_SAMPLES = 16, 4, 1 << 24

# Pixels that are baked: up to so many a texel has several, in rows.
ALL_PIXELS = 1 << 22

# Of the child process: Blender itself, and each pixel that is baked. Peaks in 3.4 (4.5), of a plane alone: 0.25 (0.27)
# GB of 256^2 pixels, 0.99 (0.98) of 2048^2, 3.24 of 4096^2. A scene of gigabytes takes those, too.
BLENDER_BYTES, PIXEL_BYTES = 270 << 20, 190

# Of a processor, for estimates: a noise texture of two octaves in Blender 3.4 (4.5: 2.5e6).
SAMPLES_PER_SECOND = 3e6

# Texels that are hardly on the mesh take the colour beside them: so many rings of them at the most.
RINGS = 2


def colors_by_cycles(
    copy: CopyForCycles,
    target: Target,
    matrix: list | None,
    receiver: Receiver,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """Float32 (grid height, grid width, 3) of each chart, linear, averaged over each texel.

    Parameters
    ----------
    matrix : of the instance that stands for the target, rows; None: it stands in the scene itself.

    Raises
    ------
    BakeError
        Cycles failed.
    Cancelled
        `progress` returned False.
    """
    request = {
        "object": target.object_name,
        "matrix": matrix,
        "material": target.material_name,
        "texture": copy.textures[target.material_name],
        "width": receiver.width,
        "height": receiver.height,
        **_samples(receiver.width, receiver.height),
    }
    seconds = seconds_of_colors(receiver.width, receiver.height)
    found = run(copy.scene, "colors", request, progress, "Evaluating the base color", seconds)["colors"]
    known = np.isfinite(found).all(axis=2)
    if not known.any():
        raise BakeError("Cycles found no texel on it.")
    filled = extend_margin(np.where(known[..., None], found, found[known].mean(axis=0)), known, RINGS)
    return [chart.read(filled) for chart in receiver.charts]


def seconds_of_colors(width: int, height: int) -> float:
    """About how long that takes on this machine."""
    chosen = _samples(width, height)
    samples = width * height * chosen["places"] ** 2 * chosen["samples"]
    return START_SECONDS + samples / (SAMPLES_PER_SECOND * (os.cpu_count() or 1))


def bytes_of_colors(width: int, height: int) -> int:
    """About how much memory the child process takes for that, before the bake takes its own."""
    return BLENDER_BYTES + PIXEL_BYTES * width * height * _samples(width, height)["places"] ** 2


def _samples(width: int, height: int) -> dict[str, int]:
    """Places along each side of a texel, and samples of each."""
    texels = width * height
    samples = int(np.clip(ALL_SAMPLES // texels, LEAST_SAMPLES, MOST_SAMPLES))
    places = int(np.clip(np.sqrt(ALL_PIXELS / texels), 1, np.sqrt(MOST_SAMPLES)))
    return {"places": places, "samples": max(1, samples // places**2)}
