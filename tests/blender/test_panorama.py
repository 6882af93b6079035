"""Worlds that only Cycles knows, as a panorama that it renders of a copy of the scene."""

import bpy
import numpy as np
import scenes
from beamspread.blender.cycles.cycles_light import world_panorama
from beamspread.blender.cycles.scene_copy import SceneCopy
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
