"""Scenario of test_window.py: events, timers and panels that are drawn for real."""

import time
import traceback

import beamspread
import bpy
import scenes
from beamspread.blender import compat, popup
from beamspread.blender.images import icons
from beamspread.blender.jobs.run import bake_run, run_operator
from beamspread.blender.jobs.state import state
from beamspread.blender.node import buttons, draw
from beamspread.blender.ui import bake_panel as shown
from beamspread.blender.ui import panels
from beamspread.core.target import Target
from scenario_player import in_window, is_over

results = {"drawn": {}, "shown": [], "popups": []}


class WINDOW_OT_count_ticks(bpy.types.Operator):
    """Counts the events that timers send to the window."""

    bl_idname = "window.count_ticks"
    bl_label = "Count Ticks"

    def invoke(self, context, _event):
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, _context, event):
        results["ticks"] += event.type == "TIMER"
        return {"PASS_THROUGH"}


def ticks_of_a_second():
    """Count them anew."""
    results["ticks"] = 0
    yield is_over(1.0)


def count_draws(owner, name: str) -> None:
    """Count the calls of a drawing function under the name of its owner; store its exceptions."""
    function, label = getattr(owner, name), owner.__name__.rpartition(".")[2]

    def draw(first, second):  # Blender counts the arguments
        results["drawn"][label] = results["drawn"].get(label, 0) + 1
        try:
            function(first, second)
        except Exception:
            results["error"] = traceback.format_exc()
            raise

    setattr(owner, name, draw)


def prepare_panels() -> None:
    """Count drawn panels; closed panels and those in another tab of the side bar are drawn, too."""
    for panel in panels._classes:
        count_draws(panel, "draw")
        panel.bl_options = set()
    panels.BEAMSPREAD_PT_node_editor.bl_category = "Node"
    count_draws(draw, "draw_properties")
    count_draws(buttons, "_draw_menu")
    draw_lines = shown.draw_lines

    def record(layout, context, messages, icon):
        results["shown"].extend(message for message in messages if message not in results["shown"])
        draw_lines(layout, context, messages, icon)

    shown.draw_lines = record
    show_soon = popup.show_soon

    def note(title, sentences):
        results["popups"].append([title, sentences])
        show_soon(title, sentences)

    popup.show_soon = note


def areas() -> list:
    return list(bpy.context.window_manager.windows[0].screen.areas)


def lay_out(material) -> None:
    """Give every panel a place: two areas of properties and the Shader Editor with its side bar."""
    by_type = {area.type: area for area in areas()}
    by_type["OUTLINER"].ui_type = "PROPERTIES"
    by_type["VIEW_3D"].ui_type = "ShaderNodeTree"
    by_type["VIEW_3D"].spaces.active.show_region_ui = True
    material.node_tree.nodes.active = scenes.node_of(material)


def show_tabs() -> bool:
    """Turn the properties to render and material, which Blender allows once it has drawn them."""
    try:
        for area, tab in zip((area for area in areas() if area.type == "PROPERTIES"), ("RENDER", "MATERIAL")):
            area.spaces.active.context = tab
    except TypeError:
        return False
    return True


def started(**options) -> set[str]:
    """Start the operator as a button does."""
    return in_window(bpy.ops.beamspread.bake, "INVOKE_DEFAULT", **options)


