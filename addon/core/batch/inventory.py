"""Lines of `--verbose`: lights with kind and strength, triangles that cast shadows, and bakes."""

from __future__ import annotations

from collections.abc import Iterator

from ..bake.runner import Bake
from ..scene.illumination import Illumination
from ..scene.lights import Light


class Inventory:
    """Lines of all bakes of a run. Bakes that share a light show its line once."""

    def __init__(self) -> None:
        self._shown: set[str] = set()

    def lines(self, bake: Bake) -> Iterator[str]:
        """New lines about the light of this bake, and a line about the bake."""
        job = bake.job
        if job is None:
            return
        for line in _light(job.illumination):
            if line not in self._shown:
                self._shown.add(line)
                yield line
        receiver, grids = job.receiver, [chart.grid for chart in job.receiver.charts]
        sizes = [f"{grid.width * grid.pitch_x:.4g} x {grid.height * grid.pitch_y:.4g}" for grid in grids]
        yield f"'{job.name}': {receiver.width} x {receiver.height} texels, {', '.join(sizes)} scene units"


def _light(illumination: Illumination) -> Iterator[str]:
    yield f"{len(illumination.lights)} lights; {illumination.triangle_count} triangles in the light's way"
    yield from map(_line_of, illumination.lights)
    yield from map(str, illumination.messages)


def _line_of(light: Light) -> str:
    kind = type(light).__name__.removesuffix("Light")
    color = " ".join(f"{value:.4g}" for value in light.color)
    shadow = "" if light.cast_shadow else ", throws no shadow"
    return f"{kind} '{light.name}': strength {light.strength:.6g}, color {color}{shadow}"
