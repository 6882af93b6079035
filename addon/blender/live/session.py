"""Live: steps of a timer that look what has changed, have it painted beside the window, and show what was painted."""

from __future__ import annotations

import time

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core import native
from ...core.errors import text_of
from ...core.live.painter import Painter
from ...core.live.picture import Picture
from ...core.live.subject import Subject
from ...core.messages import Level, Message, note
from ...core.target import Target
from ..images.facts import owners_of
from ..images.previews import holds_previews_alone, leave, previews
from ..jobs.state import state
from ..registration import all_or_nothing, handlers
from .canvas import Canvas, image_for, image_name_of
from .marks import Marks
from .painting import painted_results
from .reader import Reader, shows_medium_alone
from .stand_ins import StandIns

# Between steps while something changes or is painted, while nothing does, and while Live is off.
BUSY_SECONDS, IDLE_SECONDS, OFF_SECONDS = 0.01, 0.05, 0.5

# How long a thread may take to end: what it can't stop, as one transform, is shorter.
END_SECONDS = 10.0

# A look that takes so long at most may be had while Blender evaluates a change.
SMALL_SECONDS = 0.01

# So long after a change Cycles gets to see pictures, with each of which it begins anew.
CALM_SECONDS = 0.3

# Of an object's texels, those that it shares with another in the same image: more than margins do.
SAME_PLACE = 0.5

SHADED = {"MATERIAL", "RENDERED"}


