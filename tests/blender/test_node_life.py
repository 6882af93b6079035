"""The node's life: older files, copy and paste, linked and overridden materials, new inputs of the inner tree."""

from pathlib import Path

import beamspread
import bpy
import numpy as np
import pytest
from beamspread.blender.node.node import upgrade_nodes
from beamspread.blender.node.tree import BASE_COLOR, EMISSION, IMAGE, UNSEEN
from nodes import Nodes
from scenes import (
    add_camera,
    add_material,
    add_plane,
    add_sun,
    bake,
    load_data,
    node_of,
    pixels,
    render,
    reopen,
    select,
)

OLDER_FILE = str(Path(__file__).with_name("files") / "node_before_sockets.blend")
INPUTS = ["Base Color", "Roughness", "Normal"]


def inner(node, name):
    return node.node_tree.nodes[name]


def sends_base_color(node):
    """Whether the emission takes the base colour, and nothing of it."""
    total = inner(node, EMISSION).inputs["Color"].links[0].from_node
    nothing = total.inputs[1].links[0].from_node
    (given,) = nothing.inputs[0].links
    kinds = nothing.operation, total.operation, tuple(nothing.inputs[1].default_value)
    image = total.inputs[0].links[0].from_node
    return (
        image == inner(node, IMAGE) and given.from_socket.name == BASE_COLOR and kinds == ("MULTIPLY", "ADD", (0, 0, 0))
    )


def test_an_older_file_that_was_open_before_the_add_on_was_switched_on():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    beamspread.unregister()
    try:
        bpy.ops.wm.open_mainfile(filepath=OLDER_FILE)
    finally:
        beamspread.register()
    assert list(node_of(bpy.data.materials["Marble"]).inputs.keys()) == INPUTS


