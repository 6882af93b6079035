"""The world's panorama, summed over the sky by plain code, against Cycles' bake of a white plane."""

import math

import bpy
import numpy as np
import pytest
from beamspread.blender.read.image_nodes import MAX_WIDTH, shrunk
from beamspread.blender.read.lights import read_illumination
from beamspread.blender.read.scene_cache import scene_cache
from beamspread.core.scene.lights import SunLight
from beamspread.core.scene.lights.sky_sun import directions
from cycles_truth import add_receiver, cycles_irradiance, read
from mathutils import Euler, Matrix
from nodes import Nodes
from scenes import add_world

TILTS = {"up": Matrix(), "tilted": Euler((0.9, -0.4, 0.8)).to_matrix().to_4x4(), "down": Matrix.Rotation(2.5, 4, "X")}
STUDIO = ["forest", "interior", "sunset"]


def add_environment(image, background, turn=None):
    """An environment texture behind the background, through a Mapping node with Euler angles if given."""
    nodes = Nodes(bpy.context.scene.world)
    texture = nodes.add("TexEnvironment", image=image)
    nodes.set(background.inputs["Color"], texture.outputs["Color"])
    if turn is not None:
        vector = nodes.add("TexCoord").outputs["Generated"]
        nodes.set(
            texture.inputs["Vector"], nodes.add("Mapping", {"Vector": vector, "Rotation": turn}).outputs["Vector"]
        )
    return texture


def studio(name):
    folder = bpy.utils.system_resource("DATAFILES", path="studiolights/world")
    return bpy.data.images.load(f"{folder}/{name}.exr")


def the_world():
    """The one light of the scene."""
    (light,) = read().lights
    return light


def irradiance(light, normal):
    """Plain sum over the texels of a panorama, each of which is a patch of sky, cut into 4 x 4; or of a narrow sun."""
    if isinstance(light, SunLight):
        return max(-np.dot(light.direction, normal), 0) * light.rgb()
    height, width = light.radiance.shape[:2]
    finer = max(1, 1024 // width)
    radiance = np.repeat(np.repeat(light.radiance, finer, axis=0), finer, axis=1).astype(float)
    height, width = radiance.shape[:2]
    towards = directions(width, height, slice(None)) @ np.array(light.to_world).T
    edges = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, height + 1))
    solid_angle = np.repeat(np.diff(edges) * 2 * math.pi / width, width)
    seen = np.maximum(towards @ np.array(normal), 0) * solid_angle
    return seen @ radiance.reshape(-1, 3) * light.rgb()


def assert_agrees(lights, tilt, samples=2048, rel=0.01):
    plane, image = add_receiver(tilt, texels=8)
    cycles = cycles_irradiance(plane, image, samples).mean(axis=(0, 1))
    normal = tilt.to_3x3().col[2]
    bpy.data.objects.remove(plane)
    assert sum(irradiance(light, normal) for light in lights) == pytest.approx(cycles, rel=rel)


def test_an_even_world():
    add_world((1, 0.5, 0.25, 1), 2)
    light = the_world()
    assert light.rgb() == pytest.approx((2, 1, 0.5))
    assert not light.is_colored
    assert light.cast_shadow
    assert_agrees([light], TILTS["tilted"], 1, 1e-3)


def test_a_world_without_nodes():
    if bpy.app.version >= (5, 0, 0):
        pytest.skip("all worlds have nodes")
    world = add_world()[0].owner
    world.use_nodes, world.color = False, (0.2, 0.3, 0.4)
    assert the_world().rgb() == pytest.approx((0.2, 0.3, 0.4))
    assert_agrees(read().lights, TILTS["up"], 1, 1e-3)


def no_diffuse(world):
    world.cycles_visibility.diffuse = False


def no_sky(_world):
    bpy.context.view_layer.use_sky = False


def none_at_all(_world):
    bpy.context.scene.world = None


def no_output(world):
    world.node_tree.nodes.remove(world.node_tree.get_output_node("ALL"))


