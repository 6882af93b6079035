"""Bounced light that Cycles finds, and its effort."""

import math

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import cycles_light, process
from beamspread.blender.node import plain
from beamspread.blender.node.find import find_node
from beamspread.blender.node.output import make_plain
from beamspread.core.scene.illumination import Illumination
from cycles_truth import cycles_bake, target_material
from indirect_scenes import GREY, TEXELS, add_scene, add_wall, baked, blocks, irradiance, jobs_of
from mathutils import Matrix
from nodes import add_node, set_input

pytestmark = pytest.mark.usefixtures("few_nodes")


def add_halves(tree, socket):
    """Link a colour of .9, .5, .1 for x < 0, and .1, .5, .9 beyond."""
    split = add_node(tree, "SeparateXYZ", {0: add_node(tree, "TexCoord").outputs["Object"]})
    step = add_node(tree, "Math", {0: split.outputs[0], 1: 0.0}, operation="GREATER_THAN").outputs[0]
    red, blue = (
        add_node(tree, "Math", {0: step, 1: slope, 2: begin}, operation="MULTIPLY_ADD").outputs[0]
        for slope, begin in ((-0.8, 0.9), (0.8, 0.1))
    )
    set_input(socket, add_node(tree, "CombineXYZ", {0: red, 1: 0.5, 2: blue}).outputs[0])


def test_a_wall_returns_light_as_in_cycles():
    """Bounced several times, as the floor returns it, too: means of 4 x 4 texels within 2 %, and their noise of 1 %."""
    floor = add_scene()
    ours = blocks(irradiance(floor, True) - irradiance(floor, False))
    material, image = target_material((GREY,) * 3, TEXELS)
    floor.data.materials[0] = material
    # In 3.4 a bake of indirect light alone lacks the lamps' light.
    both, direct = (cycles_bake(floor, image, passes, 2048) for passes in ({"DIRECT", "INDIRECT"}, {"DIRECT"}))
    truth = blocks(both - direct)
    lit = truth > 0.1 * truth.max()
    assert lit.mean() > 0.5
    error = np.abs(ours - truth)[lit] / truth[lit]
    # Beside the wall light changes within a node.
    assert np.median(error) < 0.015
    assert np.percentile(error, 90) < 0.04
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), truth.sum(axis=(0, 1)), rtol=0.01)
    assert truth[..., 0].sum() > 2 * truth[..., 2].sum()  # orange


def test_materials_that_the_scene_does_not_use_are_no_obstacle(monkeypatch):
    """Materials of a deleted object, or of another scene, which Cycles' copy lacks."""
    monkeypatch.setattr(cycles_light, "NOISE", 0.05)  # the same in both bakes
    floor = add_scene()
    expected = irradiance(floor, True)
    scenes.add_material("Unused").use_fake_user = True
    np.testing.assert_array_equal(irradiance(floor, True), expected)


@pytest.mark.parametrize("in_group", [False, True])
def test_a_textured_floor_returns_its_colors(in_group, monkeypatch):
    """Red on one side, blue on the other, the node's own colour black: against a diffuse floor of the same nodes.

    All of each colour within 2 %; means of 4 x 4 texels within 2.5 % of the brightest, at the median of those lit.
    """
    monkeypatch.setattr(cycles_light, "NOISE", 0.002)  # of a node: means of 16 have .05 % of all light
    floor = add_scene(scenes.add_group_material() if in_group else None)
    node = find_node(floor.data.materials[0])
    node.color_mode, node.base_color = "BASE_COLOR", (0, 0, 0)
    add_halves(node.id_data, node.inputs["Base Color"])
    ours = blocks(irradiance(floor, True) - irradiance(floor, False))
    material, image = target_material((0, 0, 0), TEXELS)
    add_halves(material.node_tree, material.node_tree.nodes["Diffuse BSDF"].inputs["Color"])
    floor.data.materials[0] = material
    both, direct = (cycles_bake(floor, image, passes, 512) for passes in ({"DIRECT", "INDIRECT"}, {"DIRECT"}))
    truth = blocks(both - direct)
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), truth.sum(axis=(0, 1)), rtol=0.02)
    lit = truth > 0.1 * truth.max()
    assert np.median((np.abs(ours - truth) / truth.max())[lit]) < 0.025


def test_bounced_light_spreads_as_any_other(monkeypatch):
    """The base colour is the reflectance under even light. Light of a leaning wall is uneven, and some leaves at the
    border: its reflectance agrees within 10 %.
    """
    monkeypatch.setattr(cycles_light, "NOISE", 0.005)  # of a node: sums of 1024 have less than .1 %
    floor = add_scene()
    scenes.node_of(floor.data.materials[0]).mean_free_path = (0.005,) * 3
    arriving, leaving = (
        (baked(floor, True, output) - baked(floor, False, output)).sum(axis=(0, 1))
        for output in ("IRRADIANCE", "LUMINANCE")
    )
    assert arriving[0] > 2 * arriving[2]
    np.testing.assert_allclose(math.pi * leaving / arriving, GREY, rtol=0.1)


