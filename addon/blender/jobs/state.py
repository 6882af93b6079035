"""State of bakes for panels: the progress of the run in the window, and the status of each target.

Operators and engines do not outlive their calls; hence one object for the whole process.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from bpy.app.handlers import persistent

from ...core.bake.pace import Estimate, pace
from ...core.bake.runner import CANCELLED, WRITTEN, Bake
from ...core.bake.spread import Spread
from ...core.bake.surroundings import Surroundings
from ...core.errors import BakeError
from ...core.messages import Level, Message
from ...core.progress import Progress
from ...core.target import Target
from ..registration import all_or_nothing, handlers


class Status(Enum):
    """Status of a target, in the words of the panels."""

    NEVER = "Never baked"
    REFUSED = "Can't be baked"
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


@dataclass(frozen=True)
class Announced:
    """How long a bake will take.

    Attributes
    ----------
    steps : estimates of its steps.
    simulations : estimates of the simulations that it needs first, by medium and quality: bakes share them.
    spread : how far light spreads in the image; None if the result is not luminance.
    around : surroundings of the object by rays; None if none were traced.
    """

    steps: tuple[Estimate, ...]
    simulations: dict[object, Estimate]
    spread: Spread | None = None
    around: Surroundings | None = None


@dataclass(frozen=True)
class Run:
    """The run in the window.

    Attributes
    ----------
    progress : of all bakes of the run.
    target : target of the current bake.
    position : number of the current bake and of all bakes: "2 of 5"; "" if there is one.
    """

    progress: Progress
    target: Target
    position: str = ""

    def stage(self) -> str:
        """Name of the current stage."""
        return "Stopping" if self.progress.is_cancelled else self.progress.stage or "Preparing"

    def title(self) -> str:
        """Stage and target of the run."""
        return f"{self.stage()}: {self.target}{f' ({self.position})' if self.position else ''}"

    def in_short(self) -> str:
        """Finished part of the run, and the time that it still takes."""
        left = "" if self.progress.is_cancelled else self.progress.words_left()
        return f"{self.progress.time_fraction():.0%}{left and f', {left}'}"

    def line(self) -> str:
        return f"{self.title()}, {self.in_short()} (Esc cancels)"


class State:
    """The run in the window, the rows of the panels, and the last bakes.

    Attributes
    ----------
    run : the run in the window, or None.
    rows : status of each target of the scene; `out_of_date.stale` keeps them up to date.
    announced : how long bakes of targets will take; so does this.
    refused : reasons why targets can't be baked that are known beforehand; so does this.
    frozen : warnings about bakes that stand still while the light moves; and this.
    factors : estimates once a scene was read, relative to those without its meshes, by target and kind of step.
    """

    def __init__(self) -> None:
        self.run: Run | None = None
        self.rows: dict[Target, Row] = {}
        self.announced: dict[Target, Announced] = {}
        self.refused: dict[Target, BakeError] = {}
        self.frozen: tuple[Message, ...] = ()
        self.factors: dict[tuple[Target, str], float] = {}
        self._last: dict[Target, Row] = {}

    def is_running(self) -> bool:
        """True while a bake runs in the window."""
        return self.run is not None

    def start(self, progress: Progress, target: Target, position: str = "") -> None:
        """Note that a bake begins in the window."""
        self.run = Run(progress, target, position)

    def stop(self) -> None:
        """Note that the run in the window has ended."""
        self.run = None

    def ask_to_stop(self) -> None:
        """Have the run in the window end soon."""
        if self.run is not None:
            self.run.progress.cancel()

    def note(self, bake: Bake) -> None:
        """Replace the messages about the bake's target by those of the bake."""
        self._last.pop(Target(bake.target.object_name), None)  # an error about the whole object
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
        """How the last bake of a target ended since the file was opened."""
        return self._last.get(target)

    def failures(self) -> list[Row]:
        """Rows of the last bakes that failed or were cancelled."""
        return [row for row in self._last.values() if row.status in (Status.FAILED, Status.CANCELLED)]

    def forget_failures(self) -> None:
        """Forget failures before a run, which notes its own."""
        for row in self.failures():
            del self._last[row.target]

    def lines(self) -> list[str]:
        """All messages of the last bakes, each once, in one line each."""
        return list(dict.fromkeys(message.line() for row in self._last.values() for message in row.messages))

    def forget(self) -> None:
        self._last.clear()
        self.rows.clear()
        self.announced.clear()
        self.refused.clear()
        self.frozen = ()
        self.factors.clear()


state = State()


def redraw(context, *area_types: str) -> None:
    """Redraw the areas that show the state of bakes, and areas of these types; of 3D Views the side bar alone."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "NODE_EDITOR", *area_types}:
                area.tag_redraw()
            elif area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def restart_views(context) -> None:
    """Have views of EEVEE start their picture again, since they don't see that pixels of an image changed.

    The picture is the mean of some frames: those with former pixels would stay in it as a ghost. Cycles starts again
    with a new image.
    """
    for window in context.window_manager.windows:
        is_cycles = window.scene.render.engine == "CYCLES"
        for area in window.screen.areas:
            shading = area.spaces.active.shading if area.type == "VIEW_3D" else None
            if shading is not None and (shading.type == "MATERIAL" or (shading.type == "RENDERED" and not is_cycles)):
                shading.type = str(shading.type)  # an equal value starts it again, too


@persistent
def _forget(*_arguments) -> None:
    state.forget()
    pace.forget_subjects()


register, unregister = all_or_nothing(*handlers(load_pre=_forget))
