"""Renders while the engine is Beamspread: by Cycles or EEVEE, in another Blender on a copy of the scene.

An engine may not start the render of another engine in its own process.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

import bpy
from bpy.app.handlers import persistent

from ....core.errors import BakeError, text_of
from ....core.native import native
from ... import compat, popup
from ...cycles.process import run
from ...cycles.scene_copy import SceneCopy
from ...registration import all_or_nothing, handlers

# Seconds to wait for the main thread, which alone may read the scene and may be busy.
PATIENCE_SECONDS = 60.0

EEVEE_REMEDY = "EEVEE needs OpenGL: try Cycles (Render > Beamspread > Render With)."

_shown: set[str] = set()
"""Errors of the present render and warnings of this file that a popup has shown: an animation repeats them."""

_errors: set[str] = set()
"""Errors of the present render."""


def render_picture(engine, depsgraph) -> None:
    """Fill the engine's result for one view layer."""
    scene, layer = depsgraph.scene, depsgraph.view_layer.name
    name = scene.beamspread.render_engine
    engine.update_stats("Beamspread", f"{name.title()} renders a copy of the scene")
    result = engine.begin_result(0, 0, engine.resolution_x, engine.resolution_y, layer=layer)
    filled = False
    try:
        with _in_main_thread(lambda: _copy(scene.name, layer)) as copy:
            picture = copy.folder / "picture.exr"
            request = {
                "engine": compat.engine_id(name),
                "frame": scene.frame_current,
                "subframe": scene.frame_subframe,
                "picture": str(picture),
            }
            # A process of its own: classes of nodes stay registered, and memory for pictures may be large.
            worker = "EEVEE" if name == "EEVEE" else "Cycles"
            step = lambda fraction: _step(engine, fraction)  # noqa: E731
            outcome = run(copy, "render", request, step, keeps=False, worker=worker)
            result.load_from_file(str(picture))
            filled = True
        for note in outcome["notes"].tolist():
            engine.report({"WARNING"}, note)
            _show("Beamspread: the picture", note)
    except native.Cancelled:
        pass
    except Exception as error:  # noqa: BLE001 - Blender would swallow it
        text = f"{text_of(error)} {EEVEE_REMEDY if name == 'EEVEE' else ''}".strip()
        _errors.add(text)
        engine.report({"ERROR"}, text)
        engine.error_set(text)  # the header of the picture shows it
        _show("Beamspread: there is no picture", text)
    finally:
        engine.end_result(result, cancel=not filled)


def _show(title: str, text: str) -> None:
    """Show a text in a popup, once: Blender shows what engines report in the Info editor alone."""
    if text not in _shown and not bpy.app.background:
        _shown.add(text)
        popup.show_soon(title, [text])


@persistent
def _before_render(*_arguments) -> None:
    _shown.difference_update(_errors)
    _errors.clear()


@persistent
def _before_loading(*_arguments) -> None:
    _shown.clear()
    _errors.clear()


def _copy(scene_name: str, layer: str) -> SceneCopy:
    scene = bpy.data.scenes[scene_name]
    return SceneCopy(scene, scene.view_layers[layer])


def _step(engine, fraction: float) -> bool:
    engine.update_progress(fraction)
    return not engine.test_break()


def _in_main_thread(function: Callable):
    """Call the function in the main thread: F12 in a window renders in another, which may not read the scene."""
    if threading.current_thread() is threading.main_thread():
        return function()
    outcome: dict[str, object] = {}
    done = threading.Event()

    def call() -> None:
        try:
            outcome["value"] = function()
        except Exception as error:  # noqa: BLE001 - raised again in the other thread
            outcome["error"] = error
        done.set()

    bpy.app.timers.register(call)
    if not done.wait(PATIENCE_SECONDS):
        raise BakeError("Blender's window was busy for a minute, so the render did not start.", "Render again.")
    if "error" in outcome:
        raise outcome["error"]
    return outcome["value"]


def show_by_eevee(context) -> None:
    """Switch a viewport in Rendered mode to Material Preview with the scene's own light, once it has been drawn."""
    space = context.space_data
    if space is None or space.type != "VIEW_3D" or space.shading.type != "RENDERED":
        return
    shading = space.shading

    def change() -> None:
        shading.type = "MATERIAL"
        shading.use_scene_lights = shading.use_scene_world = True

    bpy.app.timers.register(change)


register, unregister = all_or_nothing(*handlers(render_init=_before_render, load_pre=_before_loading))