def test_leaks_into_a_closed_box_are_no_light(monkeypatch):
    """Blender's first cube around a plane as wide: some ten-millionth of the light gets in along the edges."""
    monkeypatch.setattr(cycles_light, "NODES", 64)
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    bpy.ops.mesh.primitive_cube_add()
    scenes.add_sun(40, 60, 10.0)
    scenes.add_lamp((4, 1, 6), 1000.0).data.shadow_soft_size = 0.1
    bpy.context.scene.world = bpy.data.worlds.new("Grey")
    (bake,) = jobs_of(floor)
    bake.run()
    assert not bake.error
    assert bake.is_dark
    assert "No light reaches 'Floor'" in " ".join(map(str, bake.messages))


def asked(monkeypatch):
    """Numbers of samples of each request, as they come."""
    numbers, run = [], process.run

    def note(*arguments):
        arrays = run(*arguments)
        numbers.append(int(arrays["samples"]))
        return arrays

    monkeypatch.setattr(cycles_light, "run", note)
    return numbers


def test_effort_follows_the_light_that_there_is(monkeypatch):
    """The first samples show that a decal of four triangles returns next to nothing; beside a wall there are more."""
    monkeypatch.setattr(cycles_light, "NOISE", 0.01)
    numbers = asked(monkeypatch)
    floor = scenes.add_plane("Floor", (4, 4), material=scenes.add_material(color_mode="BASE_COLOR"))
    corners = [(-0.2, -0.2, 0.002), (0.2, -0.2, 0.002), (0.2, 0.2, 0.002), (-0.2, 0.2, 0.002), (0, 0, 0.003)]
    decal = scenes.add_mesh("Decal", corners, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    decal.data.materials.append(scenes.diffuse_material((0.8, 0.4, 0.2)))
    scenes.add_sun(40, 60, 3.0)
    scenes.add_lamp((0, 0, 3), 100.0, "AREA")
    (bake,) = jobs_of(floor)
    bake.run()
    monkeypatch.setattr(cycles_light, "NOISE", 0.001)
    add_wall()
    (bake,) = jobs_of(floor)
    bake.run()
    assert not [str(message) for message in bake.messages if "noise" in str(message)]
    assert numbers[0] == 4 < numbers[1]
    monkeypatch.setattr(cycles_light, "NEGLIGIBLE", 1.0)
    (bake,) = jobs_of(floor)
    bake.run()
    assert cycles_light.NOTHING_BOUNCES in bake.messages


def test_noise_that_is_left_is_named(monkeypatch):
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 4)
    (bake,) = jobs_of(add_scene())
    bake.run()
    assert " % of noise, relative to all light there" in " ".join(map(str, bake.messages))


def test_nothing_above_a_receiver_means_no_search():
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    scenes.add_sun(40, 60, 3.0)
    below = scenes.add_plane("Below", matrix=Matrix.Translation((0, 0, -1)), material=scenes.add_material("Other"))
    first, second = jobs_of(floor, below)
    assert not first.job.finds_light
    assert second.job.finds_light  # the floor is above it
    bpy.context.scene.beamspread.use_indirect = False
    assert not jobs_of(below)[0].job.finds_light


@pytest.mark.parametrize("by_cycles", [False, True], ids=["own rays", "Cycles"])
@pytest.mark.parametrize("kind", [plain.COAT, plain.EMISSION, plain.UNLIT, plain.GROUP])
def test_a_baked_wall_does_not_shine(monkeypatch, by_cycles, kind):
    """Plain nodes show its image, which is very bright: the floor gets the light of a wall without a bake, within the
    noise of 1 % that bakes allow."""
    monkeypatch.setattr(cycles_light, "NOISE", 0.005)  # of a node: the mean of 1024 has less than .1 %
    material = scenes.add_material("Wall", color_mode="BASE_COLOR", base_color=(0.9, 0.6, 0.3), linked=True)
    floor = add_scene()
    bpy.data.objects["Wall"].data.materials[0] = material
    if not by_cycles:
        monkeypatch.setattr(Illumination, "bounce_problem", "")
    expected = irradiance(floor, True).mean(axis=(0, 1))
    assert (expected > 1.01 * irradiance(floor, False).mean(axis=(0, 1)))[0]
    image = bpy.data.images.new("Baked", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.full(64, 50, np.float32))
    node = scenes.node_of(material)
    node.image = image
    if kind == plain.GROUP:
        make_plain(node)
    else:
        plain.make(node, kind)
    np.testing.assert_allclose(irradiance(floor, True).mean(axis=(0, 1)), expected, rtol=0.01)
