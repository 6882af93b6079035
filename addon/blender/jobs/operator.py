"""The Bake operator: in the window it runs beside the user's work, in background it blocks."""

from __future__ import annotations

import threading

import bpy
from bpy.props import EnumProperty

from ...core import native
from ...core.bake.runner import CANCELLED, WRITTEN, Bake
from ..images.results import Results
from ..node.find import NOTHING_FOUND, find_misplaced, find_targets
from .prepare import prepare_scene
from .state import redraw, state

TIMER_SECONDS = 0.1


class BakeThread(threading.Thread):
    """Runs one bake; poll `fraction` until it has ended."""

    def __init__(self, bake: Bake) -> None:
        super().__init__(daemon=True)
        self.bake = bake
        self.fraction = 0.0
        self._stop_asked = threading.Event()

    def run(self) -> None:
        self.bake.run(self._step)
        if self._stop_asked.is_set():
            # Also where it ended just before it saw that it should.
            self.bake.cancel()

    def cancel(self) -> None:
        """Ask the bake to stop; it ends soon after."""
        self._stop_asked.set()

    def _step(self, fraction: float) -> bool:
        self.fraction = fraction
        return not self._stop_asked.is_set()


class BEAMSPREAD_OT_bake(bpy.types.Operator):
    """Bake the light inside translucent surfaces into the images of their Beamspread nodes"""

    bl_idname = "beamspread.bake"
    bl_label = "Bake Beamspread"
    bl_options = {"UNDO"}

    objects: EnumProperty(
        name="Objects",
        items=[
            ("SELECTED", "Selected", "The selected objects that have a Beamspread node; all if there are none", 0),
            ("ALL", "All", "All objects of the scene that have a Beamspread node", 1),
        ],
        default="SELECTED",
    )

    @classmethod
    def poll(cls, context):
        if state.is_running():
            cls.poll_message_set("A bake is running: Esc stops it")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        return True

    def execute(self, context):
        if not self._prepare(context):
            return {"CANCELLED"}
        for bake in self._queue:
            bake.run()
            self._take(bake)
        return self._finish(context)

    def invoke(self, context, _event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        if not self._prepare(context):
            return {"CANCELLED"}
        if not self._queue:
            return self._finish(context)
        manager = context.window_manager
        self._timer = manager.event_timer_add(TIMER_SECONDS, window=context.window)
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        self._next = 0
        self._start()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            self._thread.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._thread.is_alive():
            self._show_progress(context)
            return {"PASS_THROUGH"}
        bake = self._thread.bake
        self._take(bake)
        if bake.status != CANCELLED and self._next < len(self._queue):
            self._start()
            return {"PASS_THROUGH"}
        self._end_modal(context)
        return self._finish(context)

    def cancel(self, context):
        """Blender closes the window or loads another file."""
        self._thread.cancel()
        self._thread.join()
        self._end_modal(context)

    def _prepare(self, context) -> bool:
        """Make the queue of bakes; False if there is nothing to do at all."""
        self._written, self._said, self._results = [], set(), Results()
        if native.problem:
            self.report({"ERROR"}, native.problem)
            return False
        for objects in (context.selected_objects if self.objects == "SELECTED" else (), context.scene.objects):
            targets, misplaced = find_targets(objects), find_misplaced(objects)
            if targets or misplaced:
                break
        else:
            self.report({"ERROR"}, NOTHING_FOUND)
            return False
        bakes = prepare_scene(context, targets, context.scene.beamspread.for_bake())
        bakes = misplaced + [self._results.admit(bake) for bake in bakes]
        self._queue = [bake for bake in bakes if bake.job is not None]
        for bake in bakes:
            state.note(bake)
            if bake.job is None:
                self._take(bake)
        return True

    def _start(self) -> None:
        bake = self._queue[self._next]
        self._thread = BakeThread(bake)
        self._thread.start()
        self._next += 1
        state.start(bake.target)

    def _show_progress(self, context) -> None:
        done = (self._next - 1 + self._thread.fraction) / len(self._queue)
        state.update(self._thread.fraction, done)
        context.window_manager.progress_update(int(100 * done))
        context.workspace.status_text_set(": ".join(state.progress()))
        redraw(context)

    def _take(self, bake: Bake) -> None:
        """Store what a bake has made, and say what there is to say."""
        bake.keep(self._results.store)
        state.note(bake)
        if bake.status == WRITTEN:
            self._written.append(bake.target)
        elif bake.status == CANCELLED:
            self._say("WARNING", "Bake cancelled: the image keeps what it had")
        else:
            self._say("ERROR", f"{bake.target}: {bake.error}")
        for warning in bake.warnings:
            self._say("WARNING", warning)

    def _say(self, level: str, message: str) -> None:
        if message not in self._said:
            self.report({level}, message)
            self._said.add(message)

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        state.stop()

    def _finish(self, context):
        redraw(context)
        if not self._written:
            return {"CANCELLED"}
        self.report({"INFO"}, f"Baked {', '.join(map(str, self._written))}")
        return {"FINISHED"}


def register() -> None:
    bpy.utils.register_class(BEAMSPREAD_OT_bake)


def unregister() -> None:
    bpy.utils.unregister_class(BEAMSPREAD_OT_bake)
