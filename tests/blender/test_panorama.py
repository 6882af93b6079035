"""Worlds that only Cycles knows, as a panorama that it renders of a copy of the scene."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import child_world, cycles_light, kept_world
from beamspread.blender.cycles.cycles_light import world_panorama
from beamspread.blender.cycles.scene_copy import SceneCopy
from beamspread.blender.jobs.run.batch_run import bake_all
from beamspread.core.batch.batch_options import parse
from cycles_truth import cycles_bake, target_material


def panorama(width=256, height=128):
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy:
        return world_panorama(copy, width, height)


def directions(width, height):
    azimuth = 2 * np.pi * (0.5 - (np.arange(width) + 0.5) / width)
    elevation = np.pi * ((np.arange(height) + 0.5) / height - 0.5)[:, None]
    parts = np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def test_panorama_shows_every_direction_in_its_place():
    """A world as bright as the direction's coordinates; within a texel they change by pi / 128, and it is jittered."""
    nodes, background = scenes.add_world()
    moved = nodes.add("VectorMath", {0: nodes.add("TexCoord").outputs["Generated"], 1: (2, 2, 2)})
    nodes.set(background.inputs["Color"], moved.outputs[0])
    bpy.context.scene.render.film_transparent = True
    bpy.context.scene.cycles.film_exposure = 3.0
    scenes.add_plane("In the way", (50, 50))
    np.testing.assert_allclose(panorama(), 2 + directions(256, 128), atol=0.5 * np.pi / 128)


