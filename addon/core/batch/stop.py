"""Stopping a batch by Ctrl-C or SIGTERM."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Stop:
    """True once a signal has asked the batch to stop."""

    def __init__(self) -> None:
        self._signal = 0

    def __bool__(self) -> bool:
        return bool(self._signal)

    def ask(self, signal_number: int, _frame: object = None) -> None:
        """Handle a signal. A second signal of the same kind ends the process at once."""
        self._signal = signal_number
        signal.signal(signal_number, signal.SIG_DFL)

    @property
    def exit_code(self) -> int:
        """Exit code as in shells: 130 for Ctrl-C, 143 for SIGTERM."""
        return 128 + self._signal


@contextmanager
def listening() -> Iterator[Stop]:
    """Let signals ask the batch to stop, until the block ends."""
    stop = Stop()
    before = {number: signal.signal(number, stop.ask) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            # None stands for a handler of Blender's own, which ends renders; there is none here.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
