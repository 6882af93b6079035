"""Progress of a job and of its stages, and the cancellation of both."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import numpy as np

from .native import native
from .time_left import TimeLeft

Callback = Callable[[float], object]
"""Takes the finished fraction, 0..1. The answer False (or NumPy's) cancels the work; any other lets it go on."""

ROUNDING = 1e-9
"""Fraction of a whole by which parts that follow each other may seem to overlap."""


class Progress:
    """Progress of a job. The parts that `split` returns report to the whole.

    Code that does the work calls a part with its finished fraction; any thread may read the whole, and cancel it.

    Attributes
    ----------
    fraction : finished fraction of the whole, 0..1; it never falls.
    stage : name of the current stage.
    """

    def __init__(self, callback: Callback | None = None) -> None:
        if callback is not None and not callable(callback):
            allowed = "a function of the finished fraction, or None"
            raise ValueError(f"argument 'progress' is {callback!r}; allowed: {allowed}")
        self.fraction, self.stage, self._is_cancelled = 0.0, "", False
        self._callback = callback
        self._whole, self._start, self._length = self, 0.0, 1.0
        self._began = time.monotonic()
        self._stage_part, self._stage_began = self, self._began
        self._parts: list[Progress] = []
        self._expected: Callable[[], float] | None = None
        self._time_left = TimeLeft()

    @staticmethod
    def of(progress: Progress | Callback | None) -> Progress:
        """The progress itself, or a new one for a callback of the caller."""
        return progress if isinstance(progress, Progress) else Progress(progress)

    def split(self, lengths: Iterable[float]) -> list[Progress]:
        """Parts whose lengths are proportional to these, as seconds; together they run from 0 to 1."""
        lengths = list(lengths)
        parts, done, total = [], 0.0, sum(lengths) or 1.0
        for length in lengths:
            part = Progress()
            part._whole = self._whole
            part._start, part._length = self._start + self._length * done / total, self._length * length / total
            if self._expected is not None:
                part._expected = lambda share=length / total: self._expected() * share
            parts.append(part)
            done += length
        self._parts = parts
        return parts

    def expect(self, seconds: Callable[[], float]) -> None:
        """Set the function that estimates the seconds of this part. It may change its mind until the part begins."""
        self._expected = seconds

    def begin(self, stage: str) -> None:
        """Begin a stage with this part."""
        whole = self._whole
        if (whole.stage, whole._stage_part) != (stage, self):
            whole.stage, whole._stage_part, whole._stage_began = stage, self, time.monotonic()
            whole._time_left.begin_stage()

    def __call__(self, fraction: float) -> bool:
        """Report the finished fraction of this part; False if the work is to stop."""
        whole = self._whole
        whole.fraction = max(whole.fraction, min(1.0, self._start + self._length * fraction))
        if whole._callback is not None:
            answer = whole._callback(whole.fraction)
            whole._is_cancelled |= isinstance(answer, bool | np.bool_) and not answer
        return not whole._is_cancelled

    def check(self, fraction: float) -> None:
        """Report the finished fraction; raises Cancelled if the work is to stop."""
        if not self(fraction):
            raise native.Cancelled("the bake was cancelled")

    def cancel(self) -> None:
        """Have the work stop soon."""
        self._whole._is_cancelled = True

    @property
    def is_cancelled(self) -> bool:
        """True if the work is to stop."""
        return self._whole._is_cancelled

    @property
    def stage_fraction(self) -> float:
        """Finished fraction of the current stage."""
        part = self._whole._stage_part
        done = self._whole.fraction - part._start
        return min(max(done / part._length, 0.0), 1.0) if part._length else 1.0

    def seconds_left(self) -> float | None:
        """Estimate of the seconds that the whole still takes; None if unknown."""
        return self._whole._show()[0]

    def words_left(self) -> str:
        """The time that the whole still takes as a window shows it, without ever growing; "" if unknown."""
        return "" if self._whole._show()[0] is None else self._whole._time_left.words()

    def time_fraction(self) -> float:
        """Finished fraction of the time that the whole takes; it never falls. The finished work if that is unknown."""
        return self._whole._show()[1]

    def _show(self) -> tuple[float | None, float]:
        expected = self._stage_part._seconds()
        if expected is None:
            return None, self.fraction
        now, part = time.monotonic(), self._stage_part
        later = self._seconds_after(part._start + part._length, part)
        stage = now - self._stage_began, expected, self.stage_fraction
        return self._time_left.update(now, now - self._began, *stage, later)

    def _seconds(self) -> float | None:
        """Estimate of the seconds that this part takes in all; None if unknown."""
        if self._expected is None and self._parts:
            seconds = [part._seconds() for part in self._parts]
            return None if None in seconds else sum(seconds)
        return None if self._expected is None else self._expected()

    def _seconds_after(self, point: float, current: Progress) -> float:
        """Estimate of the seconds of the parts of this one that begin at a point of the whole, or later."""
        if self is current or self._start + self._length < point:
            return 0.0
        if self._parts:
            return sum(part._seconds_after(point, current) for part in self._parts)
        return (self._seconds() or 0.0) if self._start >= point - ROUNDING else 0.0


@contextmanager
def timed(stage: str, estimate: float = 0.0) -> Iterator[None]:
    """Log the seconds that a stage takes, and their estimate if there is one (`batch.py --verbose` shows them)."""
    start = time.monotonic()
    yield
    estimated = f", estimated {estimate:.2f} s" if estimate else ""
    log(f"{stage}: {time.monotonic() - start:.2f} s{estimated}")


def log(line: str) -> None:
    """Log a line about a bake."""
    import logging  # it takes time, and only this needs it

    logging.getLogger(__name__).info(line)
