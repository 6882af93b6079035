"""Node trees of shaders: following links, and evaluating sockets, each once and without recursion.

Values are arrays whose last axis is 1 for numbers, 3 for colors and vectors. Axes before it, if any, are the points
that a tree is evaluated at together.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from ...core.errors import NotSupportedError
from .node_math import FUNCTIONS, LUMINANCE

OWN_NODE = "BeamspreadNode"
# Name of the node's inner tree. Its nodes show a bake, which neither shines on other objects nor lets light through.
INNER_TREE = ".Beamspread"

PLAIN = "beamspread_plain"
"""Key of image nodes that show a bake in the node's place: kind of the plain nodes around them."""


class Source(NamedTuple):
    """Output of a node, or an input without a link, whose own value counts.

    Attributes
    ----------
    groups : group nodes around the node, outermost first.
    """

    socket: object
    groups: tuple

    @property
    def node(self):
        return self.socket.node

    def input(self, key) -> InputSocket:
        """An input of the node, by name or index."""
        return InputSocket(self.node.inputs[key], self.groups)

    def inputs(self) -> Iterator[InputSocket]:
        """All inputs that the output depends on."""
        if self.socket.is_output and not shows_bake(self.node):
            for socket in self.node.inputs:
                yield InputSocket(socket, self.groups)


class InputSocket(NamedTuple):
    """Input of a node, and the group nodes around the node, outermost first."""

    socket: object
    groups: tuple


def shows_bake(node) -> bool:
    """True for a Beamspread node, and for the plain nodes in its place: a group, or a marked image node."""
    if node.bl_idname == "ShaderNodeTexImage":
        return PLAIN in node
    tree = getattr(node, "node_tree", None)
    return node.bl_idname == OWN_NODE or (tree is not None and tree.name.startswith(INNER_TREE))


def surface_of(tree) -> InputSocket | None:
    """Surface input of the output node that Cycles renders, in a material's, a world's or a lamp's tree; or None."""
    output = tree.get_output_node("CYCLES")
    return None if output is None else InputSocket(output.inputs["Surface"], ())


class Links:
    """Links of node trees, read once: Blender searches all links of a tree for those of a socket."""

    def __init__(self) -> None:
        self._into: dict[object, dict] = {}  # by tree: the link into each input
        self._sources: dict[InputSocket, Source] = {}

    def source(self, wanted: InputSocket) -> Source:
        """Source of an input's value, through groups, reroutes and muted nodes."""
        if wanted not in self._sources:
            self._sources[wanted] = self._follow(*wanted)
        return self._sources[wanted]

    def readers(self, wanted: InputSocket) -> Counter[Source]:
        """Every source that an input depends on, with the number of inputs that read it."""
        readers, waiting = Counter(), [wanted]
        while waiting:
            source = self.source(waiting.pop())
            readers[source] += 1
            if readers[source] == 1:
                waiting += source.inputs()
        return readers

    def _follow(self, socket, groups: tuple) -> Source:
        while True:
            link = self.link_into(socket)
            if link is None:
                return Source(socket, groups)
            socket, node = link.from_socket, link.from_node
            if node.mute:
                inner = next((inner for inner in node.internal_links if inner.to_socket == socket), None)
                if inner is None:
                    return Source(socket, groups)
                socket = inner.from_socket
            elif node.type == "REROUTE":
                socket = node.inputs[0]
            elif node.type == "GROUP_INPUT" and groups:
                socket, groups = _same(groups[-1].inputs, socket), groups[:-1]
            elif getattr(node, "node_tree", None) is not None and not shows_bake(node):
                outputs = (inner for inner in node.node_tree.nodes if inner.type == "GROUP_OUTPUT")
                output = next((inner for inner in outputs if inner.is_active_output), None)
                if output is None:
                    return Source(socket, groups)
                socket, groups = _same(output.inputs, socket), (*groups, node)
            else:
                return Source(socket, groups)

    def link_into(self, socket):
        """The link into an input, or None; muted links don't count."""
        tree = socket.id_data
        if tree not in self._into:
            valid = [link for link in tree.links if link.is_valid and not link.is_muted]
            self._into[tree] = {link.to_socket: link for link in reversed(valid)}
        return self._into[tree].get(socket)


def _same(sockets, socket):
    return next(candidate for candidate in sockets if candidate.identifier == socket.identifier)


class _MissingError(Exception):
    """Asks for an output that is evaluated before the function that asks is called again."""

    def __init__(self, key: tuple) -> None:
        super().__init__()
        self.key = key