class Session:
    """From switching Live on to switching it off.

    Attributes
    ----------
    seconds : from the change that was last looked at to its picture, as measured.
    """

    def __init__(self) -> None:
        self._painter = Painter()
        self._reader = Reader()
        self._marks = Marks()
        self._marks.other = True
        self._subjects: list[Subject] = []
        self._canvases: list[Canvas] = []
        self._stand_ins = StandIns()
        self._errors: dict[Target, str] = {}
        self._regions: dict[Target, np.ndarray] = {}  # of the last pictures
        self._paused = False
        self._painted_on: list[str] = []  # names of images
        self._said: list[str] = []  # of canvases that are no more
        self._given_back: list[Subject] | None = None  # as the scene was then
        self._look_seconds = 1.0  # of the last look at more than lamps
        self._changed_at = time.perf_counter()
        self.seconds = 0.0

    def note(self, depsgraph) -> None:
        """Take the updates of a depsgraph."""
        was_calm = not self._marks
        own = {image.name for canvas in self._canvases if (image := canvas.image()) is not None}
        self._marks.note(list(depsgraph.updates), own | self._stand_ins.names())
        if was_calm and self._marks:
            self._changed_at = time.perf_counter()
        is_small = self._look_seconds < SMALL_SECONDS or self._marks.is_lamps_alone()
        is_simple = self._marks.is_movement_alone() and all(map(shows_medium_alone, self._marks.materials))
        if (self._marks or self._marks.nodes) and is_simple and is_small and not self._paused and not is_occupied():
            # At once, so that it is painted while the window is drawn.
            self._look(depsgraph)

    def forget(self) -> None:
        """Read everything again: all data may be others' now, as after undo."""
        self._stand_ins.end()
        self._reader, self._marks = Reader(), Marks()
        self._marks.other = True
        painted = painted_results(bpy.context)
        for canvas in self._canvases:
            canvas.refresh(canvas.image() in painted)

    def step(self, context) -> bool:
        """Look, have it painted, show; whether there is more to come soon."""
        if is_occupied():
            self._pause()
            return False
        if self.waits_for_painter(context):
            return False
        self._paused = False
        self._adopt_bakes(context)
        self._given_back = None
        for canvas in self._canvases:
            canvas.show_again()
        has_changed, changed_at = bool(self._marks), self._changed_at
        self._look(context.evaluated_depsgraph_get())
        shown = self._show_pictures(context)
        if shown:
            self.seconds = time.perf_counter() - changed_at
        self._show_cycles(context, shown)
        return has_changed or shown or self.is_busy()

    def waits_for_painter(self, context) -> bool:
        """Whether the user can paint on an image of a Beamspread node: it has its own pixels then."""
        painted = painted_results(context)
        self._painted_on = [image.name for image in painted]
        if not painted:
            return False
        self._pause()
        for canvas in self._canvases:
            if canvas.image() in painted:
                canvas.leave_to_painter()
        return True

    def _look(self, depsgraph) -> None:
        start = time.perf_counter()
        marks, self._marks = self._marks, Marks()
        subjects = self._reader.read(depsgraph, marks)
        if marks and not marks.is_lamps_alone():
            self._look_seconds = time.perf_counter() - start
        if [*map(id, subjects)] != [*map(id, self._subjects)]:
            self._subjects = subjects
            self._painter.show(subjects)

    def is_busy(self) -> bool:
        """Whether pictures are still to come."""
        return bool(self._marks) or self._painter.is_busy()

    def messages(self) -> list[Message]:
        """Messages about the preview."""
        errors = (self._reader.errors | self._errors).items()
        said = [f"Live waits while the image '{name}' can be painted on." for name in self._painted_on]
        if self._painter.media.simulating:
            said.append(f"The medium ({self._painter.media.simulating}) is simulated: the most similar one stands in.")
        said += self._reader.sentences()
        if self._reader.left_out:
            said.append(f"Live leaves out {', '.join(self._reader.left_out)}.")
        notes = [note("", text) for text in said + self.kept()]
        return [*(Message(Level.ERROR, str(target), why) for target, why in errors), *notes]

    def kept(self) -> list[str]:
        """What images keep of what others have drawn into pictures, in sentences."""
        return list(dict.fromkeys([*self._said, *(canvas.said for canvas in self._canvases if canvas.said)]))

    def give_back(self) -> None:
        """Have all images show their own pixels until the next step that finds nobody at work on them."""
        self._restore()
        if self._given_back is None:
            self._given_back = self._read(bpy.context.evaluated_depsgraph_get())

    def covers(self, image) -> bool:
        """Whether the image shows a picture."""
        return any(canvas.covers(image) for canvas in self._canvases)

    def end(self, keep_pixels: bool = False) -> None:
        """Stop, and give images their own pixels back unless there are other ones by now."""
        self._painter.end()
        if not keep_pixels:
            self._restore()
        self._drop(self._canvases)
        self._painter.join(END_SECONDS)

    def _drop(self, canvases: list[Canvas]) -> None:
        self._said += [canvas.said for canvas in canvases if canvas.said]
        self._canvases = [one for one in self._canvases if one not in canvases]

    def _restore(self) -> None:
        self._stand_ins.end()
        for canvas in self._canvases:
            canvas.give_back()

    def _pause(self) -> None:
        if not self._paused:
            self._paused = True
            self._stand_ins.end()
            self._subjects = []
            self._painter.show(())

    def _show_cycles(self, context, has_new: bool) -> None:
        is_calm = not self._marks and time.perf_counter() - self._changed_at >= CALM_SECONDS
        shown = (canvas.image() for canvas in self._canvases)
        images = [image for image in shown if image is not None and self.covers(image)]
        self._stand_ins.follow(context, images, has_new, is_calm, self.is_busy())

    def _adopt_bakes(self, context) -> None:
        """Take images that have other pixels than Live's, of a bake or a file, for what the scene looks like now."""
        adopted = [canvas for canvas in self._canvases if canvas.is_saved()]
        if not adopted:
            return
        saved = {canvas.image().name for canvas in adopted}
        # A bake has read the scene as it was when Live gave the images back.
        subjects = self._given_back or self._read(context.evaluated_depsgraph_get())
        self._painter.adopt([subject for subject in subjects if image_name_of(subject) in saved])
        for canvas in adopted:
            leave(canvas.image())
        self._drop(adopted)

    def _read(self, depsgraph) -> list[Subject]:
        """All subjects as the scene is now."""
        marks, self._marks = self._marks, Marks()  # after the depsgraph has told of changes that wait
        marks.other = True
        return self._reader.read(depsgraph, marks)

    def _show_pictures(self, context) -> bool:
        """Show the last picture of each subject."""
        latest = self._painter.take()
        wanted = {subject.target: subject for subject in self._subjects}
        shown = False
        for target, picture in latest.items():
            self._errors.pop(target, None)
            if target not in wanted:
                continue
            if picture.error:
                self._errors[target] = picture.error
                continue
            shown |= self._show(picture)
        if latest:
            redraw(context)
        return shown

    def _show(self, picture: Picture) -> bool:
        target, (height, width) = picture.subject.target, picture.texture.shape[:2]
        image = image_for(target, width, height)
        if image is None or tuple(image.size) != picture.texture.shape[1::-1]:
            return False  # removed or resized meanwhile
        self._regions[target] = picture.region
        other = self._in_the_way(picture, image)
        if other is not None:
            self._errors[target] = (
                f"it shares its place in the image '{image.name}' with '{other.object_name}', which Live shows: "
                "give it a material and an image of its own."
            )
            return False
        canvas = next((one for one in self._canvases if one.fits(image)), None)
        if canvas is None:
            canvas = Canvas(image, target if holds_previews_alone(image) else None)
            self._drop([one for one in self._canvases if one.image() == image])
            self._canvases.append(canvas)
        canvas.show(image, picture)
        self._stand_ins.update(image)
        return True

    def _in_the_way(self, picture: Picture, image) -> Target | None:
        """Who else is shown in the same place of an image: whose result it holds, else the first by name."""
        target = picture.subject.target
        others = [one.target for one in self._subjects if one.target != target and image_name_of(one) == image.name]
        if not others:
            return None
        owners = owners_of(image)

        def rank(one: Target) -> tuple:
            return one not in owners, str(one)

        for other in others:
            region = self._regions.get(other)
            if region is None or region.shape != picture.region.shape or rank(other) >= rank(target):
                continue
            if (region & picture.region).sum() > SAME_PLACE * picture.region.sum():
                return other
        return None


