"""The Bake operator: in the window it runs beside the user's work, in background it blocks."""

from __future__ import annotations

import threading

import bpy
from bpy.props import EnumProperty

from ....core import native
from ....core.bake.bake_settings import COMBINED
from ....core.bake.runner import CANCELLED, WRITTEN, Bake
from ....core.errors import text_of
from ....core.messages import Level, Message, Messages, warning
from ....core.target import Target
from ... import popup
from ...images.results import Results
from ...node.find import NOTHING_FOUND, find_bakeable, find_misplaced
from ...registration import all_or_nothing, classes
from ..out_of_date import stale
from ..state import redraw, state
from .bake_queue import BakeQueue
from .prepare import read_scene

TIMER_SECONDS = 0.1

NOTHING_STALE = "Nothing is out of date."

# Of the run in the window.
_timers: list[bpy.types.Timer] = []


class BakeThread(threading.Thread):
    """Runs one bake; poll `fraction` and `doing` until it has ended."""

    def __init__(self, bake: Bake) -> None:
        super().__init__(daemon=True)
        self.bake = bake
        self.fraction, self.doing = 0.0, ""
        self._stop_asked = threading.Event()

    def run(self) -> None:
        self.bake.run(self)
        if self._stop_asked.is_set():
            # Also where it ended just before it saw that it should.
            self.bake.cancel()

    def cancel(self) -> None:
        """Ask the bake to stop; it ends soon after."""
        self._stop_asked.set()

    def __call__(self, fraction: float) -> bool:
        self.fraction = fraction
        return not self._stop_asked.is_set()

    def say(self, words: str) -> None:
        self.doing = words


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
            ("STALE", "Out of Date", "Those baked before whose light, shape, material or settings changed since", 2),
        ],
        default="SELECTED",
    )

    _in_window = False

    @classmethod
    def description(cls, _context, properties):
        return properties.bl_rna.properties["objects"].enum_items[properties.objects].description

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
        if not self._prepare(context, preview_first=False):
            return {"CANCELLED"}
        while (bake := self._queue.next()) is not None:
            bake = self._results.admit(bake)
            bake.run()
            self._take(bake)
        return self._finish(context)

    def invoke(self, context, _event):
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self._in_window, self._shown = True, ""
        return self._ending_by_errors(context, self._begin)

    def modal(self, context, event):
        return self._ending_by_errors(context, lambda context: self._go_on(context, event))

    def cancel(self, _context):
        """Blender closes the window or loads another file."""
        _end_threads()

    def _ending_by_errors(self, context, step):
        """What a step in the window returns; where it raises, Blender would call it again and again, without end."""
        try:
            return step(context)
        except Exception as error:  # noqa: BLE001 - whatever it is, the run ends and says so
            text = f"An error of the add-on has ended the bake: {text_of(error)}"
            if state.progress is not None:
                state.note(Bake(state.progress.target, error=text))
            _end_threads()
            self._fail(Message(Level.ERROR, "", text))
            return self._finish(context)

    def _begin(self, context):
        if not self._prepare(context, preview_first=True):
            return self._finish(context)
        state.begin()
        if not self._start_next():
            return self._finish(context)
        manager = context.window_manager
        _timers.append(manager.event_timer_add(TIMER_SECONDS, window=context.window))
        manager.progress_begin(0, 100)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def _go_on(self, context, event):
        if event.type == "ESC" and event.value == "PRESS" and _is_ours(context, event):
            state.ask_to_stop()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if state.should_stop():
            self._thread.cancel()
        if event.type == "ESC":
            return {"RUNNING_MODAL"}
        if self._thread.is_alive():
            self._show_progress(context)
            return {"PASS_THROUGH"}
        bake = self._thread.bake
        self._take(bake)
        if bake.status != CANCELLED and self._start_next():
            return {"PASS_THROUGH"}
        _leave_window()
        return self._finish(context)

    def _prepare(self, context, preview_first: bool) -> bool:
        """Make the queue of bakes; False if there is nothing to do at all."""
        self._written, self._reported, self._results = [], Messages(), Results()
        self._problems = Messages()
        if native.problem:
            self._fail(Message(Level.ERROR, "", native.problem))
            return False
        targets, misplaced = self._chosen(context)
        if not targets and not misplaced:
            self._fail(Message(Level.ERROR, "", NOTHING_STALE if self.objects == "STALE" else NOTHING_FOUND))
            return False
        state.forget_failures()
        self._parts = stale.parts_of(context, targets)
        preparation = read_scene(context, targets, context.scene.beamspread.for_bake())
        self._queue = BakeQueue(preparation, targets, preview_first)
        for bake in misplaced:
            self._take(bake)
        return True

    def _chosen(self, context) -> tuple[list[Target], list[Bake]]:
        if self.objects == "STALE":
            stale.refresh(context)
            return [row.target for row in state.rows.values() if row.is_stale], []
        if self.objects == "SELECTED":
            chosen = context.selected_objects
            targets, misplaced = find_bakeable(context.view_layer, chosen), find_misplaced(chosen)
            if targets or misplaced:
                return targets, misplaced
        return find_bakeable(context.view_layer), find_misplaced(context.scene.objects)

    def _start_next(self) -> bool:
        """Start the next bake that can be; False if there is none."""
        while (bake := self._queue.next()) is not None:
            if self._queue.starts_again():
                self._results = Results()  # the same parts of the same images are filled anew
            bake = self._results.admit(bake)
            if bake.job is None:
                self._take(bake)
                continue
            state.start(bake.target, self._queue.fraction(0.0))
            self._thread = BakeThread(bake)
            self._thread.start()
            return True
        return False

    def _show_progress(self, context) -> None:
        done = self._queue.fraction(self._thread.fraction)
        doing = "Stopping" if state.should_stop() else self._thread.doing
        state.update(self._thread.fraction, done, doing)
        shown = state.progress.in_a_line()
        if shown == self._shown:  # to draw takes time from the bake, and from whoever works on
            return
        self._shown = shown
        context.window_manager.progress_update(int(100 * done))
        if context.workspace is not None:
            context.workspace.status_text_set(shown)
        redraw(context)

    def _take(self, bake: Bake) -> None:
        """Store what a bake has made, and say what there is to say."""
        layers = set(bake.layers)
        bake.keep(self._results.store)
        if bake.status == CANCELLED and self._queue.turn.is_again:
            text = f"The final bake of '{bake.target}' was cancelled: its quick preview is kept."
            self._report(warning(str(bake.target), text))
            return
        state.note(bake)
        if bake.status == WRITTEN:
            self._written.append(bake.target)
            if COMBINED in layers:
                parts, is_first_look = self._parts.get(bake.target), self._queue.turn.is_first
                stale.keep(bake, parts, is_first_look)
            if bake.is_dark:
                self._problems.add(*bake.messages.of(Level.WARNING))
        elif bake.status == CANCELLED:
            self._report(warning("", "The bake was cancelled: images keep their former pixels."))
        else:
            for message in bake.messages.of(Level.ERROR):
                self._fail(message)
        for message in bake.messages.of(Level.WARNING, Level.INFO):
            self._report(message)

    def _fail(self, message: Message) -> None:
        self._report(message)
        self._problems.add(message)

    def _report(self, message: Message) -> None:
        if message in self._reported:
            return
        self._reported.add(message)
        # In the window our own popup shows errors: Blender would open a second one for them.
        is_error = message.level == Level.ERROR
        self.report({"WARNING" if is_error and self._in_window else message.level.value}, message.line())

    def _finish(self, context):
        stale.look_soon()
        redraw(context)
        if self._problems and self._in_window:
            title = "Beamspread: some bakes need attention" if self._written else "Beamspread: nothing was baked"
            popup.show_soon(title, [message.line() for message in self._problems])
        if not self._written:
            return {"CANCELLED"}
        self.report({"INFO"}, f"Baked {', '.join(map(str, dict.fromkeys(self._written)))}")
        return {"FINISHED"}


