"""Values of the node as an artist edits them: color modes, presets, one length of the path, infinite thickness."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from beamspread import presets
from beamspread.blender.node import draw
from beamspread.blender.node.node import keep_names_of_presets, upgrade_appended_nodes, upgrade_nodes
from beamspread.core.bake.surface import Surface
from beamspread.core.material import Material
from nodes import Nodes
from scenes import load_data, node_of

# 32-bit floats of the properties, relative.
ROUNDED = 2e-6


@pytest.fixture
def node():
    """A new node, whose values nobody has set."""
    return Nodes(bpy.data.materials.new("Medium")).tree.nodes.new("BeamspreadNode")


def test_new_node_has_the_color_of_blenders_own_shaders(node):
    assert (node.color_mode, node.preset) == ("BASE_COLOR", "CUSTOM")
    assert list(node.base_color) == pytest.approx([0.8] * 3)
    assert node.surface().base_color == (0.8, 0.8, 0.8)
    assert list(node.inputs["Base Color"].default_value[:3]) == pytest.approx([0.8] * 3)


def test_albedo_that_a_script_sets_on_a_new_node_counts(node):
    """Nodes began with the albedo when such scripts were written."""
    node.albedo = (0.9, 0.6, 0.3)
    assert node.color_mode == "ALBEDO"
    assert node.surface().material.albedo == (0.9, 0.6, 0.3)


@pytest.mark.parametrize("order", [("color_mode", "albedo"), ("albedo", "color_mode")])
def test_script_sets_albedo_and_mode_in_any_order(node, order):
    node.color_mode = "BASE_COLOR"
    node.base_color = (0.2, 0.3, 0.4)
    for name in order:
        setattr(node, name, {"color_mode": "ALBEDO", "albedo": (0.9, 0.6, 0.3)}[name])
    assert node.surface().material.albedo == (0.9, 0.6, 0.3)
    node.color_mode = "ALBEDO"
    assert node.surface().material.albedo == (0.9, 0.6, 0.3)


def test_marble_stays_marble_in_both_modes(node):
    node.preset = "marble"
    albedo, visible = list(node.albedo), node.visible_color()
    node.color_mode = "BASE_COLOR"
    assert node.preset == "marble"
    assert list(node.base_color) == pytest.approx(visible, rel=ROUNDED)
    # The bake's albedo comes from the simulated medium, whose totals are calibrated to the exact ones.
    assert list(node.surface().resolve("final").albedo) == pytest.approx(presets()["marble"].albedo, abs=2e-5)
    node.color_mode = "ALBEDO"
    assert (node.preset, list(node.albedo)) == ("marble", albedo)


def test_base_color_becomes_the_albedo_that_shows_it(node):
    node.base_color = (0.8, 0.4, 0.1)
    node.color_mode = "ALBEDO"
    assert node.surface().reflectance() == pytest.approx([0.8, 0.4, 0.1], rel=1e-4)  # .99982 in 32 bits
    node.color_mode = "BASE_COLOR"
    assert list(node.base_color) == pytest.approx([0.8, 0.4, 0.1])


def test_color_that_is_shown_stays_when_the_medium_changes(node):
    node.albedo = (0.99, 0.9, 0.5)
    node.color_mode = "BASE_COLOR"
    shown = list(node.base_color)
    node.ior = 1.2
    assert list(node.base_color) == shown
    node.color_mode = "ALBEDO"
    assert node.surface().reflectance() == pytest.approx(shown, rel=1e-4)
    assert list(node.albedo) != pytest.approx([0.99, 0.9, 0.5], rel=1e-3)


def test_edited_color_takes_the_name_of_a_preset_away(node):
    node.preset = "marble"
    node.color_mode = "BASE_COLOR"
    node.base_color[0] = 0.5
    assert node.preset == "CUSTOM"
    node.color_mode = "ALBEDO"
    assert node.surface().reflectance()[0] == pytest.approx(0.5, rel=1e-4)


def test_values_out_of_range_are_not_converted(node):
    node.ior = 0.5
    node.color_mode = "ALBEDO"
    assert node.color_mode == "ALBEDO"
    assert list(node.albedo) == pytest.approx([0.9] * 3)


def test_node_of_an_older_file_keeps_its_color(node):
    """It has none of the hidden properties that tell where its color comes from."""
    for name in ("has_own_base_color", "has_own_albedo", "has_new_color"):
        node.property_unset(name)
    node.property_unset("base_color")
    node.property_unset("color_mode")
    assert node.color_mode == "ALBEDO"
    upgrade_nodes()
    node.color_mode = "ALBEDO"
    assert node.surface().material.albedo == (0.9, 0.9, 0.9)
    node.color_mode = "BASE_COLOR"
    assert list(node.base_color) == pytest.approx(node.surface_in("ALBEDO").reflectance(), rel=ROUNDED)


def test_node_that_is_appended_from_an_older_file_converts_its_color(node, tmp_path):
    node.color_mode, node.albedo = "ALBEDO", (0.95,) * 3
    for name in ("has_own_base_color", "has_own_albedo", "has_new_color"):
        node.property_unset(name)
    path = str(tmp_path / "older.blend")
    tree = next(made for made in bpy.data.materials if made.node_tree == node.id_data)
    bpy.data.libraries.write(path, {tree}, fake_user=True)
    tree.name = "Own"
    with bpy.data.libraries.load(path) as (there, here):
        here.materials = there.materials
    (appended,) = here.materials
    older = next(made for made in appended.node_tree.nodes if made.bl_idname == "BeamspreadNode")
    upgrade_appended_nodes()  # as the window does once it rests
    older.color_mode = "BASE_COLOR"
    assert list(older.base_color) == pytest.approx(older.surface_in("ALBEDO").reflectance(), rel=ROUNDED)


def test_unit_scale_takes_the_name_of_a_preset_away(node):
    node.preset = "skin1"
    keep_names_of_presets()
    assert node.preset == "skin1"
    bpy.context.scene.unit_settings.scale_length = 0.01
    keep_names_of_presets()  # as the window does
    assert node.preset == "CUSTOM"
    node.preset = "skin1"
    keep_names_of_presets()
    assert node.preset == "skin1"
    assert node.mean_free_path[0] == pytest.approx(presets()["skin1"].mean_free_path[0] / 0.01)


def test_path_is_one_length_and_a_color(node):
    node.preset = "skin1"
    path = list(node.mean_free_path)
    assert node.path_length == pytest.approx(max(path))
    assert list(node.path_color) == pytest.approx([length / max(path) for length in path])
    node.path_length = 2 * max(path)
    assert list(node.mean_free_path) == pytest.approx([2 * length for length in path])
    assert node.preset == "CUSTOM"
    node.path_color = (1.0, 0.5, 0.25)
    assert list(node.mean_free_path) == pytest.approx([2 * max(path) * ratio for ratio in (1, 0.5, 0.25)])
    assert node.path_length == pytest.approx(2 * max(path))


def test_color_of_the_path_counts_by_its_ratios(node):
    node.path_color = (0.5, 0.25, 0.0)
    assert list(node.mean_free_path) == pytest.approx([0.01, 0.005, 1e-5])
    node.path_color = (0, 0, 0)
    assert list(node.mean_free_path) == pytest.approx([0.01] * 3)


@pytest.mark.parametrize("scale_length", [1.0, 0.001])
def test_slider_of_the_path_is_logarithmic_in_meters(node, scale_length):
    bpy.context.scene.unit_settings.scale_length = scale_length
    for percent, meters in ((0, 1e-5), (20, 1e-4), (50, 10**-2.5), (100, 1.0)):
        node.path_slider = percent
        assert node.path_length * scale_length == pytest.approx(meters, rel=1e-5)
        assert node.path_slider == pytest.approx(percent, abs=1e-4)
    node.path_length = 50.0 / scale_length
    assert node.path_slider == 100.0
    assert node.path_length * scale_length == pytest.approx(50.0)


def test_infinite_thickness(node):
    assert node.is_infinite
    node.is_infinite = False
    assert node.thickness == pytest.approx(10 * 0.01)
    assert not node.is_infinite
    node.is_infinite = True
    assert node.thickness == 0


def test_new_media_are_announced(node):
    bpy.context.scene.beamspread.quality = "final"
    assert draw.new_medium_line(node) == ""
    node.anisotropy = 0.75
    assert draw.new_medium_line(node).startswith("New medium: simulated in ")
    alone = draw.seconds_to_simulate(node)
    draw.bent_materials.add("Medium")
    assert draw.seconds_to_simulate(node) > 1.2 * alone  # curves as well
    draw.bent_materials.clear()
    node.anisotropy = 2.0
    assert draw.new_medium_line(node) == ""


def test_values_survive_a_file_and_appending(node, tmp_path):
    node.preset = "ketchup"
    node.color_mode = "BASE_COLOR"
    bpy.data.materials["Medium"].use_fake_user = True
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    again = node_of(load_data(path, materials=["Medium"])[0])
    assert (again.preset, again.color_mode) == ("ketchup", "BASE_COLOR")
    again.color_mode = "ALBEDO"
    assert again.preset == "ketchup"
    assert list(again.albedo) == pytest.approx(presets()["ketchup"].albedo)


def test_exact_albedo_inverts_the_reflectance_of_slabs():

    material = Material((0.0,) * 3, (0.01, 0.005, 0.02), 0.5, 1.3)
    surface = Surface(material, 0.05, (0.3, 0.2, 0.99))
    albedo = surface.exact_albedo()
    assert albedo[2] == 0.99999  # brighter than this slab can be

    seen = Surface(replace(material, albedo=tuple(albedo)), 0.05).reflectance()
    assert np.allclose(seen[:2], [0.3, 0.2], rtol=1e-7)


def test_coat_suits_the_preset(node):
    """The studio lights of Material Preview show a smooth coat as wet plastic."""
    roughness = {}
    for name in presets():
        node.preset = name
        roughness[name] = node.inputs["Roughness"].default_value
    assert roughness["skin1"] == pytest.approx(0.45)
    assert roughness["regular_milk"] == pytest.approx(0.1)
    assert all(0.05 <= value <= 0.9 for value in np.round(list(roughness.values()), 6))
    value = node.id_data.nodes.new("ShaderNodeValue")
    node.id_data.links.new(node.inputs["Roughness"], value.outputs[0])
    node.preset = "marble"
    assert node.inputs["Roughness"].is_linked


def test_new_node_stands_left_of_the_output(node):
    """The Principled BSDF of new materials stands there, too: the node is above it."""
    output, shader = (node.id_data.nodes[name] for name in ("Material Output", "Principled BSDF"))
    assert node.width == 240
    assert node.location.x + node.width < output.location.x
    assert node.location.x < shader.location.x + shader.width  # else it would be left of that, too
    assert node.location.y > shader.location.y + 400
    second = node.id_data.nodes.new("BeamspreadNode")
    assert second.location.y > node.location.y + 400
