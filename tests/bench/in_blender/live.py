"""Runs for live.py in a Blender with a window: moves objects and measures the time until the image is drawn.

blender --factory-startup --window-geometry 0 0 1600 1000 --python THIS -- RESULTS.json SHADING RESOLUTION
"""

import json
import math
import statistics
import sys
import time
import traceback
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "build" / "stage"), str(ROOT / "tests" / "blender")]

import beamspread  # noqa: E402
import scenes  # noqa: E402
from beamspread.blender.live import preview, session, timer  # noqa: E402
from beamspread.core.live.renderer import quick_side  # noqa: E402

CHANGES, WARM_UP, PAUSE_SECONDS, PATIENCE_SECONDS = 14, 4, 0.05, 20.0
times = {"began": 0.0, "stored": 0.0, "drawn": 0.0, "exact": 0.0}  # of the last change
results = {}


def note_renderings():
    show = preview.Preview.show

    def timed(self, rendering):
        show(self, rendering)
        now = time.perf_counter()
        if times["stored"] <= times["began"]:  # bounced light and the exact picture follow
            times["stored"] = now
        if rendering.is_exact:
            times["exact"] = now
        times["texels"] = max(rendering.texture.shape)

    preview.Preview.show = timed


def note_draws():
    if times["drawn"] <= max(times["began"], times["stored"]):
        times["drawn"] = time.perf_counter()


def lamp(name, kind, energy, location=(0.3, 0.2, 0.5)):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    if kind in ("POINT", "SPOT"):
        data.shadow_soft_size = 0.0
    if kind == "AREA":
        data.size = 0.4
    if kind == "SUN":
        data.angle = 0.0
    obj = bpy.data.objects.new(name, data)
    obj.location = location
    bpy.context.collection.objects.link(obj)
    return obj


def build(resolution):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scene = bpy.context.scene
    scene.world = None
    scene.beamspread.resolution = resolution
    material = scenes.add_material(ior=1.4, albedo=(0.99, 0.9, 0.6), mean_free_path=(0.02,) * 3, linked=True)
    plane = scenes.add_plane(size=(2, 2), material=material)
    plane.location.z = -0.3
    bpy.ops.mesh.primitive_monkey_add(size=0.8, location=(0, 0, 0.2))
    return material, bpy.context.object


def shade(shading):
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.shading.type = shading
            area.spaces.active.shading.use_scene_lights = True


class Stopwatch:
    """Times of changes and of their results, in seconds."""

    def __init__(self):
        self.stored, self.drawn = [], []

    @property
    def began(self):
        return times["began"]

    def start(self):
        times["began"] = time.perf_counter()

    def is_drawn(self):
        return times["stored"] > self.began and times["drawn"] > times["stored"]

    def stop(self):
        self.stored.append(times["stored"] - self.began)
        self.drawn.append(times["drawn"] - self.began)

    def is_over(self, seconds):
        return lambda: time.perf_counter() > self.began + seconds


def changes(name, change):
    """Make changes one after the other; each waits until the preview of the one before is drawn."""
    watch = Stopwatch()
    for number in range(CHANGES):
        watch.start()
        change(number)
        yield watch.is_drawn
        watch.stop()
        yield watch.is_over(watch.drawn[-1] + PAUSE_SECONDS)
    lights = timer.live.session._targets[0].illumination.lights
    last = watch.began
    yield lambda: times["exact"] > last
    results[name] = {
        "stored": statistics.median(watch.stored[WARM_UP:]),
        "drawn": statistics.median(watch.drawn[WARM_UP:]),
        "worst drawn": max(watch.drawn[WARM_UP:]),
        "exact": times["exact"] - last,
        "texels": min(quick_side(lights), times["texels"]),
    }


def redraws():
    """How long the window itself takes."""
    watch, seconds = Stopwatch(), []
    for _ in range(CHANGES):
        watch.start()
        session.redraw(bpy.context, "VIEW_3D")
        yield lambda: times["drawn"] > watch.began
        seconds.append(times["drawn"] - watch.began)
    results["nothing, only drawn again"] = {"drawn": statistics.median(seconds)}


def moves(obj):
    def change(number):
        obj.location.x = 0.3 * math.sin(number + 1)

    return change


def scenario(shading, resolution):
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    bpy.types.SpaceView3D.draw_handler_add(note_draws, (), "WINDOW", "POST_PIXEL")
    material, monkey = build(resolution)
    shade(shading)
    bpy.context.scene.beamspread.use_live = True
    yield lambda: times["exact"] > 0
    yield from redraws()

    sun = lamp("Sun", "SUN", 3)
    yield from changes("a sun turns", lambda number: setattr(sun, "rotation_euler", (0.4 + 0.03 * number, 0.2, 0)))
    bpy.data.objects.remove(sun)

    point = lamp("Point", "POINT", 50)
    node = scenes.node_of(material)
    yield from changes("a lamp moves", moves(point))
    yield from changes("what throws the shadow moves", moves(monkey))
    yield from changes("the receiver moves", moves(bpy.data.objects["Plane"]))
    yield from changes("an albedo", lambda number: setattr(node, "albedo", (0.99, 0.89 - 0.01 * number, 0.6)))
    bpy.data.objects.remove(point)

    yield from changes("an area lamp moves", moves(lamp("Area", "AREA", 50)))


def main():
    path, shading, resolution = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    note_renderings()
    steps = scenario(shading, int(resolution))
    waiting = {"for": lambda: True, "since": time.monotonic()}

    def step():
        try:
            if not waiting["for"]():
                if time.monotonic() - waiting["since"] < PATIENCE_SECONDS:
                    return 0.001
                raise TimeoutError(f"waited in vain after {times}, {[*map(str, timer.messages())]}")
            waiting.update({"for": next(steps), "since": time.monotonic()})
            return 0.001
        except StopIteration:
            pass
        except BaseException:  # noqa: BLE001 - the bench shows it
            results["error"] = traceback.format_exc()
        Path(path).write_text(json.dumps(results))
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=0.5, persistent=True)


main()