def _is_ours(context, event) -> bool:
    """Whether Esc is meant for the bake: menus, fields and operators started later get it before us anyway."""
    if event.ctrl or event.alt or event.shift or event.oskey:
        return False
    if context.screen is not None and context.screen.is_animation_playing:
        return False
    area = _area_under(context.screen, event)
    return area is None or area.type not in {"FILE_BROWSER", "PREFERENCES"}


def _area_under(screen, event):
    """Where the mouse is: a modal operator's own context stays where it was started."""
    for area in screen.areas if screen is not None else ():
        if 0 <= event.mouse_x - area.x < area.width and 0 <= event.mouse_y - area.y < area.height:
            return area
    return None


class BEAMSPREAD_OT_cancel(bpy.types.Operator):
    """Stop the bake that is running: images keep what they had (Esc)"""

    bl_idname = "beamspread.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        return state.is_running()

    def execute(self, _context):
        state.ask_to_stop()
        return {"FINISHED"}


def _leave_window() -> None:
    """Take away what a run has in the window."""
    while _timers:
        bpy.context.window_manager.event_timer_remove(_timers.pop())
        bpy.context.window_manager.progress_end()
    if state.is_running():
        for workspace in bpy.data.workspaces:  # the user may have changed to another meanwhile
            workspace.status_text_set(None)
    state.stop()


def _end_threads() -> None:
    """One that outlives its operator would end Blender with an error when that quits."""
    for thread in threading.enumerate():
        if isinstance(thread, BakeThread):
            thread.cancel()
            thread.join()
    _leave_window()  # the operator goes without being asked to


register, unregister = all_or_nothing(*classes(BEAMSPREAD_OT_bake, BEAMSPREAD_OT_cancel), (lambda: None, _end_threads))
