"""Values of nodes against Cycles: a world of that colour lights a white plane, which then shows it."""

import math

import bpy
import numpy as np
import pytest
from beamspread.blender.read.node_math import BLENDS, LUMINANCE, MATH, VECTOR_MATH
from beamspread.blender.read.nodes import surface_of
from beamspread.blender.read.shading import ShadingPoints
from beamspread.core.errors import NotSupportedError
from cycles_truth import add_receiver, cycles_irradiance, our_irradiance
from mathutils import Matrix
from nodes import Nodes, add_sockets
from scenes import add_lamp, add_plane

# Cycles sums even light from everywhere exactly, but for single precision.
EXACT = {"rel": 2e-5, "abs": 2e-6}
COLORS = (0.8, 0.3, 0.15, 1), (0.25, 0.6, 0.4, 1)


class World:
    """A world whose background has the colour that a test links to it."""

    def __init__(self):
        bpy.context.scene.world = bpy.data.worlds.new("World")
        self.tree = Nodes(bpy.context.scene.world, clear=True).tree
        self.background, self.output = self.add("ShaderNodeBackground"), self.add("ShaderNodeOutputWorld")
        self.link(self.background.outputs[0], self.output.inputs["Surface"])
        self.plane, self.image = add_receiver(Matrix(), texels=4)

    def add(self, kind, tree=None, **properties):
        node = (tree or self.tree).nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def link(self, output, socket):
        (output.node.id_data).links.new(output, socket)

    def show(self, output):
        self.link(output, self.background.inputs["Color"])

    def ours(self):
        return ShadingPoints().value(surface_of(self.tree))

    def cycles(self, samples):
        return cycles_irradiance(self.plane, self.image, samples).mean(axis=(0, 1)) / math.pi

    def assert_agree(self, samples=1, **tolerance):
        cycles = self.cycles(samples)
        assert np.broadcast_to(self.ours(), 3) == pytest.approx(cycles, **(tolerance or EXACT))
        return cycles

    def assert_near(self):
        """Cycles takes random samples of light that it does not know to be even: 1024 for each of 16 texels."""
        return self.assert_agree(1024, rel=3e-3)


@pytest.fixture
def world():
    return World()


def set_inputs(node, *values):
    """Values of the enabled inputs, in order."""
    for socket, value in zip([socket for socket in node.inputs if socket.enabled], values):
        socket.default_value = value


@pytest.mark.parametrize("operation", MATH)
def test_math(world, operation):
    node = world.add("ShaderNodeMath", operation=operation)
    world.show(node.outputs[0])
    for values in [(0.7, 0.45, 0.2), (-0.6, 0.5, 0.3), (0.3, 0, 0.0), (1.4, -2.3, 0.5)]:
        set_inputs(node, *values)
        world.assert_agree()
    node.use_clamp = True
    world.assert_agree()


@pytest.mark.parametrize("operation", [*VECTOR_MATH, "SCALE", "DOT_PRODUCT", "LENGTH", "NORMALIZE"])
def test_vector_math(world, operation):
    node = world.add("ShaderNodeVectorMath", operation=operation)
    is_number = operation in ("DOT_PRODUCT", "LENGTH")
    world.show(node.outputs["Value" if is_number else "Vector"])
    first, second, third = (0.3, -0.7, 1.2), (0.5, 0.25, -0.4), (0.1, 0.2, 0.3)
    set_inputs(node, first, 0.4 if operation == "SCALE" else second, third)
    world.assert_agree()


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("kind", ["ShaderNodeMix", "ShaderNodeMixRGB"])
def test_mixed_colors(world, kind, blend):
    node = world.add(kind, blend_type=blend)
    if kind == "ShaderNodeMix":
        node.data_type = "RGBA"
    world.show(next(output for output in node.outputs if output.enabled))
    for factor in (0.0, 0.3, 1.0, 1.7):
        set_inputs(node, factor, *COLORS)
        world.assert_agree()


