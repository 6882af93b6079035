"""Scenario of test_kept_undo.py: undo of bakes, also while one runs."""

import bpy
import scenes
from beamspread.blender.images import icons
from beamspread.blender.jobs.state import state
from scenario_player import in_window, is_over

results = {}


def image():
    return scenes.node_of(bpy.data.materials["Medium"]).image


def shown_and_packed():
    """Brightness of the pixels on display, and of the pixels that a saved file would show."""
    if image() is None:
        return [-1.0, -1.0]
    shown = float(scenes.pixels(image()).mean())
    icons.stop_drawing()
    image().buffers_free()
    return [shown, float(scenes.pixels(image()).mean())]


def noted(name):
    results[name] = shown_and_packed()


def ended():
    return not state.is_running()


def scenario():
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    settings = bpy.context.scene.beamspread
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    bpy.context.scene.world = None
    settings.quality, settings.resolution, settings.use_indirect = "preview", 32, False
    scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    bpy.ops.ed.undo_push(message="before")
    for strength in (1.0, 3.0):
        bpy.data.objects["Sun"].data.energy = strength
        bpy.ops.ed.undo_push(message="light")
        in_window(bpy.ops.beamspread.bake, "INVOKE_DEFAULT")
        yield ended
        noted(f"baked {strength:.0f}")
    for name in ("undone", "undone light", "undone all"):
        in_window(bpy.ops.ed.undo)
        yield lambda: True
        noted(name)
    for name in ("redone", "redone light", "redone all"):
        in_window(bpy.ops.ed.redo)
        yield lambda: True
        noted(name)

    # Undo while a slow bake runs.
    settings = bpy.context.scene.beamspread
    settings.solver = "direct"
    icons.scale(image(), 256, 256)
    bpy.data.objects["Sun"].data.energy = 7.0
    bpy.ops.ed.undo_push(message="light and size")
    in_window(bpy.ops.beamspread.bake, "INVOKE_DEFAULT")
    results["runs"] = state.is_running()
    in_window(bpy.ops.ed.undo)
    results["still runs"] = state.is_running()
    yield ended
    results["said"] = state.lines()
    noted("baked across undo")
    in_window(bpy.ops.ed.undo)
    yield lambda: True
    noted("undone at last")
    yield is_over(1.0)  # Blender draws the window
