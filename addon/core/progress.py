"""Progress of a job made of stages, each stage a callback of its own."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from .native import native

# Takes the fraction done, 0..1. Answering False (or NumPy's False_) stops the work, which then raises Cancelled; any
# other answer goes on, also None and 0. Only the native module and `ask` read the answers: all else passes them on.
Progress = Callable[[float], object]


def stages(progress: Progress | None, weights: list[float]) -> Iterator[Progress | None]:
    """Yield one callback per weight; together they run from 0 to 1. Raises ValueError for what can't be called."""
    if progress is not None and not callable(progress):
        raise ValueError(f"argument 'progress' is {progress!r}; allowed: a function of the finished fraction, or None")
    total, done = sum(weights) or 1.0, 0.0
    for weight in weights:
        yield _Stage(progress, done / total, weight / total) if progress is not None else None
        done += weight


class _Stage:
    """A part of the progress, from `start` on; what it does, it says to the whole."""

    def __init__(self, progress: Progress, start: float, length: float) -> None:
        self._progress, self._start, self._length = progress, start, length

    def __call__(self, fraction: float) -> object:
        return self._progress(min(1.0, self._start + self._length * fraction))

    def say(self, words: str) -> None:
        say(self._progress, words)


def ask(progress: Progress | None, fraction: float) -> None:
    """Tell how much is done, where Python does the work itself; raises Cancelled if that is to stop."""
    answer = None if progress is None else progress(fraction)
    if isinstance(answer, bool | np.bool_) and not answer:
        raise native.Cancelled("the bake was cancelled")


def say(progress: Progress | None, words: str) -> None:
    """Tell whoever watches what begins now, if the callback has a method `say(words)` beside being called."""
    listener = getattr(progress, "say", None)
    if listener is not None:
        listener(words)


@contextmanager
def timed(stage: str) -> Iterator[None]:
    """Log how long a stage of the work took: nothing shows it unless it is asked for (`batch.py --verbose`)."""
    import logging  # takes its time, and is only for this

    start = time.monotonic()
    yield
    logging.getLogger(__name__).info("%s: %.2f s", stage, time.monotonic() - start)
