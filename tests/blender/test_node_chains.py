"""Node trees of artists that are long, deep or linked many times over: each socket is evaluated once."""

import tracemalloc

import bpy
import numpy as np
import pytest
from beamspread.blender.node.find import find_node, find_node_in_groups
from beamspread.blender.read import shading
from beamspread.blender.read.digests import digest_of_tree
from beamspread.blender.read.image_nodes import Pixels, uv_transform_of
from beamspread.blender.read.lights import read_illumination
from beamspread.blender.read.node_math import FUNCTIONS
from beamspread.blender.read.nodes import InputSocket, Links, surface_of
from beamspread.blender.read.shading import ShadingPoints
from beamspread.blender.read.transparency import TexelEvaluator
from beamspread.core.errors import NotSupportedError
from nodes import add_sockets
from scenes import add_material, add_plane, diffuse_material, node_of

LONG = 400


class Calls:
    """Wraps a function and counts its complete calls."""

    def __init__(self, function):
        self.function, self.count = function, 0

    def __call__(self, *arguments):
        result = self.function(*arguments)
        self.count += 1
        return result


@pytest.fixture
def material():
    return diffuse_material((0.5, 0.5, 0.5))


def add(tree, kind, **properties):
    node = tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(node, name, value)
    return node


def show(material, output):
    surface = material.node_tree.get_output_node("CYCLES").inputs["Surface"]
    material.node_tree.links.new(surface, output)
    return surface_of(material.node_tree)


def chain(tree, kind, count, first, inputs=(0, 1), **properties):
    """Nodes whose inputs are linked to the node before; the output of the last one."""
    output = first
    for _ in range(count):
        node = add(tree, kind, **properties)
        for number in inputs:
            tree.links.new(node.inputs[number], output)
        output = node.outputs[0]
    return output


def emission(tree, strength=1.0):
    node = add(tree, "ShaderNodeEmission")
    node.inputs["Color"].default_value, node.inputs["Strength"].default_value = (1, 1, 1, 1), strength
    return node


def number(tree, value):
    node = add(tree, "ShaderNodeValue")
    node.outputs[0].default_value = value
    return node.outputs[0]


def test_math_nodes_linked_twice_to_the_one_before(material, monkeypatch):
    calls = Calls(FUNCTIONS["ShaderNodeMath"])
    monkeypatch.setitem(FUNCTIONS, "ShaderNodeMath", calls)
    tree = material.node_tree
    light = emission(tree)
    tree.links.new(light.inputs["Strength"], chain(tree, "ShaderNodeMath", 22, number(tree, 0.5), operation="ADD"))
    assert ShadingPoints().value(show(material, light.outputs[0])) == pytest.approx([2.0**21] * 3)
    assert calls.count == 22


def test_added_shaders_linked_twice_to_the_one_before(material, monkeypatch):
    calls = Calls(shading.EMITTERS["ShaderNodeAddShader"])
    monkeypatch.setitem(shading.EMITTERS, "ShaderNodeAddShader", calls)
    tree = material.node_tree
    surface = show(material, chain(tree, "ShaderNodeAddShader", 40, emission(tree).outputs[0]))
    assert ShadingPoints().value(surface) == pytest.approx([2.0**40] * 3)
    assert calls.count == 40


def test_transparent_shaders_linked_twice_to_the_one_before(material):
    tree = material.node_tree
    clear = add(tree, "ShaderNodeBsdfTransparent")
    clear.inputs[0].default_value = (2.0**-41,) * 3 + (1,)
    surface = show(material, chain(tree, "ShaderNodeAddShader", 40, clear.outputs[0]))
    assert TexelEvaluator(Pixels()).value(surface) == pytest.approx(np.full((1, 1, 3), 0.5))


def test_long_chains(material):
    tree = material.node_tree
    light = emission(tree)
    strength = chain(tree, "ShaderNodeMath", LONG, number(tree, 1.0), inputs=(0,), operation="ADD")
    tree.links.new(light.inputs["Strength"], strength)
    added = chain(tree, "ShaderNodeAddShader", LONG, light.outputs[0], inputs=(1,))
    assert ShadingPoints().value(show(material, added)) == pytest.approx([1 + LONG / 2] * 3)


def test_long_chains_of_transparency(material):
    tree = material.node_tree
    clear = add(tree, "ShaderNodeBsdfTransparent")
    surface = show(material, chain(tree, "ShaderNodeMixShader", LONG, clear.outputs[0], inputs=(1, 2)))
    assert TexelEvaluator(Pixels()).value(surface) == pytest.approx(np.ones((1, 1, 3)))


