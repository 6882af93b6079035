"""Skies that only Cycles can evaluate, for Live: rendered in the background, coarse at first."""

from __future__ import annotations

import threading

import numpy as np

from ...core.errors import BakeError
from ...core.native import native
from ...core.recent import keep_recent
from ...core.scene.lights import WorldLight
from ..read.scene_cache import scene_cache
from . import kept_world
from .cycles_light import UPRIGHT, WHITE, world_panorama
from .scene_copy import WorldCopy

COARSE = {"width": 512, "height": 256, "samples": 2, "fine_samples": 64}
"""Panorama while a sky changes, in .1 s; see `world_panorama`."""

REST_SECONDS = 0.5
"""Seconds without changes before a sky is rendered as for a bake; more wastes less work on skies that still change."""

MAX_SKIES = 4
"""Number of coarse panoramas in memory, 2 MB each; more show skies at once that were there before."""

UNKEPT = "unkept "
"""Begin of keys of worlds that later bakes render again, as more than their nodes decides about their light."""


class SkyService:
    """Renders the world that it was asked for last.

    Attributes
    ----------
    time : number of panoramas so far.
    problem : why the last request failed; "" if it did not.
    """

    def __init__(self) -> None:
        self.time, self.problem = 0, ""
        self._condition = threading.Condition()
        self._wanted: tuple[str, WorldCopy] | None = None
        self._lights: dict[str, WorldLight] = {}  # by key of the world
        self._latest: WorldLight | None = None
        self._thread: threading.Thread | None = None

    def light(self, world, scene) -> WorldLight | None:
        """The light of an original world; until it is rendered, that of the former one, or None.

        Call it in the main thread.
        """
        key = kept_world.key_of(world, scene) or UNKEPT + scene_cache.tree(world).text
        light = kept_world.kept(key, world.name)
        if light is None and (self._wanted is None or self._wanted[0] != key):
            self._request(key, WorldCopy(world))
        return light or self._lights.get(key) or self._latest

    def is_busy(self) -> bool:
        """True while a panorama is still to come."""
        return self._thread is not None

    def end(self) -> None:
        """Have the thread stop soon."""
        self._request("", None)

    def join(self, seconds: float) -> bool:
        """Wait for the thread; True if it has ended within this time."""
        thread = self._thread
        if thread is not None:
            thread.join(seconds)
        return thread is None or not thread.is_alive()

    def _request(self, key: str, copy: WorldCopy | None) -> None:
        with self._condition:
            self._wanted = None if copy is None else (key, copy)
            self._condition.notify_all()
            if self._wanted and self._thread is None:
                self._thread = threading.Thread(target=self._run, daemon=True, name="Beamspread sky")
                self._thread.start()

    def _run(self) -> None:
        done = None
        while True:
            with self._condition:
                wanted = self._wanted
                if wanted is None or wanted is done:
                    self._thread = None
                    return
            self._render(wanted)
            done = wanted

    def _render(self, wanted: tuple[str, WorldCopy]) -> None:
        key, copy = wanted
        name = copy.request["world"]
        try:
            radiance = world_panorama(copy, **COARSE, progress=lambda _: self._wanted is not None)
            self._put(keep_recent(self._lights, key, _light(name, radiance), MAX_SKIES))
            with self._condition:
                if self._condition.wait_for(lambda: self._wanted is not wanted, REST_SECONDS):
                    return
            light = _light(name, world_panorama(copy, progress=lambda _: self._wanted is wanted))
            if key.startswith(UNKEPT):
                keep_recent(self._lights, key, light, MAX_SKIES)
            else:
                kept_world.keep(key, light)
            self._put(light)
            self.problem = ""
        except native.Cancelled:
            return
        except BakeError as error:
            self.problem = error.text

    def _put(self, light: WorldLight) -> None:
        self._latest = light
        self.time += 1


def _light(name: str, radiance: np.ndarray) -> WorldLight:
    return WorldLight(name, *WHITE, True, radiance, UPRIGHT)
