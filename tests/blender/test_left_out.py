"""Messages name all that a bake leaves out or can't light: in the window, in the batch's report, and by the engine."""

from unittest.mock import MagicMock

import bpy
import pytest
import scenes
from beamspread.blender.compat import add_input_socket
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import state
from beamspread.blender.ui import bake_panel
from mathutils import Matrix
from nodes import Nodes


@pytest.fixture(autouse=True)
def small():
    bpy.context.scene.beamspread.resolution = 16
    state.forget()


def add_grouped():
    """Its group is another material's, too."""
    plane = scenes.add_plane("Grouped", material=scenes.add_group_material())
    plane.data.materials[0].copy()
    return plane


def add_instances():
    """A plane that the scene has only as two instances of an instanced collection."""
    plane = scenes.add_plane("Shown", material=scenes.add_material())
    inner, outer = scenes.new_collection("Inner", plane), scenes.new_collection("Outer")
    scenes.add_instancer(inner, name="Instance of Inner", within=outer)
    return [scenes.add_instancer(outer, name="Instance of Outer") for _ in range(2)][1]


def add_metaball():
    ball = bpy.data.objects.new("Ball", bpy.data.metaballs.new("Ball"))
    ball.data.materials.append(scenes.add_material())
    bpy.context.scene.collection.objects.link(ball)
    return ball


def add_volume():
    smoke = bpy.data.objects.new("Smoke", bpy.data.volumes.new("Smoke"))
    smoke.data.materials.append(scenes.add_material())
    bpy.context.scene.collection.objects.link(smoke)
    return smoke


def add_hair():
    hair = bpy.data.objects.new("Fur", bpy.data.hair_curves.new("Fur"))
    hair.data.materials.append(scenes.add_material())
    bpy.context.scene.collection.objects.link(hair)
    return hair


MISPLACED = [
    (add_grouped, "Grouped", ["'Grouped' has one image, but its node group 'Outer'", "Ctrl Alt G"]),
    (add_instances, "Shown", ["'Shown' has 2 instances", "Make Instances Real", "Object & Data & Materials"]),
    (add_metaball, "Ball", ["'Ball' is not a mesh", "Convert"]),
    (add_volume, "Smoke", ["'Smoke' is a volume, which has no faces. Give the node to a mesh."]),
    (add_hair, "Fur", ["'Fur' is hair, which has no faces. Give the node to a mesh."]),
]


@pytest.mark.parametrize(("add", "name", "words"), MISPLACED, ids=[name for _, name, _ in MISPLACED])
def test_a_node_where_no_bake_can_use_it_is_named(add, name, words, tmp_path):
    obj = add()
    scenes.add_sun(0)
    scenes.select(obj)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "No mesh has a material" not in message
    assert all(word in message for word in words)
    assert all(word in state.lines()[0] for word in words)
    for arguments in ([], ["--object", name]):
        report = scenes.run_batch(*arguments, "--output", tmp_path)
        assert [(one.object, one.status) for one in report.bakes] == [(name, "failed")]
        assert all(word in report.bakes[0].message for word in words)


@pytest.mark.parametrize("add", [add for add, _, _ in MISPLACED], ids=[name for _, name, _ in MISPLACED])
def test_the_others_are_baked(add):
    add()
    plane = scenes.add_plane("Sound", matrix=Matrix.Translation((5, 0, 0)), material=scenes.add_material("Sound"))
    scenes.add_sun(0)
    assert scenes.messages_of(lambda: bpy.ops.beamspread.bake(objects="ALL")).count("Error") == 1
    assert (scenes.pixels(scenes.node_of(plane.data.materials[0]).image) > 0).all()


def test_a_node_in_a_group_of_its_own_is_baked():
    plane = scenes.add_plane(material=scenes.add_group_material())
    scenes.add_sun(0)
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    inner = bpy.data.node_groups["Inner"]
    node = next(node for node in inner.nodes if node.bl_idname == "BeamspreadNode")
    assert (scenes.pixels(node.image) > 0).all()
    assert "Link the BSDF of the node in 'Inner'" in state.lines()[0]
    assert [one.bl_idname for one in inner.nodes] == ["BeamspreadNode"]


def test_a_texture_reaches_a_group_by_its_input():
    material = scenes.add_group_material()
    outer, inner = bpy.data.node_groups["Outer"], bpy.data.node_groups["Inner"]
    node = next(node for node in inner.nodes if node.bl_idname == "BeamspreadNode")
    node.texture_blur, node.ior = 0.0, 1.0
    for tree in (outer, inner):
        add_input_socket(tree, "NodeSocketColor", "Tint")
    given = inner.nodes.new("NodeGroupInput")
    inner.links.new(node.inputs["Base Color"], given.outputs["Tint"])
    within = next(one for one in outer.nodes if one.bl_idname == "ShaderNodeGroup")
    outer.links.new(within.inputs["Tint"], outer.nodes.new("NodeGroupInput").outputs["Tint"])
    checker = material.node_tree.nodes.new("ShaderNodeTexCoord")
    group = next(one for one in material.node_tree.nodes if one.bl_idname == "ShaderNodeGroup")
    material.node_tree.links.new(group.inputs["Tint"], checker.outputs["UV"])
    plane = scenes.add_plane(material=material)
    scenes.add_sun(0)
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    found = scenes.pixels(node.image)
    # Red is u and green v: with the texture on top, the ratio of opposite texels is that of their colours.
    assert found[8, 15, 0] / found[8, 0, 0] == pytest.approx(15.5 / 0.5, rel=1e-3)
    assert found[15, 8, 1] / found[0, 8, 1] == pytest.approx(15.5 / 0.5, rel=1e-3)


