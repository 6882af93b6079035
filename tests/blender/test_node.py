"""The node: properties, inner tree, copies, undo, append, and files opened without the add-on."""

import subprocess
import sys

import bpy
import pytest
from beamspread import presets
from scenes import add_material, add_plane, load_data, node_of, reopen


def inner(node, name):
    return node.node_tree.nodes[name]


def test_outputs_and_defaults():
    node = node_of(add_material())
    assert [socket.name for socket in node.outputs] == ["Color", "BSDF"]
    assert (node.preset, node.color_mode, node.thickness, node.image) == ("CUSTOM", "ALBEDO", 0, None)
    assert node.node_tree.use_fake_user


@pytest.mark.parametrize("scale_length", [1.0, 0.001])
def test_preset_fills_in_lengths_in_scene_units(scale_length):
    bpy.context.scene.unit_settings.scale_length = scale_length
    node = node_of(add_material())
    node.color_mode = "BASE_COLOR"
    node.preset = "marble"
    marble = presets()["marble"]
    assert node.color_mode == "ALBEDO"
    assert list(node.albedo) == pytest.approx(marble.albedo)
    assert [scale_length * length for length in node.mean_free_path] == pytest.approx(marble.mean_free_path)
    assert (node.anisotropy, node.ior) == pytest.approx((marble.anisotropy, marble.ior))


def test_preset_with_an_anisotropy_per_channel_becomes_the_similar_one():
    """The node has one anisotropy: a mean free path in it is that of the material with sigma_s (1 - g) kept."""
    node = node_of(add_material())
    node.preset = "regular_milk"
    similar = presets()["regular_milk"].with_one_anisotropy()
    assert list(node.mean_free_path) == pytest.approx(similar.mean_free_path)
    assert node.anisotropy == pytest.approx(0.715)


def test_presets_keep_their_numbers_in_saved_files():
    items = {item.identifier: item.value for item in node_of(add_material()).bl_rna.properties["preset"].enum_items}
    assert (items["CUSTOM"], items["apple"], items["whole_milk"], items["regular_milk"]) == (0, 1, 12, 15)


def test_values_out_of_range_can_be_set_by_scripts():
    """The bake has to complain about them, not Blender to change them silently."""
    node = node_of(add_material(albedo=(1, 1, 1), mean_free_path=(-1, 0, 1), anisotropy=2.0, ior=0.5, thickness=-1.0))
    assert list(node.albedo) == [1, 1, 1]
    assert list(node.mean_free_path) == [-1, 0, 1]
    assert (node.anisotropy, node.ior, node.thickness) == (2, 0.5, -1)


def test_image_and_ior_reach_the_inner_tree():
    node = node_of(add_material())
    assert inner(node, "Coat").inputs[1].default_value == 0
    node.image = bpy.data.images.new("Baked", 4, 4)
    node.ior = 1.4
    assert inner(node, "Image").image == node.image
    assert inner(node, "Fresnel").inputs["IOR"].default_value == pytest.approx(1.4)
    assert inner(node, "Coat").inputs[1].default_value == 1


def test_copies_part_when_one_changes():
    first = add_material(ior=1.3)
    second = first.copy()
    third = second.copy()
    node_of(second).ior = 1.5
    node_of(third).image = bpy.data.images.new("Third", 4, 4)
    iors = [inner(node_of(material), "Fresnel").inputs["IOR"].default_value for material in (first, second, third)]
    assert iors == pytest.approx([1.3, 1.5, 1.3])
    images = [inner(node_of(material), "Image").image for material in (first, second, third)]
    assert images[:2] == [None, None]
    assert images[2].name == "Third"
    for material in (first, second, third):
        assert node_of(material).node_tree.use_fake_user
        assert node_of(material).node_tree.users >= 2


def test_removing_one_copy_keeps_the_other_through_a_save(tmp_path):
    first = add_material(ior=1.3)
    second = first.copy()
    second.use_fake_user = True
    bpy.data.materials.remove(first)
    reopen(tmp_path)
    node = node_of(bpy.data.materials["Medium.001"])
    assert inner(node, "Fresnel").inputs["IOR"].default_value == pytest.approx(1.3)


def test_inner_tree_of_a_removed_node_goes_with_the_file(tmp_path):
    material = add_material()
    material.use_fake_user = True
    material.node_tree.nodes.remove(node_of(material))
    reopen(tmp_path)
    assert not bpy.data.node_groups


def test_undo_and_redo():
    material = add_material(ior=1.3)
    material.use_fake_user = True
    bpy.ops.ed.undo_push(message="made")
    node_of(bpy.data.materials["Medium"]).ior = 1.5
    bpy.ops.ed.undo_push(message="changed")
    bpy.data.materials["Medium"].node_tree.nodes.remove(node_of(bpy.data.materials["Medium"]))
    bpy.ops.ed.undo_push(message="removed")
    bpy.ops.ed.undo()
    node = node_of(bpy.data.materials["Medium"])
    assert inner(node, "Fresnel").inputs["IOR"].default_value == pytest.approx(1.5)
    bpy.ops.ed.undo()
    node = node_of(bpy.data.materials["Medium"])
    assert (node.ior, inner(node, "Fresnel").inputs["IOR"].default_value) == pytest.approx((1.3, 1.3))
    bpy.ops.ed.redo()
    assert node_of(bpy.data.materials["Medium"]).ior == pytest.approx(1.5)


def test_append_and_duplicate_objects(tmp_path):
    add_plane(material=add_material(ior=1.3))
    path = str(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    first, second = (load_data(path, materials=["Medium"])[0] for _ in range(2))
    node_of(first).ior = 1.6
    assert inner(node_of(first), "Fresnel").inputs["IOR"].default_value == pytest.approx(1.6)
    assert inner(node_of(second), "Fresnel").inputs["IOR"].default_value == pytest.approx(1.3)


SAVED_WITHOUT_ADDON = """
import bpy, sys
path = sys.argv[sys.argv.index("--") + 1]
bpy.ops.wm.open_mainfile(filepath=path)
node = next(n for n in bpy.data.materials["Medium"].node_tree.nodes if n.bl_idname != "ShaderNodeOutputMaterial"
            and "Principled" not in n.bl_idname)
print("CLASS KNOWN", bpy.types.Node.bl_rna_get_subclass_py("BeamspreadNode") is not None)
bpy.ops.wm.save_as_mainfile(filepath=path)
"""


def test_file_saved_by_a_blender_without_the_add_on(tmp_path):
    material = add_material(ior=1.3, albedo=(0.1, 0.2, 0.3), linked=True)
    add_plane(material=material)
    path, script = tmp_path / "foreign.blend", tmp_path / "script.py"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    script.write_text(SAVED_WITHOUT_ADDON)
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
    command = [*program, str(script)] if bpy.app.binary_path else [sys.executable, str(script)]
    output = subprocess.run([*command, "--", str(path)], capture_output=True, text=True, check=True).stdout
    assert "CLASS KNOWN False" in output
    bpy.ops.wm.open_mainfile(filepath=str(path))
    node = node_of(bpy.data.materials["Medium"])
    assert list(node.albedo) == pytest.approx([0.1, 0.2, 0.3])
    assert inner(node, "Fresnel").inputs["IOR"].default_value == pytest.approx(1.3)
    output = bpy.data.materials["Medium"].node_tree.get_output_node("ALL")
    assert output.inputs["Surface"].links[0].from_node == node