def test_long_chains_of_mappings(material):
    tree = material.node_tree
    uvs, texture = add(tree, "ShaderNodeUVMap"), add(tree, "ShaderNodeTexImage")
    vector = chain(tree, "ShaderNodeMapping", LONG, uvs.outputs[0], inputs=(0,))
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeMapping":
            node.inputs["Location"].default_value = (0.25, 0, 0)
    tree.links.new(texture.inputs["Vector"], vector)
    links = Links()
    light = emission(tree)
    tree.links.new(light.inputs["Color"], texture.outputs["Color"])
    source = links.source(InputSocket(light.inputs["Color"], ()))
    assert uv_transform_of(links, source).matrix[0] == pytest.approx((1, 0, 0.25 * LONG))


def test_groups_used_twice_in_each_other(material):
    """Each group doubles its input by two of the group below: as many paths as 2 to the depth."""
    depth, inner = 12, None
    for _ in range(depth):
        tree = bpy.data.node_groups.new("Doubled", "ShaderNodeTree")
        add_sockets(tree, "NodeSocketFloat", "Value", "Value")
        start, end = add(tree, "NodeGroupInput"), add(tree, "NodeGroupOutput")
        output = start.outputs[0]
        for _ in range(2 if inner else 0):
            group = add(tree, "ShaderNodeGroup", node_tree=inner)
            tree.links.new(group.inputs[0], output)
            output = group.outputs[0]
        tree.links.new(end.inputs[0], output)
        inner = tree
    node = add(material.node_tree, "ShaderNodeGroup", node_tree=inner)
    node.inputs[0].default_value = 3.0
    light = emission(material.node_tree)
    material.node_tree.links.new(light.inputs["Strength"], node.outputs[0])
    assert ShadingPoints().value(show(material, light.outputs[0])) == pytest.approx([3.0] * 3)
    assert find_node_in_groups(material) is None
    assert len(digest_of_tree([surface_of(material.node_tree).socket]).groups) == depth
    add(bpy.data.node_groups[0], "BeamspreadNode")
    assert find_node(material) is None  # the innermost group has many users


def test_an_error_is_found_once_and_named(material):
    tree = material.node_tree
    noise = add(tree, "ShaderNodeTexNoise", name="Clouds")
    light = emission(tree)
    tree.links.new(light.inputs["Strength"], chain(tree, "ShaderNodeMath", 40, noise.outputs[0]))
    with pytest.raises(NotSupportedError, match="The node 'Clouds' is not supported"):
        ShadingPoints().value(show(material, light.outputs[0]))


def test_evaluation_can_be_cancelled(material):
    class Stopped(Exception):
        pass

    steps = []

    def check():
        steps.append(None)
        if len(steps) == 10:
            raise Stopped

    tree = material.node_tree
    surface = show(material, chain(tree, "ShaderNodeAddShader", 40, emission(tree).outputs[0]))
    points = ShadingPoints(check=check)
    with pytest.raises(Stopped):
        points.value(surface)
    assert points.value(surface) == pytest.approx([2.0**40] * 3)  # a cancelled evaluation leaves nothing behind


def test_reading_a_scene_can_be_cancelled(material):
    """While the nodes of lamps, emissive and transparent materials and of the world are evaluated."""

    class Stopped(Exception):
        pass

    def check():
        raise Stopped

    add_plane(material=material)
    with pytest.raises(Stopped):
        read_illumination(bpy.context.evaluated_depsgraph_get(), check=check)


def test_values_are_dropped_after_their_last_reader(material):
    tree = material.node_tree
    light, uvs = emission(tree), add(tree, "ShaderNodeTexCoord")
    first = add(tree, "ShaderNodeSeparateXYZ")
    tree.links.new(first.inputs[0], uvs.outputs["UV"])
    strength = chain(tree, "ShaderNodeMath", 60, first.outputs[0], operation="MAXIMUM")
    tree.links.new(light.inputs["Strength"], strength)
    surface = show(material, light.outputs[0])
    outputs = {("ShaderNodeTexCoord", "UV"): np.random.default_rng(1).random((100_000, 3))}
    tracemalloc.start()
    try:
        radiance = ShadingPoints(outputs).value(surface)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert radiance[:, 0] == pytest.approx(outputs["ShaderNodeTexCoord", "UV"][:, 0])
    assert peak < 12 * 100_000 * 8  # of 60 values


def test_the_node_of_a_material_is_found_in_nested_groups():
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    add(inner, "BeamspreadNode")
    group = add(outer, "ShaderNodeGroup", node_tree=inner)
    material = add_material()
    material.node_tree.nodes.remove(node_of(material))
    around = add(material.node_tree, "ShaderNodeGroup", node_tree=outer)
    assert find_node_in_groups(material) == (inner.nodes[0], (around, group))
