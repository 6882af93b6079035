"""The bakes of one call of the operator: their steps, run in a thread or at once, stored, and told to the artist."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

from ....core.bake.bake_settings import COMBINED, FINAL, PREVIEW, BakeSettings
from ....core.bake.forecast import seconds_of, steps_of_bakes
from ....core.bake.runner import CANCELLED, WRITTEN, Bake, Sink
from ....core.errors import message_of
from ....core.messages import Level, Message, Messages, warning
from ....core.progress import Progress
from ....core.target import Target
from ...images.results import Results
from .. import announced
from ..out_of_date import stale
from ..out_of_date.fingerprint import Parts
from ..state import state
from .bake_plan import Plan


class Pass(Enum):
    """Purpose of a bake in its run: the only one of its target, its quick preview, or the bake after that preview."""

    SINGLE = 1
    PREVIEW = 2
    FINAL = 3


@dataclass(frozen=True)
class BakeStep:
    """One bake of a target in a run."""

    plan: Plan
    settings: BakeSettings
    purpose: Pass = Pass.SINGLE

    def bake(self) -> Bake:
        """The bake; call it in the main thread."""
        return self.plan.bake(self.settings)


def steps_of(plans: list[Plan], settings: BakeSettings, preview_first: bool) -> list[BakeStep]:
    """The steps of a run in their order.

    With `preview_first`, targets whose medium is not simulated yet get a quick preview: a quick simulation and direct
    light alone. They are baked once all targets have something to show. Targets that share an image with them take
    part in this, since a run fills each image as a whole.
    """
    quick = [plan for plan in plans if preview_first and settings.quality == FINAL and plan.to_simulate(settings)]
    images = {_image_key(plan) for plan in quick}
    twice = [plan for plan in plans if _image_key(plan) in images]
    first = []
    for plan in plans:
        changes = {"quality": PREVIEW} if plan in quick else {}
        changes |= {"indirect": False} if plan in twice else {}
        purpose = Pass.PREVIEW if plan in twice else Pass.SINGLE
        first.append(BakeStep(plan, replace(settings, **changes), purpose))
    return first + [BakeStep(plan, settings, Pass.FINAL) for plan in twice]


def _image_key(plan: Plan) -> str:
    """Equal for targets that fill the same image."""
    return f"image {plan.image}" if plan.image else f"material {plan.target.image_key}"


class BakeThread(threading.Thread):
    """Runs the job of one bake."""

    def __init__(self, bake: Bake, progress: Progress) -> None:
        super().__init__(daemon=True)
        self.bake, self.progress = bake, progress

    def run(self) -> None:
        self.bake.run(self.progress)


class BakeRun(Sink):
    """The bakes of one call of the operator.

    Attributes
    ----------
    written : targets whose results were stored.
    problems : messages that nobody should miss.
    """

    def __init__(self, report: Callable[[set[str], str], None], in_window: bool) -> None:
        self._report_to, self._in_window = report, in_window
        self._reported, self.problems = Messages(), Messages()
        self.written: list[Target] = []
        self._results, self._progress = Results(), Progress()
        self._steps: list[BakeStep] = []
        self._shares: list[Progress] = []
        self._number, self._purpose = 0, Pass.SINGLE
        self._parts: dict[Target, Parts] = {}

    def take(self, steps: list[BakeStep], parts: dict[Target, Parts]) -> None:
        """Take the steps of the run, and the digests of all that they have read of each target."""
        self._steps, self._parts = steps, parts
        expected = steps_of_bakes([(step.plan.forecast(), step.settings) for step in steps])
        self._progress = Progress()
        self._shares = self._progress.split(map(seconds_of, expected))
        for step, share, estimates in zip(steps, self._shares, expected):
            share.expect(partial(seconds_of, estimates))
            if step.purpose != Pass.PREVIEW:
                announced.compare(step.plan.target, estimates)

    def bakes(self) -> Iterator[Bake | None]:
        """The bakes in their order, until the run is cancelled."""
        for number, step in enumerate(self._steps, 1):
            self._number = number
            if step.purpose == Pass.FINAL and self._purpose == Pass.PREVIEW:
                self._write_waiting()
                self._results = Results()  # the same parts of the same images are filled again
            self._purpose = step.purpose
            yield self._results.admit(step.bake())
            if self._progress.is_cancelled:
                return

    def run(self, bake: Bake) -> Iterator[None]:
        if bake.job is None:
            return
        progress = self._shares[self._number - 1]
        if not self._in_window:
            bake.run(progress)
            return
        state.start(self._progress, bake.target, self._position())
        thread = BakeThread(bake, progress)
        thread.start()
        yield  # also if it has ended: only the modal part of an operator makes an undo step for scripts
        while thread.is_alive():
            yield

    def _position(self) -> str:
        """Number of the current bake and of all bakes; "" if there is one."""
        return f"{self._number} of {len(self._steps)}" if len(self._steps) > 1 else ""

    def store(self, bake: Bake) -> str:
        key = _image_key(self._steps[self._number - 1].plan)
        return self._results.store(bake, any(_image_key(step.plan) == key for step in self._steps[self._number :]))

    def _write_waiting(self) -> None:
        """Write the results that wait for others of their image."""
        for target, error in self._results.waiting.write():
            self.written = [other for other in self.written if other != target]
            bake = Bake(target, error=error)
            state.note(bake)
            self.fail(message_of(error, str(target)))

    def end(self, bake: Bake) -> None:
        if bake.status == CANCELLED and self._purpose == Pass.FINAL:
            text = f"The final bake of '{bake.target}' was cancelled: its quick preview is kept."
            self.report(warning(str(bake.target), text))
            return
        state.note(bake)
        if bake.status == WRITTEN:
            self.written.append(bake.target)
            if bake.job.settings.layer == COMBINED:
                stale.keep(bake, self._parts.get(bake.target), self._purpose == Pass.PREVIEW)
            if bake.is_dark:
                self.problems.add(*bake.messages.of(Level.WARNING))
        elif bake.status == CANCELLED:
            self.report(warning("", "The bake was cancelled: images keep their former pixels."))
        else:
            for message in bake.messages.of(Level.ERROR):
                self.fail(message)
        for message in bake.messages.of(Level.WARNING, Level.INFO):
            self.report(message)

    def close(self) -> None:
        """End the run, also after an error."""
        self._write_waiting()

    def is_successful(self) -> bool:
        """True if the run has results."""
        return bool(self.written)

    def summary(self) -> str:
        """The results of the run in one line."""
        return f"Baked {', '.join(map(str, dict.fromkeys(self.written)))}"

    def fail(self, message: Message) -> None:
        self.report(message)
        self.problems.add(message)

    def report(self, message: Message) -> None:
        """Show a message in the Info editor and the console, once."""
        if message in self._reported:
            return
        self._reported.add(message)
        # In the window our own popup shows errors: Blender would open a second one for them.
        is_error = message.level == Level.ERROR
        self._report_to({"WARNING" if is_error and self._in_window else message.level.value}, message.line())