def is_occupied() -> bool:
    """Whether a bake or a render has the scene."""
    return state.is_running() or any(map(bpy.app.is_job_running, ("RENDER", "OBJECT_BAKE")))


def is_looked_at(context) -> bool:
    """Whether a window shows materials: a 3D View in Material Preview or Rendered, or an Image Editor."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type == "IMAGE_EDITOR" or (area.type == "VIEW_3D" and space.shading.type in SHADED):
                return True
    return False


def redraw(context) -> None:
    """Have every area that shows images or says something of Live show the new state."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "IMAGE_EDITOR", "PROPERTIES", "NODE_EDITOR"}:
                area.tag_redraw()


class _Live:
    """The session of the process, if Live is on."""

    def __init__(self) -> None:
        self.session: Session | None = None
        self.scene_name = ""
        self.failure = ""  # why it was switched off
        self.kept: list[str] = []  # what there was to say of images then


live = _Live()


def messages() -> list[Message]:
    """Messages about Live for panels."""
    if live.session is not None:
        return live.session.messages()
    ended = [f"Live was switched off: {live.failure}"] if live.failure else []
    return [note("", text) for text in (*ended, *live.kept)]


def step(context) -> float:
    """What the timer does; seconds to the next time."""
    scene = context.scene
    if native.problem or scene is None or not scene.beamspread.use_live or scene.name != live.scene_name:
        end()
        if native.problem or scene is None or not scene.beamspread.use_live:
            return OFF_SECONDS
    if live.session is not None and not is_occupied() and live.session.waits_for_painter(context):
        return IDLE_SECONDS
    if not bpy.app.background and not is_looked_at(context):
        return IDLE_SECONDS
    if live.session is None:
        live.session, live.scene_name, live.failure, live.kept = Session(), scene.name, "", []
        previews.holder = live.session
    return BUSY_SECONDS if live.session.step(context) else IDLE_SECONDS


def end(keep_pixels: bool = False) -> None:
    """Switch off."""
    session, live.session = live.session, None
    if session is not None:
        session.end(keep_pixels)
        live.kept = [] if keep_pixels else session.kept()
        previews.holder = None


def _tick() -> float:
    try:
        return step(bpy.context)
    except Exception as error:  # noqa: BLE001 - Blender would drop the timer, and Live would be on and dead
        live.failure = text_of(error)
        end()
        bpy.context.scene.beamspread.use_live = False
        return OFF_SECONDS


@persistent
def _changed(_scene, depsgraph) -> None:
    is_ours = depsgraph.mode == "VIEWPORT" and depsgraph.scene.name == live.scene_name
    if live.session is not None and is_ours:
        live.session.note(depsgraph)


@persistent
def _undone(*_arguments) -> None:
    if live.session is not None:
        live.session.forget()


@persistent
def _leave_file(*_arguments) -> None:
    end(keep_pixels=True)


def _start() -> None:
    if not bpy.app.background:
        bpy.app.timers.register(_tick, first_interval=OFF_SECONDS, persistent=True)


def _stop() -> None:
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    end()


register, unregister = all_or_nothing(
    *handlers(
        depsgraph_update_post=_changed,
        frame_change_post=_changed,
        undo_post=_undone,
        redo_post=_undone,
        load_pre=_leave_file,
    ),
    (_start, _stop),
)