def press_escape() -> None:
    window = bpy.context.window_manager.windows[0]
    for value in ("PRESS", "RELEASE"):
        window.event_simulate(type="ESC", value=value, x=window.width // 2, y=window.height // 2)


def ended() -> bool:
    return not state.is_running()


def image_of(name: str):
    return scenes.node_of(bpy.data.materials[name]).image


def brightness(name: str) -> float:
    """Mean of the image that the material shows; -1 without one."""
    image = image_of(name)
    return -1.0 if image is None else float(scenes.pixels(image).mean())


def simulates() -> bool:
    """True once the simulation has begun to tell how far it is."""
    return state.run.progress.stage_fraction > 0


def note_step() -> bool:
    """Store each step that the run reports, once; True."""
    if state.run is not None and state.run.progress.stage not in ("", *results["steps"]):
        results["steps"].append(state.run.progress.stage)
    return True


def scenario():
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    scene, settings = bpy.context.scene, bpy.context.scene.beamspread
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    settings.quality, settings.resolution, scene.world = "preview", 32, None
    sun = scenes.add_sun(0)
    planes = [scenes.add_plane(name, material=scenes.add_material(name)) for name in ("First", "Second")]
    planes[1].location.x = 5
    scene.render.engine = beamspread.blender.jobs.run.engine.BeamspreadEngine.bl_idname
    scenes.select(*planes)
    lay_out(planes[0].data.materials[0])
    yield show_tabs
    yield lambda: len(results["drawn"]) >= len(panels._classes)

    older = scenes.node_of(planes[1].data.materials[0])  # as an appended one: nothing tells where its color comes from
    for name in ("has_own_base_color", "has_own_albedo"):
        older.property_unset(name)
    bpy.context.view_layer.update()
    planes[1].location.x = 6
    yield lambda: older.has_own_albedo
    results["upgraded"] = [older.has_own_base_color, older.has_own_albedo]
    planes[1].location.x = 5

    editor = next(area for area in areas() if area.type == "NODE_EDITOR")
    region = next(region for region in editor.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=editor, region=region):
        bpy.ops.wm.call_menu(name=compat.shader_menu().__name__)
    yield lambda: "buttons" in results["drawn"]
    press_escape()
    yield lambda: True  # the menu takes it, and not the bake

    bpy.ops.ed.undo_push(message="before")
    results["returned"] = sorted(started(objects="ALL"))
    results["can start another"] = in_window(bpy.ops.beamspread.bake.poll)
    results["running"] = str(state.run.target)
    yield ended
    results["baked"] = [brightness(name) for name in ("First", "Second")]
    for name in ("undo", "redo"):
        in_window(getattr(bpy.ops.ed, name))
        results[f"after {name}"] = [brightness(name) for name in ("First", "Second")]

    # A solver and a size that take minutes, under another light: only Esc ends that.
    settings, sun = bpy.context.scene.beamspread, bpy.data.objects["Sun"]
    settings.solver, sun.data.energy = "direct", 100.0
    for name in ("First", "Second"):
        icons.scale(image_of(name), 512, 512)
    before = [brightness(name) for name in ("First", "Second")]
    started(objects="ALL")
    progress = state.run.progress
    yield lambda: progress.stage_fraction > 0.02
    results["progress"] = [progress.stage_fraction, progress.fraction, progress.stage, state.run.position]
    opened = []
    bpy.types.TOPBAR_MT_file.append(lambda _menu, _context: opened.append(True))
    in_window(bpy.ops.wm.call_menu, "INVOKE_DEFAULT", name="TOPBAR_MT_file")
    yield lambda: opened
    press_escape()
    yield is_over(0.5)  # some ticks of the operator's timer
    results["goes on behind a menu"] = state.is_running() and not state.run.progress.is_cancelled
    began = time.process_time()
    press_escape()
    yield ended
    results["seconds to cancel"] = time.process_time() - began
    results["kept by cancel"] = [brightness(name) for name in ("First", "Second")] == before
    results["messages of cancel"] = state.lines()
    results["standing after cancel"] = state.status_of(Target("First", "First")).status.value

    settings.solver = "fft"
    started(objects="ALL")
    bpy.data.materials.remove(bpy.data.materials["First"])
    yield ended
    results["messages of removal"] = state.lines()
    results["baked after removal"] = brightness("Second") / before[1]
    yield lambda: results["messages of removal"][0].partition(": ")[2] in results["shown"]

    # A medium that takes a minute: the result of a quick simulation comes long before.
    target = Target("Second", "Second")
    settings.quality, scenes.node_of(bpy.data.materials["Second"]).ior = "final", 1.234
    scenes.select(bpy.data.objects["Second"])
    old = brightness("Second")
    results["steps"] = []
    started()
    yield lambda: note_step() and brightness("Second") != old
    yield lambda: note_step() and results["steps"][-1].endswith("(only the first time)") and simulates()
    looked = brightness("Second")
    bpy.ops.beamspread.cancel()
    yield ended
    yield lambda: state.rows[target].messages
    results["first look"] = [looked == brightness("Second"), state.rows[target].messages[0].text]
    results["out of date"] = state.rows[target].is_stale
    settings.quality = "preview"

    results["of errors"] = []
    for where in ("run", "end"):  # as it starts, and in the middle

        def fail(*_arguments):
            raise ValueError("what went wrong")

        works, before = getattr(bake_run.BakeRun, where), len(results["popups"])
        setattr(bake_run.BakeRun, where, fail)
        started()
        yield ended
        setattr(bake_run.BakeRun, where, works)
        results["of errors"].append([results["popups"][before:], state.lines(), len(run_operator._timers)])
        results["after errors"] = [sorted(started())]
        yield ended
        results["after errors"].append(state.lines())

    # An error would raise here, and Blender would open a popup of its own beside ours.
    scenes.node_of(bpy.data.materials["Second"]).albedo = (1, 1, 1)
    before = len(results["popups"])
    results["refused"] = sorted(started())
    results["popups of refusal"] = results["popups"][before:]
    yield lambda: True
    press_escape()
    scenes.node_of(bpy.data.materials["Second"]).albedo = (0.5, 0.5, 0.5)

    # A bake may end before its operator looks for the first time.
    bake_run.BakeThread.start = bake_run.BakeThread.run
    results["ends at once"] = sorted(started())
    yield ended
    del bake_run.BakeThread.start

    settings.solver, results["ticks"] = "direct", 0
    bpy.utils.register_class(WINDOW_OT_count_ticks)
    in_window(bpy.ops.window.count_ticks, "INVOKE_DEFAULT")
    started()
    yield lambda: results["ticks"] > 2
    beamspread.unregister()
    yield from ticks_of_a_second()  # some are still queued
    yield from ticks_of_a_second()
    results["ticks when disabled"] = results["ticks"]
    results["runs on when disabled"] = state.is_running()
    beamspread.register()

    started()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    results["runs on in the next file"] = state.is_running()
    yield is_over(1.0)  # Blender crashes if it quits before it has drawn the new file


prepare_panels()
