"""Values of shader nodes at places that a light shines from: directions of the world, points of a mesh."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .node_links import End, Wanted, follow
from .node_values import Evaluator, converted
from .textures import Images, environment_coordinates, lookup

ZERO = np.zeros(1)

# By (type of node, output). Cycles samples lamps and meshes as no kind of ray.
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


class Places(Evaluator):
    """Evaluates nodes at places together.

    Attributes
    ----------
    lookups : where not None, gets (pixels, directions) of each environment texture that is looked up.
    """

    def __init__(self, outputs: Mapping[tuple[str, str], np.ndarray] = ON_NO_PATH, images: Images | None = None):
        """`outputs` : values that the places decide, by (type of node, name of output)."""
        self._outputs = outputs
        self._images = images or Images()
        self.lookups: list[tuple[np.ndarray, np.ndarray]] | None = None

    def own_value(self, end: End) -> np.ndarray | None:
        kind = end.node.bl_idname
        known = self._outputs.get((kind, end.socket.name))
        if known is not None:
            return converted(known, "VALUE" if known.shape[-1] == 1 else end.socket.type, end.socket.type)
        if kind == "ShaderNodeLightFalloff":
            return self._falloff(end)
        if kind == "ShaderNodeUVMap" and not end.node.uv_map:
            return self._outputs.get(("ShaderNodeTexCoord", "UV"))
        if kind == "ShaderNodeTexEnvironment" and end.node.projection == "EQUIRECTANGULAR":
            return self._environment(end)
        if kind == "ShaderNodeTexImage" and end.node.projection == "FLAT":
            return self._image(end)
        return None

    def _falloff(self, end: End) -> np.ndarray | None:
        """That of light itself alone: smoothed and by its other outputs it depends on the distance."""
        is_own = end.socket.name == "Quadratic" and not self.value(end.input("Smooth")).any()
        return self.value(end.input("Strength")) if is_own else None

    def _environment(self, end: End) -> np.ndarray | None:
        directions = self._coordinates(end.input("Vector"), "Generated")
        if directions is None:
            return None
        pixels = self._images.environment(end.node)
        if self.lookups is not None:
            self.lookups.append((pixels, directions))
        columns, rows = environment_coordinates(directions, pixels.shape)
        return lookup(pixels, columns, rows, end.node.interpolation != "Closest", "REPEAT", "EXTEND")

    def _image(self, end: End) -> np.ndarray | None:
        places, node = self._coordinates(end.input("Vector"), "UV"), end.node
        if places is None:
            return None
        return self._images.at(node, places)[end.socket.name]

    def _coordinates(self, vector: Wanted, default: str) -> np.ndarray | None:
        """Where to look an image up, or None if the place is unknown."""
        if follow(vector).socket.is_output:
            return self.value(vector)
        return self._outputs.get(("ShaderNodeTexCoord", default))
