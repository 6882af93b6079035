"""Runs inside a Blender with a window for test_live_window.py: Live by its own timer, beside events and operators.

xvfb-run blender --factory-startup --python THIS -- RESULTS.json
"""

import math
import sys
import threading
import time
from pathlib import Path

import bpy

FOLDER = Path(__file__).resolve().parent
sys.path[:0] = [str(FOLDER), str(FOLDER.parent.parent / "build" / "stage")]

import beamspread  # noqa: E402
import numpy as np  # noqa: E402
import scenes  # noqa: E402
from beamspread.blender.jobs.state import state  # noqa: E402
from beamspread.blender.live import preview, timer  # noqa: E402
from live_scenes import hidden_images, shown_image, shown_pixels, shows_own_image  # noqa: E402
from scenario_player import play  # noqa: E402

PATIENCE_SECONDS, DRAG_SECONDS = 60, 2.0
results = {"shown": 0, "shown during the bake": 0, "exact": 0}


def count_renderings():
    show = preview.Preview.show

    def counted(self, rendering):
        results["shown"] += 1
        results["exact"] += rendering.is_exact
        results["shown during the bake"] += state.is_running()
        show(self, rendering)

    preview.Preview.show = counted


def shade(shading):
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.shading.type = shading


def is_at_rest():
    live = timer.live.session
    return live is not None and not live.is_busy()


def override():
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])


def add_lamp(name, x):
    data = bpy.data.lights.new(name, "POINT")
    data.energy, data.shadow_soft_size = 50, 0
    obj = bpy.data.objects.new(name, data)
    obj.location = (x, 0.2, 0.5)
    bpy.context.collection.objects.link(obj)
    return obj


def is_over(seconds):
    end = time.monotonic() + seconds
    return lambda: time.monotonic() > end


def drawing_icons(material):
    """Have Blender draw the material's icon in a thread; True if it does."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], id=material):
        bpy.ops.ed.lib_id_generate_preview()
    return bpy.app.is_job_running("RENDER_PREVIEW")


def scenario():
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scene, settings = bpy.context.scene, bpy.context.scene.beamspread
    settings.quality, settings.resolution, settings.use_indirect, scene.world = "preview", 64, False, None
    material = scenes.add_material(ior=1.4, linked=True)
    plane = scenes.add_plane(material=material)
    lamps = [add_lamp(f"Lamp {x}", x) for x in (-0.5, 0.0, 0.5)]
    shade("SOLID")
    settings.use_live = True
    yield is_over(1.5)
    results["shown in solid view"] = results["shown"]

    shade("MATERIAL")
    yield lambda: results["exact"] > 0
    before, end = results["shown"], time.monotonic() + DRAG_SECONDS
    while time.monotonic() < end:
        for number, lamp in enumerate(lamps):
            lamp.location.y = 0.4 * math.sin(9 * time.monotonic() + number)
        yield lambda: True
    results["shown while dragged"] = results["shown"] - before
    yield is_at_rest

    results["icons are drawn"] = [drawing_icons(material)]
    live, timer.live.session = timer.live.session, None
    live.end()
    results["icons are drawn"].append(bpy.app.is_job_running("RENDER_PREVIEW"))
    yield lambda: timer.live.session is not None and is_at_rest()

    settings.solver = "direct"
    settings.resolution = 40
    yield is_at_rest
    with override():
        scenes.select(plane)
        results["bake"] = sorted(bpy.ops.beamspread.bake("INVOKE_DEFAULT"))
    yield is_over(0.2)
    results["shown beside the bake"] = shown_image(material).name in hidden_images()
    lamps[0].data.energy = 49
    yield lambda: not state.is_running()
    baked = scenes.pixels(scenes.node_of(material).image)
    yield is_at_rest
    results["a change during the bake is shown"] = shown_image(material).name in hidden_images()
    lamps[0].data.energy = 50
    settings.solver = "fft"
    yield is_at_rest
    with override():
        bpy.ops.beamspread.bake("INVOKE_DEFAULT")
    yield lambda: not state.is_running()
    image, shown = scenes.node_of(material).image, results["shown"]
    yield is_over(1.0)
    results["the bake stays"] = shown_image(material) == image and np.allclose(scenes.pixels(image), baked, rtol=0.05)
    results["shown after the bake"] = results["shown"] - shown

    bpy.ops.ed.undo_push(message="before paint")
    lamps[0].data.energy = 500
    yield is_at_rest
    yield lambda: shown_image(material).name in hidden_images()
    with override():
        bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    yield is_over(0.3)
    results["slots while painting"] = [image.name for image in material.texture_paint_images]
    with override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield lambda: shown_image(material).name in hidden_images()

    shade("RENDERED")
    bpy.ops.ed.undo_push(message="before")
    bpy.data.lights["Lamp 0.0"].energy = 500
    bpy.ops.ed.undo_push(message="brighter")
    yield is_over(0.2)
    with override():
        bpy.ops.ed.undo()
    material = bpy.data.materials["Medium"]
    results["shown right after undo"] = shown_image(material).name in hidden_images() and bool(
        shown_pixels(material).any()
    )
    yield is_at_rest
    results["still on after undo"] = timer.live.session is not None
    bpy.data.objects["Lamp 0.0"].location.x = 0.3
    yield is_over(0.05)
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    yield is_at_rest
    yield lambda: shows_own_image(material)

    bpy.context.scene.beamspread.use_live = False
    yield lambda: timer.live.session is None
    plane = scenes.add_plane(material=bpy.data.materials["Medium"])
    bpy.context.scene.beamspread.use_live = True
    yield lambda: timer.live.session is not None
    yield is_over(0.05)
    results["failure"] = timer.live.failure
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield is_over(1.0)  # Blender crashes if it quits before it has drawn the new file
    beamspread.unregister()
    results["threads"] = [thread.name for thread in threading.enumerate() if thread.name.startswith("Beamspread")]


def main():
    beamspread.register()
    count_renderings()
    play(scenario(), results, PATIENCE_SECONDS, pause=0.02)


main()
