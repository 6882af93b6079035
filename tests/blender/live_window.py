"""Scenario of test_live_window.py: Live by its own timer, beside events and operators."""

import math
import threading
import time

import beamspread
import bpy
import numpy as np
import scenes
from beamspread.blender.jobs.state import state
from beamspread.blender.live import preview, timer
from live_scenes import hidden_images, shown_image, shown_pixels, shows_own_image
from scenario_player import in_window, is_over

DRAG_SECONDS = 2.0
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
    lamps = [scenes.add_lamp((x, 0.2, 0.5), 50, name=f"Lamp {x}") for x in (-0.5, 0.0, 0.5)]
    shade("SOLID")
    settings.use_live = True
    yield is_over(1.5)
    results["shown in solid view"] = results["shown"]

    shade("MATERIAL")
    yield lambda: results["exact"] > 0
    before, end = results["shown"], is_over(DRAG_SECONDS)
    while not end() or results["shown"] - before <= 3:
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
    scenes.select(plane)
    results["bake"] = sorted(in_window(bpy.ops.beamspread.bake, "INVOKE_DEFAULT"))
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
    in_window(bpy.ops.beamspread.bake, "INVOKE_DEFAULT")
    yield lambda: not state.is_running()
    image, shown = scenes.node_of(material).image, results["shown"]
    yield is_over(1.0)
    results["the bake stays"] = shown_image(material) == image and np.allclose(scenes.pixels(image), baked, rtol=0.05)
    results["shown after the bake"] = results["shown"] - shown

    bpy.ops.ed.undo_push(message="before paint")
    lamps[0].data.energy = 500
    yield is_at_rest
    yield lambda: shown_image(material).name in hidden_images()
    in_window(bpy.ops.object.mode_set, mode="TEXTURE_PAINT")
    yield is_over(0.3)
    results["slots while painting"] = [image.name for image in material.texture_paint_images]
    in_window(bpy.ops.object.mode_set, mode="OBJECT")
    yield lambda: shown_image(material).name in hidden_images()

    shade("RENDERED")
    bpy.ops.ed.undo_push(message="before")
    bpy.data.lights["Lamp 0.0"].energy = 500
    bpy.ops.ed.undo_push(message="brighter")
    yield is_over(0.2)
    in_window(bpy.ops.ed.undo)
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


count_renderings()
