"""Images that no renderer can load: Cycles shows them in magenta; bakes leave them out and name image and owner."""

import json
import subprocess

import bpy
import pytest
import scenes
from beamspread.blender.jobs.state import state
from cycles_truth import read
from nodes import Nodes
from scenes import add_lamp, add_material, add_mesh, add_plane, add_sun, bake, batch_command, node_of, save_scene

SIZE = 16


@pytest.fixture(autouse=True)
def scene():
    bpy.context.scene.beamspread.resolution = SIZE
    bpy.context.scene.beamspread.use_indirect = False
    state.forget()


def missing(name="studio.hdr"):
    """An image whose file is gone."""
    image = bpy.data.images.new(name, 4, 4)
    image.source, image.filepath = "FILE", f"/nowhere/{name}"
    return image


def texture(nodes, image, kind="TexImage"):
    return nodes.add(kind, image=image).outputs["Color"]


def add_world(image):
    nodes, background = scenes.add_world(name="Sky")
    nodes.set(background.inputs["Color"], texture(nodes, image, "TexEnvironment"))
    return nodes, background


def add_panel(image):
    """A mesh that emits an image."""
    nodes = Nodes(bpy.data.materials.new("Screen"))
    nodes.show(nodes.add("Emission", {"Color": texture(nodes, image)}))
    add_mesh("Panel", [(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)]).data.materials.append(nodes.owner)


def texts(illumination):
    return [str(message) for message in illumination.messages]


def test_the_world_is_left_out():
    add_world(missing())
    illumination = read()
    assert (illumination.lights, illumination.by_cycles) == ((), {})
    (text,) = texts(illumination)
    assert "The world 'Sky' is left out. The image 'studio.hdr' is missing." in text
    assert "Find Missing Files" in text


@pytest.mark.parametrize("source", ["TILED", "SEQUENCE"])
def test_tiles_and_frames_that_are_gone_count_as_missing(source, tmp_path):
    """With one of their files left, Cycles shows them."""
    image = missing()
    image.source = source
    image.filepath = str(tmp_path / ("sky.<UDIM>.exr" if source == "TILED" else "sky0001.exr"))
    add_world(image)
    (text,) = texts(read())
    assert "The world 'Sky' is left out. The image 'studio.hdr' is missing." in text
    (tmp_path / ("sky.1001.exr" if source == "TILED" else "sky0007.exr")).touch()
    assert not any("is missing" in text for text in texts(read()))


def test_a_node_without_an_image_is_named():
    add_world(None)
    (text,) = texts(read())
    assert "The world 'Sky' is left out. The node 'Environment Texture' has no image." in text


def test_a_missing_image_that_is_not_used_changes_nothing():
    nodes, background = add_world(missing())
    nodes.show(nodes.add("MixShader", {0: 1.0, 1: background.outputs[0], 2: nodes.add("Background").outputs[0]}))
    illumination = read()
    assert len(illumination.lights) == 1
    assert texts(illumination) == []


def test_a_world_that_cycles_evaluates_says_that_its_image_is_magenta():
    nodes, background = add_world(missing())
    color = background.inputs["Color"]
    mix = nodes.add("MixRGB", {1: nodes.add("TexNoise").outputs[1], 2: color.links[0].from_socket})
    nodes.set(color, mix.outputs[0])
    illumination = read()
    assert list(illumination.by_cycles) == ["Sky"]
    expected = "The image 'studio.hdr' is missing. Cycles shows it in magenta, as light of 'Sky'."
    assert any(expected in text for text in texts(illumination))


def test_emission_is_left_out():
    add_panel(missing("ad.png"))
    illumination = read()
    assert (illumination.lights, illumination.by_cycles) == ((), {})
    (text,) = texts(illumination)
    assert "The emission of 'Panel' is left out. The image 'ad.png' is missing." in text


def test_a_lamp_shines_as_without_nodes():
    nodes = Nodes(add_lamp((0, 0, 1)).data)
    nodes.set(nodes.of_type("EMISSION").inputs["Color"], texture(nodes, missing("gobo.png")))
    illumination = read()
    assert (len(illumination.lights), illumination.by_cycles) == (1, {})
    (text,) = texts(illumination)
    assert "The light 'Lamp' is baked without its nodes. The image 'gobo.png' is missing." in text


def test_transparency_is_left_out():
    wall = add_mesh("Leaf", [(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1, 2)])
    nodes = Nodes(bpy.data.materials.new("Leaf"))
    leaf = nodes.add("TexImage", image=missing("leaf.png"))
    nodes.set(nodes.of_type("BSDF_PRINCIPLED").inputs["Alpha"], leaf.outputs["Alpha"])
    wall.data.materials.append(nodes.owner)
    (text,) = texts(read())
    assert "The material 'Leaf' casts opaque shadows." in text
    assert "The image 'leaf.png' is missing." in text


def test_the_base_color_is_the_nodes_own():
    add_sun(30)
    material = add_material(color_mode="BASE_COLOR", base_color=(0.5, 0.6, 0.4))
    plane = add_plane(material=material)
    plain = bake(plane)[0].copy()
    nodes = Nodes(material)
    nodes.set(node_of(material).inputs["Base Color"], texture(nodes, missing("tiles.png")))
    assert bake(plane)[0] == pytest.approx(plain, rel=1e-5)
    (message,) = state.lines()
    assert "The Base Color of 'Plane' is left out: the node's own color is used." in str(message)
    assert "The image 'tiles.png' is missing." in str(message)


def test_bounced_light_of_other_materials_is_said_to_be_magenta():
    bpy.context.scene.beamspread.use_indirect = True
    add_sun(30)
    add_world(missing())
    wall = add_mesh("Wall", [(0.2, -1, 0), (0.2, 1, 0), (0.2, 1, 1), (0.2, -1, 1)], [(0, 1, 2, 3)])
    nodes = Nodes(bpy.data.materials.new("Bricks"))
    nodes.set(nodes.of_type("BSDF_PRINCIPLED").inputs["Base Color"], texture(nodes, missing("bricks.png")))
    wall.data.materials.append(nodes.owner)
    plane = add_plane(material=add_material(albedo=(0.9, 0.9, 0.9)))
    found = bake(plane)[0]
    said = " ".join(map(str, state.lines()))
    assert "The image 'bricks.png' is missing. Light that bounces from the material 'Bricks' is magenta" in said
    assert "The world 'Sky' is left out." in said
    # The world's magenta would be as bright as the sun; that of the wall is dim beside the sun.
    assert found[..., 1].mean() > 0.5 * found[..., 0].mean()


def test_report_and_console_name_image_and_world(tmp_path):
    add_sun(30)
    add_world(missing())
    add_plane(material=add_material())
    scene, report = save_scene(tmp_path), tmp_path / "report.json"
    arguments = ("--output", tmp_path, "--report", report, "--no-indirect", "--resolution", SIZE)
    result = subprocess.run(batch_command(scene, *arguments), capture_output=True, text=True, check=True)
    words = "The world 'Sky' is left out. The image 'studio.hdr' is missing."
    assert words in json.loads(report.read_text())["bakes"][0]["message"]
    assert words in result.stdout + result.stderr
