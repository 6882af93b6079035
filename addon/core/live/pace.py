"""How fine a picture may be to come in time."""

from __future__ import annotations

# Texels along the longer side of quick pictures, and the seconds that one may take.
SIDES, BUDGET_SECONDS = (64, 128, 256, 512), 0.08
FIRST_SIDE = 256

# Of a side not tried yet, over the seconds of the next smaller one: less than four times, as not all depends on texels.
GROWTH = 2.5

# What is left, a picture later, of the seconds that another side once took: too slow once is not too slow for ever.
MEMORY = 0.95


class Pace:
    """Chooses sides by the seconds that pictures have taken."""

    def __init__(self) -> None:
        self._seconds: dict[int, float] = {}

    def side(self) -> int:
        """Of the next picture."""
        if not self._seconds:
            return FIRST_SIDE
        return max((side for side in SIDES if self._expected(side) <= BUDGET_SECONDS), default=SIDES[0])

    def note(self, side: int, seconds: float) -> None:
        """Take what a picture of this side has taken."""
        self._seconds = {one: MEMORY * before for one, before in self._seconds.items()} | {side: seconds}

    def _expected(self, side: int) -> float:
        if side in self._seconds:
            return self._seconds[side]
        smaller = [one for one in self._seconds if one < side]
        if not smaller:
            return 0.0  # a larger one is known
        return self._seconds[max(smaller)] * GROWTH ** (SIDES.index(side) - SIDES.index(max(smaller)))
