"""The Bake operator: in the window it runs beside the user's work, in background it blocks."""

from __future__ import annotations

import threading

import bpy
from bpy.props import EnumProperty

from . import bakes, results, status

TIMER_SECONDS = 0.1


class BakeThread(threading.Thread):
    """Runs one job; poll `fraction` and, when it has ended, `texture`, `cancelled` and `error`."""

    def __init__(self, job) -> None:
        super().__init__(daemon=True)
        self.job = job
        self.fraction = 0.0
        self.texture = None
        self.cancelled = False
        self.error = ""
        self._stop_asked = threading.Event()

    def run(self) -> None:
        try:
            self.texture = self.job.run(self._step)
        except Exception as error:  # noqa: BLE001 - everything has to reach the artist as a sentence
            self.cancelled = self._stop_asked.is_set()
            self.error = bakes.sentence(error)

    def cancel(self) -> None:
        """Ask the job to stop; it ends soon after."""
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
        if status.is_running():
            cls.poll_message_set("A bake is running: Esc stops it")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Go to Object Mode first")
            return False
        return True

    def execute(self, context):
        if not self._prepare(context):
            return {"CANCELLED"}
        for prepared in self._queue:
            try:
                self._results.store(prepared.target, prepared.job, prepared.job.run())
                self._written.append(prepared.target)
            except Exception as error:  # noqa: BLE001 - the other objects are still to be baked
                self._fail(prepared.target, bakes.sentence(error))
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
        if self._thread.cancelled:
            self.report({"WARNING"}, "Bake cancelled: the image keeps what it had")
            self._end_modal(context)
            return self._finish(context)
        self._take_result()
        if self._next < len(self._queue):
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
        """Make the queue of jobs; False if there is nothing to do at all."""
        self._written, self._queue, self._results = [], [], results.Results()
        problem = status.native_problem()
        if problem:
            self.report({"ERROR"}, problem)
            return False
        wanted = bakes.find_targets(context.selected_objects) if self.objects == "SELECTED" else []
        wanted = wanted or bakes.find_targets(context.scene.objects)
        if not wanted:
            self.report({"ERROR"}, "No mesh has a material with a Beamspread node: add one in the Shader Editor")
            return False
        warnings = {}
        for prepared in bakes.prepare(context, wanted, bakes.core_settings(context.scene.beamspread)):
            if prepared.job is None:
                self._fail(prepared.target, prepared.error)
            else:
                self._queue.append(prepared)
                warnings.update(dict.fromkeys(prepared.job.warnings))
        for warning in warnings:
            self.report({"WARNING"}, warning)
        return True

    def _start(self) -> None:
        prepared = self._queue[self._next]
        self._thread = BakeThread(prepared.job)
        self._thread.start()
        self._next += 1
        status.start(str(prepared.target))

    def _show_progress(self, context) -> None:
        done = (self._next - 1 + self._thread.fraction) / len(self._queue)
        status.update(self._thread.fraction, done)
        context.window_manager.progress_update(int(100 * done))
        context.workspace.status_text_set(": ".join(status.lines()))
        status.redraw(context)

    def _take_result(self) -> None:
        prepared, thread = self._queue[self._next - 1], self._thread
        if thread.error:
            self._fail(prepared.target, thread.error)
            return
        try:
            self._results.store(prepared.target, prepared.job, thread.texture)
            self._written.append(prepared.target)
        except Exception as error:  # noqa: BLE001 - e.g. the material was deleted meanwhile
            self._fail(prepared.target, bakes.sentence(error))

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        status.stop()

    def _fail(self, target, message: str) -> None:
        self.report({"ERROR"}, f"{target}: {message}")

    def _finish(self, context):
        status.redraw(context)
        if not self._written:
            return {"CANCELLED"}
        self.report({"INFO"}, f"Baked {', '.join(map(str, self._written))}")
        return {"FINISHED"}


def register() -> None:
    bpy.utils.register_class(BEAMSPREAD_OT_bake)


def unregister() -> None:
    bpy.utils.unregister_class(BEAMSPREAD_OT_bake)
