"""The thread that paints: quickly while subjects change, exactly once they rest."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Sequence

from ..errors import text_of
from ..native import native
from ..progress import Progress
from ..target import Target
from .media import Media
from .pace import SIDES, Pace
from .picture import Picture, Studio
from .subject import Subject

# So long after the last change all texels are painted exactly.
REST_SECONDS = 0.4


class Painter:
    """Paints what it was last asked to show.

    A quick picture is always finished, so that pictures come while changes do; an exact one stops at the next change.
    """

    def __init__(self, rest_seconds: float = REST_SECONDS) -> None:
        self._pictures: queue.SimpleQueue[tuple[int, Picture]] = queue.SimpleQueue()
        self.media = Media(self._repaint)
        self._studio = Studio(self.media)
        self._rest_seconds = rest_seconds
        self._condition = threading.Condition()
        self._subjects: tuple[Subject, ...] = ()
        self._generation, self._done = 0, 0
        self._is_ending = False
        self._epoch = 0  # counts adoptions
        self._epochs: dict = {}  # by target: of its last adoption
        self._adopted: dict = {}  # by target: key
        self._painted: dict = {}  # by target: key, whether with libraries of their own, whether exact
        self._surfaces: dict = {}  # by target, as painted last
        self.paces: dict = {}  # by target and whether its surface is that of the picture before
        self._thread = threading.Thread(target=self._run, daemon=True, name="Beamspread painter")
        self._thread.start()

    def show(self, subjects: Sequence[Subject]) -> None:
        """Paint these from now on, in this order, in place of those before."""
        with self._condition:
            self._subjects = tuple(subjects)
            self._generation += 1
            self._condition.notify_all()

    def adopt(self, subjects: Sequence[Subject]) -> None:
        """Take these as painted already, and exactly; no older picture of them will come any more."""
        with self._condition:
            self._epoch += 1
            for subject in subjects:
                self._epochs[subject.target] = self._epoch
                self._adopted[subject.target] = subject.key

    def take(self) -> dict[Target, Picture]:
        """The last picture of each target that was painted since the last time."""
        latest = {}
        while not self._pictures.empty():
            epoch, picture = self._pictures.get()
            if epoch >= self._epochs.get(picture.subject.target, 0):
                latest[picture.subject.target] = picture
        return latest

    def is_busy(self) -> bool:
        """Whether pictures are still to come."""
        return self._done < self._generation or not self._pictures.empty() or self.media.is_busy()

    def end(self) -> None:
        """Stop soon, whatever is being painted."""
        self.media.end()
        with self._condition:
            self._is_ending = True
            self._condition.notify_all()

    def join(self, seconds: float) -> bool:
        """Whether all threads have ended within this time."""
        self._thread.join(seconds)
        return self.media.join(seconds) and not self._thread.is_alive()

    def _repaint(self) -> None:
        with self._condition:
            self._generation += 1
            self._condition.notify_all()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._done < self._generation or self._is_ending)
                if self._is_ending:
                    return
                subjects, generation = self._subjects, self._generation
            try:
                if self._paint(subjects, generation):
                    self._done = generation
            except native.Cancelled:
                continue

    def _paint(self, subjects: Sequence[Subject], generation: int) -> bool:
        """All of them; False where others are wanted meanwhile."""
        missing: dict = {}
        for subject in subjects:
            if self._is_stale(generation):
                return False
            self._paint_one(subject, missing)
        self.media.want(list(missing))
        with self._condition:
            if self._condition.wait_for(lambda: self._is_stale(generation), self._rest_seconds):
                return False
        for subject in subjects:
            if self._painted[subject.target][2]:
                continue
            if self.paces[subject.target, True].side() < SIDES[-1] < max(self._studio.size_of(subject)):
                # A look before what may take long.
                self._put(subject, lambda subject: self._studio.quick(subject, SIDES[-1], self._until(generation)))
            self._put(subject, lambda subject: self._studio.exact(subject, self._until(generation)))
            self._note(subject, is_exact=True)
        return True

    def _paint_one(self, subject: Subject, missing: dict) -> None:
        lacking = self._lacking(subject)
        missing.update(dict.fromkeys(lacking))
        known = self._painted.get(subject.target)
        if self._adopted.pop(subject.target, None) == subject.key:
            known = self._painted[subject.target] = subject.key, not lacking, True
        if known is not None and known[:2] == (subject.key, not lacking):
            return
        for is_same in (True, False):
            self.paces.setdefault((subject.target, is_same), Pace())
        # A new medium takes longer, as its kernels have to be made.
        is_same = self._surfaces.get(subject.target) == subject.surface
        self._surfaces[subject.target] = subject.surface
        pace, made = self.paces[subject.target, is_same], self._studio.fields.made
        side = pace.side()
        start = time.perf_counter()
        has_failed = not self._put(
            subject, lambda subject: self._studio.quick(subject, side, lambda _: not self._is_ending)
        )
        if self._studio.fields.made == made or not is_same:
            pace.note(side, time.perf_counter() - start)
        # What went wrong would go wrong again.
        self._note(subject, is_exact=has_failed)

    def _lacking(self, subject: Subject) -> list:
        try:
            return self._studio.missing(subject)
        except ValueError:
            return []  # painting says why

    def _note(self, subject: Subject, is_exact: bool) -> None:
        self._painted[subject.target] = subject.key, not self._lacking(subject), is_exact

    def _put(self, subject: Subject, paint) -> bool:
        """Whether nothing went wrong, of which the picture tells."""
        epoch = self._epoch
        try:
            picture = paint(subject)
        except native.Cancelled:
            raise
        except Exception as error:  # noqa: BLE001 - the window says it, and the others are still to be painted
            picture = Picture(subject, error=text_of(error))
        self._pictures.put((epoch, picture))
        return not picture.error

    def _until(self, generation: int) -> Progress:
        return lambda _fraction: not self._is_stale(generation)

    def _is_stale(self, generation: int) -> bool:
        return self._is_ending or self._generation != generation
