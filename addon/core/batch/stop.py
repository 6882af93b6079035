"""Ctrl-C, and the end that a system asks for, while a batch runs."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """Whether a batch was asked to stop; true from then on."""

    def __init__(self) -> None:
        self._signal = 0

    def __bool__(self) -> bool:
        return bool(self._signal)

    def ask(self, signal_number: int, _frame: object = None) -> None:
        """Handler of signals; the next one of the kind ends the process at once."""
        self._signal = signal_number
        signal.signal(signal_number, signal.SIG_DFL)

    @property
    def exit_code(self) -> int:
        """As shells count them: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + self._signal


@contextmanager
def listening() -> Iterator[Stop]:
    """Have signals ask to stop, until the block ends."""
    stop = Stop()
    before = {number: signal.signal(number, stop.ask) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            # None where it is not one of Python's: Blender's own ends a render, of which there is none.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
