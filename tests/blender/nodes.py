"""Node trees of shaders for the tests."""

import bpy


class Nodes:
    """Nodes of a material, world or lamp, made by kind, with inputs given as values or as sockets to link.

    Attributes
    ----------
    owner, tree : data-block and its node tree.
    """

    def __init__(self, owner, clear=False):
        if bpy.app.version < (5, 0, 0):  # later ones always use nodes, and warn
            owner.use_nodes = True
        self.owner, self.tree = owner, owner.node_tree
        if clear:
            self.tree.nodes.clear()

    def add(self, kind, inputs=(), **properties):
        """A node by the end of its identifier."""
        return add_node(self.tree, kind, inputs, **properties)

    def set(self, socket, value):
        set_input(socket, value)

    def of_type(self, kind):
        return next(node for node in self.tree.nodes if node.type == kind)

    def show(self, shader, socket="Surface"):
        """Link the shader, or a socket, to the output that Cycles renders, which may be new."""
        output = self.tree.get_output_node("CYCLES")
        if output is None:
            output = self.add(f"Output{type(self.owner).__name__}")
        set_input(output.inputs[socket], getattr(shader, "outputs", [shader])[0])

    def finish(self, shader, socket="Surface"):
        """The owner, which shows the shader."""
        self.show(shader, socket)
        return self.owner


def add_node(tree, kind, inputs=(), **properties):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in properties.items():
        setattr(node, name, value)
    for key, value in dict(inputs).items():
        set_input(node.inputs[key], value)
    return node


def set_input(socket, value):
    """Link an input to an output, or give it a value."""
    if isinstance(value, bpy.types.NodeSocket):
        value.id_data.links.new(socket, value)
    else:
        socket.default_value = value


def add_sockets(tree, kind, inputs=(), outputs=()):
    """Give a group an input and an output of a kind, or several by their names."""
    for in_out, names in (("INPUT", inputs), ("OUTPUT", outputs)):
        for name in [names] if isinstance(names, str) else names:
            if hasattr(tree, "interface"):  # Blender 4.0
                tree.interface.new_socket(name, in_out=in_out, socket_type=kind)
            else:
                (tree.inputs if in_out == "INPUT" else tree.outputs).new(kind, name)
