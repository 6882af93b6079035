"""What a batch read, in lines: lights with kind and strength, what throws shadows, and what is baked."""

from __future__ import annotations

from collections.abc import Iterator

from ..bake.runner import Bake
from ..scene.illumination import Illumination
from ..scene.lights import Light


class Inventory:
    """Says of the light that bakes share each line once."""

    def __init__(self) -> None:
        self._said: set[str] = set()

    def lines(self, bake: Bake) -> Iterator[str]:
        """What is new of the light of this bake, then the bake."""
        job = bake.job
        if job is None:
            return
        for line in _light(job.illumination):
            if line not in self._said:
                self._said.add(line)
                yield line
        receiver, grids = job.receiver, [chart.grid for chart in job.receiver.charts]
        sizes = [f"{one.width * one.pitch_x:.4g} x {one.height * one.pitch_y:.4g}" for one in grids]
        yield f"'{job.name}': {receiver.width} x {receiver.height} texels, {', '.join(sizes)} scene units"


def _light(illumination: Illumination) -> Iterator[str]:
    yield f"{len(illumination.lights)} lights; {illumination.triangle_count} triangles in the light's way"
    yield from map(_one_light, illumination.lights)
    yield from map(str, illumination.messages)


def _one_light(light: Light) -> str:
    kind = type(light).__name__.removesuffix("Light")
    color = " ".join(f"{value:.4g}" for value in light.color)
    shadow = "" if light.cast_shadow else ", throws no shadow"
    return f"{kind} '{light.name}': strength {light.strength:.6g}, color {color}{shadow}"
