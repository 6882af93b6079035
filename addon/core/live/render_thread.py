"""The thread that renders for Live: quickly while targets change, exactly once they rest."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from ..errors import message_of
from ..native import native
from ..progress import Progress
from ..target import Target
from .library_service import LibraryService
from .live_target import LiveTarget
from .renderer import SIDES, LiveRenderer, Rendering

REST_SECONDS = 0.4
"""Seconds without changes before targets are rendered exactly; more wastes less work on targets that still change."""


MAX_WAIT_SECONDS = 0.25
"""Seconds after which bounced light is found although a target still changes; more keeps direct light quicker."""


@dataclass
class Work:
    """Progress on one target.

    Attributes
    ----------
    key : `LiveTarget.key` of the last rendering.
    has_libraries : True if that rendering used the libraries of its own media.
    bounced_key : the same of the last rendering whose bounced light was up to date.
    bounced_since : time since which bounced light is not up to date.
    """

    key: tuple | None = None
    has_libraries: bool = False
    is_exact: bool = False
    bounced_key: tuple | None = None
    bounced_since: float = 0.0


class RenderThread:
    """Renders the targets that it was last asked to show.

    A quick rendering is always finished, so that some appear during changes. An exact one stops at the next change.
    """

    def __init__(self, rest_seconds: float = REST_SECONDS) -> None:
        self._renderings: queue.SimpleQueue[tuple[Work, Rendering]] = queue.SimpleQueue()
        self.libraries = LibraryService(self._render_again)
        self._renderer = LiveRenderer(self.libraries)
        self._rest_seconds = rest_seconds
        self._condition = threading.Condition()
        self._targets: tuple[LiveTarget, ...] = ()
        self._generation, self._done, self._quickly_done = 0, 0, 0
        self._is_ending = False
        self._work: dict[Target, Work] = {}
        self._thread = threading.Thread(target=self._run, daemon=True, name="Beamspread renderer")
        self._thread.start()

    def show(self, targets: Sequence[LiveTarget]) -> None:
        """Render these targets from now on, in this order, in place of those before."""
        with self._condition:
            self._targets = tuple(targets)
            self._generation += 1
            self._condition.notify_all()

    def adopt(self, targets: Collection[LiveTarget]) -> None:
        """Count these targets as rendered exactly; older renderings of them are dropped."""
        for target in targets:
            self._work[target.target] = Work(target.key, True, is_exact=True, bounced_key=target.key)

    def forget(self, targets: Collection[Target]) -> None:
        """Render these targets anew when they are shown again."""
        for target in targets:
            self._work.pop(target, None)

    def take(self) -> dict[Target, Rendering]:
        """The last rendering of each target that was finished since the last call."""
        latest = {}
        while not self._renderings.empty():
            work, rendering = self._renderings.get()
            if self._work.get(rendering.target) is work:
                latest[rendering.target] = rendering
        return latest

    def await_quick(self, seconds: float) -> bool:
        """Wait for the quick renderings of the targets to show; True if they were finished within this time."""
        with self._condition:
            return self._condition.wait_for(lambda: self._quickly_done == self._generation, seconds)

    def is_busy(self) -> bool:
        """True while renderings are still to come."""
        return self._done < self._generation or not self._renderings.empty() or self.libraries.is_busy()

    def end(self) -> None:
        """Have all threads stop soon."""
        self.libraries.end()
        with self._condition:
            self._is_ending = True
            self._condition.notify_all()

    def join(self, seconds: float) -> bool:
        """Wait for all threads; True if they have ended within this time."""
        self._thread.join(seconds)
        return self.libraries.join(seconds) and not self._thread.is_alive()

    def _render_again(self) -> None:
        with self._condition:
            self._generation += 1
            self._condition.notify_all()

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._done < self._generation or self._is_ending)
                if self._is_ending:
                    return
                targets, generation = self._targets, self._generation
            try:
                if self._render(targets, generation):
                    self._done = generation
            except native.Cancelled:
                continue

    def _render(self, targets: Sequence[LiveTarget], generation: int) -> bool:
        """Render all targets quickly and, after a rest, exactly; False if others are asked for meanwhile."""
        missing: dict = {}
        for target in targets:
            if self._is_outdated(generation):
                return False
            missing.update(dict.fromkeys(self._render_quickly(target)))
        with self._condition:
            self._quickly_done = generation
            self._condition.notify_all()
        for target in targets:
            self._add_bounced(target, generation)
        planes, curves = ([medium for medium, curved in missing if curved == wanted] for wanted in (False, True))
        self.libraries.request(planes, curves)
        with self._condition:
            if self._condition.wait_for(lambda: self._is_outdated(generation), self._rest_seconds):
                return False
        for target in targets:
            work = self._work.get(target.target)
            if work is not None and work.has_libraries and target.is_final and not work.is_exact:
                self._render_exactly(target, work, lambda _fraction: not self._is_outdated(generation))
        return True

    def _render_quickly(self, target: LiveTarget) -> list:
        """Render a target unless its rendering is up to date; the media that it lacks, see `LiveRenderer.missing`."""
        work = self._work.setdefault(target.target, Work())
        missing = self._renderer.missing(target)
        if work.key == target.key and (work.has_libraries or missing):
            return missing
        if not self._renderer.has_libraries(target):
            return missing  # the service calls back once they are there
        was_current = work.bounced_key == work.key
        failed = not self._put(
            work,
            target,
            lambda: self._renderer.quick(target, self._renderer.quick_side(target), lambda _: not self._is_ending),
        )
        # An error would occur again in the exact rendering.
        work.key, work.has_libraries, work.is_exact = target.key, not missing, failed
        if failed or target.max_bounces is None:
            work.bounced_key = target.key
        elif was_current:
            work.bounced_since = time.monotonic()
        return missing

    def _add_bounced(self, target: LiveTarget, generation: int) -> None:
        """Add bounced light to the quick rendering of a target, unless it is up to date or the target changes."""
        work = self._work.get(target.target)
        if work is None or work.key is None or work.bounced_key == work.key:
            return

        def goes_on(_fraction: float) -> bool:
            is_due = time.monotonic() > work.bounced_since + MAX_WAIT_SECONDS
            return not self._is_ending and (is_due or not self._is_outdated(generation))

        if goes_on(0.0):
            self._put(work, target, lambda: self._renderer.quick_bounced(target, goes_on))
            work.bounced_key = work.key

    def _render_exactly(self, target: LiveTarget, work: Work, progress: Progress) -> None:
        def render() -> Rendering:
            if self._renderer.quick_side(target) < SIDES[-1] < max(self._renderer.size_of(target)):
                # The exact rendering of a large image may take long.
                self._renderings.put((work, self._renderer.quick(target, SIDES[-1], progress)))
            return self._renderer.exact(target, progress)

        self._put(work, target, render)
        work.is_exact = True

    def _put(self, work: Work, target: LiveTarget, render: Callable[[], Rendering]) -> bool:
        """Hand over a rendering, or the error in its place; True if there was none."""
        try:
            rendering = render()
        except native.Cancelled:
            raise
        except Exception as error:  # noqa: BLE001 - the window shows it, and other targets are still to be rendered
            rendering = Rendering(target.target, error=message_of(error))
        self._renderings.put((work, rendering))
        return not rendering.error

    def _is_outdated(self, generation: int) -> bool:
        return self._is_ending or self._generation != generation
