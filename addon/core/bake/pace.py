"""Pace: seconds that steps of this session took, over their estimates. It corrects later estimates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass


class Pace:
    """Ratios of measured to estimated seconds, in memory.

    They are kept by kind of step and by subject, such as an object: its own last ratio counts for a subject, and the
    mean of all others for one that was not measured yet.
    """

    MIN_SECONDS = 0.1
    """Seconds that a step takes at least, or was estimated to take, to count; shorter ones tell little."""

    LARGEST = 100.0
    """Largest ratio, and the inverse of the smallest one."""

    MACHINE = 4.0
    """Largest ratio, and the inverse of the smallest one, that other scenes are told; larger: more mistakes there."""

    def __init__(self) -> None:
        self._ratios: dict[str, dict[str, float]] = {}
        self._means: dict[str, float] = {}  # for other subjects, by kind

    def note(self, kind: str, subject: str, estimated: float, measured: float) -> None:
        """Note how long a step took, and its estimate without this correction."""
        if estimated > 0 and max(estimated, measured) >= self.MIN_SECONDS:
            self._keep(kind, {subject: _within(measured / estimated, self.LARGEST)})

    def _keep(self, kind: str, ratios: Mapping[str, float]) -> None:
        known = self._ratios[kind] = {**self._ratios.get(kind, {}), **ratios}
        # One more of ratio 1: few measurements of others say little about a subject.
        self._means[kind] = math.exp(sum(map(math.log, known.values())) / (len(known) + 1))

    def corrected(self, kind: str, subject: str, estimated: float) -> float:
        """The estimate for a step at the pace of this session."""
        ratio = self._ratios.get(kind, {}).get(subject)
        return estimated * (self._means.get(kind, 1.0) if ratio is None else ratio)

    def has_measured(self, kind: str, subject: str) -> bool:
        """True if there is a ratio of this subject."""
        return subject in self._ratios.get(kind, {})

    def ratios_of(self, subject: str) -> dict[str, float]:
        """The ratios of a subject by kind of step, for `recall`."""
        return {kind: ratios[subject] for kind, ratios in self._ratios.items() if subject in ratios}

    def recall(self, subject: str, ratios: Mapping[str, float]) -> None:
        """Take ratios of an earlier session, by kind of step, for what this session has not measured."""
        for kind, ratio in ratios.items():
            if not self.has_measured(kind, subject):
                self._keep(kind, {subject: ratio})

    def forget_subjects(self) -> None:
        """Keep the mean of all subjects alone: another scene may have others of the same names."""
        for kind, ratios in list(self._ratios.items()):
            mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
            self._ratios[kind] = {}
            self._keep(kind, {"": _within(mean, self.MACHINE)})

    def forget(self) -> None:
        """Forget all ratios."""
        self._ratios.clear()
        self._means.clear()


def _within(ratio: float, limit: float) -> float:
    return min(max(ratio, 1 / limit), limit)


pace = Pace()
"""The pace of this process."""


@dataclass(frozen=True)
class Estimate:
    """Seconds of a step, before they are corrected by the pace; see `Pace` for its kind and subject."""

    kind: str
    subject: str
    seconds: float

    def corrected(self) -> float:
        """Seconds at the pace of this session."""
        return pace.corrected(self.kind, self.subject, self.seconds)

    def is_measured(self) -> bool:
        """True if such a step of this subject was measured."""
        return pace.has_measured(self.kind, self.subject)

    def compare(self, measured: float) -> None:
        """Note how many seconds the step took."""
        pace.note(self.kind, self.subject, self.seconds, measured)
