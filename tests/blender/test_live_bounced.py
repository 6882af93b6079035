"""Live shows light that bounces, and skies that only Cycles can evaluate, as bakes do."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import timer
from live_scenes import live_lines, live_pixels, make_scene, settle, shown_pixels, switch_off

pytestmark = pytest.mark.usefixtures("live_switched_off")


def add_wall(shader="ShaderNodeBsdfDiffuse", color=(0.8, 0.1, 0.1)):
    """A wall along one side of the plane."""
    material = bpy.data.materials.new("Wall")
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new(shader)
    node.inputs["Color"].default_value = (*color, 1)
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    wall = scenes.add_plane("Wall", material=material)
    wall.rotation_euler, wall.location = (0, np.pi / 2, 0), (-1.0, 0, 1.01)
    return wall


@pytest.fixture
def lit():
    """A plane beside a red wall; its lamp and its material."""
    plane, lamp, material = make_scene()
    bpy.context.scene.beamspread.use_indirect = True
    return plane, lamp, material, add_wall()


def baked_pixels(plane):
    switch_off()
    return scenes.bake(plane)[0]


def test_at_rest_the_preview_is_the_bake_with_bounced_light(lit):
    plane, lamp, material, wall = lit
    live_pixels(material)
    lamp.location.x = -0.4
    live_pixels(material)
    wall.location.x = -0.8
    live = live_pixels(material)
    assert live_lines() == []
    baked = baked_pixels(plane)
    np.testing.assert_allclose(live, baked, rtol=1e-4, atol=1e-6)
    bpy.context.scene.beamspread.use_indirect = False
    assert baked[..., 0].mean() > 1.05 * scenes.bake(plane)[0][..., 0].mean()


def test_the_switch_for_indirect_light_is_followed(lit):
    _plane, _lamp, material, _wall = lit
    both = live_pixels(material)
    bpy.context.scene.beamspread.use_indirect = False
    assert live_pixels(material)[..., 0].mean() < both[..., 0].mean() / 1.05
    bpy.context.scene.beamspread.use_indirect = True
    np.testing.assert_array_equal(live_pixels(material), both)


def test_a_wall_that_changes_its_color_is_followed(lit):
    plane, _lamp, material, wall = lit
    live_pixels(material)
    node = wall.data.materials[0].node_tree.nodes["Diffuse BSDF"]
    node.inputs["Color"].default_value = (0.1, 0.1, 0.8, 1)
    live = live_pixels(material)
    np.testing.assert_allclose(live, baked_pixels(plane), rtol=1e-4, atol=1e-6)


def test_a_message_says_that_only_cycles_can_find_the_bounced_light():
    _plane, _lamp, material = make_scene()
    bpy.context.scene.beamspread.use_indirect = True
    add_wall("ShaderNodeBsdfGlass", (1, 1, 1))
    live_pixels(material)
    (line,) = live_lines()
    assert line.startswith("Live leaves out bounced light, which only Cycles can find here (")
    assert "'Wall'" in line


def add_sky():
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type, sky.turbidity = "PREETHAM", 3
    world.node_tree.links.new(sky.outputs["Color"], world.node_tree.nodes["Background"].inputs["Color"])
    bpy.context.scene.world = world
    return world


def test_a_sky_by_cycles_is_shown_coarsely_and_then_as_in_the_bake():
    plane, lamp, material = make_scene()
    bpy.context.scene.beamspread.use_indirect = False
    lamp.data.energy = 1
    dark = live_pixels(material)
    world = add_sky()
    sky = timer.live.session._sky
    settle(until=lambda: sky.time == 1)
    settle(until=lambda: shown_pixels(material).mean() > 2 * dark.mean())
    coarse = shown_pixels(material)
    fine = live_pixels(material)
    assert sky.time == 2
    # The coarse one has a sun of 64 samples in a texel of .7 degrees, the quick rendering few rays.
    np.testing.assert_allclose(coarse.mean((0, 1)), fine.mean((0, 1)), rtol=0.05)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.5
    half = live_pixels(material)
    np.testing.assert_allclose(half, baked_pixels(plane), rtol=1e-3)
    assert live_lines() == []