@pytest.mark.parametrize(
    "temperature", [300, 800, 1000, 1500, 1902, 2400, 2700, 3300, 4000, 5500, 6500, 9000, 12000, 3e4]
)
def test_blackbody(world, temperature):
    """A fit: within .4 % of the strongest channel."""
    node = world.add("ShaderNodeBlackbody")
    node.inputs[0].default_value = temperature
    world.show(node.outputs[0])
    cycles = world.cycles(1)
    assert world.ours() == pytest.approx(cycles, abs=0.004 * float(cycles.max()))


# Inputs of a Mapping node: vector, location, rotation and scale.
PLACED = ((0.3, 0.5, 0.2), (0.1, -0.2, 0.3), (0.4, 0.5, 0.6), (1.5, 0.7, 2))
PLAIN = [
    ("ShaderNodeMapRange", {}, (0.4, 0.1, 0.9, 2.0, -1.0)),
    ("ShaderNodeMapRange", {"clamp": True}, (1.4, 0.1, 0.9, 0.2, 0.7)),
    ("ShaderNodeMapRange", {"clamp": False}, (1.4, 0.1, 0.9, 0.2, 0.7)),
    ("ShaderNodeClamp", {}, (1.4, 0.2, 0.9)),
    ("ShaderNodeClamp", {"clamp_type": "RANGE"}, (0.1, 0.9, 0.2)),
    ("ShaderNodeRGBToBW", {}, (COLORS[0],)),
    ("ShaderNodeGamma", {}, (COLORS[0], 2.2)),
    ("ShaderNodeBrightContrast", {}, (COLORS[0], 0.1, -0.4)),
    ("ShaderNodeInvert", {}, (0.3, COLORS[0])),
    ("ShaderNodeHueSaturation", {}, (0.62, 1.3, 0.8, 0.7, COLORS[0])),
    ("ShaderNodeHueSaturation", {}, (0.15, 0.5, 2.0, 1.0, COLORS[1])),
    ("ShaderNodeHueSaturation", {}, (0.4, 1.0, 1.0, 1.0, (0.3, 0.3, 0.3, 1))),
    ("ShaderNodeCombineXYZ", {}, (0.1, 0.2, 0.3)),
    ("ShaderNodeCombineColor", {}, (0.1, 0.2, 0.3)),
    ("ShaderNodeMix", {"data_type": "FLOAT"}, (0.3, 0.2, 0.9)),
    ("ShaderNodeMix", {"data_type": "VECTOR"}, (1.3, (0.1, 0.2, 0.3), (0.5, 0.1, 0.9))),
    ("ShaderNodeMix", {"data_type": "VECTOR", "clamp_factor": False}, (1.3, (0.1, 0.2, 0.3), (0.5, 0.4, 0.9))),
    (
        "ShaderNodeMix",
        {"data_type": "VECTOR", "factor_mode": "NON_UNIFORM"},
        ((0.1, 0.5, 0.9), (0.1, 0.2, 0.3), (0.5, 0.1, 0.9)),
    ),
    *(("ShaderNodeMapping", {"vector_type": kind}, PLACED) for kind in ("POINT", "TEXTURE", "VECTOR")),
    ("ShaderNodeMapping", {"vector_type": "NORMAL"}, ((0.3, 0.5, 0.2), (0.4, 0.5, 0.6), (1.5, 0.7, 2))),
]


@pytest.mark.parametrize(("kind", "properties", "values"), PLAIN)
def test_nodes_of_their_inputs_alone(world, kind, properties, values):
    node = world.add(kind, **properties)
    set_inputs(node, *values)
    world.show(next(output for output in node.outputs if output.enabled))
    world.assert_agree()


@pytest.mark.parametrize("interpolation", ["LINEAR", "CONSTANT", "EASE"])
def test_color_ramp(world, interpolation):
    node = world.add("ShaderNodeValToRGB")
    node.color_ramp.interpolation = interpolation
    node.color_ramp.elements.new(0.4).color = (0.9, 0.2, 0.1, 0.5)
    for output in node.outputs:
        world.show(output)
        for factor in (-1, 0.1, 0.39, 0.41, 0.77, 2):
            node.inputs[0].default_value = factor
            world.assert_agree(abs=5e-5)


