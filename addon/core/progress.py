"""Progress of a job and of its stages, and the cancellation of both."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import numpy as np

from .native import native

Callback = Callable[[float], object]
"""Takes the finished fraction, 0..1. The answer False (or NumPy's) cancels the work; any other lets it go on."""

MIN_SECONDS = 3.0
"""Seconds after which the time left is estimated; longer is steadier."""


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
        self._stage_part, self._stage_began = self, time.monotonic()

    @staticmethod
    def of(progress: Progress | Callback | None) -> Progress:
        """The progress itself, or a new one for a callback of the caller."""
        return progress if isinstance(progress, Progress) else Progress(progress)

    def split(self, weights: Iterable[float]) -> list[Progress]:
        """Parts whose lengths are proportional to the weights; together they run from 0 to 1."""
        weights = list(weights)
        parts, done, total = [], 0.0, sum(weights) or 1.0
        for weight in weights:
            part = Progress()
            part._whole = self._whole
            part._start, part._length = self._start + self._length * done / total, self._length * weight / total
            parts.append(part)
            done += weight
        return parts

    def begin(self, stage: str) -> None:
        """Begin a stage with this part."""
        whole = self._whole
        if (whole.stage, whole._stage_part) != (stage, self):
            whole.stage, whole._stage_part, whole._stage_began = stage, self, time.monotonic()

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
        """Estimate of the seconds that the current stage still takes, at its speed so far; None if unknown."""
        seconds, fraction = time.monotonic() - self._whole._stage_began, self.stage_fraction
        return seconds * (1 - fraction) / fraction if seconds >= MIN_SECONDS and fraction > 0 else None


@contextmanager
def timed(stage: str) -> Iterator[None]:
    """Log the seconds that a stage takes (`batch.py --verbose` shows them)."""
    start = time.monotonic()
    yield
    log(f"{stage}: {time.monotonic() - start:.2f} s")


def log(line: str) -> None:
    """Log a line about a bake."""
    import logging  # it takes time, and only this needs it

    logging.getLogger(__name__).info(line)
