"""Values of shader nodes that follow from numbers, images and places alone, without a renderer.

Values are NumPy arrays: a number is (1,) or (N, 1), a colour or vector (3,) or (N, 3), for N places that a tree is
evaluated at together. Formulas are those of Cycles, measured (tests/blender/test_read_nodes.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from . import node_math
from .node_math import LUMINANCE, NotUnderstoodError
from .textures import Images, environment_texture, image_texture

# Cycles samples lamps and meshes as no kind of ray.
ON_NO_PATH = {
    ("ShaderNodeLightPath", name): np.zeros(1)
    for name in (
        "Is Camera Ray",
        "Is Shadow Ray",
        "Is Diffuse Ray",
        "Is Glossy Ray",
        "Is Reflection Ray",
        "Is Singular Ray",
        "Is Transmission Ray",
        "Is Volume Scatter Ray",
    )
}


@dataclass(frozen=True)
class Scope:
    """Where a tree is evaluated.

    Attributes
    ----------
    outputs : values of nodes that the places decide, by (type of node, name of output).
    images : pixels already read.
    groups : the group nodes that lead to the tree, innermost last.
    """

    outputs: Mapping[tuple[str, str], np.ndarray] = field(default_factory=lambda: ON_NO_PATH)
    images: Images = field(default_factory=Images)
    groups: tuple = ()

    def inside(self, group) -> Scope:
        return replace(self, groups=(*self.groups, group))

    def outside(self) -> Scope:
        return replace(self, groups=self.groups[:-1])


def linked_output(socket):
    """The output socket that an input gets its value from, or None."""
    links = [link for link in socket.links if not link.is_muted] if socket.is_linked else []
    return links[0].from_socket if links else None


def passed_on(output, scope: Scope):
    """Where a node only hands a value on: (the input socket that it comes from, its scope); None: it has none.

    `output` itself with its scope where the node does more than that.
    """
    node = output.node
    if node.mute:
        through = [link.from_socket for link in node.internal_links if link.to_socket == output]
        return (through[0], scope) if through else None
    if node.bl_idname == "NodeReroute":
        return node.inputs[0], scope
    if node.bl_idname == "NodeGroupInput" and scope.groups:
        return _same(scope.groups[-1].inputs, output), scope.outside()
    if node.bl_idname == "ShaderNodeGroup":
        inner = node.node_tree.nodes if node.node_tree else ()
        ends = [one for one in inner if one.bl_idname == "NodeGroupOutput" and one.is_active_output]
        return (_same(ends[0].inputs, output), scope.inside(node)) if ends else None
    return output, scope


def _same(sockets, wanted):
    return next(socket for socket in sockets if socket.identifier == wanted.identifier)


def input_value(socket, scope: Scope) -> np.ndarray:
    """Value of an input socket; NotUnderstoodError names the first node in its way."""
    output = linked_output(socket)
    if output is None:
        return np.atleast_1d(np.asarray(getattr(socket, "default_value", 0.0), float))[:3]
    return _converted(output_value(output, scope), output.type, socket.type)


def output_value(output, scope: Scope) -> np.ndarray:
    origin = passed_on(output, scope)
    if origin is None:
        return _converted(np.zeros(1), "VALUE", output.type)
    if origin[0] != output:
        return _converted(input_value(*origin), origin[0].type, output.type)
    known = scope.outputs.get((output.node.bl_idname, output.name))
    value = known if known is not None else Node(output, scope).value()
    return _converted(value, "VALUE" if value.shape[-1] == 1 else output.type, output.type)


def _converted(value: np.ndarray, source: str, target: str) -> np.ndarray:
    """As Cycles converts between types of sockets."""
    if target in ("RGBA", "VECTOR"):
        return np.broadcast_to(value, (*value.shape[:-1], 3))
    if value.shape[-1] == 1:
        return value
    return (value @ LUMINANCE if source == "RGBA" else value.mean(axis=-1))[..., None]


class Node:
    """A node seen from one of its outputs, for the functions that know its type."""

    def __init__(self, output, scope: Scope) -> None:
        self.output, self.node, self.scope = output, output.node, scope

    def value(self) -> np.ndarray:
        known = FUNCTIONS.get(self.node.bl_idname)
        if known is None:
            raise NotUnderstoodError(f"only Cycles knows what its node '{self.node.name}' does")
        value = known(self)
        if value is None:
            raise NotUnderstoodError(f"only Cycles knows what its node '{self.node.name}' does here")
        return np.asarray(value, float)

    def __getitem__(self, name: str | int) -> np.ndarray:
        """Value of an input, by its identifier or number."""
        return input_value(self.socket(name), self.scope)

    def socket(self, name: str | int):
        if isinstance(name, int):
            return self.node.inputs[name]
        return next(socket for socket in self.node.inputs if socket.identifier == name)

    def is_linked(self, name: str | int) -> bool:
        return linked_output(self.socket(name)) is not None


def _falloff(node: Node):
    """Light Falloff counts as the light's own only without smoothing; its other outputs depend on the distance."""
    is_own = node.output.name == "Quadratic" and not np.any(node["Smooth"])
    return node["Strength"] if is_own else None


def _uv_map(node: Node):
    """Of the map that renders alone; others are seldom used on what glows."""
    return None if node.node.uv_map else node.scope.outputs.get(("ShaderNodeTexCoord", "UV"))


FUNCTIONS = node_math.FUNCTIONS | {
    "ShaderNodeLightFalloff": _falloff,
    "ShaderNodeTexEnvironment": environment_texture,
    "ShaderNodeTexImage": image_texture,
    "ShaderNodeUVMap": _uv_map,
}
