"""A linked node that was never baked shows its base color as a diffuse surface, and lights nothing by itself."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.node.tree import make_inner_tree
from cycles_truth import add_receiver, cycles_bake
from mathutils import Euler, Matrix
from nodes import Nodes

COLOR = (0.7, 0.4, 0.2)
WALL = Matrix.Translation((0.0, 0.0, 0.4)) @ Euler((0, np.pi / 2, 0)).to_matrix().to_4x4()


def unbaked(**properties):
    return scenes.add_material(color_mode="BASE_COLOR", base_color=COLOR, linked=True, ior=1.0, **properties)


def light_from(material, with_sun):
    """Irradiance of a white plane beside a wall of the material."""
    receiver, image = add_receiver(Matrix(), texels=4)
    wall = scenes.add_plane("Wall", (1, 1), WALL, material=material)
    sun = scenes.add_sun(40) if with_sun else None
    light = cycles_bake(receiver, image, {"DIRECT", "INDIRECT"}, 256)
    for obj in filter(None, (receiver, wall, sun)):
        bpy.data.objects.remove(obj)
    return light.mean(axis=(0, 1))


def test_it_lights_nothing_by_itself():
    assert not light_from(unbaked(), with_sun=False).any()


def test_it_reflects_as_a_diffuse_surface_of_its_base_color():
    expected = light_from(scenes.diffuse_material(COLOR), with_sun=True)
    assert light_from(unbaked(), with_sun=True) == pytest.approx(expected, rel=0.01)


def test_a_linked_color_counts_instead():
    material = unbaked()
    color = material.node_tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.1, 0.2, 0.3, 1)
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], color.outputs[0])
    expected = light_from(scenes.diffuse_material((0.1, 0.2, 0.3)), with_sun=True)
    assert light_from(material, with_sun=True) == pytest.approx(expected, rel=0.01)


def test_an_albedo_shows_the_color_of_its_medium():
    node = scenes.node_of(scenes.add_material(albedo=(0.999, 0.9, 0.5)))
    shown = list(node.inputs["Base Color"].default_value)[:3]
    assert shown == pytest.approx(node.surface().reflectance())
    node.albedo = (1, 1, 1)  # out of range
    assert list(node.inputs["Base Color"].default_value)[:3] == pytest.approx(list(node.base_color))


def test_its_color_output_is_black_until_it_is_baked():
    material = unbaked()
    nodes = Nodes(material)
    nodes.show(nodes.add("Emission", {"Color": scenes.node_of(material).outputs["Color"]}))
    assert not light_from(material, with_sun=False).any()


def test_an_image_replaces_the_base_color():
    image = scenes.known_image((0.2, 0.3, 0.4))
    image.pack()
    material = unbaked()
    scenes.node_of(material).image = image
    light = light_from(material, with_sun=False)
    assert light[2] > light[1] > light[0] > 0
    assert light / light[0] == pytest.approx([1, 1.5, 2], rel=0.01)
    scenes.node_of(material).image = None
    assert not light_from(material, with_sun=False).any()


def test_nodes_of_older_files_show_their_base_color():
    material = unbaked()
    tree = scenes.node_of(material).node_tree
    for name in ("Is Baked", "Diffuse", "Surface", "Baked Color"):
        tree.nodes.remove(tree.nodes[name])
    tree.links.new(tree.nodes["Total"].inputs[0], tree.nodes["Emission"].outputs[0])
    tree.links.new(tree.nodes["Output"].inputs["Color"], tree.nodes["Image"].outputs["Color"])
    scenes.node_of(material).inputs["Base Color"].default_value = (0, 0, 0, 1)
    for handler in bpy.app.handlers.load_post:
        if "beamspread" in handler.__module__:
            handler("")
    made = make_inner_tree()
    assert set(tree.nodes.keys()) == set(made.nodes.keys())
    assert len(tree.links) == len(made.links)
    assert list(scenes.node_of(material).inputs["Base Color"].default_value)[:3] == pytest.approx(COLOR)
