"""Light on a mesh that bends that only Cycles finds, in Blender."""

import bpy
import numpy as np
import pytest
import scenes
from indirect_scenes import GREY as ALBEDO
from indirect_scenes import add_ball, baked, jobs_of


def checkered(color_input="Color", kind="ShaderNodeBsdfDiffuse", grey=ALBEDO):
    """A material of one color, which a Checker Texture gives, so that our own readers don't know it."""
    material = bpy.data.materials.new("Checkered")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    checker = tree.nodes.new("ShaderNodeTexChecker")
    for name in ("Color1", "Color2"):
        checker.inputs[name].default_value = (grey, grey, grey, 1)
    shader = tree.nodes.new(kind)
    tree.links.new(shader.inputs[color_input], checker.outputs["Color"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output.inputs["Surface"], shader.outputs[0])
    return material


def baked_by_cycles(ball, output="IRRADIANCE"):
    """The pass of a bake for which Cycles found the bounced light."""
    bpy.context.scene.beamspread.use_indirect = True
    (bake,) = jobs_of(ball, output=output)
    bake.run()
    assert any("Cycles finds the bounced light" in str(message) for message in bake.messages)
    return bake.texture


def test_cycles_finds_bounced_light_on_a_ball():
    """A normal at an angle b from downward sees (1 + cos b) / 2 of a wide floor. The ball's shadow takes 4 % from the
    sides, and 1 % is noise. test_bent_bounced.py has the same by our own rays.
    """
    ball = add_ball()
    floor = scenes.add_plane("Floor", size=(400.0, 400.0))
    floor.data.materials.clear()
    floor.data.materials.append(checkered())
    scenes.add_sun(0, 0, 2.0)
    direct, all_light = baked(ball, False, "IRRADIANCE"), baked_by_cycles(ball)
    bounced = np.nan_to_num(all_light - direct)[..., :3].mean((1, 2))
    rows = len(bounced)
    downward = np.cos(np.pi * (np.arange(rows) + 0.5) / rows)
    exact = 2.0 * ALBEDO * (1 + downward) / 2
    sides = slice(rows * 3 // 8, rows * 5 // 8)
    np.testing.assert_allclose(bounced[sides], exact[sides], rtol=0.08)
    assert bounced[rows // 8] > 2 * bounced[-rows // 8] >= 0


def test_both_ways_find_the_same_bounced_light():
    """In a corner of two walls, by our own rays and, with a far object that only Cycles knows, by Cycles: 1 % of noise
    each, 4 % in a texel, which has that of few nodes. Directions, at .2 W/m^2 and more, agree within a few degrees on
    average: frames turned by a quarter differ by 30.
    """
    ball = add_ball()
    floor = scenes.add_plane("Floor", size=(8.0, 8.0))
    floor.data.materials.clear()
    floor.data.materials.append(scenes.diffuse_material((0.8, 0.5, 0.2)))
    corners = [(-3, 2, 0), (3, 2, 0), (3, 2, 4), (-3, 2, 4)]
    scenes.add_mesh("Wall", corners, [(0, 1, 2, 3)]).data.materials.append(scenes.diffuse_material((0.2, 0.3, 0.9)))
    scenes.add_sun(30, 60, 2.0)
    direct = baked(ball, False, "IRRADIANCE")
    own = baked(ball, True, "IRRADIANCE") - direct
    flow = baked(ball, True, "DIRECTION")
    far = scenes.add_plane("Far", size=(0.1, 0.1))
    far.location = (0, 0, 50)
    far.data.materials.clear()
    far.data.materials.append(checkered())
    by_cycles = baked_by_cycles(ball) - direct
    angle = np.degrees(np.arccos(np.clip((flow * baked_by_cycles(ball, "DIRECTION")).sum(-1), -1, 1)))
    compared = np.nan_to_num(own)[..., :3].mean(-1) > 0.2
    print("directions differ by", angle[compared].mean())
    assert angle[compared].mean() < 6
    own, by_cycles = (np.nan_to_num(values)[..., :3] for values in (own, by_cycles))
    assert by_cycles.mean() == pytest.approx(own.mean(), rel=0.02)
    assert np.abs(own - by_cycles).mean() < 0.06 * own.mean()


def test_a_mesh_that_glows_by_nodes_lights_a_ball():
    """A large ceiling of radiance L, which only Cycles knows: pi L (1 + cos b) / 2, b from upward."""
    ball = add_ball()
    ceiling = scenes.add_plane("Ceiling", size=(400.0, 400.0))
    ceiling.location.z = 3
    ceiling.data.materials.clear()
    ceiling.data.materials.append(checkered(kind="ShaderNodeEmission", grey=0.7))
    light = np.nan_to_num(baked(ball, False, "IRRADIANCE"))[..., :3].mean((1, 2))
    rows = len(light)
    upward = -np.cos(np.pi * (np.arange(rows) + 0.5) / rows)
    exact = np.pi * 0.7 * (1 + upward) / 2
    np.testing.assert_allclose(light[rows // 4 :], exact[rows // 4 :], rtol=0.05, atol=0.03)
