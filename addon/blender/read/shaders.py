"""What a tree of shader nodes emits."""

from __future__ import annotations

import numpy as np

from .image_texture import NotUnderstoodError
from .node_links import End, Wanted, follow
from .places import Places

DARK = np.zeros(3)


def radiance(places: Places, surface: Wanted) -> np.ndarray:
    """Of the shader at an input socket: (3,) or (N, 3), W/(m^2 sr) on a mesh or of the world, a factor of a lamp.

    Shaders that only scatter are dark. NotUnderstoodError names the first node in the way of an answer.
    """
    end = follow(surface)
    if not end.socket.is_output or end.node.mute:
        return DARK
    emits = EMITTERS.get(end.node.bl_idname)
    return DARK if emits is None else emits(places, end)


def surface_of(tree) -> Wanted | None:
    """What a material's, a world's or a light's tree shows in Cycles, or None."""
    output = tree.get_output_node("CYCLES")
    return None if output is None else Wanted(output.inputs["Surface"], ())


def _product(places: Places, end: End, *names: str) -> np.ndarray:
    """Of inputs; one that is 0 makes it 0, whether the others are understood or not."""
    product, reason = np.ones(3), None
    for name in names:
        try:
            product = product * places.value(end.input(name))
        except NotUnderstoodError as error:
            reason = reason or error
    if reason and product.any():
        raise reason
    return product


def _emission(places: Places, end: End) -> np.ndarray:
    return _product(places, end, "Color", "Strength")


def _principled(places: Places, end: End) -> np.ndarray:
    """A coat, sheen or transmission leaves it as it is, alpha does not."""
    color = "Emission Color" if "Emission Color" in end.node.inputs else "Emission"
    return _product(places, end, color, "Emission Strength", "Alpha")


def _add(places: Places, end: End) -> np.ndarray:
    return radiance(places, end.input(0)) + radiance(places, end.input(1))


def _mix(places: Places, end: End) -> np.ndarray:
    try:
        factor = np.clip(places.value(end.input(0)), 0, 1)
    except NotUnderstoodError:
        if radiance(places, end.input(1)).any() or radiance(places, end.input(2)).any():
            raise
        return DARK
    # A shader that does not count need not be understood.
    first = DARK if (factor == 1).all() else radiance(places, end.input(1))
    second = DARK if not factor.any() else radiance(places, end.input(2))
    return first + factor * (second - first)


EMITTERS = {
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,  # the same, on meshes as well
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeAddShader": _add,
    "ShaderNodeMixShader": _mix,
}
