"""The time that a run still takes: from estimates of its stages, and from how fast they go."""

from __future__ import annotations

import math

OVERRUN = 0.15
"""Seconds that a stage is expected to go on for each second so far, once its estimate is over. Larger: longer times."""

RECENT = 0.7
"""Fraction of a stage's time so far that its speed is taken from. Larger: steadier, slower to follow another speed."""

LONGEST = 2.0
"""Largest number of times that a stage is expected to take its time so far and its estimate once more."""

FOLLOWING = 0.05
"""Fraction of a run's time within which the time left that is shown follows a new estimate; longer is steadier."""

MAX_LOOKS = 200
"""Number of earlier fractions that are kept of a stage."""

MARGIN = 0.25
"""Part by which the time left is shown longer than it is estimated; larger: more runs end early, fewer late."""

SLACK = 0.25, 1.0
"""Part of the time shown, and seconds, by which the estimate, or the time for which it stands, may exceed it unsaid."""

MINUTES = 120
"""Seconds from which on the time left is shown in minutes."""


class TimeLeft:
    """The time left as it is shown: it follows estimates without jumps."""

    def __init__(self) -> None:
        self._left: float | None = None
        self._fraction = self._time = 0.0
        self._looks: list[tuple[float, float]] = []
        self._shown, self._shown_since = math.inf, 0.0
        self._is_longer = False

    def begin_stage(self) -> None:
        """Forget the speed of the stage before."""
        self._looks = []

    def update(
        self, now: float, lasted: float, stage_lasted: float, expected: float, fraction: float, later: float
    ) -> tuple[float, float]:
        """Seconds left of the run, and the finished fraction of its time, which never falls.

        Parameters
        ----------
        now, lasted, stage_lasted : time of a clock; seconds since the run and its stage began.
        expected, fraction : estimate of the stage's seconds in all, and its finished fraction.
        later : estimate of the seconds of all stages that follow.
        """
        left = later + stage_left(expected, stage_lasted, fraction, self._by_speed(stage_lasted, fraction))
        if self._left is not None:
            passed = max(now - self._time, 0.0)
            steady = max(self._left - passed, 0.0)
            left = steady + (left - steady) * -math.expm1(-passed / (FOLLOWING * (lasted + max(left, steady, 1e-9))))
        self._left, self._time = left, now
        self._fraction = max(self._fraction, lasted / max(lasted + left, 1e-9))
        self._show(now, left)
        return left, self._fraction

    def words(self) -> str:
        """The time left as a window shows it, such as "about 8 s left"; "" before the first update.

        Its number never grows: if the estimate does, it stays, as the least time that is left.
        """
        if math.isinf(self._shown):
            return ""
        number = duration(self._shown) if self._shown >= MINUTES else f"{self._shown:.0f} s"
        return f"{'over' if self._is_longer else 'about'} {number} left"

    def _show(self, now: float, left: float) -> None:
        shown = rounded_up((1.0 + MARGIN) * left)
        if shown < self._shown:
            self._shown, self._shown_since = shown, now
        part, seconds = SLACK
        most = (1.0 + part) * self._shown + seconds
        # The words change back only once the number holds again, or they would flicker.
        too_long = left > (self._shown if self._is_longer else most)
        self._is_longer = too_long or now - self._shown_since > most

    def _by_speed(self, lasted: float, fraction: float) -> float | None:
        """Seconds left of a stage at its recent speed; None if it has not gone on recently."""
        looks = self._looks
        looks.append((lasted, fraction))
        if len(looks) > MAX_LOOKS:
            del looks[::2]
        since = (1 - RECENT) * lasted
        before, done = next((look for look in reversed(looks) if look[0] <= since), (0.0, 0.0))
        return (1.0 - fraction) * (lasted - before) / (fraction - done) if fraction > done else None


def stage_left(expected: float, lasted: float, fraction: float, by_speed: float | None) -> float:
    """Estimate of the seconds that a stage still takes.

    Its estimate counts at first. The more of its time has passed, or the more is finished, the more its speed counts;
    fractions that are reported at uneven speed matter little thus.
    """
    by_plan = max(expected - lasted, OVERRUN * lasted)
    if by_speed is None:
        return by_plan
    weight = min(max(fraction, (lasted / expected) ** 2 if expected > 0 else 1.0), 1.0)
    return (1.0 - weight) * by_plan + weight * min(by_speed, LONGEST * (lasted + expected))


def rounded_up(seconds: float) -> float:
    """The next longer time that is worth a look of its own: 1, 5 or 15 seconds, a minute or an hour."""
    for longest, step in ((10, 1), (60, 5), (MINUTES, 15), (3600, 60), (math.inf, 3600)):
        rounded = step * max(math.ceil(seconds / step - 1e-9), 1)
        if rounded <= longest:
            return float(rounded)
    return seconds


def duration(seconds: float) -> str:
    """A length of time, rounded as one would say it."""
    if seconds < 59.5:
        return f"{max(1, round(seconds))} s"
    if seconds < 3600:
        return f"{round(seconds / 60)} min"
    if seconds < 48 * 3600:
        return f"{seconds / 3600:.0f} h"
    return f"{seconds / 86400:.0f} days"
