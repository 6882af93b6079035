"""Bounced light by our own rays against Cycles' own bakes, and the decision between both.

The mean of each channel agrees within 1 %, and blocks of 4 x 4 texels within 5 % of the mean. Noise of our nodes is 1 %
of all light, and some of it is left in blocks of 16 x 16 nodes. Cycles' is less.
"""

import math
from functools import partial

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.compat import indirect_bakes_lack_lamps
from beamspread.blender.cycles import cycles_light
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.core.bake.bounced import BY_OWN_RAYS, BouncedLight
from beamspread.core.target import Target
from cycles_truth import cycles_bake, target_material
from mathutils import Matrix
from nodes import Nodes

TEXELS, GREY, SAMPLES = 16, 0.5, 1000


@pytest.fixture(autouse=True)
def with_bounces():
    bpy.context.scene.beamspread.use_indirect = True
    bpy.context.scene.beamspread.margin = 0


def bake_of(obj, output="IRRADIANCE", indirect=True):
    settings = bpy.context.scene.beamspread.for_bake(output=output, indirect=indirect)
    (bake,) = prepare_scene(bpy.context, [Target(obj.name, obj.data.materials[0].name)], settings, TEXELS)
    assert not bake.error
    return bake


def found_on(floor):
    """Bounced irradiance of our own rays."""
    values = []
    for indirect in (True, False):
        bake = bake_of(floor, indirect=indirect)
        assert bake.job.finds_light == indirect
        assert not indirect or any(isinstance(step, BouncedLight) for step in bake.job.steps)
        assert not indirect or BY_OWN_RAYS in bake.messages
        bake.run()
        assert not bake.error
        values.append(bake.texture)
    return values[0] - values[1]


def truth_on(floor, samples=SAMPLES):
    """The same by Cycles' bake."""
    floor.data.materials[0], image = target_material((GREY,) * 3, TEXELS)
    if not indirect_bakes_lack_lamps():
        return cycles_bake(floor, image, {"INDIRECT"}, samples)
    both, direct = (cycles_bake(floor, image, passes, samples) for passes in ({"DIRECT", "INDIRECT"}, {"DIRECT"}))
    return both - direct


def in_blocks(values, side=4):
    return values.reshape(TEXELS // side, side, TEXELS // side, side, 3).mean(axis=(1, 3))


def compare(floor, samples=SAMPLES, mean=0.01, block=0.05):
    ours, truth = in_blocks(found_on(floor)), in_blocks(truth_on(floor, samples))
    print(
        "means", ours.mean(axis=(0, 1)) / truth.mean(axis=(0, 1)), "blocks", np.abs(ours - truth).max() / truth.mean()
    )
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=mean)
    np.testing.assert_allclose(ours, truth, atol=block * truth.mean())
    return ours, truth


def principled(name="Principled", **inputs):
    nodes = Nodes(bpy.data.materials.new(name))
    shader = nodes.of_type("BSDF_PRINCIPLED")
    for key, value in inputs.items():
        nodes.set(shader.inputs[key.replace("_", " ")], value)
    return nodes.owner


def add_room(material_of=scenes.diffuse_material):
    """A closed room around a floor that is baked; `material_of` makes the material of a color."""
    floor = scenes.add_plane("Floor", material=scenes.add_material(color_mode="BASE_COLOR", base_color=(GREY,) * 3))
    sides = {
        "Back": ([(-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)], (0.8, 0.8, 0.8)),
        "Front": ([(-1, -1, 0), (1, -1, 0), (1, -1, 2), (-1, -1, 2)], (0.8, 0.8, 0.8)),
        "Left": ([(-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)], (0.8, 0.2, 0.2)),
        "Right": ([(1, -1, 0), (1, 1, 0), (1, 1, 2), (1, -1, 2)], (0.2, 0.7, 0.2)),
        "Ceiling": ([(-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2)], (0.8, 0.8, 0.8)),
    }
    for name, (corners, color) in sides.items():
        wall = scenes.add_mesh(name, corners, [(0, 1, 2, 3)], uvs=scenes.SQUARE_UVS)
        wall.data.materials.append(material_of(color, name))
    for place in ((0.5, 0.2, 1.9), (-0.4, -0.5, 1.5)):
        scenes.add_lamp(place, 20.0, "AREA", size=0.4)
    return floor


def painted(color, name):
    """Principled as in a new material, with that base color."""
    return principled(name, Base_Color=(*color, 1))


def test_a_closed_room_of_colored_walls():
    """Blocks of 4 x 4 texels are 1 % off on average; noise of both is less than half of that."""
    ours, truth = compare(add_room(), block=0.03)
    assert np.abs(ours - truth).mean() < 0.01 * truth.mean()


def test_a_room_of_principled_walls():
    """The lobe of the default material over its diffuse part: within 1.5 % in all, and Cycles' noise in blocks."""
    compare(add_room(painted), mean=0.015, block=0.08)


def test_a_room_of_rough_metal():
    """Half of it. Cycles filters lobes by the angle at which light left the floor, here by its mean: within 3 %."""

    def metal(color, name):
        return principled(name, Base_Color=(*color, 1), Metallic=0.5, Roughness=0.6)

    compare(add_room(metal), mean=0.03, block=0.1)