@pytest.mark.parametrize(("kind", "outputs"), [("XYZ", "XYZ"), ("Color", ("Red", "Green", "Blue"))])
def test_separate(world, kind, outputs):
    node = world.add(f"ShaderNodeSeparate{kind}")
    node.inputs[0].default_value = COLORS[0][: len(node.inputs[0].default_value)]
    for output in outputs:
        world.show(node.outputs[output])
        world.assert_agree()


def test_a_color_becomes_a_number_by_its_luminance_a_vector_by_its_mean(world):
    color, vector = world.add("ShaderNodeRGB"), world.add("ShaderNodeCombineXYZ")
    color.outputs[0].default_value = COLORS[0]
    set_inputs(vector, 0.1, 0.3, 0.9)
    number = world.add("ShaderNodeMath", operation="ABSOLUTE")
    world.show(number.outputs[0])
    seen = []
    for output in (color.outputs[0], vector.outputs[0]):
        world.link(output, number.inputs[0])
        seen.append(world.assert_agree()[0])
    assert seen == pytest.approx([np.dot(COLORS[0][:3], LUMINANCE), 1.3 / 3], rel=1e-3)


def new_group(world):
    """A group that multiplies its two inputs by 3 each, as a node of the world; in Blender 4.0 sockets moved."""
    tree = bpy.data.node_groups.new("Times", "ShaderNodeTree")
    add_sockets(tree, "NodeSocketFloat", ("A", "B"), ("C", "D"))
    start, end = world.add("NodeGroupInput", tree), world.add("NodeGroupOutput", tree)
    for i in range(2):
        times = world.add("ShaderNodeMath", tree, operation="MULTIPLY")
        times.inputs[1].default_value = 3
        tree.links.new(start.outputs[i], times.inputs[0])
        tree.links.new(times.outputs[0], end.inputs[i])
    return world.add("ShaderNodeGroup", node_tree=tree)


def test_groups_reroutes_and_muted_nodes(world):
    outer, inner = new_group(world), new_group(world)
    inner.node_tree = outer.node_tree
    color = world.add("ShaderNodeRGB")
    color.outputs[0].default_value = COLORS[0]
    knot = world.add("NodeReroute")
    world.link(color.outputs[0], knot.inputs[0])
    world.link(knot.outputs[0], inner.inputs["B"])
    world.link(inner.outputs["D"], outer.inputs["A"])
    world.show(outer.outputs["C"])
    assert world.assert_agree()[0] == pytest.approx(9 * np.dot(COLORS[0][:3], LUMINANCE), rel=1e-3)
    outer.inputs["B"].default_value = 0.2
    world.show(outer.outputs["D"])
    assert world.assert_agree()[0] == pytest.approx(0.6)
    world.show(outer.outputs["C"])
    outer.node_tree.nodes["Math"].mute = True
    assert world.assert_agree()[0] == pytest.approx(3 * np.dot(COLORS[0][:3], LUMINANCE), rel=1e-3)
    outer.node_tree.nodes["Math"].mute = False
    link = next(link for link in world.tree.links if link.to_node == outer)
    link.is_muted = True
    world.assert_agree()
    outer.mute = True
    world.assert_agree()


@pytest.mark.parametrize("output", ["Is Camera Ray", "Is Shadow Ray", "Is Glossy Ray", "Is Transmission Ray"])
def test_the_world_as_diffuse_surfaces_see_it(world, output):
    """Commonly backgrounds are mixed by the kind of ray."""
    path, mix = world.add("ShaderNodeLightPath"), world.add("ShaderNodeMixShader")
    other = world.add("ShaderNodeBackground")
    other.inputs["Color"].default_value = COLORS[1]
    # Nodes that cameras alone see are not evaluated.
    world.link(world.add("ShaderNodeTexNoise").outputs["Color"], other.inputs["Color"])
    world.background.inputs["Color"].default_value = COLORS[0]
    for socket, source in zip(mix.inputs, (path.outputs[output], world.background.outputs[0], other.outputs[0])):
        world.link(source, socket)
    world.link(mix.outputs[0], world.output.inputs["Surface"])
    assert world.assert_near() == pytest.approx(COLORS[0][:3], rel=3e-3)


