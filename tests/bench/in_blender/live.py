"""What live.py runs in a Blender with a window: moves things and times how long it takes until the picture is drawn.

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
from beamspread.blender.live import canvas, session  # noqa: E402

CHANGES, PAUSE_SECONDS, PATIENCE_SECONDS = 12, 0.05, 20.0
times = {"stored": 0.0, "drawn": 0.0, "exact": 0.0}
results = {}


def note_pictures():
    show = canvas.Canvas.show

    def timed(self, image, picture):
        show(self, image, picture)
        times["stored"] = time.perf_counter()
        if picture.is_exact:
            times["exact"] = times["stored"]
        times["texels"] = picture.texture.shape[:2]

    canvas.Canvas.show = timed


def note_draws():
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


def changes(name, change, context):
    """Make changes one after the other; each waits for the picture of the one before to be drawn."""
    rows = {"stored": [], "drawn": []}
    for number in range(CHANGES):
        began = time.perf_counter()
        change(number)
        yield lambda: times["stored"] > began
        rows["stored"].append(times["stored"] - began)
        yield lambda: times["drawn"] > times["stored"]
        rows["drawn"].append(times["drawn"] - began)
        paused = time.perf_counter()
        yield lambda: time.perf_counter() > paused + PAUSE_SECONDS
    last = time.perf_counter()
    yield lambda: times["exact"] > began
    own = [pace.side() for pace in session.live.session._painter.paces.values()]
    results[name] = {
        "stored": statistics.median(rows["stored"][2:]),
        "drawn": statistics.median(rows["drawn"][2:]),
        "worst drawn": max(rows["drawn"][2:]),
        "exact": times["exact"] - last,
        "side": own,
        "texels": times["texels"],
    }


def scenario(shading, resolution):
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    bpy.types.SpaceView3D.draw_handler_add(note_draws, (), "WINDOW", "POST_PIXEL")
    material, monkey = build(resolution)
    shade(shading)
    bpy.context.scene.beamspread.use_live = True
    node = scenes.node_of(material)

    def move(obj):
        def change(number):
            obj.location.x = 0.3 * math.sin(number + 1)

        return change

    yield lambda: times["exact"] > 0
    redraws = []
    for _ in range(CHANGES):
        began = time.perf_counter()
        session.redraw(bpy.context)
        yield lambda: times["drawn"] > began
        redraws.append(times["drawn"] - began)
    results["a redraw alone"] = {"drawn": statistics.median(redraws)}
    for kind, energy in (("SUN", 3), ("POINT", 50), ("AREA", 50)):
        obj = lamp(kind.title(), kind, energy)
        if kind == "SUN":
            yield from changes(
                "a sun turned", lambda n, obj=obj: setattr(obj, "rotation_euler", (0.4 + 0.03 * n, 0.2, 0)), None
            )
        else:
            yield from changes(f"{kind.lower()} lamp moved", move(obj), None)
        if kind == "POINT":
            yield from changes("monkey moved", move(monkey), None)

            def albedo(n):
                node.albedo = (0.99, 0.89 - 0.01 * n, 0.6)

            yield from changes("albedo changed", albedo, None)
            yield from changes("receiver moved", move(bpy.data.objects["Plane"]), None)
        bpy.data.objects.remove(obj)
        yield lambda: True


def main():
    path, shading, resolution = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    note_pictures()
    steps = scenario(shading, int(resolution))
    waiting = {"for": lambda: True, "since": time.monotonic()}

    def step():
        try:
            if not waiting["for"]():
                if time.monotonic() - waiting["since"] < PATIENCE_SECONDS:
                    return 0.001
                raise TimeoutError(f"waited in vain after {times}, {session.sentences()}")
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
