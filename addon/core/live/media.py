"""The library of a medium if it is at hand, or the nearest one while its own is simulated in the background."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Collection
from pathlib import Path

from ..ldf import library as libraries
from ..native import native
from ..recent import keep_recent

# Libraries in memory, those used last: some megabytes each.
MOST_KEPT = 12

# A medium that changes again sooner, as under a slider, is not worth a simulation.
PATIENCE_SECONDS = 0.5

# Of the distance between media: anisotropy, index of refraction, and logarithm of thickness, at most `FARTHEST_DEPTH`.
WEIGHTS, FARTHEST_DEPTH = (2.0, 3.0, 0.3), 5.0


class Media:
    """Libraries at hand; `on_news` is called, from another thread, when there is a new one."""

    def __init__(self, on_news: Callable[[], None] = lambda: None) -> None:
        self._known: dict = {}  # by medium: its own library
        self._stand_ins: dict = {}  # by file: the library in it
        self._on_news = on_news
        self._condition = threading.Condition()
        self._wanted: tuple = ()
        self._ending = False
        self._thread: threading.Thread | None = None
        self.simulating = ""

    def serve(self, medium) -> tuple[object, bool]:
        """A library, and whether it is the medium's own. Simulates in preview quality if there is none at all."""
        if own := self._known.get(medium) or libraries.known_library(medium):
            return keep_recent(self._known, medium, own, MOST_KEPT), True
        path = nearest(medium)
        if path is None:
            return keep_recent(self._known, medium, libraries.library(medium, "preview"), MOST_KEPT), True
        if path not in self._stand_ins:
            keep_recent(self._stand_ins, path, native.LdfLibrary.load(path), MOST_KEPT)
        return self._stand_ins[path], False

    def want(self, media: Collection) -> None:
        """Simulate these in the background, and no others any more."""
        with self._condition:
            if tuple(media) == self._wanted:
                return
            self._wanted = tuple(media)
            if self._wanted and self._thread is None and not self._ending:
                self._thread = threading.Thread(target=self._simulate_wanted, daemon=True, name="Beamspread media")
                self._thread.start()
            self._condition.notify_all()

    def is_busy(self) -> bool:
        """Whether a simulation is under way, or will be."""
        return bool(self._wanted)

    def end(self) -> None:
        """Stop soon."""
        with self._condition:
            self._wanted, self._ending = (), True
            self._condition.notify_all()

    def join(self, seconds: float) -> bool:
        """Whether its thread has ended within this time."""
        if self._thread is not None:
            self._thread.join(seconds)
        return self._thread is None or not self._thread.is_alive()

    def _simulate_wanted(self) -> None:
        while True:
            with self._condition:
                while not self._wanted and not self._ending:
                    self._condition.wait()
                if self._ending:
                    return
                wanted = self._wanted
                self._condition.wait(PATIENCE_SECONDS)
                if self._wanted != wanted:
                    continue
            for medium in wanted:
                self._simulate(medium)

    def _simulate(self, medium) -> None:
        self.simulating = f"g {medium.g:g}, IOR {medium.ior:g}"
        try:
            found = libraries.library(medium, "preview", lambda _fraction: medium in self._wanted)
        except native.Cancelled:
            return
        finally:
            self.simulating = ""
        keep_recent(self._known, medium, found, MOST_KEPT)
        self._on_news()
        with self._condition:
            self._wanted = tuple(one for one in self._wanted if one != medium)


def nearest(medium) -> Path | None:
    """The file with the library of the medium most like this one, or None without any."""
    known = [(_distance(medium, one), path) for path in _files() if (one := _medium_of(path)) is not None]
    return min(known, default=(0.0, None))[1]


def _files() -> list[Path]:
    folders = libraries.SHIPPED_FOLDER, libraries.cache_folder()
    return [path for folder in folders if folder.is_dir() for path in folder.glob("g*_ior*_thickness*.exr")]


def _medium_of(path: Path):
    """By its name, see `libraries.file_name`."""
    g, ior, thickness, *_ = path.stem.split("_")
    try:
        values = float(g.removeprefix("g")), float(ior.removeprefix("ior")), float(thickness.removeprefix("thickness"))
        return native.Medium(*values)
    except ValueError:
        return None


def _distance(one, other) -> float:
    if one.thickness == other.thickness:
        depth = 0.0
    elif math.isinf(one.thickness) or math.isinf(other.thickness):
        depth = FARTHEST_DEPTH
    else:
        depth = min(abs(math.log(one.thickness / other.thickness)), FARTHEST_DEPTH)
    parts = abs(one.g - other.g), abs(one.ior - other.ior), depth
    return sum(weight * part for weight, part in zip(WEIGHTS, parts))