def black(world):
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0


@pytest.mark.parametrize("darken", [no_diffuse, no_sky, none_at_all, no_output, black])
def test_a_dark_world_is_no_light(darken):
    darken(add_world()[0].owner)
    plane, image = add_receiver(Matrix(), texels=4)
    assert cycles_irradiance(plane, image, 4).max() == 0
    assert read().lights == ()
    assert read().messages == ()


@pytest.mark.parametrize("tilt", TILTS.values(), ids=TILTS.keys())
@pytest.mark.parametrize("name", STUDIO)
def test_studio_lights(name, tilt):
    _, background = add_world(strength=1.5)
    add_environment(studio(name), background)
    assert_agrees(read().lights, tilt)


TURNS = [(0, 0, 0.7), (0.3, -0.5, 2.0), (math.pi, 0, 0)]


@pytest.mark.parametrize("turn", TURNS)
def test_a_turned_environment_keeps_its_texels(turn):
    _, background = add_world()
    image = studio("sunset")
    add_environment(image, background, turn)
    light = the_world()
    stored = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(stored)
    stored = stored.reshape(image.size[1], image.size[0], 4)[..., :3]
    factors = np.divide(light.radiance.shape[:2], stored.shape[:2]).astype(int)
    if tuple(factors) == (1, 1):
        assert light.radiance == pytest.approx(stored, rel=1e-5, abs=1e-6)
    assert np.linalg.det(light.to_world) == pytest.approx(1)
    assert_agrees([light], TILTS["tilted"])


def test_a_mirrored_and_a_stretched_environment():
    """A change that is no rotation is evaluated again."""
    _, background = add_world()
    texture = add_environment(studio("sunset"), background, (0, 0, 0.7))
    mapping = texture.inputs["Vector"].links[0].from_node
    for scale in ((-1, 1, 1), (1, 1, 2.5)):
        mapping.inputs["Scale"].default_value = scale
        assert_agrees(read().lights, TILTS["tilted"])


def test_images_of_few_texels_are_smooth():
    _, background = add_world()
    image = bpy.data.images.new("Few", 8, 4, float_buffer=True)
    values = np.random.default_rng(3).random((32, 4), np.float32)
    image.pixels.foreach_set(values.ravel())
    add_environment(image, background)
    for tilt in TILTS.values():
        assert_agrees(read().lights, tilt)


def test_mixed_and_graded_environments():
    nodes, background = add_world()
    texture = add_environment(studio("forest"), background, (0, 0, 1.0))
    hue = nodes.add("HueSaturation", {"Saturation": 0.5, "Color": texture.outputs["Color"]})
    mix = nodes.add("Mix", data_type="RGBA", blend_type="MULTIPLY")
    for socket, value in zip((one for one in mix.inputs if one.enabled), (0.7, hue.outputs["Color"], (1, 0.4, 0.2, 1))):
        nodes.set(socket, value)
    nodes.set(background.inputs["Color"], next(one for one in mix.outputs if one.enabled))
    assert_agrees(read().lights, TILTS["tilted"])


def test_light_that_changes_with_the_direction():
    nodes, background = add_world()
    split = nodes.add("SeparateXYZ", {0: nodes.add("TexCoord").outputs["Generated"]})
    ramp = nodes.add("ValToRGB", {0: split.outputs["Z"]})
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0.3, 0.1, 1), (0.1, 0.3, 2, 1)
    nodes.set(background.inputs["Color"], ramp.outputs["Color"])
    for tilt in TILTS.values():
        assert_agrees(read().lights, tilt)


