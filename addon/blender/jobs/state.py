"""What panels show of bakes: the one that runs, and how each target stands.

Operators and engines don't outlive their calls, and panels can't ask them; hence one object for the whole process.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from enum import Enum

from bpy.app.handlers import persistent

from ...core.bake.estimate import in_words
from ...core.bake.runner import CANCELLED, WRITTEN, Bake
from ...core.messages import Level, Message
from ...core.target import Target
from ..registration import all_or_nothing, handlers


class Status(Enum):
    """How a target stands, in the words of the panels."""

    NEVER = "Never baked"
    BAKED = "Baked"
    WARNED = "Baked, with warnings"
    FAILED = "Failed"
    CANCELLED = "Cancelled"
    STALE = "Out of date"
    RUNNING = "Baking"


@dataclass(frozen=True)
class Row:
    """A target, its status, the messages about it, and True if the bake in its image is out of date."""

    target: Target
    status: Status
    messages: tuple[Message, ...] = ()
    is_stale: bool = False


# The time that is left follows from the pace of the last seconds, once there are enough of them to tell. These are a
# part of the run's at least: what stands still for long, as Blender while it starts, would make it hours. So would what
# takes longer than it was reckoned to, and hardly moves by then: no longer than at the pace of the whole run.
PACE_SECONDS, PACE_PART, LEAST_PACE_SECONDS = 15.0, 0.5, 3.0


@dataclass
class Progress:
    """Of the run in the window.

    Attributes
    ----------
    doing : in words.
    own, everything : how far this bake and the run are, 0..1.
    seconds_left : of the run; None while nobody knows.
    """

    target: Target
    doing: str = ""
    own: float = 0.0
    everything: float = 0.0
    seconds_left: float | None = None

    def in_short(self) -> str:
        """How far the run is, and how long it will last."""
        left = f", {in_words(self.seconds_left)} left" if self.seconds_left is not None else ""
        return f"{self.everything:.0%}{left}"

    def in_words(self) -> str:
        """What is being done, and how long the run will last."""
        own, everything = f"{self.own:.0%}", f"{self.everything:.0%}"
        left = f", about {in_words(self.seconds_left)} left" if self.seconds_left is not None else ""
        return f"{self.doing or 'Baking'} {own}{f', all {everything}' if everything != own else ''}{left}"

    def in_a_line(self) -> str:
        return f"{self.target}: {self.in_words()} (Esc cancels)"


class State:
    """Progress, rows and messages."""

    def __init__(self) -> None:
        self.progress: Progress | None = None
        self.rows: dict[Target, Row] = {}
        self._paces: deque[tuple[float, float]] = deque()
        self._first: tuple[float, float] | None = None
        self._began = 0.0
        self._stop_asked = False
        self._last: dict[Target, Row] = {}

    def is_running(self) -> bool:
        """Whether a bake runs in the window."""
        return self.progress is not None

    def begin(self) -> None:
        """Note that a run begins."""
        self._paces.clear()
        self._first = None
        self._began = time.monotonic()
        self._stop_asked = False

    def start(self, subject: Target, everything: float = 0.0) -> None:
        left = self.progress.seconds_left if self.progress else None
        self.progress = Progress(subject, everything=everything, seconds_left=left)

    def update(self, own: float, everything: float, doing: str = "") -> None:
        """Note how far this bake and all bakes of the run are, 0..1, and what is being done."""
        if self.progress is None:
            return
        self.progress.doing, self.progress.own, self.progress.everything = doing, own, everything
        if self._stop_asked:
            self.progress.seconds_left = None
            return
        now = time.monotonic()
        self._paces.append((now, everything))
        self._first = self._first or (now, everything)
        while now - self._paces[0][0] > max(PACE_SECONDS, PACE_PART * (now - self._began)):
            self._paces.popleft()
        if now - self._paces[0][0] >= LEAST_PACE_SECONDS and everything > self._paces[0][1]:
            paces = ((everything - before) / (now - then) for then, before in (self._first, self._paces[0]))
            self.progress.seconds_left = (1 - everything) / max(paces)

    def stop(self) -> None:
        self.progress = None

    def ask_to_stop(self) -> None:
        """Have the run end soon."""
        self._stop_asked = True

    def should_stop(self) -> bool:
        return self._stop_asked

    def note(self, bake: Bake) -> None:
        """Keep what there is to say of a bake in place of what was said of its target before."""
        self._last.pop(Target(bake.target.object_name), None)  # while nothing of it could be baked
        status = {WRITTEN: Status.BAKED, CANCELLED: Status.CANCELLED}.get(bake.status, Status.FAILED)
        if bake.status != WRITTEN and not bake.error:
            return  # it is still to run
        if status == Status.BAKED and bake.messages.of(Level.WARNING):
            status = Status.WARNED
        # The status already says that the bake was cancelled.
        levels = (Level.WARNING, Level.INFO) if status == Status.CANCELLED else Level
        row = Row(bake.target, status, bake.messages.of(*levels))
        self._last[bake.target] = self.rows[bake.target] = row

    def status_of(self, target: Target) -> Row | None:
        """How its last bake since the file was opened ended."""
        return self._last.get(target)

    def failures(self) -> list[Row]:
        """Of the last bakes that failed or were cancelled."""
        return [row for row in self._last.values() if row.status in (Status.FAILED, Status.CANCELLED)]

    def forget_failures(self) -> None:
        """Before a run, which says anew what fails."""
        for row in self.failures():
            del self._last[row.target]

    def lines(self) -> list[str]:
        """All messages of the last bakes, each once, in one line each."""
        return list(dict.fromkeys(message.line() for row in self._last.values() for message in row.messages))

    def forget(self) -> None:
        self._last.clear()
        self.rows.clear()


state = State()


def redraw(context, *area_types: str) -> None:
    """Redraw the areas that show the state of bakes, and areas of these types."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "NODE_EDITOR", *area_types}:
                area.tag_redraw()


@persistent
def _forget(*_arguments) -> None:
    state.forget()


register, unregister = all_or_nothing(*handlers(load_pre=_forget))
