"""Following the links of a node tree: through groups, reroutes and muted nodes to what a socket's value comes from."""

from __future__ import annotations

from typing import NamedTuple

# What a bake is shown by is no light, and lets none through: its tree counts for nothing.
OWN_NODE = "BeamspreadNode"


class End(NamedTuple):
    """A node's output, or an input without link, whose own value counts; `groups` are the group nodes around it."""

    socket: object
    groups: tuple

    @property
    def node(self):
        return self.socket.node

    def input(self, key) -> Wanted:
        """An input of the node, by name or index."""
        return Wanted(self.node.inputs[key], self.groups)


class Wanted(NamedTuple):
    """An input whose value is asked for."""

    socket: object
    groups: tuple


def follow(wanted: Wanted) -> End:
    socket, groups = wanted
    while True:
        link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
        if link is None:
            return End(socket, groups)
        socket, node = link.from_socket, link.from_node
        if node.mute:
            inner = next((inner for inner in node.internal_links if inner.to_socket == socket), None)
            if inner is None:
                return End(socket, groups)
            socket = inner.from_socket
        elif node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP_INPUT" and groups:
            socket, groups = _same(groups[-1].inputs, socket), groups[:-1]
        elif getattr(node, "node_tree", None) is not None and node.bl_idname != OWN_NODE:
            output = next(
                (one for one in node.node_tree.nodes if one.type == "GROUP_OUTPUT" and one.is_active_output), None
            )
            if output is None:
                return End(socket, groups)
            socket, groups = _same(output.inputs, socket), (*groups, node)
        else:
            return End(socket, groups)


def _same(sockets, socket):
    return next(one for one in sockets if one.identifier == socket.identifier)