SPACES = ["sRGB", "Non-Color", "Filmic sRGB", "Linear", "Linear Rec.709"]


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("kind", ["OPEN_EXR", "HDR", "PNG"])
def test_color_spaces_of_images(kind, space, tmp_path):
    source = bpy.data.images.new("Source", 8, 4, float_buffer=kind != "PNG")
    source.colorspace_settings.name = "Non-Color"
    source.pixels.foreach_set(np.tile(np.array([0.5, 0.4, 0.3, 1], np.float32), 32))
    source.file_format, source.filepath_raw = kind, str(tmp_path / "image")
    source.save()
    image = bpy.data.images.load(source.filepath_raw)
    try:
        image.colorspace_settings.name = space
    except TypeError:
        pytest.skip("this Blender has no such space")
    _, background = add_world()
    add_environment(image, background)
    illumination = read()
    if kind == "PNG" and space == "Filmic sRGB":
        assert illumination.lights == ()
        assert "its color space is Filmic sRGB" in illumination.by_cycles["World"].text
        return
    # Blender reads 8 bits of HDR files a little differently from Cycles.
    assert_agrees(read().lights, TILTS["up"], 1024, 0.02 if kind == "HDR" else 0.005)


@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
@pytest.mark.parametrize("is_float", [True, False])
def test_alpha_of_images(is_float, mode):
    image = bpy.data.images.new("Source", 8, 4, float_buffer=is_float, alpha=True)
    image.pixels.foreach_set(np.tile(np.array([0.5, 0.25, 0.125, 0.5], np.float32), 32))
    image.alpha_mode = mode
    _, background = add_world()
    add_environment(image, background)
    # Cycles rounds bytes down after it has multiplied them by alpha.
    assert_agrees(read().lights, TILTS["up"], 1024, 0.01)


def test_huge_images_are_averaged_with_their_energy():
    rng = np.random.default_rng(1)
    pixels = rng.random((64, 2 * MAX_WIDTH, 4), np.float32)
    small = shrunk(pixels)
    assert small.shape == (32, MAX_WIDTH, 4)

    def energy(values):
        edges = np.sin(np.linspace(-0.5 * math.pi, 0.5 * math.pi, len(values) + 1))
        return (values.mean(axis=1, dtype=float) * np.diff(edges)[:, None]).sum(axis=0)

    assert energy(small) == pytest.approx(energy(pixels), rel=1e-5)


def test_unsupported_nodes_are_left_to_cycles():
    nodes, background = add_world()
    nodes.set(background.inputs["Color"], nodes.add("TexNoise").outputs["Color"])
    illumination = read()
    text = "The world 'World' is left out. The node 'Noise Texture' is not supported."
    assert illumination.lights == ()
    assert {name: str(message) for name, message in illumination.by_cycles.items()} == {"World": text}
    assert [*map(str, illumination.messages)] == [text]


def test_negative_light_is_named():
    add_world(strength=-1)
    assert read().lights == ()
    assert "The light 'World' is left out. The color of 'World' is -1, -1, -1" in read().messages[0].text


def test_a_panorama_stays_while_the_strength_of_its_background_changes():
    """The cache keeps it for numbers of strength alone: not for another color, or a strength by nodes."""
    nodes, background = add_world()
    texture = add_environment(studio("forest"), background, turn=(0.0, 0.0, 0.4))
    mapping = texture.inputs["Vector"].links[0].from_node

    def read_again():
        bpy.context.view_layer.update()
        (light,) = read_illumination(bpy.context.evaluated_depsgraph_get(), scene_cache).lights
        return light

    first = read_again()
    background.inputs["Strength"].default_value = 2.5
    second = read_again()
    assert second.radiance is first.radiance
    assert second.rgb() == pytest.approx(2.5 * first.rgb())
    mapping.inputs["Rotation"].default_value[2] = 1.0
    turned = read_again()
    assert turned.to_world != first.to_world
    assert irradiance(turned, (1, 0, 0)) != pytest.approx(irradiance(second, (1, 0, 0)), rel=1e-2)
    nodes.set(background.inputs["Strength"], nodes.add("Value").outputs[0])
    nodes.of_type("VALUE").outputs[0].default_value = 0.5
    by_node = read_again()
    assert irradiance(by_node, (1, 0, 0)) == pytest.approx(irradiance(turned, (1, 0, 0)) * 0.2, rel=1e-5)