def add_checkered_image():
    image = bpy.data.images.new("Squares", 512, 512, float_buffer=False)
    values = np.ones((512, 512, 4), np.float32)
    values[:256, :256, :3] = (1, 0, 0)
    values[256:, 256:, :3] = (0, 0, 1)
    values[::64, :, :3] *= 0.2
    image.pixels.foreach_set(values.ravel())
    image.pack()
    return image


def test_an_image_on_a_wall():
    """Its colours are averaged as light; Cycles interpolates them as stored, which is darker: within 2 %, and 7 % in
    blocks. Mirrored or turned ones would stand on other sides."""

    def textured(color, name):
        nodes = Nodes(bpy.data.materials.new(name), clear=True)
        texture = nodes.add("TexImage", image=bpy.data.images.get("Squares") or add_checkered_image())
        return nodes.finish(nodes.add("BsdfDiffuse", {"Color": texture.outputs["Color"]}))

    compare(add_room(textured), mean=0.02, block=0.07)


def test_a_ball_under_a_lamp(monkeypatch):
    """Blocks within 15 % of the mean: much of the light falls below the ball, where Cycles' noise is largest."""
    floor = scenes.add_plane("Floor", material=scenes.add_material(color_mode="BASE_COLOR", base_color=(GREY,) * 3))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.4, location=(0.1, 0, 0.5))
    bpy.context.object.data.materials.append(painted((0.8, 0.4, 0.2), "Ball"))
    scenes.add_lamp((0.9, -0.6, 1.2), 100.0, radius=0.1)
    # The ball returns a fiftieth of the light.
    monkeypatch.setattr(cycles_light, "BouncedLight", partial(BouncedLight, tolerance=1e-3))
    compare(floor, samples=4 * SAMPLES, mean=0.02, block=0.15)


def test_what_is_black_or_below_needs_no_paths():
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    scenes.add_sun(40, 60, 3.0)
    scenes.add_plane("Below", matrix=Matrix.Translation((0, 0, -1)), material=scenes.diffuse_material((1, 1, 1)))
    assert not bake_of(floor).job.finds_light
    scenes.add_plane("Card", (0.5, 0.5), Matrix.Translation((0, 0, 0.5)), material=scenes.glowing_material(1.0))
    bake = bake_of(floor)
    alone = bake_of(floor, indirect=False)
    for one in (bake, alone):
        one.run()
    np.testing.assert_array_equal(bake.texture, alone.texture)
    assert bake.lights == alone.lights


def glass():
    nodes = Nodes(bpy.data.materials.new("Glass"), clear=True)
    return nodes.finish(nodes.add("BsdfGlass"))


def noisy_color():
    nodes = Nodes(bpy.data.materials.new("Noise"), clear=True)
    return nodes.finish(nodes.add("BsdfDiffuse", {"Color": nodes.add("TexNoise").outputs["Color"]}))


TRANSMISSION = "Transmission" if bpy.app.version < (4, 0, 0) else "Transmission_Weight"

ONLY_CYCLES = {
    "Glass": glass,
    "Noise": noisy_color,
    "Mirror": lambda: principled("Mirror", Metallic=1.0, Roughness=0.1),
    "Water": lambda: principled("Water", **{TRANSMISSION: 1.0}),
}


@pytest.mark.parametrize("name", ONLY_CYCLES)
def test_a_material_beyond_our_rays_is_named(name):
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    scenes.add_plane("Card", (0.5, 0.5), Matrix.Translation((0, 0, 0.5)), material=ONLY_CYCLES[name]())
    scenes.add_sun(40, 60, 3.0)
    bpy.context.scene.cycles.blur_glossy = 0  # mirrors are rough with it
    bake = bake_of(floor)
    assert not any(isinstance(step, BouncedLight) for step in bake.job.steps)
    assert bake.job.finds_light
    (reason,) = (str(message) for message in bake.messages if "Cycles finds the bounced light" in str(message))
    assert f"'{name}'" in reason


@pytest.mark.parametrize("name", ["visible_diffuse", "visible_shadow"])
def test_a_card_that_some_rays_pass(name):
    """It hides the lamps and returns no light, or returns light and hides nothing; both differ from other cards."""
    floor = add_room()
    corners = [(-0.8, -0.8, 1), (0.1, -0.8, 1), (0.1, 0.8, 1), (-0.8, 0.8, 1)]
    card = scenes.add_mesh("Card", corners, [(0, 1, 2, 3)], uvs=scenes.SQUARE_UVS)
    card.data.materials.append(scenes.diffuse_material((0.8, 0.7, 0.1), "Card"))
    seen = in_blocks(found_on(floor))
    setattr(card, name, False)
    ours, _ = compare(floor)
    assert np.abs(ours - seen).mean() > 0.1 * seen.mean()


def test_bounces_end_as_in_cycles():
    """Without any there is no bounced light, and one bounce gives less than four."""
    floor = add_room()
    sums = []
    for bounces in (0, 1, 4):
        bpy.context.scene.cycles.diffuse_bounces = bounces
        sums.append(found_on(floor).sum())
    assert sums[0] == 0
    assert sums[2] > 1.5 * sums[1] > 0
    assert math.isfinite(sums[2])
