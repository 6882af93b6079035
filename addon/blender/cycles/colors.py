"""Base color that nodes give a receiver, by Cycles, which evaluates all nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...core.bake.estimate import cycles_color_seconds
from ...core.bake.job import BakeJob, Step
from ...core.bake.margin import extend_margin
from ...core.bake.surface import Surface
from ...core.errors import BakeError, text_of
from ...core.messages import warning
from ...core.progress import Callback, Progress
from ...core.scene.receiver import Receiver
from ...core.scene.texture import BaseColor, TextureUse
from ...core.scene.tiles import Place
from ...core.target import Target
from .process import run
from .scene_copy import CopyForCycles

# Samples of each texel; more take longer.
MAX_SAMPLES, MIN_SAMPLES = 16, 4
# Number of samples of the whole texture, above which texels get fewer than the maximum.
ALL_SAMPLES = 1 << 24

# Number of baked pixels; up to it texels have several pixels, in rows.
ALL_PIXELS = 1 << 22

# Memory of the child process, bytes, without that of the scene: for Blender itself, and for each baked pixel.
BLENDER_BYTES, PIXEL_BYTES = 270 << 20, 190

# Rings of texels at the mesh's border that take the color of their neighbors.
RINGS = 2


@dataclass(frozen=True, eq=False)
class BaseColorByCycles(Step):
    """Evaluates a base color that only Cycles knows. The result, or the failure, holds for all jobs of the target.

    Attributes
    ----------
    surface : of the node, without the base color.
    use : how the texture colors the surface.
    matrix : rows of the matrix of the instance that is baked; None if the object itself is.
    """

    copy: CopyForCycles
    target: Target
    surface: Surface
    use: TextureUse
    matrix: list | None

    name = "Evaluating the base color"

    @property
    def finds_albedos(self) -> bool:
        return self.use.is_scattered

    def seconds(self, job: BakeJob) -> float:
        return 0.0 if self.target in self.copy.base_colors else cycles_color_seconds(job.receiver.coverage.size)

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        known = self.copy.base_colors
        if self.target not in known:
            known[self.target] = self._evaluate(job.receiver, progress)
        return replace(job, surface=self.surface).colored(known[self.target])

    def memory_bytes(self, job: BakeJob) -> float:
        known = self.target in self.copy.base_colors
        return 0.0 if known else bytes_of_colors(job.receiver.width, job.receiver.height)

    def _evaluate(self, receiver: Receiver, progress: Progress) -> BaseColor:
        try:
            colors = colors_by_cycles(self.copy, self.target, self.matrix, receiver, progress)
        except (BakeError, OSError) as error:
            return not_evaluated(self.target, text_of(error))
        return BaseColor.of(colors, receiver, self.use, self.target.object_name)


def not_evaluated(target: Target, why: str) -> BaseColor:
    """The base color if Cycles could not evaluate it: only a warning."""
    text = f"Cycles could not evaluate the Base Color of '{target.object_name}': the node's own color is used. {why}"
    return BaseColor(warnings=(warning(target.object_name, text),))


def colors_by_cycles(
    copy: CopyForCycles,
    target: Target,
    matrix: list | None,
    receiver: Receiver,
    progress: Callback | None = None,
) -> list[np.ndarray]:
    """Linear color averaged over each texel, float32 (grid height, grid width, 3) of each chart.

    Parameters
    ----------
    matrix : rows of the transform of the target's instance; None if the target is an object of the scene itself.

    Raises
    ------
    BakeError
        Cycles failed.
    Cancelled
        `progress` returned False.
    """
    colors = np.full((receiver.height, receiver.width, 3), np.nan, np.float32)
    places = [Place(0, 0, receiver.width, receiver.height)]
    if receiver.tiling is not None:
        places = list(receiver.tiling.places.values())
    for place, part in zip(places, Progress.of(progress).split([place.width * place.height for place in places])):
        request = {
            "object": target.object_name,
            "matrix": matrix,
            "material": target.material_name,
            "texture": copy.textures[target.material_name],
            "width": place.width,
            "height": place.height,
            "tile": (place.u, place.v),
            "uv_map": receiver.uv_map,
            **_samples(place.width, place.height),
        }
        result = run(copy.scene, "colors", request, part, "Evaluating the base color")["colors"]
        colors[place.row : place.row + place.height, : place.width] = result
    known = np.isfinite(colors).all(axis=2)
    if not known.any():
        raise BakeError("Cycles found no texel on the mesh.")
    filled = extend_margin(np.where(known[..., None], colors, colors[known].mean(axis=0)), known, RINGS)
    return [chart.read(filled) for chart in receiver.charts]


def bytes_of_colors(width: int, height: int) -> int:
    """Estimate of the memory of the child process in `colors_by_cycles`, bytes."""
    return BLENDER_BYTES + PIXEL_BYTES * width * height * _samples(width, height)["positions"] ** 2


def _samples(width: int, height: int) -> dict[str, int]:
    """Sample positions along each side of a texel, and samples at each."""
    texels = width * height
    samples = int(np.clip(ALL_SAMPLES // texels, MIN_SAMPLES, MAX_SAMPLES))
    positions = int(np.clip(np.sqrt(ALL_PIXELS / texels), 1, np.sqrt(MAX_SAMPLES)))
    return {"positions": positions, "samples": max(1, samples // positions**2)}
