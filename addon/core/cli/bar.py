"""A progress bar for people: on a terminal, and nowhere else."""

from __future__ import annotations

import sys
import time

WIDTH = 30


class ProgressBar:
    """Callback for `progress=`; a context that leaves no trace of the bar behind.

    Parameters
    ----------
    title : what is going on.
    stream : where to draw; nothing is drawn unless it is a terminal. Default: stderr, so that results can be piped.
    """

    def __init__(self, title: str, stream=None) -> None:
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._visible = self._stream.isatty()
        self._drawn = ""
        self._start = time.monotonic()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_exception) -> None:
        if self._drawn:
            self._stream.write("\r" + " " * len(self._drawn) + "\r")
            self._stream.flush()

    def __call__(self, fraction: float) -> bool:
        if self._visible:
            seconds = int(time.monotonic() - self._start)
            filled = int(WIDTH * fraction)
            bar = "#" * filled + "." * (WIDTH - filled)
            line = f"{self._title} [{bar}] {int(100 * fraction):3d} %  {seconds // 60}:{seconds % 60:02d}"
            if line != self._drawn:
                self._stream.write("\r" + line)
                self._stream.flush()
                self._drawn = line
        return True
