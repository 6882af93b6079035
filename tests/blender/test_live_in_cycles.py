"""Live in Rendered views of Cycles, which reads an image once: nodes show it a new one whenever the scene rests."""

import time

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import session, timer
from live_scenes import (
    hidden_images,
    live_pixels,
    make_scene,
    settle,
    shown_image,
    shown_pixels,
    shows_own_image,
    switch_off,
)

pytestmark = pytest.mark.usefixtures("live_switched_off")

REST_SECONDS = session.CALM_SECONDS + session.CYCLES_PAUSE_SECONDS + 0.1


def views():
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    return [area.spaces.active for area in areas if area.type == "VIEW_3D"]


def shade(shading):
    for view in views():
        view.shading.type = shading


@pytest.fixture
def scene():
    if not views():
        pytest.skip("this Blender starts without a 3D View")
    plane, lamp, material = make_scene()
    bpy.context.scene.render.engine = "CYCLES"
    shade("RENDERED")
    return plane, lamp, material


def at_rest(material):
    """The image that renderers see once the scene rests."""
    settle()
    end = time.monotonic() + REST_SECONDS
    while time.monotonic() < end:
        timer.step(bpy.context)
        bpy.context.view_layer.update()
        time.sleep(0.01)
    return shown_image(material)


def test_it_gets_a_new_image_whenever_the_scene_comes_to_rest(scene):
    """Cycles recognizes images by their addresses."""
    _plane, lamp, material = scene
    first = at_rest(material)
    address, pixels = first.as_pointer(), scenes.pixels(first).copy()
    assert at_rest(material).as_pointer() == address  # nothing has changed
    lamp.location.x = -0.3
    second = at_rest(material)
    assert second.as_pointer() != address
    assert not np.allclose(scenes.pixels(second), pixels)
    assert len(hidden_images()) == 2  # the former one keeps its address


def test_other_views_follow_between_two_images(scene):
    _plane, lamp, material = scene
    image = at_rest(material)
    name, before = image.name, scenes.pixels(image).copy()
    lamp.location.x = -0.3
    settle(lambda: np.abs(shown_pixels(material) - before).max() > 0.1 * before.max())
    assert shown_image(material).name == name


@pytest.mark.parametrize("end", ["off", "another view", "bake"])
def test_no_image_stays_behind(scene, end):
    plane, lamp, material = scene
    at_rest(material)
    lamp.location.x = -0.3
    at_rest(material)
    if end == "off":
        switch_off()
    elif end == "another view":
        shade("MATERIAL")
        timer.step(bpy.context)
        assert len(hidden_images()) == 1
        return
    else:
        scenes.bake(plane)
        timer.step(bpy.context)
    assert shows_own_image(material)


def test_a_final_render_shows_the_preview(scene, tmp_path):
    """F12 renders the same image as the viewport, whether or not the node's own image has a file."""
    plane, lamp, material = scene
    scenes.bake(plane)
    lamp.data.energy = 500
    live = live_pixels(material).copy()
    lamp.hide_render = True  # the coat would reflect it
    bpy.context.scene.cycles.max_bounces = 0
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", 2.0, 5.0
    bpy.context.collection.objects.link(camera)
    render = bpy.context.scene.render
    bpy.context.scene.camera, bpy.context.scene.cycles.samples = camera, 4
    bpy.context.scene.cycles.use_denoising = False
    render.resolution_x = render.resolution_y = 64
    render.filepath, render.image_settings.file_format = str(tmp_path / "render.exr"), "OPEN_EXR"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    assert scenes.pixels(image).mean() == pytest.approx(live.mean(), rel=0.05)
    np.testing.assert_array_equal(shown_pixels(material), live)
