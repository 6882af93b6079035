"""Makes window.blend beside this file: the window that the example scenes open in. It needs a real window:

    xvfb-run -a -s "-screen 0 1600x1000x24 +extension GLX" blender --factory-startup --enable-event-simulate \
        --window-geometry 0 0 1600 1000 --python blend_examples/window/make_window.py

Blender 3.4 has no name in Python for the tab that a side bar shows, so the mouse clicks on it.
"""

import functools
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "build" / "stage"))

import beamspread  # noqa: E402

# Pixels of the tab from the right border of the side bar and from its top, in Blender 3.4 at 1600 x 1000.
TAB = (9, 137)

SECONDS = 2.0

EVENTS = (("MOUSEMOVE", "NOTHING"), ("MOUSEMOVE", "NOTHING"), ("LEFTMOUSE", "PRESS"), ("LEFTMOUSE", "RELEASE"))


def side_bar():
    areas = bpy.context.window_manager.windows[0].screen.areas
    area = next(area for area in areas if area.type == "VIEW_3D")
    return next(region for region in area.regions if region.type == "UI")


def begin():
    beamspread.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.view.show_splash = False
    bpy.app.timers.register(show, first_interval=SECONDS)


def show():
    for area in bpy.context.window_manager.windows[0].screen.areas:
        space = area.spaces.active
        if area.type == "VIEW_3D":
            space.show_region_ui = True
            shading = space.shading
            shading.type, shading.use_scene_lights, shading.use_scene_world = "MATERIAL", True, True
    bpy.app.timers.register(click, first_interval=SECONDS)


def click():
    """Click on the tab, one event at a time: Blender finds the region under the mouse between two events."""
    window, bar = bpy.context.window_manager.windows[0], side_bar()
    place = {"x": bar.x + bar.width - TAB[0], "y": bar.y + bar.height - TAB[1]}
    for number, (kind, value) in enumerate(EVENTS):
        event = functools.partial(window.event_simulate, type=kind, value=value, **place)
        bpy.app.timers.register(lambda event=event: event() and None, first_interval=0.5 * number)
    bpy.app.timers.register(save, first_interval=0.5 * len(EVENTS) + SECONDS)


def save():
    bpy.context.preferences.filepaths.save_version = 0
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        bpy.ops.wm.save_as_mainfile(filepath=str(HERE / "window.blend"), compress=True, check_existing=False)
    bpy.ops.wm.quit_blender()


begin()
