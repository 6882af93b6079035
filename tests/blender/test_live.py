"""Live: images follow the scene. In background no timer runs: these tests take its steps."""

import threading
import time

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import session

PATIENCE_SECONDS = 30


@pytest.fixture(autouse=True)
def switched_off_at_the_end():
    yield
    session.end()
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("Beamspread")]


def settle(until=None):
    """Take steps until all is painted, or until a condition holds."""
    began = time.monotonic()
    bpy.context.view_layer.update()
    while True:
        session.step(bpy.context)
        live = session.live.session
        calm = live is not None and not live.is_busy()
        if until() if until else calm:
            return
        assert time.monotonic() < began + PATIENCE_SECONDS
        time.sleep(0.005)


def make_scene(image_size=64, **properties):
    """A plane under a lamp, and its material; Live is on."""
    image = bpy.data.images.new("Target", image_size, image_size, float_buffer=True, alpha=False)
    material = scenes.add_material(image=image, linked=True, **({"ior": 1.4} | properties))
    plane = scenes.add_plane(material=material)
    data = bpy.data.lights.new("Lamp", "POINT")
    data.energy, data.shadow_soft_size = 50, 0
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location = (0.3, 0.2, 0.5)
    bpy.context.collection.objects.link(lamp)
    bpy.context.scene.beamspread.use_live = True
    return plane, lamp, material


def live_pixels(material):
    settle()
    return scenes.pixels(scenes.node_of(material).image)


def baked_pixels(plane):
    bpy.context.scene.beamspread.use_live = False
    session.step(bpy.context)
    return scenes.bake(plane)[0]


def test_at_rest_the_picture_is_the_bake():
    plane, lamp, material = make_scene()
    live_pixels(material)
    lamp.location.x = -0.4
    live = live_pixels(material)
    np.testing.assert_allclose(live, baked_pixels(plane), rtol=1e-4)
