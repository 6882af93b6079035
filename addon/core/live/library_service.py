"""Libraries for Live: those at hand at once, all others after a simulation in the background."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection

from ..ldf import library as libraries
from ..native import native
from ..recent import keep_recent

MAX_LIBRARIES = 12
"""Number of libraries in memory, some megabytes each; more keep media of more objects at hand."""

PATIENCE_SECONDS = 0.5
"""Seconds that media stay unchanged before they are simulated; more simulates fewer media under a slider."""


class LibraryService:
    """Serves libraries of media, and simulates missing ones in preview quality.

    Parameters
    ----------
    on_new_library : called from another thread after a simulation.

    Attributes
    ----------
    simulating : the medium that is simulated now, in words; "" if none is.
    """

    def __init__(self, on_new_library: Callable[[], None] = lambda: None) -> None:
        self._simulated: dict = {}  # libraries by medium and `curved`
        self._on_new_library = on_new_library
        self._condition = threading.Condition()
        self._requested: tuple = ()
        self._is_ending = False
        self._thread: threading.Thread | None = None
        self.simulating = ""

    def serve(self, medium, curved: bool = False):
        """The library of a medium, with curved surfaces if `curved`; None if it needs a simulation first."""
        library = self._simulated.get((medium, curved)) or libraries.known_library(medium, curved)
        return library and keep_recent(self._simulated, (medium, curved), library, MAX_LIBRARIES)

    def request(self, media: Collection, curved: Collection = ()) -> None:
        """Simulate these media in the background, and no others any more; `curved` are those with curved surfaces."""
        requested = (*((medium, False) for medium in media), *((medium, True) for medium in curved))
        with self._condition:
            if requested == self._requested:
                return
            self._requested = requested
            if self._requested and self._thread is None and not self._is_ending:
                self._thread = threading.Thread(target=self._run, daemon=True, name="Beamspread media")
                self._thread.start()
            self._condition.notify_all()

    def is_busy(self) -> bool:
        """True while requested media are without a library."""
        return bool(self._requested)

    def end(self) -> None:
        """Have the thread stop soon."""
        with self._condition:
            self._requested, self._is_ending = (), True
            self._condition.notify_all()

    def join(self, seconds: float) -> bool:
        """Wait for the thread; True if it has ended within this time."""
        if self._thread is not None:
            self._thread.join(seconds)
        return self._thread is None or not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._requested or self._is_ending)
                if self._is_ending:
                    return
                requested = self._requested
                self._condition.wait(PATIENCE_SECONDS)
                if self._requested != requested:
                    continue
            for medium, curved in requested:
                self._simulate(medium, curved)

    def _simulate(self, medium, curved: bool) -> None:
        self.simulating = f"g {medium.g:g}, IOR {medium.ior:g}"
        try:
            wanted = medium, curved
            library = libraries.library(medium, "preview", lambda _fraction: wanted in self._requested, curved=curved)
        except native.Cancelled:
            return
        finally:
            self.simulating = ""
        keep_recent(self._simulated, wanted, library, MAX_LIBRARIES)
        self._on_new_library()
        with self._condition:
            self._requested = tuple(waiting for waiting in self._requested if waiting != wanted)
