"""Live in background, where no timer runs: its steps are taken here."""

import time

import bpy
import scenes
from beamspread.blender.live import session

PATIENCE_SECONDS = 30


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


def switch_off():
    bpy.context.scene.beamspread.use_live = False
    session.step(bpy.context)


def save(folder, name="scene.blend"):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / name))


def live_lines() -> list[str]:
    """Messages about Live, a line each."""
    return [message.line() for message in session.messages()]
