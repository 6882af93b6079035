"""Live in background, where no timer runs: its steps are taken here."""

import time

import bpy
import scenes
from beamspread.blender.live import preview, timer

PATIENCE_SECONDS = 120


def settle(until=None):
    """Take steps until everything is rendered, or until a condition holds."""
    began = time.monotonic()
    bpy.context.view_layer.update()
    while True:
        timer.step(bpy.context)
        live = timer.live.session
        is_calm = live is not None and not live.is_busy()
        if until() if until else is_calm:
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


def shown_image(material):
    """The image that renderers see in the material's node."""
    return scenes.node_of(material).node_tree.nodes["Image"].image


def shown_pixels(material):
    return scenes.pixels(shown_image(material))


def live_pixels(material):
    """Pixels that renderers see once everything is rendered."""
    settle()
    return shown_pixels(material)


def hidden_images():
    """Names of all images that Live has made."""
    return {image.name for image in bpy.data.images if image.name.startswith(preview.NAME)}


def shows_own_image(material):
    """True if the node shows its own image, and nothing of Live is left."""
    return shown_image(material) == scenes.node_of(material).image and not hidden_images()


def switch_off():
    bpy.context.scene.beamspread.use_live = False
    timer.step(bpy.context)


def save(folder, name="scene.blend"):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / name))


def live_lines() -> list[str]:
    """Messages about Live, a line each."""
    return [message.line() for message in timer.messages()]
