"""Scenario of test_window_animation.py: Bake Animation with Esc, once more, and rendered animations."""

import sys
from pathlib import Path

import bpy
import scenes
from beamspread.blender import popup
from beamspread.blender.images.facts import facts_of, is_sequence
from beamspread.blender.jobs.state import state
from scenario_player import in_window, is_over

results = {"popups": [], "lines": []}
FOLDER = Path(sys.argv[-1]).parent
FRAMES = 6


def files():
    """Times of the files of frames, by name."""
    return {path.name: path.stat().st_mtime_ns for path in sorted((FOLDER / "beamspread").glob("*.exr"))}


def press_escape():
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="ESC", value=value, x=window.width // 2, y=window.height // 2)


def note_line():
    """Store each line of the status bar; True."""
    if state.run is not None and state.run.line() not in results["lines"]:
        results["lines"].append(state.run.line())
    return True


def scenario():
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    scene = bpy.context.scene
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    plane = scenes.add_plane(size=(4, 4), material=scenes.add_material(linked=True))
    lamp = bpy.data.objects["Light"]
    for frame, x in ((1, 1.0), (FRAMES, -1.0)):
        lamp.location = (x, 0, 1.5)
        lamp.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, FRAMES
    scene.beamspread.quality, scene.beamspread.use_indirect = "preview", False
    scenes.select(plane)
    scenes.save_scene(FOLDER)
    show_soon = popup.show_soon

    def note(title, sentences):
        results["popups"].append([title, sentences])
        show_soon(title, sentences)

    popup.show_soon = note

    scene.frame_set(2)
    results["started"] = sorted(in_window(bpy.ops.beamspread.bake_animation, "INVOKE_DEFAULT"))
    yield lambda: note_line() and len(files()) >= 2
    press_escape()
    yield lambda: not state.is_running()
    results["after esc"] = [sorted(files()), scene.frame_current, is_sequence(scenes.image_of(plane))]
    before = files()
    in_window(bpy.ops.beamspread.bake_animation, "INVOKE_DEFAULT")
    yield lambda: note_line() and not state.is_running()
    after = files()
    results["kept"] = {name: after[name] for name in before} == before
    results["files"] = sorted(after)
    results["frames"] = list(facts_of(scenes.image_of(plane)).frames)[:2]

    # The sequence, and one bake in its place, in a rendered animation; F12 renders one frame.
    bpy.context.preferences.view.render_display_type = "NONE"
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.render.filepath, scene.frame_end = str(FOLDER / "picture"), 2
    ended = []
    bpy.app.handlers.render_complete.append(lambda *_: ended.append(1))
    results["popups by render"] = []
    for is_one, animation in ((False, True), (True, False), (True, True)):
        if is_one:
            scenes.node_of(plane.data.materials[0]).image = scenes.known_image()
        ended.clear()
        results["popups"].clear()
        in_window(bpy.ops.render.render, "INVOKE_DEFAULT", animation=animation)
        yield lambda: ended
        yield lambda: not bpy.app.is_job_running("RENDER")
        yield is_over(0.5)  # a timer shows popups
        results["popups by render"].append(list(results["popups"]))
