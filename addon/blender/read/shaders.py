"""What a tree of shader nodes emits."""

from __future__ import annotations

import numpy as np

from .node_math import NotUnderstoodError
from .node_values import Node, Scope, linked_output, passed_on

DARK = np.zeros(3)


def radiance(surface, scope: Scope) -> np.ndarray:
    """Of the shader at an input socket: (3,) or (N, 3), W/(m^2 sr) on a mesh or of the world, a factor of a lamp.

    Shaders that only scatter are dark. NotUnderstoodError names the first node in the way of an answer.
    """
    output = linked_output(surface)
    origin = None if output is None else passed_on(output, scope)
    if origin is None:
        return DARK
    if origin[0] != output:
        return radiance(*origin)
    emits = EMITTERS.get(output.node.bl_idname)
    return DARK if emits is None else emits(Node(output, scope))


def _product(node: Node, *names: str) -> np.ndarray:
    """Of inputs; one that is 0 makes it 0, whether the others are understood or not."""
    values, reason = [], None
    for name in names:
        try:
            values.append(node[name])
        except NotUnderstoodError as error:
            reason = reason or error
    if any(not value.any() for value in values):
        return DARK
    if reason:
        raise reason
    product = np.ones(3)
    for value in values:
        product = product * value
    return product


def _emission(node: Node) -> np.ndarray:
    return _product(node, "Color", "Strength")


def _principled(node: Node) -> np.ndarray:
    """A coat, sheen or transmission leaves it as it is, alpha does not."""
    color = "Emission Color" if "Emission Color" in node.node.inputs else "Emission"
    return _product(node, color, "Emission Strength", "Alpha")


def _add(node: Node) -> np.ndarray:
    return radiance(node.socket(0), node.scope) + radiance(node.socket(1), node.scope)


def _mix(node: Node) -> np.ndarray:
    try:
        factor = np.clip(node[0], 0, 1)
    except NotUnderstoodError:
        if radiance(node.socket(1), node.scope).any() or radiance(node.socket(2), node.scope).any():
            raise
        return DARK
    # A shader that does not count need not be understood.
    first = DARK if (factor == 1).all() else radiance(node.socket(1), node.scope)
    second = DARK if not factor.any() else radiance(node.socket(2), node.scope)
    return first + factor * (second - first)


EMITTERS = {
    "ShaderNodeEmission": _emission,
    "ShaderNodeBackground": _emission,  # the same, on meshes as well
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeAddShader": _add,
    "ShaderNodeMixShader": _mix,
}
