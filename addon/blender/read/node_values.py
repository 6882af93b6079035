"""Values of shader nodes by NumPy, without a renderer: numbers, images and arithmetic on them, as Cycles has them.

Values are arrays whose last axis is 1 for numbers, 3 for colours and vectors; the axes before it, if any, are the
places that a tree is evaluated at together.
"""

from __future__ import annotations

import numpy as np

from .image_texture import NotUnderstoodError
from .node_links import End, Wanted, follow
from .node_math import FUNCTIONS, LUMINANCE


class Evaluator:
    """Evaluates nodes; what else than their inputs they depend on is said by `own_value`."""

    def value(self, wanted: Wanted) -> np.ndarray:
        """Of an input, in the type of its socket; NotUnderstoodError names the first node in its way."""
        end = follow(wanted)
        if not end.socket.is_output:
            value = np.atleast_1d(np.asarray(getattr(end.socket, "default_value", 0.0), float))[:3]
        elif end.node.mute:
            value = np.zeros(1)
        else:
            value = self.own_value(end)
            if value is None:
                value = self.computed(end)
        return converted(value, end.socket.type, wanted.socket.type)

    def own_value(self, end: End) -> np.ndarray | None:
        """Of a node that knows more than its inputs, or None."""
        raise NotImplementedError

    def computed(self, end: End) -> np.ndarray:
        """By the node's inputs alone."""
        known = FUNCTIONS.get(end.node.bl_idname)
        value = None if known is None else known(Node(self, end))
        if value is None:
            raise NotUnderstoodError(f"the node '{end.node.name}' is")
        return np.asarray(value, float)


class Node:
    """A node seen from one of its outputs, for the functions that know its type."""

    def __init__(self, evaluator: Evaluator, end: End) -> None:
        self.evaluator, self.output, self.node, self.groups = evaluator, end.socket, end.node, end.groups

    def __getitem__(self, key: str | int) -> np.ndarray:
        return self.evaluator.value(self.wanted(key))

    def wanted(self, key: str | int) -> Wanted:
        """An input, by its identifier (names are not unique) or number."""
        if isinstance(key, str):
            key = next(i for i, socket in enumerate(self.node.inputs) if socket.identifier == key)
        return Wanted(self.node.inputs[key], self.groups)


def converted(value: np.ndarray, source: str, target: str) -> np.ndarray:
    """As Cycles converts between types of sockets: colours to numbers by their luminance, vectors by their mean."""
    if target in ("RGBA", "VECTOR"):
        return np.broadcast_to(value, (*value.shape[:-1], 3))
    if value.shape[-1] == 1:
        return value
    return (value @ LUMINANCE if source == "RGBA" else value.mean(axis=-1))[..., None]