class Evaluator:
    """Evaluates nodes. Subclasses know the nodes that depend on more than their inputs, and the shaders.

    A function of a node asks for the values of inputs. The first input that is not known yet ends the call. The
    function is called again once that input has been evaluated, so that no chain of nodes is too long. An outcome is
    dropped when the last node that reads it has been evaluated.
    """

    NO_SHADER: np.ndarray

    def __init__(self, links: Links | None = None, check: Callable[[], None] | None = None) -> None:
        """`check` is called before each step, and raises an exception to cancel the evaluation."""
        self.links = links or Links()
        self._check = check
        self._outcomes: dict | None = None  # while the outermost input is evaluated

    def value(self, wanted: InputSocket) -> np.ndarray:
        """Value of an input in the type of its socket, for a shader's input as `shader` has it.

        Raises
        ------
        NotSupportedError
            Names the first node that only Cycles can evaluate.
        """
        source, is_shader = self.links.source(wanted), wanted.socket.type == "SHADER"
        if source.socket.is_output and not source.node.mute:
            value = self._outcome(wanted, (source, is_shader))
        elif is_shader and (source.socket.is_output or source.socket.type == "SHADER"):
            value = self.NO_SHADER
        elif source.socket.is_output:
            value = np.zeros(1)
        else:
            value = np.atleast_1d(np.asarray(getattr(source.socket, "default_value", 0.0), float))[:3]
            value = self.emission(value, source.socket.type) if is_shader else value
        return value if is_shader else converted(value, source.socket.type, wanted.socket.type)

    def shader(self, source: Source) -> np.ndarray:
        """The quantity of a shader that the subclass evaluates, of any output that is linked to a shader's input."""
        raise NotImplementedError

    def emission(self, _value: np.ndarray, _kind: str) -> np.ndarray:
        """The quantity of the emission that Cycles makes of a value in a shader's place; `_kind` is a socket's type."""
        return self.NO_SHADER

    def own_value(self, source: Source) -> np.ndarray | None:
        """Value of a node that depends on more than its inputs, or None."""
        raise NotImplementedError

    def computed(self, source: Source) -> np.ndarray:
        """Value of a node that depends on its inputs alone."""
        known = FUNCTIONS.get(source.node.bl_idname)
        value = None if known is None else known(Node(self, source))
        if value is None:
            raise NotSupportedError("node", source.node.name)
        return np.asarray(value, float)

    def _outcome(self, wanted: InputSocket, key: tuple[Source, bool]) -> np.ndarray:
        if self._outcomes is None:
            outcome = self._evaluate(wanted, key)
        elif key in self._outcomes:
            outcome = self._outcomes[key]
        else:
            raise _MissingError(key)
        if isinstance(outcome, NotSupportedError):
            try:
                raise outcome.with_traceback(None)
            finally:
                del outcome  # its traceback has this frame, and by it all that its callers hold
        return outcome

    def _evaluate(self, wanted: InputSocket, key: tuple[Source, bool]) -> np.ndarray | NotSupportedError:
        readers = self.links.readers(wanted)
        self._outcomes, stack = {}, {key: None}
        try:
            while stack:
                if self._check is not None:
                    self._check()
                last = next(reversed(stack))
                source, is_shader = last
                try:
                    outcome = self.shader(source) if is_shader else self._value_of(source)
                except _MissingError as missing:
                    if missing.key in stack:
                        raise NotSupportedError("node", source.node.name, "it is linked in a circle") from None
                    stack[missing.key] = None
                    continue
                except NotSupportedError as error:
                    outcome = error.with_traceback(None)
                    outcome.__context__ = None
                del stack[last]
                self._outcomes[last] = outcome
                self._drop_inputs(source, readers)
            return self._outcomes[key]
        finally:
            self._outcomes = None

    def _value_of(self, source: Source) -> np.ndarray:
        value = self.own_value(source)
        return self.computed(source) if value is None else value

    def _drop_inputs(self, source: Source, readers: Counter[Source]) -> None:
        for wanted in source.inputs():
            before = self.links.source(wanted)
            readers[before] -= 1
            if readers[before] == 0:
                self._outcomes.pop((before, True), None)
                self._outcomes.pop((before, False), None)


class Node:
    """A node seen from one of its outputs, for the functions that know its type."""

    def __init__(self, evaluator: Evaluator, source: Source) -> None:
        self.evaluator, self.output, self.node, self.groups = evaluator, source.socket, source.node, source.groups

    def __getitem__(self, key: str | int) -> np.ndarray:
        """Value of an input, by its identifier (names are not unique) or number."""
        if isinstance(key, str):
            key = next(i for i, socket in enumerate(self.node.inputs) if socket.identifier == key)
        return self.evaluator.value(InputSocket(self.node.inputs[key], self.groups))


def converted(value: np.ndarray, source: str, target: str) -> np.ndarray:
    """A value in another type of socket, as in Cycles: colors become numbers by luminance, vectors by their mean."""
    if target in ("RGBA", "VECTOR"):
        return np.broadcast_to(value, (*value.shape[:-1], 3))
    if value.shape[-1] == 1:
        return value
    return (value @ LUMINANCE if source == "RGBA" else value.mean(axis=-1))[..., None]