def test_an_older_linked_node_has_no_texture():
    """A node of another file keeps its inputs, which were none."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    (material,) = load_data(OLDER_FILE, link=True, materials=["Marble"])
    assert BASE_COLOR not in node_of(material).inputs
    assert not node_of(material).has_texture()


class TestOlderFile:
    """Made by the first version of the node, which had neither inputs nor an IOR of its own other than 1."""

    @pytest.fixture(autouse=True)
    def opened(self):
        bpy.ops.wm.open_mainfile(filepath=OLDER_FILE)
        bpy.context.scene.beamspread.quality, bpy.context.scene.beamspread.use_indirect = "preview", False

    def test_values_links_and_image_stay_and_inputs_come(self):
        nodes = {name: node_of(bpy.data.materials[name]) for name in ("Untouched", "Marble", "Set", "Shared")}
        assert [round(nodes[name].ior, 4) for name in nodes] == [1.0, 1.5, 1.3, 1.0]
        assert nodes["Marble"].preset == "marble"
        untouched = nodes["Untouched"]
        assert inner(untouched, "Image").image.name == untouched.image.name == "Baked"
        assert pixels(untouched.image)[0, 0] == pytest.approx([0.25, 0.5, 0.75])
        output = bpy.data.materials["Untouched"].node_tree.get_output_node("ALL")
        assert output.inputs["Surface"].links[0].from_node == untouched
        for node in nodes.values():
            assert [socket.name for socket in node.inputs] == INPUTS
            assert [socket.name for socket in node.outputs] == ["Color", "BSDF"]
            assert sends_base_color(node)
            assert inner(node, "Glossy").inputs["Roughness"].is_linked
            assert node.inputs["Roughness"].default_value == pytest.approx(0.1)

    def test_saved_and_opened_again_nothing_is_added_twice(self, tmp_path):
        path = str(tmp_path / "again.blend")
        counts = [len(tree.nodes) for tree in bpy.data.node_groups]
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        assert [len(tree.nodes) for tree in bpy.data.node_groups] == counts
        assert [socket.name for socket in node_of(bpy.data.materials["Set"]).inputs] == INPUTS

    def test_bakes_as_it_did(self):
        plane = bpy.data.objects["Plane"]
        while len(plane.data.materials) > 1:
            plane.data.materials.pop()
        add_sun(0)
        bake(plane)
        assert (pixels(node_of(plane.data.materials[0]).image) > 0).all()
        assert node_of(plane.data.materials[0]).ior == 1.0


def test_no_input_is_greyed_out_and_trees_without_that_get_it():
    node = node_of(add_material())
    # Earlier trees had all inputs and did not use this one.
    tree = node.node_tree
    tree.nodes.remove(tree.nodes[UNSEEN])
    tree.links.new(inner(node, EMISSION).inputs["Color"], inner(node, IMAGE).outputs["Color"])
    upgrade_nodes()
    assert sends_base_color(node)
    if hasattr(node.inputs[0], "is_inactive"):
        bpy.context.view_layer.update()
        assert [socket.name for socket in node.inputs if socket.is_inactive] == []


def test_append_from_an_older_file():
    node = node_of(load_data(OLDER_FILE, materials=["Untouched"])[0])
    node.ior = 1.2
    assert [socket.name for socket in node.inputs] == INPUTS
    assert inner(node, "Image").image.name == "Baked"


def test_new_nodes_have_an_ior_and_old_defaults_stay_those_of_files():
    material = bpy.data.materials.new("New")
    material.use_nodes = True
    node = material.node_tree.nodes.new("BeamspreadNode")
    assert node.ior == pytest.approx(1.4)
    assert node.bl_rna.properties["ior"].default == 1.0
    assert [socket.name for socket in node.inputs] == INPUTS
    assert node.inputs["Roughness"].default_value == pytest.approx(0.4)
    assert node.preset == "CUSTOM"


def test_links_of_the_inputs_outlive_a_bake_and_a_save(tmp_path):
    plane = add_plane(material=add_material(linked=True))
    add_sun(0)
    tree = plane.data.materials[0].node_tree
    bump, value = tree.nodes.new("ShaderNodeNormalMap"), tree.nodes.new("ShaderNodeValue")
    tree.links.new(node_of(plane.data.materials[0]).inputs["Normal"], bump.outputs["Normal"])
    tree.links.new(node_of(plane.data.materials[0]).inputs["Roughness"], value.outputs[0])
    bpy.context.scene.beamspread.resolution = 16
    bake(plane)
    reopen(tmp_path)
    node = node_of(bpy.data.materials["Medium"])
    sources = [node.inputs[name].links[0].from_node.bl_idname for name in ("Roughness", "Normal")]
    assert sources == ["ShaderNodeValue", "ShaderNodeNormalMap"]


def test_linked_and_overridden_materials(tmp_path):
    path = str(tmp_path / "library.blend")
    add_plane("Asset", material=add_material(ior=1.3))
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    (asset,) = load_data(path, link=True, objects=["Asset"])
    bpy.context.collection.objects.link(asset)
    node = node_of(asset.data.materials[0])
    assert node.ior == pytest.approx(1.3)
    select(asset)
    assert not bpy.ops.beamspread.toggle_result.poll()
    override = asset.override_create(remap_local_usages=True)
    material = asset.data.materials[0].copy()
    override.material_slots[0].link = "OBJECT"
    override.material_slots[0].material = material
    node_of(material).ior = 1.6
    assert inner(node_of(material), "Fresnel").inputs["IOR"].default_value == pytest.approx(1.6)
    assert inner(node, "Fresnel").inputs["IOR"].default_value == pytest.approx(1.3)


def test_undo_of_a_first_bake_gives_the_shader_back():
    plane = add_plane(material=add_material(shader=True))
    add_sun(0)
    bpy.context.scene.beamspread.resolution = 16
    bpy.ops.ed.undo_push(message="made")
    bake(plane)
    bpy.ops.ed.undo_push(message="baked")
    bpy.ops.ed.undo()
    material = bpy.data.materials["Medium"]
    surface = material.node_tree.get_output_node("ALL").inputs["Surface"]
    assert surface.links[0].from_node.type == "BSDF_PRINCIPLED"
    assert node_of(material).former_node == ""
    bpy.ops.ed.redo()
    material = bpy.data.materials["Medium"]
    assert material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node == node_of(material)


def rendered(material, tmp_path):
    """Pixels of a picture by Cycles of a plane in front of a bright world, seen at a slant."""
    camera = add_camera(0.5)
    camera.location, camera.rotation_euler = (0, -2, 2), (0.7854, 0, 0)
    Nodes(bpy.data.worlds.new("World"))
    bpy.context.scene.world = bpy.data.worlds["World"]
    return render(tmp_path / f"{material.name}.exr", samples=64)


def test_the_coat_is_that_of_glossy_without_a_normal_and_turns_with_one(tmp_path):
    """An unlinked input of a group is the null vector, of which some renderers would make no coat at all."""
    black = bpy.data.images.new("Black", 4, 4, float_buffer=True)
    material = add_material(image=black, ior=1.5, linked=True)
    add_plane(material=material)
    node = node_of(material)
    node.inputs["Roughness"].default_value = 0.1
    plain = rendered(material, tmp_path)
    # Under an even world of .0509 the coat returns Fresnel's part at 45 degrees.
    assert plain.mean() / 0.05088 == pytest.approx(0.0502, rel=0.03)
    combine = material.node_tree.nodes.new("ShaderNodeCombineXYZ")
    combine.inputs[1].default_value, combine.inputs[2].default_value = -np.sqrt(0.5), np.sqrt(0.5)
    material.node_tree.links.new(node.inputs["Normal"], combine.outputs[0])
    bent = rendered(material, tmp_path)
    assert bent.mean() / 0.05088 == pytest.approx(0.04, rel=0.03)


def test_the_add_on_can_be_switched_off_and_on_again():
    material = add_material(ior=1.3, linked=True)
    for _ in range(2):
        beamspread.unregister()
        assert not hasattr(bpy.types.Scene, "beamspread")
        beamspread.register()
    assert node_of(material).ior == pytest.approx(1.3)
    assert node_of(add_material("Another", ior=1.2)).ior == pytest.approx(1.2)


def test_copies_that_part_leave_no_tree_behind():
    first = add_material(ior=1.3)
    second = first.copy()
    node_of(second).ior = 1.2
    node_of(first).ior = 1.4
    assert len(bpy.data.node_groups) == 2


def test_a_removed_material_leaves_no_tree_in_the_file(tmp_path):
    first = add_material(ior=1.3)
    add_plane(material=first)
    second = first.copy()
    node_of(second).ior = 1.2
    bpy.data.materials.remove(second)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "removed.blend"))
    assert len(bpy.data.node_groups) == 2  # undo may bring its material back
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "removed.blend"))
    (tree,) = bpy.data.node_groups
    assert node_of(bpy.data.materials["Medium"]).node_tree == tree
    assert tree.use_fake_user