def test_instances_of_a_baked_object_are_no_mistake():
    holder = add_instances()
    scenes.node_of(bpy.data.materials["Medium"]).image = bpy.data.images.new("Baked", 4, 4)
    assert "No mesh has a material" in scenes.messages_of(lambda: bpy.ops.beamspread.bake(objects="ALL"))
    scenes.select(holder)
    assert "'Shown' has 2 instances" in scenes.messages_of(bpy.ops.beamspread.bake)


def baked_with_messages(plane):
    """Pixels of the plane, and the window's messages about the bake."""
    (texture,) = scenes.bake(plane)
    return texture, state.lines()


@pytest.mark.parametrize(
    ("power", "words"),
    [(float("nan"), "is nan"), (-3.0, "is -3, and a bake cannot remove light")],
)
def test_a_light_of_impossible_power_is_named_and_left_out(power, words, tmp_path, capfd):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    expected, messages = baked_with_messages(plane)
    assert messages == []
    scenes.add_lamp((0, 0, 1), power, name="Broken")
    texture, messages = baked_with_messages(plane)
    assert texture == pytest.approx(expected)
    assert messages == [f"The light 'Broken' is left out. The power of 'Broken' {words}."]
    assert f"The light 'Broken' is left out. The power of 'Broken' {words}." in capfd.readouterr().out
    (record,) = scenes.run_batch("--output", tmp_path).bakes
    assert (record.status, record.message) == ("written", messages[0])


def add_hair():
    plane = scenes.add_plane("Furry")
    scenes.select(plane)
    bpy.ops.object.particle_system_add()
    plane.particle_systems[0].settings.type = "HAIR"
    return "The hair of 'Furry' is not baked: neither its shadow nor its own light."


def add_volume():
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Fog", bpy.data.volumes.new("Fog")))
    return "'Fog' is a volume: its shadow and its own light are not baked."


def add_foggy_world():
    world = bpy.context.scene.world = bpy.data.worlds.new("Hazy")
    nodes = Nodes(world, clear=True)
    nodes.add("OutputWorld", {"Volume": nodes.add("VolumeScatter").outputs[0]})
    return "The volume of the world 'Hazy' is not baked: neither the light that it absorbs nor its own light."


@pytest.mark.parametrize("add", [add_hair, add_volume, add_foggy_world])
def test_rendered_objects_that_no_bake_knows_are_named(add):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    sentence = add()
    _, messages = baked_with_messages(plane)
    assert messages == [sentence]


def flipped():
    return scenes.add_plane(matrix=Matrix.Diagonal((1, 1, -1, 1)), material=scenes.add_material())


def in_shadow():
    scenes.add_plane("Roof", size=(9, 9), matrix=Matrix.Translation((0, 0, 1)))
    return scenes.add_plane(material=scenes.add_material())


@pytest.mark.parametrize(
    ("add", "words"),
    [(flipped, ["behind 'Plane'", "Flip"]), (in_shadow, ["No light reaches 'Plane'"])],
)
def test_a_black_bake_says_why(add, words, tmp_path):
    plane = add()
    scenes.add_sun(0)
    texture, (message,) = baked_with_messages(plane)
    assert not texture.any()
    assert all(word in message for word in words)
    (record,) = scenes.run_batch("--output", tmp_path, "--object", "Plane").bakes
    assert (record.status, record.message) == ("written", message)
    scenes.node_of(plane.data.materials[0]).image = None
    bpy.context.scene.render.engine = "BEAMSPREAD"
    active = plane.data.materials[0].node_tree.nodes.new("ShaderNodeTexImage")
    active.image = bpy.data.images.new("Active", 16, 16)
    plane.data.materials[0].node_tree.nodes.active = active
    state.forget()
    bpy.ops.object.bake(type="COMBINED")
    assert state.lines() == [message]


def test_a_panel_shows_a_message_of_object_and_last_bake_once(monkeypatch):
    said = []
    monkeypatch.setattr(bake_panel, "draw_lines", lambda _layout, _context, messages, _icon: said.extend(messages))
    scenes.select(add_grouped())
    scenes.messages_of(bpy.ops.beamspread.bake)
    (message,) = state.lines()
    bake_panel.draw_bake(MagicMock(), bpy.context)
    assert said == [message.replace("Grouped / Grouped: ", ""), "Grouped: Failed"]  # the sentence names the object
    # Once nothing of it is selected, the bake's own words stay.
    said.clear()
    bpy.ops.object.select_all(action="DESELECT")
    stale.refresh(bpy.context)
    bake_panel.draw_bake(MagicMock(), bpy.context)
    nothing = "No selected object has a Beamspread node"
    assert said == [nothing, "Grouped: Failed", message.replace("Grouped / Grouped: ", "")]


def test_messages_go_with_the_file():
    baked_with_messages(flipped())
    assert state.lines()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert state.lines() == []
