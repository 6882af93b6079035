"""What materials let through of the light that shadow rays ask for, as Cycles without caustics.

Only transparent closures let light through: Transparent BSDF and what alpha leaves of a Principled BSDF, mixed and
added. Glass, refraction and translucent BSDFs bend or spread light, and throw full shadows.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ...core.native import native
from .. import compat
from .image_texture import NotUnderstoodError, Pixels, TexturePlace
from .node_links import Wanted, follow
from .texels import FINE_SIDE, Texels

# A size that tells what comes from images from what is constant.
PROBE = (2, 2)

BLACK = np.zeros((1, 1, 1), np.float32)


@dataclass(frozen=True, eq=False)
class LetThrough:
    """A native `Transmittance`, and where its image lies if it has one."""

    transmittance: object
    place: TexturePlace | None = None


@functools.cache
def plain(part: int) -> LetThrough:
    """What lets everything or nothing through: 1 or 0."""
    return LetThrough(native.Transmittance((part, part, part)))


class Materials:
    """Evaluates each material once; `warnings` are sentences about what is not understood."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self._known: dict[str | None, LetThrough] = {None: plain(0)}

    def read(self, material) -> LetThrough:
        """`material` None: Cycles' default, which is opaque."""
        name = material and material.name_full
        if name not in self._known:
            self._known[name] = self._read(material)
        return self._known[name]

    def forget(self, name: str) -> None:
        """Evaluate a material of that full name again."""
        self._known.pop(name, None)

    def _read(self, material) -> LetThrough:
        if not (compat.uses_nodes(material) and compat.has_transparent_shadow(material)):
            return plain(0)
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            return plain(0)
        if not output.inputs["Surface"].is_linked:
            if not output.inputs["Volume"].is_linked:
                return plain(0)
            self.warnings.append(
                f"The material '{material.name}' has a volume alone: it throws no shadow, whatever the volume takes."
            )
            return plain(1)
        try:
            return self._evaluate(Wanted(output.inputs["Surface"], ()))
        except NotUnderstoodError as what:
            self.warnings.append(f"The material '{material.name}' throws opaque shadows: {what} not understood.")
            return plain(0)

    def _evaluate(self, surface: Wanted) -> LetThrough:
        pixels = Pixels()  # of this material alone: they may take gigabytes
        # Once to see which images there are, then at the texels of the largest of them, or between.
        values = Texels(pixels, PROBE)
        transmittance = transparency(values, surface)
        place = values.place
        if place is None:
            return LetThrough(native.Transmittance(_color(transmittance)))
        finer = max(1, FINE_SIDE // max(values.largest)) if values.is_bent else 1
        size = tuple(side * finer for side in values.largest)
        texels = _in_range(transparency(Texels(pixels, size), surface))
        if (texels[..., :1] == texels).all():
            texels = texels[..., :1]
        texels = np.ascontiguousarray(texels, np.float32)
        outside = _color(transparency(Texels(pixels, is_outside=True), surface))
        image = native.Transmittance.from_image(texels, place.extension, place.is_smooth, outside)
        return LetThrough(image, place)


def _in_range(transmittance: np.ndarray) -> np.ndarray:
    return np.clip(np.nan_to_num(transmittance), 0, 1)


def _color(transmittance: np.ndarray) -> list[float]:
    return np.broadcast_to(_in_range(transmittance)[0, 0], 3).tolist()


def transparency(values: Texels, wanted: Wanted) -> np.ndarray:
    """The weight of a shader's transparent closures, as of `Texels`."""
    end = follow(wanted)
    if not end.socket.is_output or end.node.mute:
        return BLACK
    kind = end.node.bl_idname
    if kind == "ShaderNodeBsdfTransparent":
        return values.color(end.input("Color"))
    if kind == "ShaderNodeBsdfPrincipled":
        return 1 - np.clip(values.number(end.input("Alpha")), 0, 1)
    if kind == "ShaderNodeAddShader":
        return transparency(values, end.input(0)) + transparency(values, end.input(1))
    if kind == "ShaderNodeMixShader":
        first, second = (transparency(values, end.input(i)) for i in (1, 2))
        if first is second or (values.place is None and np.array_equal(first, second)):
            return first  # whatever the factor is
        part = np.clip(values.number(end.input(0)), 0, 1)
        if first.shape[:2] != (1, 1) or second.shape[:2] != (1, 1):
            values.bent(part)
        return (1 - part) * first + part * second
    return BLACK