def test_a_color_at_the_surface_is_an_emission(world):
    color = world.add("ShaderNodeRGB")
    color.outputs[0].default_value = COLORS[0]
    world.link(color.outputs[0], world.output.inputs["Surface"])
    assert world.assert_near() == pytest.approx(COLORS[0][:3], rel=3e-3)


def test_shaders(world):
    """Emission counts as Background: added, mixed, and with shaders that do not emit."""
    emission = world.add("ShaderNodeEmission")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = COLORS[0], 2
    world.background.inputs["Color"].default_value = COLORS[1]
    surface = world.output.inputs["Surface"]
    for kind in ("ShaderNodeAddShader", "ShaderNodeMixShader"):
        node = world.add(kind)
        both = [socket for socket in node.inputs if socket.type == "SHADER"]
        world.link(emission.outputs[0], both[0])
        world.link(world.background.outputs[0], both[1])
        world.link(node.outputs[0], surface)
        for factor in (0.3, 1.4) if len(node.inputs) == 3 else (None,):
            if factor:
                node.inputs[0].default_value = factor
            world.assert_near()
        node.mute = True
        world.assert_near()
        node.mute = False
        world.link(world.add("ShaderNodeBsdfDiffuse").outputs[0], both[1])
        world.assert_near()
    world.tree.links.remove(surface.links[0])
    assert not world.assert_near().any()


def test_unsupported_nodes_are_named(world):
    noise = world.add("ShaderNodeTexNoise", name="Clouds")
    world.show(noise.outputs["Color"])
    with pytest.raises(NotSupportedError, match="The node 'Clouds' is not supported"):
        world.ours()
    for size in (0.0, 1.0):
        world.background.inputs["Strength"].default_value = size
        if not size:
            assert not world.assert_agree().any()
    curves = world.add("ShaderNodeMath", operation="PINGPONG")
    world.show(curves.outputs[0])
    with pytest.raises(NotSupportedError, match="The node 'Math' is not supported"):
        world.ours()


def in_group(nodes, default=COLORS[0]):
    """Output of a group whose color is the default value of its own input."""
    inside = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    ends = inside.nodes.new("NodeGroupInput"), inside.nodes.new("NodeGroupOutput")
    add_sockets(inside, "NodeSocketColor", "Color")
    add_sockets(inside, "NodeSocketShader", (), "Shader")
    inside.links.new(ends[1].inputs[0], ends[0].outputs[0])
    group = nodes.add("Group", node_tree=inside)
    group.inputs[0].default_value = default
    return group.outputs[0]


def unlinked_in_group(nodes):
    """Output of a group whose color is the default value of the group's output, which has no link."""
    inside = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    end = inside.nodes.new("NodeGroupOutput")
    add_sockets(inside, "NodeSocketColor", (), "Color")
    end.inputs[0].default_value = COLORS[0]
    return nodes.add("Group", node_tree=inside).outputs[0]


def straight(nodes):
    return nodes.add("HueSaturation", {"Color": COLORS[0]}).outputs[0]


@pytest.mark.parametrize("color", [straight, in_group, unlinked_in_group])
@pytest.mark.parametrize("kind", ["world", "material", "lamp"])
def test_a_color_in_a_shaders_place_emits(kind, color):
    """Cycles makes an emission of a color that is linked to Surface, in groups as well."""
    if kind == "world":
        owner = bpy.context.scene.world = bpy.data.worlds.new("World")
    elif kind == "material":
        owner = bpy.data.materials.new("Glow")
        add_plane("Panel", matrix=Matrix.Translation((0, 0, 1)), material=owner)
    else:
        owner = add_lamp((0, 0, 1)).data
        owner.use_nodes = True
    nodes = Nodes(owner)
    nodes.show(color(nodes))
    plane, image = add_receiver(Matrix(), texels=4)
    (ours, _), cycles = our_irradiance(plane, 4), cycles_irradiance(plane, image, 256)
    assert cycles.max() > 0.1
    assert ours.mean((0, 1)) == pytest.approx(cycles.mean((0, 1)), rel=0.02)
