"""Operators that run bakes: in the window beside the user's work, in background they block."""

from __future__ import annotations

import threading

import bpy

from ....core import native
from ....core.bake.runner import Bake, run_bakes, run_in_steps
from ....core.errors import text_of
from ....core.messages import Level, Message
from ... import popup
from ..out_of_date import stale
from ..state import redraw, state
from .bake_run import BakeRun, BakeThread

TIMER_SECONDS = 0.1
"""Seconds between two looks at the thread of a bake."""

_timers: list[bpy.types.Timer] = []
"""Timers of the run in the window."""


class RunOperator:
    """Base of operators that bake. `_prepare` makes the run; the status bar, Esc and popups are the same for all.

    Attributes
    ----------
    _run : the run, see `BakeRun`.
    """

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
        if self._prepare(context, in_window=False):
            run_bakes(self._run.bakes(), self._run)
        return self._finish(context)

    def invoke(self, context, _event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        return self._ending_by_errors(context, self._begin)

    def modal(self, context, event):
        return self._ending_by_errors(context, lambda context: self._go_on(context, event))

    def cancel(self, _context):
        """Blender closes the window or loads another file."""
        end_threads()

    def _ending_by_errors(self, context, step):
        """The result of a step in the window. Blender would repeat a step that raises without end: it ends the run."""
        try:
            return step(context)
        except Exception as error:  # noqa: BLE001 - any error has to end the run, and to be shown
            text = f"An error of the add-on has ended the bake: {text_of(error)}"
            if state.run is not None:
                state.note(Bake(state.run.target, error=text))
            end_threads()
            self._run.fail(Message(Level.ERROR, "", text))
            return self._finish(context)

    def _begin(self, context):
        if not self._prepare(context, in_window=True):
            return self._finish(context)
        self._shown = ""
        self._steps = run_in_steps(self._run.bakes(), self._run)
        if not self._step():
            return self._finish(context)
        manager = context.window_manager
        _timers.append(manager.event_timer_add(TIMER_SECONDS, window=context.window))
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _go_on(self, context, event):
        if event.type == "ESC" and event.value == "PRESS" and _is_ours(context, event):
            state.ask_to_stop()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self._step():
            self._show_progress(context)
            return {"PASS_THROUGH"}
        return self._finish(context)

    def _step(self) -> bool:
        """Go on with the run as far as that is possible now; False once it has ended."""
        for _ in self._steps:
            return True
        return False

    def _prepare(self, context, in_window: bool) -> bool:
        """Make `_run` and read the scene for it; False if there is nothing to do."""
        raise NotImplementedError

    def _new(self, run: BakeRun, in_window: bool) -> bool:
        """Take a run; False if the native module is missing."""
        self._run, self._in_window = run, in_window
        if native.problem:
            self._run.fail(Message(Level.ERROR, "", native.problem))
        return not native.problem

    def _show_progress(self, context) -> None:
        line = state.run.line()
        if line == self._shown:  # drawing takes time from the bake, and from the user
            return
        self._shown = line
        context.window_manager.progress_update(int(100 * state.run.progress.time_fraction()))
        if context.workspace is not None:
            context.workspace.status_text_set(line)
        redraw(context)

    def _finish(self, context):
        self._run.close()
        _leave_window()
        stale.scan_soon()
        redraw(context)
        is_successful, problems = self._run.is_successful(), self._run.problems
        if problems and self._in_window:
            title = "Beamspread: some bakes need attention" if is_successful else "Beamspread: nothing was baked"
            popup.show_soon(title, [message.line() for message in problems])
        if not is_successful:
            return {"CANCELLED"}
        self.report({"INFO"}, self._run.summary())
        return {"FINISHED"}


def _is_ours(context, event) -> bool:
    """True if Esc is meant for the bake: menus, fields and operators started later get it before us anyway."""
    if event.ctrl or event.alt or event.shift or event.oskey:
        return False
    if context.screen is not None and context.screen.is_animation_playing:
        return False
    area = _area_under(context.screen, event)
    return area is None or area.type not in {"FILE_BROWSER", "PREFERENCES"}


def _area_under(screen, event):
    """Area under the mouse: a modal operator's own context keeps the area where it was started."""
    for area in screen.areas if screen is not None else ():
        if 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height:
            return area
    return None


def _leave_window() -> None:
    """Remove the timer, the cursor and the status text of a run."""
    while _timers:
        bpy.context.window_manager.event_timer_remove(_timers.pop())
        bpy.context.window_manager.progress_end()
    if state.is_running():
        for workspace in bpy.data.workspaces:  # the user may have changed to another meanwhile
            workspace.status_text_set(None)
    state.stop()


def end_threads() -> None:
    """End all bakes: a thread that outlived its operator would make Blender end with an error."""
    for thread in threading.enumerate():
        if isinstance(thread, BakeThread):
            thread.progress.cancel()
            thread.join()
    _leave_window()  # the operator goes without being asked to
