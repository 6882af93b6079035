"""The world as a panorama, by Cycles."""

from __future__ import annotations

import numpy as np

from ...core.progress import Progress
from .process import run
from .scene_copy import SceneCopy

# Of every texel, and of those in tiles around a sun: with 16 and 256 its irradiance is the same to 1e-6.
SAMPLES, FINE_SAMPLES = 2, 256

# For the progress: of a sky in Blender 3.4 on two cores.
SECONDS = 8.0


def world_panorama(
    copy: SceneCopy, width: int = 4096, height: int = 2048, progress: Progress | None = None
) -> np.ndarray:
    """Radiance of the world by direction, as it lights a diffuse surface.

    Returns
    -------
    float32 (height, width, 3), W/(m^2 sr), row 0 at the bottom: what an Environment Texture node (equirectangular)
    would show the same world with. The direction of the point (u, v), each 0..1, has the azimuth 2 pi (0.5 - u) around
    +Z from +X, and the elevation pi (v - 0.5).

    Raises
    ------
    BakeError
        Cycles failed.
    Cancelled
        `progress` returned False.
    """
    request = {"width": width, "height": height, "samples": SAMPLES, "fine_samples": FINE_SAMPLES}
    return run(copy, "world", request, progress, "Rendering the world", SECONDS)["radiance"]
