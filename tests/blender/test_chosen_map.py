"""The node's property UV Map: the map of its image, also where another one renders."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.read.geometry import OWN_MAP
from beamspread.core.target import Target
from live_scenes import live_lines, live_pixels, settle, shown_pixels, switch_off
from nodes import Nodes

SIDE = 32
LEFT = [(0, 0), (0.5, 0), (0.5, 1), (0, 1)]
RIGHT = [(0.5, 0), (1, 0), (1, 1), (0.5, 1)]

is_lit = {"UVMap": np.s_[:, : SIDE // 2], "Second": np.s_[:, SIDE // 2 :]}
"""Texels that the plane covers in each of its maps."""


@pytest.fixture
def plane():
    """A plane with a map in the left half of the image, which renders, and a second one in the right half."""
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin = False, 0
    image = bpy.data.images.new("Target", SIDE, SIDE, float_buffer=True, alpha=False)
    plane = scenes.add_plane(uvs=LEFT, material=scenes.add_material(image=image, linked=True))
    plane.data.uv_layers.new(name="Second").data.foreach_set("uv", np.float32(RIGHT).ravel())
    scenes.add_sun(20)
    bpy.context.view_layer.update()
    return plane


def node_of(plane):
    return scenes.node_of(plane.data.materials[0])


def shown_map(plane):
    node = node_of(plane).node_tree.nodes.get("UV Map")
    return "" if node is None else getattr(node, "uv_map", "") or getattr(node, "attribute_name", "")


@pytest.mark.parametrize("name", is_lit)
def test_the_image_follows_the_chosen_map(plane, name):
    node_of(plane).uv_map = name
    pixels = scenes.bake(plane)[0]
    lit = np.zeros((SIDE, SIDE), bool)
    lit[is_lit[name]] = True
    np.testing.assert_array_equal(pixels.any(axis=-1), lit)
    assert shown_map(plane) == name
    assert plane.data.uv_layers["UVMap"].active_render


def test_a_map_that_the_object_lacks_is_named_with_those_that_it_has(plane):
    node_of(plane).uv_map = "Third"
    scenes.select(plane)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "'Plane' has no UV map 'Third', which the Beamspread node asks for. It has 'UVMap' and 'Second'." in message
    assert "Choose another one in the node, or clear the field." in message
    for _ in range(2):
        plane.data.uv_layers.remove(plane.data.uv_layers[0])
    plane.data.update()
    assert "It has none." in scenes.messages_of(bpy.ops.beamspread.bake)
    assert not plane.data.uv_layers
    node_of(plane).uv_map = ""
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert [layer.name for layer in plane.data.uv_layers] == [OWN_MAP]


def test_a_chosen_map_that_does_not_fit_is_refused_and_no_map_is_made(plane):
    plane.data.uv_layers["Second"].data.foreach_set("uv", np.float32(np.multiply(RIGHT, 3)).ravel())
    plane.data.update()
    node_of(plane).uv_map = "Second"
    scenes.select(plane)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "reaches outside the image" in message
    assert "If the node's UV Map is empty, Beamspread's own Bake makes a map." in message
    assert [layer.name for layer in plane.data.uv_layers] == ["UVMap", "Second"]
    for layer in plane.data.uv_layers:
        layer.data.foreach_set("uv", np.float32(np.multiply(RIGHT, 3)).ravel())
    plane.data.update()
    node_of(plane).uv_map = ""
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert [layer.name for layer in plane.data.uv_layers] == ["UVMap", "Second", OWN_MAP]


def test_a_chosen_map_without_area_is_sent_to_a_bake(plane):
    node_of(plane).uv_map = "Second"
    scenes.select(plane)
    plane.data.uv_layers["Second"].data.foreach_set("uv", np.zeros(8, np.float32))
    plane.data.update()
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "The UV map has no area in any face." in message
    assert message.strip().endswith("If the node's UV Map is empty, Beamspread's own Bake makes a map.")


def test_another_choice_makes_the_bake_out_of_date(plane):
    def row():
        stale.refresh(bpy.context)
        return state.rows[Target("Plane", "Medium")]

    scenes.bake(plane)
    assert row().status == Status.BAKED
    node_of(plane).uv_map = "Second"
    bpy.context.view_layer.update()
    assert row().status == Status.STALE
    assert "material" in row().messages[0].text
    node_of(plane).uv_map = ""
    bpy.context.view_layer.update()
    assert row().status == Status.BAKED


@pytest.mark.usefixtures("live_switched_off")
def test_live_follows_the_choice_and_the_image_of_the_bake_keeps_its_map(plane):
    material = plane.data.materials[0]
    baked = scenes.bake(plane)[0].copy()
    bpy.context.scene.beamspread.use_live = True
    settle()
    node_of(plane).uv_map = "Second"
    live = live_pixels(material).copy()
    assert live[is_lit["Second"]].all()
    assert shown_map(plane) == "Second"
    node_of(plane).uv_map = "Third"
    settle()
    assert any("'Plane' has no UV map 'Third'" in line for line in live_lines())
    switch_off()
    assert shown_map(plane) == ""
    np.testing.assert_array_equal(shown_pixels(material), baked)
    node_of(plane).uv_map = "Second"
    after = scenes.bake(plane)[0]
    assert shown_map(plane) == "Second"
    np.testing.assert_allclose(live[is_lit["Second"]], after[is_lit["Second"]], rtol=1e-4)


def test_objects_of_one_material_need_the_map_each(plane):
    bare = scenes.add_plane("Bare", uvs=RIGHT, material=plane.data.materials[0])
    bare.location.x = 4
    node_of(plane).uv_map = "Second"
    scenes.select(plane, bare)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "'Bare' has no UV map 'Second'" in message
    assert "Plane /" not in message
    assert scenes.pixels(scenes.image_of(plane)).any()


def test_textures_stay_on_the_map_that_renders(plane, tmp_path):
    """The image of the texture is red at the left; the plane shows that half, wherever its bake lies."""
    bpy.context.scene.render.engine = "CYCLES"
    node = node_of(plane)
    node.color_mode, node.uv_map = "BASE_COLOR", "Second"
    image = bpy.data.images.new("Halves", 2, 1, float_buffer=True)
    image.pixels = [0.8, 0.1, 0.1, 1, 0.1, 0.1, 0.8, 1]
    tree = Nodes(plane.data.materials[0]).tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    tree.links.new(node.inputs["Base Color"], texture.outputs["Color"])
    pixels = scenes.bake(plane)[0][is_lit["Second"]]
    assert (pixels[..., 0] > 2 * pixels[..., 2]).all()


def test_a_map_of_a_modifier_may_be_chosen(plane):
    """Blender 3.4 has it as an attribute alone."""
    plane.data.uv_layers.remove(plane.data.uv_layers["Second"])
    plane.modifiers.new("Array", "ARRAY").count = 2
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert plane.modifiers[-1].name == "Beamspread UV Map"
    before = scenes.pixels(scenes.image_of(plane)).copy()
    node_of(plane).uv_map = OWN_MAP
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    np.testing.assert_array_equal(scenes.pixels(scenes.image_of(plane)), before)


def test_it_is_kept_in_files(plane, tmp_path):
    node_of(plane).uv_map = "Second"
    scenes.reopen(tmp_path)
    assert node_of(bpy.data.objects["Plane"]).uv_map == "Second"