def test_panorama_keeps_images_in_memory():
    """An unsaved environment image comes back as it is, texel by texel; Cycles interpolates it linearly."""
    nodes, background = scenes.add_world()
    image = bpy.data.images.new("Sky", 32, 16, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    values = np.ones((16, 32, 4), np.float32)
    values[..., :3] = np.random.default_rng(1).random((16, 32, 3))
    image.pixels.foreach_set(values.ravel())
    texture = nodes.add("TexEnvironment", image=image, interpolation="Closest")
    nodes.set(background.inputs["Color"], texture.outputs["Color"])
    np.testing.assert_allclose(panorama(32, 16), values[..., :3], atol=1e-5)


def test_panorama_answers_light_paths_as_to_a_diffuse_surface():
    nodes, background = scenes.add_world((0.1, 0.2, 0.3, 1))
    is_camera = nodes.add("LightPath").outputs["Is Camera Ray"]
    strength = nodes.add("Math", {0: is_camera, 1: 5.0, 2: 1.0}, operation="MULTIPLY_ADD")
    nodes.set(background.inputs["Strength"], strength.outputs[0])
    np.testing.assert_allclose(panorama(16, 8), np.broadcast_to((0.1, 0.2, 0.3), (8, 16, 3)), rtol=1e-6)


def test_smooth_skies_take_a_smaller_panorama_with_the_same_light():
    """A sky model without a sun, and the same beside a node of another type, which takes the full panorama.

    Light of 32 x 16 parts is the same to the fraction that steps toward fewer texels may change.
    """
    nodes, background = scenes.add_world()
    sky = nodes.add("TexSky", sky_type="HOSEK_WILKIE", sun_direction=(0.6, 0.3, 0.4), turbidity=3.0)
    nodes.set(background.inputs["Color"], sky.outputs["Color"])
    assert child_world.is_smooth(bpy.context.scene.world)
    smaller = panorama(4096, 2048)
    nodes.add("TexChecker")
    assert not child_world.is_smooth(bpy.context.scene.world)
    full = panorama(4096, 2048)
    parts = [
        radiance.reshape(16, len(radiance) // 16, 32, radiance.shape[1] // 32, 3).mean(axis=(1, 3))
        for radiance in (smaller, full)
    ]
    assert np.abs(parts[0] / parts[1] - 1).max() <= child_world.MAX_LOSS


def test_skies_with_a_sun_and_images_take_the_full_panorama():
    nodes, background = scenes.add_world()
    assert child_world.is_smooth(bpy.context.scene.world)
    for added in (nodes.add("TexSky"), nodes.add("TexEnvironment")):
        nodes.set(background.inputs["Color"], added.outputs["Color"])
        assert not child_world.is_smooth(bpy.context.scene.world)
        bpy.context.scene.world.node_tree.nodes.remove(added)


def test_panorama_has_all_of_a_sky_s_sun():
    """Its irradiance on a level plane against Cycles' bake, 1 %."""
    nodes, background = scenes.add_world()
    sky = nodes.add("TexSky")
    kinds = {item.identifier for item in sky.bl_rna.properties["sky_type"].enum_items}
    sky.sky_type = "NISHITA" if "NISHITA" in kinds else "MULTIPLE_SCATTERING"
    sky.sun_elevation, sky.sun_rotation = 0.5, 1.0
    nodes.set(background.inputs["Color"], sky.outputs["Color"])
    seen = panorama(1024, 512)
    up = np.clip(directions(1024, 512)[..., 2], 0, None)
    solid = 2 * np.pi / 1024 * np.pi / 512 * np.sqrt(1 - directions(1024, 512)[..., 2] ** 2)
    ours = (seen * (up * solid)[..., None]).sum(axis=(0, 1))
    material, image = target_material((1, 1, 1), 4)
    floor = scenes.add_plane("Floor", material=material)
    truth = cycles_bake(floor, image, {"DIRECT"}, 16384).mean(axis=(0, 1))
    np.testing.assert_allclose(ours, truth, rtol=0.01)


def test_panorama_without_detail_has_fewer_texels():
    """Light that changes by half a per cent from texel to texel; a small lamp in it keeps all texels."""
    nodes, background = scenes.add_world()
    moved = nodes.add("VectorMath", {0: nodes.add("TexCoord").outputs["Generated"], 1: (2, 2, 2)})
    nodes.set(background.inputs["Color"], moved.outputs[0])
    np.testing.assert_allclose(panorama(1024, 512), 2 + directions(512, 256), atol=np.pi / 512)
    up = nodes.add("SeparateXYZ", {0: nodes.add("TexCoord").outputs["Generated"]}).outputs["Z"]
    is_lamp = nodes.add("Math", {0: up, 1: 0.9999}, operation="GREATER_THAN")
    strength = nodes.add("Math", {0: is_lamp.outputs[0], 1: 1e5, 2: 1.0}, operation="MULTIPLY_ADD")
    nodes.set(background.inputs["Strength"], strength.outputs[0])
    assert panorama(1024, 512).shape == (512, 1024, 3)


@pytest.fixture
def rendered(monkeypatch):
    """Names of the worlds that Cycles renders."""
    names = []

    def render(copy, progress=None):
        names.append(bpy.data.scenes[copy.request["scene"]].world.name)
        return np.ones((4, 8, 3), np.float32)

    monkeypatch.setattr(cycles_light, "world_panorama", render)
    kept_world._kept.clear()
    yield names
    kept_world._kept.clear()


def sky_over_floor():
    nodes, background = scenes.add_world(name="Sky")
    checker = nodes.add("TexChecker")
    nodes.set(background.inputs["Color"], checker.outputs["Color"])
    scenes.add_plane("Floor", material=scenes.add_material())
    bpy.context.scene.beamspread.resolution = 16
    return checker


def bake_frames(folder, frames="1-2"):
    report = bake_all(parse(["--frames", frames, "--no-indirect", "--output", str(folder)]))
    assert [bake.status for bake in report.bakes] == ["written"] * len(report.bakes)
    assert {bake.lights for bake in report.bakes} == {1}


def test_frames_share_a_world_until_it_changes(rendered, tmp_path):
    checker = sky_over_floor()
    lamp = scenes.add_sun(30.0)
    lamp.location.x = 1.0
    lamp.data.energy = 0.0
    lamp.keyframe_insert("location", frame=1)
    bake_frames(tmp_path, "1-3")
    assert rendered == ["Sky"]
    bpy.context.scene.world.name = "Renamed"
    bake_frames(tmp_path)
    assert rendered == ["Sky"]
    checker.inputs["Scale"].default_value = 7.0
    bake_frames(tmp_path)
    assert rendered == ["Sky", "Renamed"]


def test_worlds_that_move_are_rendered_at_each_frame(rendered, tmp_path):
    checker = sky_over_floor()
    checker.inputs["Scale"].keyframe_insert("default_value", frame=1)
    bake_frames(tmp_path)
    assert len(rendered) == 2


def test_worlds_that_hang_on_objects_are_rendered_anew(rendered, tmp_path):
    checker = sky_over_floor()
    tree = bpy.context.scene.world.node_tree
    place = tree.nodes.new("ShaderNodeTexCoord")
    place.object = scenes.add_sun(30.0)
    place.object.data.energy = 0.0
    tree.links.new(checker.inputs["Vector"], place.outputs["Object"])
    bake_frames(tmp_path)
    assert len(rendered) == 2
