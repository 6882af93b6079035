"""Values and radiance of shader nodes at points: directions of the world, points of a mesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...core.errors import NotSupportedError
from .image_nodes import Images, environment_coordinates, sampled
from .nodes import Evaluator, InputSocket, Links, Source, converted, shows_bake

ZERO, DARK = np.zeros(1), np.zeros(3)

# Outputs by (type of node, output). Cycles samples lamps and meshes as no kind of ray.
ON_NO_PATH = {
    ("ShaderNodeLightPath", f"Is {kind} Ray"): ZERO
    for kind in (
        "Camera",
        "Shadow",
        "Diffuse",
        "Glossy",
        "Singular",
        "Reflection",
        "Transmission",
        "Volume Scatter",
    )
}


class ShadingPoints(Evaluator):
    """Evaluates nodes at points together; the quantity of a shader is the radiance that it emits.

    Radiance is (3,) or (N, 3): W/(m^2 sr) on a mesh or of the world, a factor of a lamp's. Shaders that only scatter
    are dark.

    Attributes
    ----------
    lookups : if not None, (pixels, directions) of each environment texture that is looked up.
    """

    NO_SHADER = DARK

    def __init__(
        self,
        outputs: Mapping[tuple[str, str], np.ndarray] = ON_NO_PATH,
        images: Images | None = None,
        links: Links | None = None,
        check: Callable[[], None] | None = None,
    ) -> None:
        """`outputs` : values that depend on the points, by (type of node, name of output)."""
        super().__init__(links, check)
        self._outputs = outputs
        self._images = images or Images()
        self.lookups: list[tuple[np.ndarray, np.ndarray]] | None = None

    def own_value(self, source: Source) -> np.ndarray | None:
        kind = source.node.bl_idname
        known = self._outputs.get((kind, source.socket.name))
        if known is not None:
            return converted(known, "VALUE" if known.shape[-1] == 1 else source.socket.type, source.socket.type)
        if shows_bake(source.node):
            return ZERO
        if kind == "ShaderNodeLightFalloff":
            return self._falloff(source)
        if kind == "ShaderNodeUVMap" and not source.node.uv_map:
            return self._outputs.get(("ShaderNodeTexCoord", "UV"))
        if kind == "ShaderNodeTexEnvironment" and source.node.projection == "EQUIRECTANGULAR":
            return self._environment(source)
        if kind == "ShaderNodeTexImage" and source.node.projection == "FLAT":
            return self._image(source)
        return None

    def shader(self, source: Source) -> np.ndarray:
        if source.socket.type != "SHADER":
            return self.emission(self._value_of(source), source.socket.type)
        if shows_bake(source.node):
            return DARK
        emits = EMITTERS.get(source.node.bl_idname)
        return DARK if emits is None else emits(self, source)

    def emission(self, value: np.ndarray, kind: str) -> np.ndarray:
        return converted(value, kind, "RGBA")

    def _falloff(self, source: Source) -> np.ndarray | None:
        """Strength of a falloff by the square; a smoothed or another one depends on the distance."""
        is_square = source.socket.name == "Quadratic" and not self.value(source.input("Smooth")).any()
        return self.value(source.input("Strength")) if is_square else None

    def _environment(self, source: Source) -> np.ndarray | None:
        pixels = self._images.environment(source.node)
        directions = self._coordinates(source.input("Vector"), "Generated")
        if directions is None:
            return None
        if self.lookups is not None:
            self.lookups.append((pixels, directions))
        columns, rows = environment_coordinates(directions, pixels.shape)
        return sampled(source.node, pixels, columns, rows, "REPEAT", "EXTEND")

    def _image(self, source: Source) -> np.ndarray | None:
        self._images.check(source.node)
        uvs = self._coordinates(source.input("Vector"), "UV")
        return None if uvs is None else self._images.at(source.node, uvs)[source.socket.name]

    def _coordinates(self, vector: InputSocket, default: str) -> np.ndarray | None:
        """Coordinates at which an image is looked up, or None if they are unknown."""
        if self.links.source(vector).socket.is_output:
            return self.value(vector)
        return self._outputs.get(("ShaderNodeTexCoord", default))


def _product(points: ShadingPoints, source: Source, *names: str) -> np.ndarray:
    """Product of inputs; if one is 0, the others need not be understood. Emission that shows a bake is no light."""
    inputs = [source.input(name) for name in names]
    if any(shows_bake(reader.node) for wanted in inputs for reader in points.links.readers(wanted)):
        return DARK
    product, reason = np.ones(3), None
    for wanted in inputs:
        try:
            product = product * points.value(wanted)
        except NotSupportedError as error:
            reason = reason or error
    if reason and product.any():
        raise reason
    return product


def _emission(points: ShadingPoints, source: Source) -> np.ndarray:
    return _product(points, source, "Color", "Strength")


def _principled(points: ShadingPoints, source: Source) -> np.ndarray:
    """Emission times alpha; coat, sheen and transmission don't change it."""
    color = "Emission Color" if "Emission Color" in source.node.inputs else "Emission"
    return _product(points, source, color, "Emission Strength", "Alpha")


def _add(points: ShadingPoints, source: Source) -> np.ndarray:
    return points.value(source.input(0)) + points.value(source.input(1))


def _mix(points: ShadingPoints, source: Source) -> np.ndarray:
    try:
        factor = np.clip(points.value(source.input(0)), 0, 1)
    except NotSupportedError:
        if points.value(source.input(1)).any() or points.value(source.input(2)).any():
            raise
        return DARK
    # A shader of weight 0 need not be understood.
    first = DARK if (factor == 1).all() else points.value(source.input(1))
    second = DARK if not factor.any() else points.value(source.input(2))
    return first + factor * (second - first)


EMITTERS = {
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,  # also on meshes
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeAddShader": _add,
    "ShaderNodeMixShader": _mix,
}
