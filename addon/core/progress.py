"""Progress of a job made of stages, each stage a callback of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator

# Takes the fraction done, 0..1; returning False stops the work, which then raises Cancelled.
Progress = Callable[[float], bool]


def stages(progress: Progress | None, weights: list[float]) -> Iterator[Progress | None]:
    """Yield one callback per weight; together they run from 0 to 1."""
    total, done = sum(weights) or 1.0, 0.0
    for weight in weights:
        yield _stage(progress, done / total, weight / total) if progress else None
        done += weight


def _stage(progress: Progress, start: float, length: float) -> Progress:
    # Native code takes anything but False for "go on"; so does this.
    return lambda fraction: progress(min(1.0, start + length * fraction)) is not False
