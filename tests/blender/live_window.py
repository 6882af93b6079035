"""What test_live.py runs inside a Blender with a window: Live by its own timer, beside events and an operator.

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
import scenes  # noqa: E402
from beamspread.blender.images import previews  # noqa: E402
from beamspread.blender.jobs.state import state  # noqa: E402
from beamspread.blender.live import canvas, session  # noqa: E402
from scenario_player import play  # noqa: E402

PATIENCE_SECONDS, DRAG_SECONDS = 60, 2.0
results = {"painted": 0, "painted during the bake": 0, "exact": 0}


def count_pictures():
    show = canvas.Canvas.show

    def counted(self, image, picture):
        results["painted"] += 1
        results["exact"] += picture.is_exact
        results["painted during the bake"] += state.is_running()
        show(self, image, picture)

    canvas.Canvas.show = counted


def shade(shading):
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.shading.type = shading


def is_at_rest():
    live = session.live.session
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
    results["painted in solid view"] = results["painted"]

    shade("MATERIAL")
    yield lambda: results["exact"] > 0
    before, end = results["painted"], time.monotonic() + DRAG_SECONDS
    while time.monotonic() < end:
        for number, lamp in enumerate(lamps):
            lamp.location.y = 0.4 * math.sin(9 * time.monotonic() + number)
        yield lambda: True
    results["painted while dragged"] = results["painted"] - before
    yield is_at_rest

    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], id=material):
        bpy.ops.ed.lib_id_generate_preview()
    results["icons are drawn"] = [bpy.app.is_job_running("RENDER_PREVIEW")]
    previews.give_back()
    results["icons are drawn"].append(bpy.app.is_job_running("RENDER_PREVIEW"))
    with override():
        scenes.select(plane)
        results["bake"] = sorted(bpy.ops.beamspread.bake("INVOKE_DEFAULT"))
    yield lambda: not state.is_running()
    image = scenes.node_of(material).image
    baked, shown = scenes.pixels(image).mean(), results["painted"]
    yield is_over(1.0)
    results["the bake stays"] = bool(not image.is_dirty and scenes.pixels(image).mean() == baked)
    results["painted after the bake"] = results["painted"] - shown

    shade("RENDERED")
    bpy.ops.ed.undo_push(message="before")
    lamps[0].data.energy = 500
    bpy.ops.ed.undo_push(message="brighter")
    yield is_over(0.2)
    with override():
        bpy.ops.ed.undo()
    yield is_at_rest
    results["still on after undo"] = session.live.session is not None
    bpy.data.objects["Lamp 0.0"].location.x = 0.3
    yield is_over(0.05)
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    yield is_at_rest

    bpy.context.scene.beamspread.use_live = False
    yield lambda: session.live.session is None
    plane = scenes.add_plane(material=bpy.data.materials["Medium"])
    bpy.context.scene.beamspread.use_live = True
    yield lambda: session.live.session is not None
    yield is_over(0.05)
    results["failure"] = session.live.failure
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield is_over(1.0)  # Blender crashes if it quits before it has drawn the new file
    beamspread.unregister()
    results["threads"] = [one.name for one in threading.enumerate() if one.name.startswith("Beamspread")]


def main():
    beamspread.register()
    count_pictures()
    play(scenario(), results, PATIENCE_SECONDS, pause=0.02)


main()
